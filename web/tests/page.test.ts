/** The built page in a real browser: what a person does, and what they must then see. */
import { afterAll, afterEach, beforeAll, beforeEach, expect, test } from 'vitest';
import type { Page } from 'playwright-core';
import { exported, openSite, phase, waitForPhase, type Site } from './browser.ts';
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

test('two clicks measure a distance with its uncertainty', async () => {
  const box = (await page.locator('#camera-view').boundingBox())!;
  await page.mouse.click(box.x + box.width * 0.4, box.y + box.height * 0.75);
  await page.mouse.click(box.x + box.width * 0.6, box.y + box.height * 0.75);
  await page.waitForSelector('#tape-clear:not([hidden])');
  await page.keyboard.press('Escape');
  await page.waitForSelector('#tape-clear', { state: 'hidden' });
});

test('the sample ends in a map', async () => {
  await page.click('#sample');
  await waitForPhase(page, 'done');
  expect(await status()).toMatch(/^Frame 300 of 300 · \d+ corners?.* · \d+(\.\d)? ms · position ±\d/);
  const map = (await exported(page, 'map.csv')).trim().split('\n');
  expect(map.length).toBeGreaterThan(5);
  const trajectory = (await exported(page, 'trajectory.tum')).trim().split('\n');
  expect(trajectory.length).toBe(300);
});

/** How much more green than red there is in the lower middle of the picture. */
const greenness = () => page.evaluate(() => {
  const canvas = document.querySelector<HTMLCanvasElement>('#camera-view')!;
  const [width, height] = [canvas.width, canvas.height];
  const { data } = canvas.getContext('2d')!.getImageData(0.4 * width, 0.8 * height, 0.2 * width, 0.1 * height);
  let sum = 0;
  for (let at = 0; at < data.length; at += 4) sum += data[at + 1]! - data[at]!;
  return (4 * sum) / data.length;
});

test('the free floor is tinted, of the first picture and while the sample plays, until its switch is pressed', async () => {
  await expect.poll(greenness).toBeGreaterThan(20);
  await page.click('#sample');
  await waitForPhase(page, 'done');
  await page.locator('#timeline').focus();
  await page.keyboard.press('Home');
  await page.keyboard.press('Space');
  const seen: number[] = [];
  for (let look = 0; look < 10; look += 1) {
    seen.push(await greenness());
    await page.waitForTimeout(100);
  }
  await page.keyboard.press('Space');
  expect(Math.min(...seen), seen.join()).toBeGreaterThan(20);
  expect(await status()).toMatch(/ · floor free for \d\.\d\d m ahead, nearest (boundary|obstacle) \d+\.\d+ m ± \d\.\d+, /);
  await page.click('[data-layer=scan]');
  await expect.poll(greenness).toBeLessThan(5);
});

test('everything on the export menu can be saved and read again', async () => {
  await openFiles([1, 2, 3].map((index) => ({ name: `${index}.png`, buffer: png(320, 240, (u, v) => (v > 150 ? 60 : u > 150 + index ? 180 : 120)) })));
  await waitForPhase(page, 'done');
  const names = await page.locator('#export-menu button').evaluateAll((buttons) => buttons.map((button) => button.firstChild?.textContent ?? ''));
  expect(names.length).toBeGreaterThan(8);
  for (const name of names) expect((await exported(page, name)).length, name).toBeGreaterThan(20);
  expect(await exported(page, 'report.html')).toMatch(/<h1>[\d.]+ m driven, .*data:image\/jpeg;base64/s);
  const report = JSON.parse(await exported(page, 'report.json')) as { frames: number; frames_used: number };
  expect(report).toMatchObject({ frames: 3, frames_used: 3 });
  const rows = (await exported(page, 'observations.csv')).trim().split('\n');
  expect(rows[0]).toBe('t,frame,u,v,range,bearing,landmark,decision,nis');
});

