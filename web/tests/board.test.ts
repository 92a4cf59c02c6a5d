/** A printed chessboard in the set-up panel: pictures of it give the camera, and the mount where one of them lies on the floor. */
import { afterAll, afterEach, beforeAll, beforeEach, expect, onTestFinished, test } from 'vitest';
import type { Page } from 'playwright-core';
import { expectAccessible } from './axe.ts';
import { exported, openSite, waitForPhase, type Site } from './browser.ts';
import { png } from './pictures.ts';
import { longestTask, startTrace } from './trace.ts';

const [WIDTH, HEIGHT, FOCAL] = [320, 240, 300];
const CENTRE = [162, 118] as const;
const SQUARE = 0.03;
const MOUNT = { height: 0.4, tilt: (35 * Math.PI) / 180 };

type Vector = [number, number, number];
/** The board's two sides and its first corner in the camera's frame (x right, y down, z forward). */
interface Pose { across: Vector; down: Vector; corner: Vector }

const dot = (a: Vector, b: Vector) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a: Vector, b: Vector): Vector => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** A board turned about x, then y, then z, its middle at a place. */
function pose([x, y, z]: Vector, middle: Vector): Pose {
  const turn = ([a, b, c]: Vector): Vector => {
    const [b1, c1] = [b * Math.cos(x) - c * Math.sin(x), b * Math.sin(x) + c * Math.cos(x)];
    const [a2, c2] = [a * Math.cos(y) + c1 * Math.sin(y), c1 * Math.cos(y) - a * Math.sin(y)];
    return [a2 * Math.cos(z) - b1 * Math.sin(z), a2 * Math.sin(z) + b1 * Math.cos(z), c2];
  };
  const [across, down] = [turn([1, 0, 0]), turn([0, 1, 0])];
  const corner = middle.map((at, axis) => at - 4 * SQUARE * across[axis]! - 2.5 * SQUARE * down[axis]!) as Vector;
  return { across, down, corner };
}

/** On the floor, its long side across the robot's way. */
function onFloor(): Pose {
  const [sin, cos] = [Math.sin(MOUNT.tilt), Math.cos(MOUNT.tilt)];
  // From the robot's frame (forward, left, up).
  const seen = ([forward, left, up]: Vector): Vector => [-left, -forward * sin - up * cos, forward * cos - up * sin];
  return { across: seen([0, -1, 0]), down: seen([-1, 0, 0]), corner: seen([0.7, 0.12, -MOUNT.height]) };
}

function picture({ across, down, corner }: Pose): Buffer {
  const normal = cross(across, down);
  const grey = (u: number, v: number) => {
    const ray: Vector = [(u - CENTRE[0]) / FOCAL, (v - CENTRE[1]) / FOCAL, 1];
    const scale = dot(corner, normal) / dot(ray, normal);
    const from = ray.map((entry, axis) => entry * scale - corner[axis]!) as Vector;
    const [column, row] = [Math.floor(dot(from, across) / SQUARE), Math.floor(dot(from, down) / SQUARE)];
    if (scale < 0 || column < -2 || column > 9 || row < -2 || row > 6) return 90;
    const black = column >= -1 && column < 9 && row >= -1 && row < 6 && (column + row) % 2 === 0;
    return black ? 35 : 215;
  };
  return png(WIDTH, HEIGHT, (u, v) => {
    let sum = 0;
    for (const dv of [-0.375, -0.125, 0.125, 0.375]) for (const du of [-0.375, -0.125, 0.125, 0.375]) sum += grey(u + du, v + dv);
    return Math.round(sum / 16);
  });
}

const HELD: [Vector, Vector][] = [
  [[0.45, 0.1, 0], [-0.05, -0.03, 0.4]], [[-0.45, 0.2, 0.3], [0.06, -0.03, 0.42]], [[0.1, 0.5, 0.1], [-0.05, 0.03, 0.4]],
  [[0, -0.5, 0.4], [0.05, 0.03, 0.42]], [[-0.3, -0.4, -0.2], [0.02, 0.01, 0.5]], [[0.5, -0.3, 0.2], [-0.03, 0.03, 0.38]],
];
const file = (name: string, buffer: Buffer) => ({ name, buffer, mimeType: 'image/png' });
const held = HELD.map(([turn, middle], index) => file(`held ${index + 1}.png`, picture(pose(turn, middle))));
const all = [...held, file('floor.png', picture(onFloor())), file('wall.png', png(WIDTH, HEIGHT, (u) => 100 + (u % 7)))];

let site: Site;
let page: Page;
beforeAll(async () => void (site = await openSite({ width: 1280, height: 720 })));
afterAll(() => site.close());
beforeEach(async () => {
  page = await site.context.newPage();
  await page.goto(site.address);
  await waitForPhase(page, 'empty');
});
afterEach(() => page.close());

const setup = () => page.locator('#setup').innerText();

/** By keyboard alone. */
async function openPanel(): Promise<void> {
  await page.locator('#setup-toggle').press('Enter');
  await page.locator('.board summary').press('Enter');
  await page.getByRole('button', { name: 'Choose pictures of the board…' }).waitFor();
}

async function choose(files: typeof all): Promise<void> {
  const button = page.getByRole('button', { name: 'Choose pictures of the board…' });
  const [chooser] = await Promise.all([page.waitForEvent('filechooser'), button.press('Enter')]);
  await chooser.setFiles(files);
}

