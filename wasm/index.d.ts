export * from './pkg/monorange_wasm.js';

/** Whether this engine runs WebAssembly SIMD. */
export function hasSimd(): boolean;

/**
 * Makes the package ready; every other export needs it first. Calls after the first wait for the same start.
 *
 * @param options `simd` overrides the choice of build; `module` is the compiled module or its bytes, where the
 * package's own files cannot be fetched (in Node.js, for instance).
 */
export function init(options?: {
  simd?: boolean;
  module?: WebAssembly.Module | BufferSource;
}): Promise<void>;
