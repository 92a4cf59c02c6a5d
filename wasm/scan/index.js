import start from './pkg/monorange_wasm_scan.js';
export * from './pkg/monorange_wasm_scan.js';

let starting;

export function init({ simd = false, module } = {}) {
  starting ??= start({
    module_or_path:
      module ??
      (simd
        ? new URL('./pkg/monorange_wasm_scan_simd.wasm', import.meta.url)
        : new URL('./pkg/monorange_wasm_scan_scalar.wasm', import.meta.url)),
  }).then(() => undefined);
  return starting;
}
