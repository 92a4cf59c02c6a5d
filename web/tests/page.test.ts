/** The built page in a real browser: what a person does, and what they must then see. */
import { mkdtemp, readFile, writeFile, mkdir } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createRequire } from 'node:module';
import { afterAll, afterEach, beforeAll, beforeEach, expect, test } from 'vitest';
import type { Page } from 'playwright-core';
import { exported, isQuiet, openSite, phase, waitForPhase, type Site } from './browser.ts';
import { grey, png } from './pictures.ts';

let site: Site;
let page: Page;
let elsewhere: string[] = [];
let complaints: string[] = [];

beforeAll(async () => {
  site = await openSite();
  site.context.on('request', (request) => {
    const { protocol, host } = new URL(request.url());
    if (protocol.startsWith('http') && host !== new URL(site.address).host) elsewhere.push(request.url());
  });
});
afterAll(() => site.close());
beforeEach(async () => {
  [elsewhere, complaints] = [[], []];
  page = await site.context.newPage();
  page.on('pageerror', (error) => complaints.push(error.message));
  page.on('console', (message) => {
    // Offline, the browser cannot ask for a newer service worker, and says so.
    if (message.type() === 'error' && !message.location().url.endsWith('sw.js')) complaints.push(`${message.text()} ${message.location().url}`);
  });
  await page.goto(site.address);
  await waitForPhase(page, 'empty');
});
afterEach(async () => {
  await page.close();
  expect(elsewhere, 'requests to other hosts').toEqual([]);
  expect(complaints, 'errors on the console').toEqual([]);
});

const status = () => page.locator('#status').innerText();
const message = () => page.locator('#messages').innerText();

async function openFiles(files: { name: string; buffer: Buffer; mimeType?: string }[]): Promise<void> {
  await page.setInputFiles('#files', files.map((file) => ({ mimeType: 'application/octet-stream', ...file })));
}

test('the empty page is a range finder: the pointer reads a range, the sky has none', async () => {
  const box = (await page.locator('#camera-view').boundingBox())!;
  await page.mouse.move(box.x + box.width / 2, box.y + box.height * 0.8);
  await expect.poll(() => page.locator('#readout').innerText()).toMatch(/^\d\.\d+ m ± 0\.\d+, (straight ahead|\d+\.\d° (left|right))$/);
  await page.mouse.move(box.x + box.width * 0.2, box.y + box.height * 0.12);
  await expect.poll(() => page.locator('#readout').innerText()).toContain('Above the horizon');
});

test('the wasm is ready within 100 ms', async () => {
  const took: number[] = [];
  // The least of a few: other work on the machine only ever adds.
  for (let visit = 0; visit < 5; visit += 1) {
    await page.reload();
    await waitForPhase(page, 'empty');
    took.push(await page.evaluate(() => performance.getEntriesByName('wasm-init')[0]?.duration ?? NaN));
  }
  console.log(`ms until the wasm is ready: ${took.map((time) => time.toFixed(0)).join(', ')}`);
  if (isQuiet()) expect(Math.min(...took)).toBeLessThan(100);
});

test('two clicks measure a distance with its uncertainty', async () => {
  const box = (await page.locator('#camera-view').boundingBox())!;
  await page.mouse.click(box.x + box.width * 0.4, box.y + box.height * 0.75);
  await page.mouse.click(box.x + box.width * 0.6, box.y + box.height * 0.75);
  await page.waitForSelector('#tape-clear:not([hidden])');
  await page.keyboard.press('Escape');
  await page.waitForSelector('#tape-clear', { state: 'hidden' });
});

test('the sample ends in a map, and the main thread stays free', async () => {
  await page.evaluate(() => {
    const long: number[] = [];
    new PerformanceObserver((list) => long.push(...list.getEntries().map((entry) => entry.duration))).observe({ type: 'longtask' });
    Object.assign(window, { long });
  });
  await page.click('#sample');
  await waitForPhase(page, 'done');
  expect(await status()).toMatch(/^Frame 300 of 300 · \d+ corners?.* · \d+(\.\d)? ms · position ±\d/);
  const map = (await exported(page, 'map.csv')).trim().split('\n');
  expect(map.length).toBeGreaterThan(5);
  const trajectory = (await exported(page, 'trajectory.tum')).trim().split('\n');
  expect(trajectory.length).toBe(300);
  const long = await page.evaluate(() => (window as unknown as { long: number[] }).long);
  console.log(`longest tasks of the main thread, ms: ${long.sort((a, b) => b - a).slice(0, 3).join(', ') || 'none above 50'}`);
});

test('cancel ends a run and keeps what is done', async () => {
  await page.click('#sample');
  await waitForPhase(page, 'running');
  await page.click('#cancel');
  await waitForPhase(page, 'cancelled');
  expect(await status()).toMatch(/cancelled after \d+ frames?/);
  expect(await status()).not.toContain('cancelled after 300');
});

test('a damaged picture among good ones is named and skipped', async () => {
  const good = png(320, 240, () => 128);
  await openFiles([
    { name: '1.png', buffer: good },
    { name: '2.png', buffer: good.subarray(0, 60) },
    { name: '3.png', buffer: good },
  ]);
  await waitForPhase(page, 'done');
  await page.locator('#timeline').focus();
  await page.keyboard.press('Home');
  await page.keyboard.press('ArrowRight');
  await expect.poll(status).toContain('2.png: it cannot be decoded as a picture');
  expect(await message()).toContain('2.png');
});

