/** What people do with the page that a bench does not: they touch, undo, drop what they have, listen to it. */
import { readdir, readFile, rm, writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { afterAll, beforeAll, beforeEach, afterEach, expect, test } from 'vitest';
import type { Page } from 'playwright-core';
import { expectAccessible } from './axe.ts';
import { exported, openSite, phase, waitForPhase, type Site } from './browser.ts';
import { corner, png, RIG } from './pictures.ts';

let site: Site;
let page: Page;
beforeAll(async () => void (site = await openSite()));
afterAll(() => site.close());
beforeEach(async () => {
  page = await site.context.newPage();
  await page.goto(site.address);
  await waitForPhase(page, 'empty');
});
afterEach(() => page.close());

const status = () => page.locator('#status').innerText();
const message = () => page.locator('#messages').innerText();
const readout = () => page.locator('#readout').innerText();

async function openFiles(files: Record<string, Buffer | string>): Promise<void> {
  await page.setInputFiles('#files', Object.entries(files).map(([name, content]) => ({ name, buffer: Buffer.from(content), mimeType: 'application/octet-stream' })));
}

/** A folder with these files, opened as someone would open theirs. */
async function openFolder(files: Record<string, Buffer | string>): Promise<void> {
  await page.setInputFiles('#folder', await site.written(files));
}

const pictures = (folder: string, names: string[], width = 320, height = 240) =>
  Object.fromEntries(names.map((name) => [`${folder}${name}`, png(width, height, corner)]));

async function setHeight(value: string): Promise<void> {
  if (!(await page.locator('#setup').isVisible())) await page.click('#setup-toggle');
  await page.getByLabel('Height in m').fill(value);
  await page.getByLabel('Height in m').press('Enter');
}
const height = () => page.getByLabel('Height in m').inputValue();

test('the empty page has ranged corners before anything is opened', async () => {
  await expect.poll(() => page.locator('#corners-table tbody tr').count()).toBeGreaterThan(0);
  expect(await page.locator('#corners-table').textContent()).toMatch(/\d\.\d+ m ± 0\.\d+/);
});

test('a setting survives files that are dropped later, and rubbish changes nothing', async () => {
  await openFiles(pictures('', ['1.png', '2.png', '3.png']));
  await waitForPhase(page, 'done');
  await setHeight('0.77');
  await waitForPhase(page, 'done');
  await openFiles({ 'times.txt': '0.0\n0.2\n0.4\n' });
  await expect.poll(() => phase(page)).toBe('done');
  expect(await height()).toBe('0.770');
  const before = await exported(page, 'trajectory.tum');
  await openFiles({ 'drive.mcap': 'rubbish' });
  await expect.poll(message).toContain('drive.mcap: is neither MCAP nor a rosbag2 database');
  expect(await phase(page)).toBe('done');
  expect([await height(), await exported(page, 'trajectory.tum')]).toEqual(['0.770', before]);
});

test('Undo takes back settings one by one, and never leaves the page', async () => {
  await page.click('#setup-toggle');
  const undo = page.getByRole('button', { name: 'Undo' });
  const first = await height();
  expect(await undo.isDisabled()).toBe(true);
  await setHeight('0.9');
  await setHeight('1.1');
  await undo.click();
  await expect.poll(height).toBe('0.900');
  await undo.click();
  await expect.poll(height).toBe(first);
  expect(await undo.isDisabled()).toBe(true);
  expect(page.url()).toContain(site.address);
});

test('a camera file counts beside a rig that is open', async () => {
  await openFiles({ ...pictures('', ['1.png']), 'rig.toml': RIG });
  await waitForPhase(page, 'done');
  const matrix = (name: string, rows: number, cols: number, data: number[]) => `${name}:\n  rows: ${rows}\n  cols: ${cols}\n  data: [${data.join(', ')}]\n`;
  await openFiles({ 'mine.yaml': `image_width: 320\nimage_height: 240\n${matrix('camera_matrix', 3, 3, [300, 0, 160, 0, 300, 120, 0, 0, 1])}${matrix('distortion_coefficients', 1, 5, [0, 0, 0, 0, 0])}` });
  await page.click('#setup-toggle');
  await expect.poll(() => page.locator('#setup').innerText()).toContain('focal length 300.0 px, from mine.yaml');
  await expect.poll(() => exported(page, 'rig.toml')).toContain('height = 0.4\n');
});

test('a mount that nobody has measured stays marked as a guess, with a ± to match', async () => {
  const matrix = 'camera_matrix:\n  rows: 3\n  cols: 3\n  data: [365, 0, 160, 0, 365, 120, 0, 0, 1]\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0, 0, 0, 0, 0]\n';
  await openFiles({ ...pictures('', ['1.png']), 'camera.yaml': `image_width: 320\nimage_height: 240\n${matrix}` });
  await waitForPhase(page, 'done');
  await page.locator('#messages button').first().click();
  expect(await status()).toContain('how the camera sits is a guess');
  const box = (await page.locator('#camera-view').boundingBox())!;
  await page.mouse.move(box.x + box.width * 0.4, box.y + box.height * 0.85);
  const share = async () => Number(/± ([\d.]+)/.exec(await readout())![1]) / Number(/^([\d.]+) m/.exec(await readout())![1]);
  await expect.poll(readout).toContain('how the camera sits is a guess');
  expect(await share()).toBeGreaterThan(0.2);
  expect(await exported(page, 'rig.toml')).toContain('# Nobody has measured how the camera sits');
  await setHeight('0.5');
  await expect.poll(status).not.toContain('guess');
});

test('one ±: a corner’s is that of the floor beside it', async () => {
  await openFiles({ ...pictures('', ['1.png']), 'rig.toml': `${RIG}height_std = 0.01\ntilt_std_deg = 1.0\nroll_std_deg = 1.0\nyaw_std_deg = 1.0\n` });
  await waitForPhase(page, 'done');
  const row = await page.locator('#corners-table tbody tr td').nth(1).textContent();
  const [, range, std] = /([\d.]+) m ± ([\d.]+)/.exec(row ?? '')!;
  // 1° of tilt alone is several per cent of a range of metres.
  expect(Number(std) / Number(range)).toBeGreaterThan(0.05);
});

/** A JPEG of 64 × 48 with entries of EXIF data, each a tag and a whole number: of the first directory, and of EXIF's own. */
async function photo(first: [number, number][], own: [number, number][]): Promise<Buffer> {
  const jpeg = await page.evaluate(async () => {
    const canvas = document.createElement('canvas');
    [canvas.width, canvas.height] = [64, 48];
    canvas.getContext('2d')!.fillRect(0, 0, 64, 20);
    const blob = await new Promise<Blob>((done) => canvas.toBlob((made) => done(made!), 'image/jpeg'));
    return [...new Uint8Array(await blob.arrayBuffer())];
  });
  const short = ([tag, number]: [number, number]) => [tag >> 8, tag & 255, 0, 3, 0, 0, 0, 1, number >> 8, number & 255, 0, 0];
  const after = 8 + 2 + 12 * (first.length + 1) + 4;
  const pointer = [0x87, 0x69, 0, 4, 0, 0, 0, 1, 0, 0, 0, after];
  const tiff = [0x4d, 0x4d, 0, 42, 0, 0, 0, 8, 0, first.length + 1, ...first.flatMap(short), ...pointer, 0, 0, 0, 0,
    0, own.length, ...own.flatMap(short), 0, 0, 0, 0];
  const exif = [...Buffer.from('Exif\0\0', 'latin1'), ...tiff];
  return Buffer.from([...jpeg.slice(0, 2), 0xff, 0xe1, 0, exif.length + 2, ...exif, ...jpeg.slice(2)]);
}
const [ORIENTATION, FILM_FOCAL] = [0x0112, 0xa405];

test('a photograph is shown upright, as it says', async () => {
  await openFiles({ 'photo.jpg': await photo([[ORIENTATION, 6]], []) });
  await waitForPhase(page, 'done');
  await page.click('#setup-toggle');
  expect(await page.locator('#setup').innerText()).toContain('48 × 64, not calibrated');
});

test('a photograph’s focal length is where the guess begins, and the guess says so', async () => {
  await openFiles({ 'photo.jpg': await photo([[ORIENTATION, 6]], []) });
  await waitForPhase(page, 'done');
  const box = (await page.locator('#camera-view').boundingBox())!;
  const share = async () => {
    await page.mouse.move(box.x + box.width / 2, box.y + box.height * 0.7);
    await expect.poll(readout).toMatch(/ m ± /);
    return Number(/± ([\d.]+)/.exec(await readout())![1]) / Number(/^([\d.]+) m/.exec(await readout())![1]);
  };
  await setHeight('0.5');
  await waitForPhase(page, 'done');
  const wide = await share();
  await page.goto('about:blank');
  await page.goto(site.address);
  await waitForPhase(page, 'empty');
  await openFiles({ 'photo.jpg': await photo([[ORIENTATION, 6]], [[FILM_FOCAL, 26]]) });
  await waitForPhase(page, 'done');
  expect(await status()).toContain('focal from the photo’s EXIF, ± 5 %; how the camera sits is a guess, and so are the ranges');
  // 26 mm on the film's diagonal of 43.27 mm, on this picture's of 80 pixels.
  expect(await exported(page, 'rig.toml')).toMatch(/# The camera is not calibrated: focal length \(from the photo’s EXIF\).*\n.*\n.*\n.*\nfocal = \[48\.07\d*, 48\.07/);
  await setHeight('0.5');
  await waitForPhase(page, 'done');
  expect(await status()).toContain('the camera is a guess: focal from the photo’s EXIF, ± 5 %');
  expect(await share()).toBeLessThan(wide);
  await page.getByLabel('View angle in °').fill('70');
  await page.getByLabel('View angle in °').press('Enter');
  await expect.poll(status).toContain('the camera is a guess, and so are the ranges');
});

test('a folder of EuRoC’s opens, with its foreign files as notes', async () => {
  await openFolder({
    ...pictures('mav0/cam0/data/', ['1403636579763555584.png', '1403636579863555584.png']),
    ...pictures('mav0/cam1/data/', ['1403636579763555584.png', '1403636579863555584.png']),
    'mav0/imu0/sensor.yaml': 'sensor_type: imu\ngyroscope_noise_density: 1.6968e-04\n',
  });
  await waitForPhase(page, 'done');
  expect(await status()).toContain('Frame 2 of 2');
  expect(await message()).toMatch(/sensor\.yaml is not used/);
  const [first = '', second = ''] = (await exported(page, 'trajectory.tum')).trim().split('\n');
  expect(Number(second.split(' ')[0]) - Number(first.split(' ')[0])).toBeCloseTo(0.1, 3);
});

test('folders of TUM and of KITTI open, and what is left aside is said', async () => {
  const names = ['1305031102.175304.png', '1305031102.211214.png'];
  await openFolder({ ...pictures('rgb/', names), ...pictures('depth/', names), 'rgb.txt': '# color images\n', 'depth.txt': '# depth maps\n', 'groundtruth.txt': names.map((name, k) => `${name.slice(0, -4)} ${k} 0 0 0 0 0 1\n`).join('') });
  await waitForPhase(page, 'done');
  expect(await message()).toMatch(/2 pictures were in drive\/depth left aside/);
  expect(await message()).toContain('they are taken from the pictures\' names');
  expect(await message()).not.toContain('.txt is not used');
  const [first = '', second = ''] = (await exported(page, 'trajectory.tum')).trim().split('\n');
  expect(Number(second.split(' ')[0]) - Number(first.split(' ')[0])).toBeCloseTo(0.036, 3);
  await openFolder({
    ...pictures('image_0/', ['000000.png', '000001.png', '000002.png']), ...pictures('image_1/', ['000000.png', '000001.png', '000002.png']),
    'times.txt': '0.0\n0.104\n0.207\n', 'calib.txt': `P0: ${[718.8, 0, 607.2, 0, 0, 718.8, 185.2, 0, 0, 0, 1, 0].join(' ')}\n`,
  });
  await waitForPhase(page, 'done');
  expect(await status()).toContain('Frame 3 of 3');
  expect(await message()).toMatch(/calib\.txt is not used: KITTI's calib\.txt does not say the picture's size.*write width and height into \[camera\]/);
  expect(await message()).toContain('image_1 left aside');
});

test('a car’s floor has a grid of metres that can be told apart', async () => {
  const grid = () => page.locator('#camera-view').getAttribute('aria-description');
  const small = await grid();
  await openFiles({ ...pictures('', ['1.png']), 'rig.toml': RIG.replace('height = 0.4', 'height = 1.65').replace('tilt_deg = 12.0', 'tilt_deg = 1.0') });
  await waitForPhase(page, 'done');
  const metres = (text: string | null) => Number(/grid of ([\d.]+) m/.exec(text ?? '')?.[1]);
  expect(metres(small)).toBeLessThanOrEqual(1);
  expect(metres(await grid())).toBeGreaterThanOrEqual(2);
});

test('what cannot be opened says what to do instead', async () => {
  await openFiles({ 'drive.rar': 'Rar!' });
  await expect.poll(message).toContain('drive.rar is not a picture: it is an archive. Unpack it, or make a ZIP of the folder, then drop that.');
  await openFiles({ 'drive.bag': '#ROSBAG' });
  await expect.poll(message).toContain('rosbags-convert --src drive.bag');
  await openFiles({ 'IMG_1.heic': 'ftypheic' });
  await expect.poll(message).toMatch(/IMG_1\.heic: it cannot be decoded .*of a kind that this browser does not know/);
});

test('a picture too large for any browser is refused before it is decoded', async () => {
  const bomb = png(2, 2, () => 0);
  bomb.writeUInt32BE(16_000, 16);
  bomb.writeUInt32BE(16_000, 20);
  await openFiles({ 'bomb.png': bomb });
  await expect.poll(message).toContain('it has 16000 × 16000 pixels, and this page takes 64 million');
});

test('many damaged pictures are one sentence', async () => {
  const good = png(320, 240, corner);
  await openFiles(Object.fromEntries(Array.from({ length: 12 }, (_, k) => [`${k}.png`, k % 2 ? good.subarray(0, 90) : good])));
  await waitForPhase(page, 'done');
  expect(await page.locator('#messages .problem').count()).toBe(1);
  expect(await message()).toContain('1.png: it cannot be decoded');
  expect(await message()).toContain('and so are 5 more pictures');
});

test('no corners is a sentence that says what to do', async () => {
  await openFiles(Object.fromEntries([1, 2].map((k) => [`${k}.png`, png(320, 240, () => 100 + k)])));
  await waitForPhase(page, 'done');
  await expect.poll(() => page.locator('#result').innerText()).toMatch(/^No floor corner was found in 2 pictures.*A floor corner is where/);
});

test('a plot’s picture is a picture while its table is shown', async () => {
  await openFiles(pictures('', ['1.png', '2.png']));
  await waitForPhase(page, 'done');
  const plot = page.locator('.plot').first();
  await plot.getByRole('button', { name: 'Table' }).click();
  const [download] = await Promise.all([page.waitForEvent('download'), plot.getByRole('button', { name: 'PNG' }).click()]);
  expect((await readFile(await download.path())).length).toBeGreaterThan(1000);
});

test('a number that is no setting goes back to what was set', async () => {
  const before = await (await page.click('#setup-toggle'), height());
  for (const wrong of ['-3', '']) {
    await setHeight(wrong);
    expect(await height()).toBe(before);
  }
  expect(await message()).toContain('Height must be between');
});

test('the result is told in words, and by the name of what was opened', async () => {
  await page.click('#sample');
  await waitForPhase(page, 'done');
  const result = await page.locator('#result').innerText();
  expect(result).toMatch(/^\d+\.\d m driven in \d+ pictures; \d+ landmarks; position ±.* at the end; .* from the truth, (in|out)side 3σ; .*NIS/);
  expect(await page.title()).toBe('sample – monorange');
  const tree = await page.locator('body').ariaSnapshot();
  for (const told of [result, 'Floor corners of', 'landmark', 'application "Camera view']) expect(tree).toContain(told);
  const box = (await page.locator('#camera-view').boundingBox())!;
  for (const at of [0.4, 0.6]) await page.mouse.click(box.x + box.width * at, box.y + box.height * 0.8);
  await expect.poll(readout).toMatch(/tape \d\.\d+ m ± 0\.\d+/);
});

test('a camera’s pictures stay after Stop and can be run again', async () => {
  await page.click('#camera');
  await waitForPhase(page, 'live');
  await expect.poll(status).toMatch(/Frame [3-9]/);
  await page.click('#cancel');
  await waitForPhase(page, 'done');
  const frames = (await exported(page, 'trajectory.tum')).trim().split('\n').length;
  expect(frames).toBeGreaterThan(2);
  await setHeight('0.6');
  await waitForPhase(page, 'done');
  expect((await exported(page, 'trajectory.tum')).trim().split('\n').length).toBe(frames);
});

test('Cancel ends a run at once, and a lost worker is started again', async () => {
  await page.click('#sample');
  await waitForPhase(page, 'running');
  await expect.poll(status).toMatch(/working: [1-9]/);
  const done = await page.evaluate(() => {
    document.getElementById('cancel')!.click();
    return Number(/working: (\d+)/.exec(document.getElementById('status')!.textContent)![1]);
  });
  await waitForPhase(page, 'cancelled');
  // Those of the last tenth of a second, which had not been told of, and the one in work.
  expect(Number(/cancelled after (\d+)/.exec(await status())![1]) - done).toBeLessThan(25);
  await page.click('#sample');
  await waitForPhase(page, 'running');
  await page.workers()[0]!.evaluate(() => self.close());
  await expect.poll(message, { timeout: 60_000 }).toContain('was started again');
  await page.click('#sample');
  await waitForPhase(page, 'done');
});

test('a tab of an old build finds the parts that it has yet to load', async () => {
  await page.evaluate(() => navigator.serviceWorker.ready);
  await page.reload();
  await waitForPhase(page, 'empty');
  const assets = join(site.folder, 'assets');
  const gone = (await readdir(assets)).filter((name) => name.startsWith('monorange_wasm_results')).map((name) => join(assets, name));
  const worker = join(site.folder, 'sw.js');
  const before = await Promise.all([...gone, worker].map(async (path) => [path, await readFile(path)] as const));
  try {
    for (const path of gone) await rm(path);
    await writeFile(worker, (await readFile(worker, 'utf8')).replace(/const CACHE = .*/, "const CACHE = 'monorange-next';").replace(/const FILES = .*/, "const FILES = ['./'];"));
    await page.evaluate(async () => {
      const registration = await navigator.serviceWorker.getRegistration();
      await registration!.update();
      while (!registration!.waiting) await new Promise((done) => setTimeout(done, 50));
    });
    await openFiles(pictures('', ['1.png', '2.png']));
    await waitForPhase(page, 'done');
    expect(await exported(page, 'report.html')).toContain('<h1>');
  } finally {
    for (const [path, content] of before) await writeFile(path, content);
  }
});

test('nothing that WCAG 2.2 AA asks for is missing, in any state', async () => {
  const check = (state: string) => expectAccessible(page, state);
  await check('empty');
  await page.click('#setup-toggle');
  await check('set-up');
  await openFiles({ ...pictures('', ['1.png', '2.png', '3.png']), 'notes.txt': 'hello' });
  await waitForPhase(page, 'done');
  await check('done, with a message');
  await page.click('#setup-toggle');
  await page.locator('.plot').first().getByRole('button', { name: 'Table' }).click();
  await check('tables');
  await page.click('#export-toggle');
  await check('export');
  await page.emulateMedia({ colorScheme: 'dark' });
  await check('dark');
  await page.keyboard.press('Escape');
  await page.click('#setup-toggle');
  await page.getByRole('button', { name: 'Click floor points' }).click();
  await check('points, dark');
  await page.click('#setup-toggle');
  await page.click('#sample');
  await waitForPhase(page, 'running');
  await check('running, dark');
  await page.click('#cancel');
  await waitForPhase(page, 'cancelled');
  await page.emulateMedia({ colorScheme: 'light' });
  await check('cancelled');
  await page.click('#camera');
  await waitForPhase(page, 'live');
  await check('live');
});

test('what looks wrong and is used all the same is said, as on the command line', async () => {
  const [a, b] = [1, 2].map((shift) => png(320, 240, (u, v) => corner(u + shift, v)));
  const wheels = `t,v,omega\n${[0, 1, 2, 3, 4, 5].map((k) => `${k / 10},0.5,0.0\n`).join('')}`;
  await openFiles({
    'rig.toml': RIG.replace('height = 0.4', 'height = 40.0'), 'odometry.csv': wheels, 'times.txt': '0\n0.1\n0.2\n0.3\n0.4\n0.5\n',
    '1.png': a!, '2.png': a!, '3.png': a!, '4.png': a!, '5.png': b!, '6.png': png(320, 240, () => 9),
  });
  await waitForPhase(page, 'done');
  for (const said of ['rig.toml: `mount.height` is 40', '3 of 6 pictures are the one before, pixel for pixel, while the wheels drove', '6.png: the picture is almost black']) {
    await expect.poll(message).toContain(said);
  }
  // Pictures that stand still check nothing.
  expect(await page.locator('#result').innerText()).toContain('unchecked');
  const report = JSON.parse(await exported(page, 'report.json')) as { warnings: string[]; verdict: string };
  expect(report.verdict).toBe('unchecked');
  expect(report.warnings.join()).toMatch(/mount\.height.*almost black.*the one before/s);
});

test('a JPEG that is cut short is skipped, whatever the browser makes up', async () => {
  const jpeg = await page.evaluate(async () => {
    const canvas = Object.assign(document.createElement('canvas'), { width: 320, height: 240 });
    canvas.getContext('2d')!.fillRect(0, 0, 160, 150);
    const blob = await new Promise<Blob>((done) => canvas.toBlob((made) => done(made!), 'image/jpeg'));
    return [...new Uint8Array(await blob.arrayBuffer())];
  });
  const whole = Buffer.from(jpeg);
  await openFiles({ '1.jpg': whole, '2.jpg': whole.subarray(0, whole.length - 200), '3.jpg': whole });
  await waitForPhase(page, 'done');
  await expect.poll(message).toContain('2.jpg: it is cut short: its JPEG data has no end. It is skipped.');
});
