import start from './pkg/monorange_wasm_containers.js';
export * from './pkg/monorange_wasm_containers.js';

let starting;

export function init({ module } = {}) {
  starting ??= start({
    module_or_path: module ?? new URL('./pkg/monorange_wasm_containers_scalar.wasm', import.meta.url),
  }).then(() => undefined);
  return starting;
}
