// The front door of the package: picks the SIMD build where the engine has it, the scalar one elsewhere.
import start from './pkg/monorange_wasm.js';
export * from './pkg/monorange_wasm.js';

// (module (func (result v128) i32.const 0 i8x16.splat)), the smallest module that needs SIMD.
const SIMD_PROBE = Uint8Array.of(
  0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 8, 1, 6, 0, 65, 0, 253, 15, 11,
);

let starting;

export function hasSimd() {
  return WebAssembly.validate(SIMD_PROBE);
}

export function init({ simd = hasSimd(), module } = {}) {
  starting ??= start({
    module_or_path:
      module ??
      (simd
        ? new URL('./pkg/monorange_wasm_simd.wasm', import.meta.url)
        : new URL('./pkg/monorange_wasm_scalar.wasm', import.meta.url)),
  }).then(() => undefined);
  return starting;
}
