export * from './pkg/monorange_wasm_scan.js';

/** Makes the package ready; every other export needs it first. `simd`: the engine has it. `module` is for engines without `fetch` for files. */
export function init(options?: { simd?: boolean; module?: WebAssembly.Module | BufferSource }): Promise<void>;
