/** Files that hold many: ZIP archives and recordings of ROS 2 open as the folder would that they stand for. */
import { mkdir, mkdtemp, open, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, afterEach, beforeAll, beforeEach, expect, test } from 'vitest';
import type { Page } from 'playwright-core';
import { exported, exportedBytes, openSite, phase, waitForPhase, type Site } from './browser.ts';
import { drive, large } from './mcap.ts';
import { png } from './pictures.ts';
import { zip, type Entry } from './zip.ts';

let site: Site;
let page: Page;
let folder: string;
beforeAll(async () => {
  folder = await mkdtemp(join(tmpdir(), 'monorange-'));
  site = await openSite();
});
afterAll(async () => {
  await site.close();
  await rm(folder, { recursive: true });
});
beforeEach(async () => {
  page = await site.context.newPage();
  await page.goto(site.address);
  await waitForPhase(page, 'empty');
});
afterEach(() => page.close());

const status = () => page.locator('#status').innerText();
const message = () => page.locator('#messages').innerText();
const openFiles = (files: Record<string, Buffer | string>) =>
  page.setInputFiles('#files', Object.entries(files).map(([name, content]) => ({ name, buffer: Buffer.from(content), mimeType: 'application/octet-stream' })));

const RIG = '[camera]\nwidth = 320\nheight = 240\nfocal = [365.0, 365.0]\nprincipal = [160.0, 120.0]\n[mount]\nheight = 0.4\ntilt_deg = 12.0\n';
const corner = (k: number) => (u: number, v: number) => (v > 150 + k ? 60 : u > 150 + 2 * k ? 180 : 120);
/** A folder's files: pictures, rig, times and odometry, one that nobody needs, and what systems leave in archives. */
const FILES: Entry[] = [
  ...[0, 1, 2, 3].map((k) => ({ path: `frames/${k}.png`, content: png(320, 240, corner(k)) })),
  { path: 'rig.toml', content: RIG },
  { path: 'times.txt', content: '0.0\n0.1\n0.2\n0.3\n' },
  { path: 'odometry.csv', content: 't,v,omega\n0.0,0.5,0.0\n0.4,0.5,0.0\n' },
  { path: 'notes.docx', content: 'hello' },
];
const under = (top: string, files: Entry[]) => files.map((file) => ({ ...file, path: top + file.path }));

test('a ZIP of a folder gives what the folder gives, with or without the folder’s name in it', async () => {
  for (const { path, content } of under('drive/', FILES)) {
    await mkdir(join(folder, path, '..'), { recursive: true });
    await writeFile(join(folder, path), content);
  }
  await page.setInputFiles('#folder', join(folder, 'drive'));
  await waitForPhase(page, 'done');
  const [trajectory, seen] = [await exported(page, 'trajectory.csv'), await exported(page, 'observations.csv')];
  expect(trajectory.split('\n').length).toBeGreaterThan(4);
  const litter = { path: '__MACOSX/drive/frames/._0.png', content: 'x' };
  for (const files of [[...under('drive/', FILES), litter], FILES]) {
    await page.reload();
    await waitForPhase(page, 'empty');
    await openFiles({ 'drive.zip': zip(files) });
    await waitForPhase(page, 'done');
    expect([await exported(page, 'trajectory.csv'), await exported(page, 'observations.csv')]).toEqual([trajectory, seen]);
    expect(await page.title()).toBe('drive – monorange');
    expect(await message()).toContain('notes.docx is not used');
  }
});

test('an archive that cannot be read says why, and what is open stays', async () => {
  await openFiles({ '1.png': png(320, 240, corner(0)), 'rig.toml': RIG });
  await waitForPhase(page, 'done');
  const before = await exported(page, 'trajectory.tum');
  const [first] = FILES;
  const whole = zip(FILES);
  for (const [archive, said] of [
    [zip([{ ...first!, encrypted: true }]), '0.png: it is encrypted; unpack it with its password, then open the folder'],
    [zip([{ ...first!, claims: 3 * 2 ** 30 }]), '0.png: it has 3072 MB unpacked, and this page unpacks 512'],
    [zip([{ ...first!, claims: 5 }]), '0.png: it is damaged in the archive'],
    [whole.subarray(0, whole.length - 30), 'drive.zip: the archive is damaged or cut short'],
    [Buffer.from('PK'), 'drive.zip: the archive is damaged or cut short'],
    [Buffer.alloc(0), 'drive.zip: the archive is damaged or cut short'],
    [zip([{ path: 'notes.docx', content: 'x' }]), 'notes.docx is not a picture'],
  ] as const) {
    await openFiles({ 'drive.zip': archive });
    await expect.poll(message).toContain(said);
    expect(await phase(page)).toBe('done');
  }
  expect(await exported(page, 'trajectory.tum')).toBe(before);
});