test('a picture of another size is named and skipped', async () => {
  await openFiles([
    { name: '1.png', buffer: png(320, 240, () => 90) },
    { name: '2.png', buffer: png(64, 48, () => 90) },
  ]);
  await waitForPhase(page, 'done');
  expect(await message()).toContain('2.png: it is 64 × 48, the camera 320 × 240');
});

test('pictures of another size than the rig’s are refused in words', async () => {
  await openFiles([
    { name: '1.png', buffer: png(64, 48, () => 90) },
    { name: 'rig.toml', buffer: Buffer.from('[camera]\nwidth = 320\nheight = 240\nfocal = [365.0, 365.0]\nprincipal = [160.0, 120.0]\n[mount]\nheight = 0.4\ntilt_deg = 12.0\n') },
  ]);
  await expect.poll(message).toContain('The pictures are 64 × 48 (1.png), the camera of rig.toml 320 × 240');
});

test('a mistake in a rig is named with its line and the nearest key', async () => {
  await openFiles([
    { name: '1.png', buffer: png(320, 240, () => 90) },
    { name: 'rig.toml', buffer: Buffer.from('[camera]\nwidth = 320\nheight = 240\nfocal = [365.0, 365.0]\nprincipal = [160.0, 120.0]\n[mount]\nheigth = 0.4\ntilt_deg = 12.0\n') },
  ]);
  await expect.poll(message).toMatch(/rig\.toml, line 7: .*heigth.*height/);
});

test('without calibration the ranges are marked as a guess', async () => {
  await openFiles([{ name: 'photo.png', buffer: png(640, 480, (u, v) => (u + v) % 256) }]);
  await waitForPhase(page, 'done');
  expect(await status()).toContain('camera not calibrated: ranges are a guess');
});

test('a text file is refused in words that say what to do', async () => {
  await openFiles([{ name: 'notes.txt', buffer: Buffer.from('hello') }]);
  await expect.poll(message).toBe('notes.txt is not a picture. Drop pictures (PNG, JPEG, PGM …), a folder of them or a video.\n✕');
  expect(await phase(page)).toBe('empty');
});

test('a rig that was saved gives the same settings when it is opened', async () => {
  await page.goto(`${site.address}#height=0.735&tilt=21.5`);
  await page.reload();
  await waitForPhase(page, 'empty');
  const saved = await exported(page, 'rig.toml');
  expect(saved).toContain('height = 0.735\n');
  expect(saved).toContain('tilt_deg = 21.5\n');
  await page.goto(site.address);
  await page.reload();
  await waitForPhase(page, 'empty');
  await openFiles([{ name: 'mine.toml', buffer: Buffer.from(saved) }]);
  await expect.poll(() => page.locator('#setup').isVisible()).toBe(true);
  await expect.poll(() => page.locator('#setup input[type=number]').nth(1).inputValue()).toBe('0.735');
});

test('a slider’s change is in the address, and going back undoes it', async () => {
  await page.click('#setup-toggle');
  const height = page.getByLabel('Height in m');
  const before = await height.inputValue();
  await height.fill('0.9');
  await height.press('Enter');
  await expect.poll(() => page.url()).toContain('height=0.9');
  await page.getByRole('button', { name: 'Undo' }).click();
  await expect.poll(() => height.inputValue()).toBe(before);
});

test('everything can be reached and told by assistive software', async () => {
  const axe = await readFile(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
  for (const prepare of [async () => undefined, async () => page.click('#setup-toggle')]) {
    await prepare();
    // As an expression of the debugger, which the page's own policy does not bind.
    await page.evaluate(`${axe}; 0`);
    const violations = await page.evaluate(async () => {
      const { axe } = window as unknown as { axe: { run(): Promise<{ violations: { id: string; impact: string; nodes: { html: string }[] }[] }> } };
      return (await axe.run()).violations.map(({ id, impact, nodes }) => ({ id, impact, where: nodes[0]?.html }));
    });
    expect(violations.filter(({ impact }) => impact === 'serious' || impact === 'critical')).toEqual([]);
  }
});

test('the page works offline after the first visit', async () => {
  await page.evaluate(() => navigator.serviceWorker.ready);
  await page.reload();
  await waitForPhase(page, 'empty');
  await site.context.setOffline(true);
  try {
    await page.reload();
    await waitForPhase(page, 'empty');
    await page.click('#sample');
    await waitForPhase(page, 'running', 'done');
  } finally {
    await site.context.setOffline(false);
  }
});

test('a folder is opened in the natural order of its names', async () => {
  const folder = join(await mkdtemp(join(tmpdir(), 'monorange-')), 'drive');
  await mkdir(folder);
  for (const index of [10, 9, 1]) await writeFile(join(folder, `f${index}.pgm`), grey(64, 48, () => index));
  await page.setInputFiles('#folder', folder);
  await waitForPhase(page, 'done');
  expect(await status()).toContain('Frame 3 of 3');
});
