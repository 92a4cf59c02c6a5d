// Before `npm pack` and `npm publish`: without its WebAssembly the package would be empty, and nothing would say so.
import { copyFileSync, existsSync } from 'node:fs';

const here = (name) => new URL(name, import.meta.url);
const needed = ['monorange_wasm.js', 'monorange_wasm.d.ts', 'monorange_wasm_simd.wasm', 'monorange_wasm_scalar.wasm'];
const missing = needed.filter((name) => !existsSync(here(`./pkg/${name}`)));
if (missing.length > 0) {
  console.error(`monorange-wasm: pkg/ lacks ${missing.join(', ')}\n  help: build it first, in the repository: cargo xtask web`);
  process.exit(1);
}
for (const name of ['LICENSE-APACHE', 'LICENSE-MIT']) {
  copyFileSync(here(`../${name}`), here(`./${name}`));
}