const grey = (k: number) => Buffer.from(Array.from({ length: 320 * 240 }, (_, at) => corner(k)(at % 320, Math.floor(at / 320))));

test('a recording opens with its pictures, times, wheels, camera and mount', async () => {
  await openFiles({ 'drive.mcap': drive([0, 1, 2, 3].map(grey)) });
  await waitForPhase(page, 'done');
  expect(await status()).toContain('Frame 4 of 4');
  expect(await status()).not.toContain('guess');
  expect(await page.title()).toBe('drive.mcap – monorange');
  expect(await message()).toBe('');
  const rig = await exported(page, 'rig.toml');
  const read = (name: string) => Number(new RegExp(`^${name} = (.*)$`, 'm').exec(rig.split('[mount]')[1]!)![1]);
  expect([read('height'), read('tilt_deg'), read('forward')].map((number) => Number(number.toFixed(9)))).toEqual([0.4, 12, 0.1]);
  expect(rig).toContain('focal = [365.0, 365.0]');
  const rows = (await exported(page, 'trajectory.tum')).trim().split('\n').map((line) => line.split(' ').map(Number));
  expect(rows.map(([time]) => time)).toEqual([0, 0.1, 0.2, 0.3]);
  expect(rows[3]![1]).toBeCloseTo(0.15, 2);
  // The page's own recording is one that it reads.
  const own = await exportedBytes(page, 'drive.mcap');
  await openFiles({ 'again.mcap': own });
  await expect.poll(() => page.title()).toBe('again.mcap – monorange');
  await waitForPhase(page, 'done');
  // Its pictures are twice as large, so that what is drawn in them can be read.
  expect(await exported(page, 'rig.toml')).toContain('width = 640\nheight = 480\nfocal = [730.0, 730.0]\nprincipal = [320.5, 240.5]');
  expect((await exported(page, 'trajectory.tum')).trim().split('\n').length).toBe(4);
});

test('what a recording lacks stays a guess, and what is beside it counts', async () => {
  const bare = drive([0, 1].map(grey), { transform: false });
  await openFiles({ 'drive.mcap': bare });
  await waitForPhase(page, 'done');
  expect(await message()).toMatch(/drive\.mcap: no transforms lead from the pictures' frame `camera_optical`/);
  expect(await status()).toContain('how the camera sits is a guess');
  await openFiles({ 'drive.mcap': bare, 'rig.toml': RIG.replace('height = 0.4', 'height = 0.7') });
  await waitForPhase(page, 'done');
  await expect.poll(() => exported(page, 'rig.toml')).toContain('height = 0.7');
  expect(await status()).not.toContain('guess');
  await openFiles({ 'drive.mcap': drive([grey(0)], { camera: false }) });
  await expect.poll(message).toContain('has no camera_info');
  await waitForPhase(page, 'done');
  expect(await status()).toContain('camera and mount are guesses');
});

test('a folder of rosbag2 and a ZIP of it open; files that are cut or none say so', async () => {
  const bag = drive([0, 1, 2].map(grey));
  await openFiles({ 'drive.zip': zip([{ path: 'drive/metadata.yaml', content: 'rosbag2_bagfile_information:\n' }, { path: 'drive/drive_0.mcap', content: bag }]) });
  await waitForPhase(page, 'done');
  expect(await status()).toContain('Frame 3 of 3');
  expect(await message()).toBe('');
  await openFiles({ 'cut.mcap': bag.subarray(0, bag.length - 320 * 240 - 100) });
  await expect.poll(message).toContain('cut.mcap: ends early');
  await waitForPhase(page, 'done');
  expect(await status()).toContain('Frame 2 of 2');
  for (const [name, content, said] of [
    ['old.mcap', '#ROSBAG V2.0\n', 'old.mcap: is a bag of ROS 1. To mend it: turn it into ROS 2'],
    ['drive.db3', `SQLite format 3\0${'\0'.repeat(100)}`, 'drive.db3: is a damaged SQLite file'],
    ['none.mcap', drive([]), 'none.mcap: holds no pictures; its topics are'],
  ] as const) {
    await openFiles({ [name]: content });
    await expect.poll(message).toContain(said);
    expect(await phase(page)).toBe('done');
  }
});

test('a large recording says how far it is read, and stops when it is told to', async () => {
  const { pieces, length } = large(60, 16 << 20);
  const path = join(folder, 'large.mcap');
  const file = await open(path, 'w');
  for (const [at, bytes] of pieces) await file.write(bytes, 0, bytes.length, at);
  await file.truncate(length);
  await file.close();
  await page.setInputFiles('#files', path);
  await expect.poll(status, { interval: 20 }).toMatch(/^Reading large\.mcap: [1-9]\d? %\.$/);
  await page.click('#cancel');
  await expect.poll(message).toContain('Reading large.mcap was cancelled.');
  expect(await phase(page)).toBe('empty');
  expect(await page.locator('#cancel').isHidden()).toBe(true);
});
