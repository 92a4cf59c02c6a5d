export * from './pkg/monorange_wasm_board.js';

/** Makes the package ready; every other export needs it first. `module` is for engines without `fetch` for files. */
export function init(options?: { module?: WebAssembly.Module | BufferSource }): Promise<void>;