/** Dropped on the panel, from the desktop's file manager. */
async function drop(files: typeof all): Promise<void> {
  await page.evaluate((given) => {
    const transfer = new DataTransfer();
    for (const { name, bytes } of given) transfer.items.add(new File([Uint8Array.from(bytes)], name));
    const details = { dataTransfer: transfer, bubbles: true, cancelable: true };
    const place = document.querySelector('.board button')!;
    for (const kind of ['dragenter', 'dragover', 'drop']) place.dispatchEvent(new DragEvent(kind, details));
  }, files.map(({ name, buffer }) => ({ name, bytes: [...buffer] })));
  expect(await page.locator('#drop').isVisible()).toBe(false);
}

test('a board gives the camera and the mount, which can be used, saved and taken back', async () => {
  const loaded: string[] = [];
  page.on('request', (request) => loaded.push(request.url()));
  await page.setInputFiles('#files', [file('drive.png', picture(onFloor()))]);
  await waitForPhase(page, 'done');
  await openPanel();
  expect(loaded.filter((url) => /wasm_board/.test(url))).toEqual([]);
  expect(await page.locator('#status').innerText()).toContain('camera and mount are guesses');
  await page.getByLabel('Side of a square in mm').fill('30');
  const trace = await startTrace(page);
  await choose(all);
  await expect.poll(setup, { timeout: 60_000 }).toContain('of 8 pictures');
  const longest = longestTask(await trace.end());
  console.log(`ms of the longest task: ${longest.toFixed(0)}`);
  expect(longest).toBeLessThan(50);
  const words = await setup();
  console.log(words.split('\n').filter((line) => /Focal length|left out/.test(line)).join('\n'));
  expect(words).toMatch(/7 of 8 pictures are off by 0\.\d\d px/);
  expect(words).toContain('wall.png is left out: it shows no chessboard.');
  expect(Math.abs(Number(/Focal length ([\d.]+)/.exec(words)![1]) - FOCAL)).toBeLessThan(3);
  await page.getByRole('button', { name: 'floor.png' }).press('Enter');
  expect(await page.locator('.board canvas').getAttribute('aria-label')).toBe('floor.png with the 54 corners that were found');
  await expectAccessible(page, 'a board');

  await page.getByLabel('The picture in which the board lies on the floor').selectOption({ label: 'floor.png' });
  await page.getByLabel('A side of the board points straight ahead').press('Space');
  await expect.poll(setup).toMatch(/Height 0\.(39|40)\d m ± 0\.0\d+, tilt 3[45]\.\d+° ± 0\.\d+, roll .*, yaw /);
  await page.getByRole('button', { name: 'Use it' }).press('Enter');
  await expect.poll(() => page.locator('#status').innerText()).not.toContain('guess');
  await waitForPhase(page, 'done');
  expect(await setup()).toContain('from board.toml');
  const rig = await exported(page, 'rig.toml');
  const number = (key: string) => Number(new RegExp(`^${key} = ([-\\d.e]+)`, 'm').exec(rig.split('[mount]')[1]!)![1]);
  expect(rig).not.toContain('#');
  expect(Math.abs(number('height') - MOUNT.height)).toBeLessThan(0.008);
  expect(Math.abs(number('tilt_deg') - 35)).toBeLessThan(1);
  expect(Math.abs(number('yaw_deg'))).toBeLessThan(1);
  expect(Math.abs(Number(/principal = \[([\d.]+)/.exec(rig)![1]) - CENTRE[0])).toBeLessThan(2);

  await page.getByRole('button', { name: 'Undo' }).press('Enter');
  await expect.poll(() => page.locator('#status').innerText()).toContain('camera and mount are guesses');
});

test('a camera alone leaves the mount a guess, and stays for the pictures that come', async () => {
  await openPanel();
  await page.getByLabel('Side of a square in mm').fill('30');
  await choose(held);
  await page.getByRole('button', { name: 'Use it' }).press('Enter');
  await expect.poll(setup).toContain('from board.yaml');
  await page.setInputFiles('#files', [file('drive.png', picture(onFloor()))]);
  await waitForPhase(page, 'done');
  await expect.poll(() => page.locator('#status').innerText()).toContain('how the camera sits is a guess');
  expect(await setup()).toContain('from board.yaml');
});

test('what tells no camera is said in words, with what to do', async () => {
  await openPanel();
  await choose(all.slice(-3));
  await expect.poll(setup).toContain('2 of 3 pictures can be used, and 3 are needed (wall.png shows no chessboard)');
  expect(await setup()).toContain('take ten or more');
  expect(await page.getByRole('button', { name: 'Use it' }).count()).toBe(0);
  const facing = [0.36, 0.4, 0.44, 0.48].map((away, index) => file(`facing ${index}.png`, picture(pose([0, 0, 0], [0.01, 0, away]))));
  await drop(facing);
  await expect.poll(setup).toContain('held the same way');
  await page.getByLabel('Inner corners across').fill('2');
  await choose(held);
  await expect.poll(setup).toContain('3 to 100 inner corners');
  await expectAccessible(page, 'a board that is refused');
});

test('on a phone nothing is cut off', async () => {
  const phone = await openSite({ width: 390, height: 844, touch: true, scale: 2 });
  await page.close();
  page = await phone.context.newPage();
  onTestFinished(() => phone.close());
  await page.goto(phone.address);
  await waitForPhase(page, 'empty');
  await openPanel();
  await page.getByLabel('Side of a square in mm').fill('30');
  await choose(all);
  await page.getByRole('button', { name: 'Use it' }).waitFor();
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBe(390);
  const wide = await page.evaluate(() => [...document.querySelectorAll('#setup .board *')].filter((shown) => shown.getBoundingClientRect().right > 390.5 && !shown.closest('.visually-hidden')).map(({ outerHTML }) => outerHTML.slice(0, 80)));
  expect(wide).toEqual([]);
  // Half under the bar, a button of the empty page would count as too small.
  await page.evaluate(() => scrollTo(0, 0));
  await expectAccessible(page, 'a board on a phone');
});