test('a video file is decoded frame by frame, moved by what it shows', async () => {
  await page.evaluate(async () => {
    const canvas = document.createElement('canvas');
    [canvas.width, canvas.height] = [320, 240];
    const context = canvas.getContext('2d')!;
    const recorder = new MediaRecorder(canvas.captureStream(20));
    const parts: Blob[] = [];
    recorder.ondataavailable = ({ data }) => parts.push(data);
    const ended = new Promise((done) => (recorder.onstop = done));
    recorder.start();
    for (let frame = 0; frame < 20; frame += 1) {
      context.fillStyle = `hsl(0 0% ${40 + frame}%)`;
      context.fillRect(0, 0, 320, 240);
      await new Promise((done) => setTimeout(done, 50));
    }
    recorder.stop();
    await ended;
    const transfer = new DataTransfer();
    transfer.items.add(new File(parts, 'drive.webm', { type: 'video/webm' }));
    document.body.dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, bubbles: true, cancelable: true }));
  });
  await waitForPhase(page, 'done');
  expect(await status()).toMatch(/Frame (\d+) of \1 /);
  expect(await message()).toBe('');
});

test('a live camera is mapped until it is stopped', async () => {
  await page.click('#camera');
  await waitForPhase(page, 'live');
  await expect.poll(status, { timeout: 30_000 }).toMatch(/Frame ([3-9]|\d\d) of/);
  await page.click('#cancel');
  await waitForPhase(page, 'done');
  expect((await exported(page, 'trajectory.tum')).trim().split('\n').length).toBeGreaterThan(2);
});

test('a picture from the clipboard is opened', async () => {
  const bytes = [...png(320, 240, () => 90)];
  await page.evaluate((data) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([Uint8Array.from(data)], 'pasted.png', { type: 'image/png' }));
    dispatchEvent(new ClipboardEvent('paste', { clipboardData: transfer }));
  }, bytes);
  await waitForPhase(page, 'done');
  expect(await status()).toContain('Frame 1 of 1');
});

test('by keyboard alone: sample, play, step, range, tape', async () => {
  await page.locator('#empty-sample').focus();
  await page.keyboard.press('Enter');
  await waitForPhase(page, 'done');
  await page.locator('#timeline').focus();
  await page.keyboard.press('Home');
  await page.keyboard.press('ArrowRight');
  await expect.poll(status).toContain('Frame 2 of 300');
  await page.locator('#camera-view').focus();
  await page.keyboard.press('ArrowLeft');
  await expect.poll(() => page.locator('#readout').innerText()).toMatch(/ m ± /);
  await page.keyboard.press('Enter');
  for (let step = 0; step < 3; step += 1) await page.keyboard.press('Shift+ArrowRight');
  await page.keyboard.press('Enter');
  await page.waitForSelector('#tape-clear:not([hidden])');
  await page.keyboard.press('Escape');
  await page.waitForSelector('#tape-clear', { state: 'hidden' });
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
  expect(await status()).toContain('camera and mount are guesses, and so are the ranges');
});

test('a text file is refused in words that say what to do', async () => {
  await openFiles([{ name: 'notes.txt', buffer: Buffer.from('hello') }]);
  await expect.poll(message).toBe('notes.txt is not a picture. Drop pictures (PNG, JPEG, PGM …), a folder or ZIP of them, a video or a recording of ROS 2.\n✕');
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

test('a slider’s change is in the address, and Undo takes it back', async () => {
  await page.click('#setup-toggle');
  const height = page.getByLabel('Height in m');
  const before = await height.inputValue();
  await height.fill('0.9');
  await height.press('Enter');
  await expect.poll(() => page.url()).toContain('height=0.9');
  await page.getByRole('button', { name: 'Undo' }).click();
  await expect.poll(() => height.inputValue()).toBe(before);
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
  const files = [10, 9, 1].map((index) => [`f${index}.pgm`, grey(64, 48, () => index)] as const);
  const folder = await site.written(Object.fromEntries(files));
  await page.setInputFiles('#folder', folder);
  await waitForPhase(page, 'done');
  expect(await status()).toContain('Frame 3 of 3');
});
