/** The sample's first picture and rig as the small files that the empty page shows: `npm run first-picture`. */
import { readFile, writeFile } from 'node:fs/promises';
import { init, layout, offer, Sample } from 'monorange-wasm-files';
import { chromium } from 'playwright-core';
import { test } from 'vitest';
import { browserPath } from '../tests/browser.ts';
import { png } from '../tests/pictures.ts';

/** A JPEG of the picture: the simulator's noise makes a PNG four times as large, and nobody measures this one. */
async function jpeg(picture: Buffer): Promise<Buffer> {
  const browser = await chromium.launch({ ...(browserPath ? { executablePath: browserPath } : {}), args: ['--no-sandbox'] });
  const page = await browser.newPage();
  const address = await page.evaluate(async (png) => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(png), (letter) => letter.charCodeAt(0))]));
    const canvas = Object.assign(document.createElement('canvas'), { width: bitmap.width, height: bitmap.height });
    canvas.getContext('2d')!.drawImage(bitmap, 0, 0);
    return canvas.toDataURL('image/jpeg', 0.85);
  }, picture.toString('base64'));
  await browser.close();
  return Buffer.from(address.split(',')[1]!, 'base64');
}

test('the first picture', { timeout: 60_000 }, async () => {
  await init({ module: await readFile('../wasm/files/pkg/monorange_wasm_files_scalar.wasm') });
  const sample = new Sample(1, 3, 1);
  offer('rig.toml', new TextEncoder().encode(sample.rig()));
  const { width, height, ...rig } = layout(['rig.toml'], 1, undefined, 0).rig as { width: number; height: number };
  const pixels = sample.picture(0).slice(-width * height);
  await writeFile('src/engine/first.jpg', await jpeg(png(width, height, (u, v) => pixels[v * width + u]!)));
  // Without settings, which are a message of one version of the protocol: the sample has the default ones.
  await writeFile('src/engine/first.json', `${JSON.stringify({ width, height, ...rig, settings: [] })}\n`);
});
