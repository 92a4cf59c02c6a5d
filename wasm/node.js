// The same package in Node.js, where a module's bytes are read from the disk.
import { readFile } from 'node:fs/promises';
import { hasSimd, init as start } from './index.js';
export * from './index.js';

export async function init({ simd = hasSimd(), module } = {}) {
  const name = simd ? 'monorange_wasm_simd.wasm' : 'monorange_wasm_scalar.wasm';
  return start({ simd, module: module ?? (await readFile(new URL(`./pkg/${name}`, import.meta.url))) });
}
