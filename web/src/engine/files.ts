/** The second WebAssembly module: file formats and the sample, loaded when first needed. */
export type Files = typeof import('monorange-wasm-files');

let loading: Promise<Files> | undefined;

export function loadFiles(): Promise<Files> {
  loading ??= import('monorange-wasm-files').then(async (files) => {
    await files.init();
    return files;
  });
  return loading;
}
