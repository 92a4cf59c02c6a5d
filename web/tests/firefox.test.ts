/** The core of the page in Firefox: Debian's, by WebDriver BiDi. */
import { existsSync } from 'node:fs';
import { cp, mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, beforeAll, beforeEach, expect, test } from 'vitest';
import { preview, type PreviewServer } from 'vite';
import { Firefox } from './bidi.ts';
import { drive } from './mcap.ts';
import { png } from './pictures.ts';

const path = process.env['FIREFOX'] ?? ['/usr/bin/firefox-esr', '/usr/bin/firefox'].find((path) => existsSync(path));
if (!path) console.warn('Skipped: no Firefox found; install firefox-esr or set FIREFOX.');

let firefox: Firefox;
let server: PreviewServer;
let root: string;
beforeAll(async () => {
  if (!path) return;
  root = await mkdtemp(join(tmpdir(), 'monorange-firefox-'));
  await cp('dist', join(root, 'dist'), { recursive: true });
  server = await preview({ root, configFile: false, logLevel: 'error', preview: { host: '127.0.0.1', port: 0 } });
  firefox = await Firefox.start(path);
});
afterAll(async () => {
  await firefox?.close();
  await server?.close();
  if (root) await rm(root, { recursive: true, force: true });
});
beforeEach(async () => {
  if (!path) return;
  await firefox.open(server.resolvedUrls?.local[0] ?? '');
  await reach('empty');
});

const text = (id: string) => firefox.evaluate<string>(`document.getElementById('${id}').textContent`);
const reach = (phase: string) => expect.poll(() => firefox.evaluate('document.body.dataset.phase'), { timeout: 90_000 }).toBe(phase);

/** Gives the page files as a drop does. */
async function drop(files: { name: string; content: Buffer }[]): Promise<void> {
  const given = JSON.stringify(files.map(({ name, content }) => ({ name, bytes: [...content] })));
  await firefox.evaluate(`(() => {
    const transfer = new DataTransfer();
    for (const { name, bytes } of ${given}) transfer.items.add(new File([Uint8Array.from(bytes)], name));
    return dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, bubbles: true, cancelable: true }));
  })()`);
}

test.skipIf(!path)('the pointer reads a range, two clicks a distance', async () => {
  const { x, y, width, height } = await firefox.evaluate<DOMRect>("document.getElementById('camera-view').getBoundingClientRect()");
  await firefox.click([0.4, 0.6].map((at) => [x + width * at, y + height * 0.8]));
  await expect.poll(() => text('readout')).toMatch(/^\d\.\d+ m ± 0\.\d+, .*tape \d\.\d+ m ± 0\.\d+/);
});

test.skipIf(!path)('the sample ends in a map and a result', async () => {
  await firefox.evaluate("document.getElementById('sample').click()");
  await reach('done');
  expect(await text('result')).toMatch(/m driven in 300 pictures; \d+ landmarks/);
});

test.skipIf(!path)('a recording of ROS 2 is read and driven', async () => {
  const grey = (k: number) => Buffer.from(Array.from({ length: 320 * 240 }, (_, at) => (at / 320 > 150 + k ? 60 : at % 320 > 150 ? 180 : 120)));
  await drop([{ name: 'drive.mcap', content: drive([0, 1].map(grey)) }]);
  await reach('done');
  expect(await text('status')).toContain('Frame 2 of 2');
  expect(await text('messages')).toBe('');
});

test.skipIf(!path)('dropped pictures are decoded and driven', async () => {
  await drop([1, 2, 3].map((k) => ({ name: `${k}.png`, content: png(160, 120, (u, v) => (v > 80 ? 60 : u > 80 + k ? 180 : 120)) })));
  await reach('done');
  expect(await text('status')).toContain('Frame 3 of 3');
  expect(await text('messages')).toBe('');
});

test.skipIf(!path)('a frame of a video takes no longer than one of a picture would', async () => {
  await firefox.evaluate(`(async () => {
    const canvas = document.createElement('canvas');
    [canvas.width, canvas.height] = [320, 240];
    const context = canvas.getContext('2d');
    const recorder = new MediaRecorder(canvas.captureStream(20), { mimeType: 'video/webm' });
    const parts = [];
    recorder.ondataavailable = ({ data }) => parts.push(data);
    const ended = new Promise((done) => (recorder.onstop = done));
    recorder.start();
    for (let frame = 0; frame < 24; frame += 1) {
      context.fillStyle = 'hsl(0 0% ' + (40 + frame) + '%)';
      context.fillRect(0, 0, 320, 240);
      await new Promise((done) => setTimeout(done, 50));
    }
    recorder.stop();
    await ended;
    const transfer = new DataTransfer();
    transfer.items.add(new File(parts, 'drive.webm', { type: 'video/webm' }));
    return dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, bubbles: true, cancelable: true }));
  })()`);
  const begin = performance.now();
  await reach('done');
  const status = await text('status');
  const frames = Number(/of (\d+)/.exec(status)?.[1]);
  expect(frames).toBeGreaterThan(3);
  const each = (performance.now() - begin) / frames;
  console.log(`Firefox: ${each.toFixed(0)} ms a frame of video`);
  expect(each).toBeLessThan(2000);
});
