import start from './pkg/monorange_wasm_board.js';
export * from './pkg/monorange_wasm_board.js';

let starting;

export function init({ module } = {}) {
  starting ??= start({
    module_or_path: module ?? new URL('./pkg/monorange_wasm_board_scalar.wasm', import.meta.url),
  }).then(() => undefined);
  return starting;
}
