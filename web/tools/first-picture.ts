/** The sample's first picture and rig as the small files that the empty page shows: `npm run first-picture`. */
import { readFile, writeFile } from 'node:fs/promises';
import { init, layout, offer, Sample } from 'monorange-wasm-files';
import { test } from 'vitest';
import { png } from '../tests/pictures.ts';

test('the first picture', async () => {
  await init({ module: await readFile('../wasm/files/pkg/monorange_wasm_files_scalar.wasm') });
  const sample = new Sample(1, 3, 1);
  offer('rig.toml', new TextEncoder().encode(sample.rig()));
  const { width, height, ...rig } = layout(['rig.toml'], 1, undefined, 0).rig as { width: number; height: number };
  const pixels = sample.picture(0).slice(-width * height);
  await writeFile('src/engine/first.png', png(width, height, (u, v) => pixels[v * width + u]!));
  await writeFile('src/engine/first.json', `${JSON.stringify({ width, height, ...rig })}\n`);
});
