/** What the page computes is what the command line computes, byte for byte. */
import { execFileSync } from 'node:child_process';
import { appendFileSync } from 'node:fs';
import { appendFile, mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { exported, exportedBytes, openSite, waitForPhase, type Site } from './browser.ts';
import { drive as recordingOf } from './mcap.ts';

/** The command line, as `cargo xtask web --test` has built it. */
const monorange = process.env['MONORANGE'];
if (!monorange && process.env['CI']) throw new Error('MONORANGE must name the command line: run `cargo xtask web --test`.');
if (!monorange) console.warn('Skipped: MONORANGE does not name the command line; `cargo xtask web --test` builds it.');

let site: Site;
let folder: string;
beforeAll(async () => {
  if (!monorange) return;
  folder = await mkdtemp(join(tmpdir(), 'monorange-'));
  site = await openSite();
});
afterAll(async () => {
  await site?.close();
  if (folder) await rm(folder, { recursive: true, force: true });
});

const run = (...words: string[]) => execFileSync(monorange!, words, { stdio: ['ignore', 'ignore', 'inherit'] });

/** What a run writes. */
const SEVEN = ['trajectory.tum', 'trajectory.csv', 'map.csv', 'map.ply', 'observations.csv', 'report.json', 'report.html'];

/** A drive simulated by the command line: its folder. */
function simulate(name: string, frames: number): string {
  const drive = join(folder, name);
  run('simulate', '--scene=corridor', `--frames=${frames}`, '--walkers=2', '--seed=5', `--out=${drive}`);
  // The page finds corners by lines, as every target can.
  appendFileSync(join(drive, 'rig.toml'), '\n[extract]\ncorners = "lines"\n');
  return drive;
}

const recordingAt = (drive: string) => `${drive}-run.mcap`;

/** The page on the folder and `monorange slam` on the same files give these outputs the same bytes. */
async function expectSame(drive: string, slam: string[], outputs: string[]): Promise<Map<string, string>> {
  const out = `${drive}-out`;
  run('slam', `--rig=${join(drive, 'rig.toml')}`, `--frames=${join(drive, 'frames')}`, `--times=${join(drive, 'times.txt')}`,
    `--truth=${join(drive, 'truth.tum')}`, ...slam, `--out=${out}`);
  const page = await site.context.newPage();
  await page.goto(site.address);
  await waitForPhase(page, 'empty');
  await page.setInputFiles('#folder', drive);
  await waitForPhase(page, 'done');
  const texts = new Map<string, string>();
  for (const name of outputs) {
    const [here, there] = [await exported(page, name), await readFile(join(out, name), 'utf8')];
    expect(firstDifference(alike(here), alike(there)), name).toBeNull();
    texts.set(name, here);
  }
  if (slam.some((word) => word.startsWith('--mcap'))) {
    expect(byteDifference(await exportedBytes(page, 'drive.mcap'), await readFile(recordingAt(drive)))).toBeNull();
  }
  await page.close();
  return texts;
}

/** Both lengths, and the first byte that differs: of hundreds of thousands that says more than what they are. */
function byteDifference(here: Buffer, there: Buffer): { lengths: number[]; at: number } | null {
  return here.equals(there) ? null : { lengths: [here.length, there.length], at: here.findIndex((byte, at) => byte !== there[at]) };
}

/** The first lines that differ, cut short: whole files would fill screens. */
function firstDifference(here: string, there: string): [string, string] | null {
  if (here === there) return null;
  const [mine, theirs] = [here.split('\n'), there.split('\n')];
  const line = mine.findIndex((text, index) => text !== theirs[index]);
  const [a = '', b = ''] = [mine[line], theirs[line]];
  const at = Math.max(0, [...a].findIndex((letter, index) => letter !== b[index]) - 40);
  return [a.slice(at, at + 160), b.slice(at, at + 160)];
}

/** Times and the command that was typed are not the same twice. */
function alike(text: string): string {
  return text
    .replace(/<section><h2>Time per frame<\/h2>.*?<\/section>/s, '')
    .replace(/<footer>.*?<\/footer>/s, '')
    .replace(/"command": .*\n/, '')
    .replace(/ {2}"stages_ms": \{.*?\n {2}\},\n/s, '');
}

test.skipIf(!monorange)('a dropped folder gives the files of `monorange slam`, byte for byte', async () => {
  const drive = simulate('drive', 60);
  // Settings of every section, so that all of them must find their way.
  await appendFile(join(drive, 'rig.toml'), 'edge_threshold = 5.0\n\n[filter]\ngate = "hard"\n\n[association]\nmatch_nis = [6.0, 8.5]\n');
  const texts = await expectSame(drive, [`--odometry=${join(drive, 'odometry.csv')}`], SEVEN);
  expect(texts.get('trajectory.tum')?.trim().split('\n')).toHaveLength(60);
  expect(texts.get('observations.csv')?.split('\n').length).toBeGreaterThan(50);
  expect(texts.get('report.html')).toContain('data:image/jpeg');
});

test.skipIf(!monorange)('without odometry the motion comes from the pictures, byte for byte, past a damaged one', async () => {
  const drive = simulate('by-sight', 12);
  await rm(join(drive, 'odometry.csv'));
  const damaged = join(drive, 'frames', '000006.png');
  await writeFile(damaged, (await readFile(damaged)).subarray(0, 2000));
  const texts = await expectSame(drive, [`--mcap=${recordingAt(drive)}`], ['trajectory.tum', 'trajectory.csv']);
  expect(texts.get('trajectory.tum')?.trim().split('\n')).toHaveLength(11);
});

test.skipIf(!monorange)('drive.mcap is that of `slam --mcap`, and a recording gives the files of `slam --bag`, byte for byte', async () => {
  const drive = simulate('recorded', 15);
  const recording = join(folder, 'recording.mcap');
  run('slam', `--rig=${join(drive, 'rig.toml')}`, `--frames=${join(drive, 'frames')}`, `--times=${join(drive, 'times.txt')}`,
    `--odometry=${join(drive, 'odometry.csv')}`, `--out=${drive}-out`, `--mcap=${recording}`);
  const page = await site.context.newPage();
  await page.goto(site.address);
  await waitForPhase(page, 'empty');
  await page.setInputFiles('#folder', drive);
  await waitForPhase(page, 'done');
  expect(byteDifference(await exportedBytes(page, 'drive.mcap'), await readFile(recording))).toBeNull();
  // Compressed pictures, those of the overlays; and raw ones of a corner that comes nearer.
  const raw = join(folder, 'raw.mcap');
  const grey = (k: number) => Buffer.from(Array.from({ length: 320 * 240 }, (_, at) => (at / 320 > 150 + k ? 60 : at % 320 > 150 + 2 * k ? 180 : 120)));
  await writeFile(raw, recordingOf([0, 1, 2, 3, 4, 5].map(grey)));
  for (const [given, corners] of [[recording, 0], [raw, 6]] as const) {
    await page.setInputFiles('#files', given);
    await expect.poll(() => page.title()).toContain(basename(given));
    await waitForPhase(page, 'done');
    const [rig, out] = [`${given}.toml`, `${given}-out`];
    await writeFile(rig, `${await exported(page, 'rig.toml')}\n[extract]\ncorners = "lines"\n`);
    run('slam', `--rig=${rig}`, `--bag=${given}`, `--out=${out}`);
    for (const name of ['trajectory.tum', 'trajectory.csv', 'map.csv', 'map.ply', 'observations.csv']) {
      expect(firstDifference(await exported(page, name), await readFile(join(out, name), 'utf8')), `${name} of ${given}`).toBeNull();
    }
    expect((await exported(page, 'observations.csv')).trim().split('\n').length).toBeGreaterThanOrEqual(corners + 1);
  }
  await page.close();
});

/** README's rig: a camera file of ROS, a mount measured by hand, corners as every target finds them, and the floor's texture. */
async function readmeRig(drive: string): Promise<void> {
  const rig = await readFile(join(drive, 'rig.toml'), 'utf8');
  const numbers = (name: string) => JSON.parse(new RegExp(`^${name} = (.*)$`, 'm').exec(rig)![1]!) as number & number[];
  const [fx, fy] = numbers('focal') as number[];
  const [cx, cy] = numbers('principal') as number[];
  const matrix = (name: string, rows: number, cols: number, data: unknown[]) => `${name}:\n  rows: ${rows}\n  cols: ${cols}\n  data: [${data.join(', ')}]\n`;
  await writeFile(join(drive, 'camera.yaml'), [
    `image_width: ${numbers('width')}\nimage_height: ${numbers('height')}\ncamera_name: front\ndistortion_model: plumb_bob\n`,
    matrix('camera_matrix', 3, 3, [fx, 0, cx, 0, fy, cy, 0, 0, 1]),
    matrix('distortion_coefficients', 1, 5, numbers('distortion')),
  ].join(''));
  await writeFile(join(drive, 'rig.toml'), 'camera_info = "camera.yaml"\n\n[mount]\nheight = 0.40\ntilt_deg = 12.0\n\n[extract]\ncorners = "lines"\n\n[association]\ncarrier = "floor"\n');
}

test.skipIf(!monorange)('README’s rig with the floor as carrier gives the seven files of `monorange slam`, byte for byte', async () => {
  const drive = simulate('by-floor', 60);
  await readmeRig(drive);
  const texts = await expectSame(drive, [`--odometry=${join(drive, 'odometry.csv')}`], SEVEN);
  const { corners_carried_by: carried, frames_used } = JSON.parse(texts.get('report.json')!) as { corners_carried_by: { floor: number }; frames_used: number };
  expect(frames_used).toBe(60);
  // It is the floor that carries, or this says nothing.
  expect(carried.floor).toBeGreaterThan(30);
});

test.skipIf(!monorange)('a setting that only hosts have is refused in words', async () => {
  const drive = simulate('proposals', 2);
  const rig = join(drive, 'rig.toml');
  await writeFile(rig, (await readFile(rig, 'utf8')).replace('corners = "lines"', 'corners = "proposals"'));
  const page = await site.context.newPage();
  await page.goto(site.address);
  await waitForPhase(page, 'empty');
  await page.setInputFiles('#folder', drive);
  await expect.poll(() => page.locator('#messages').innerText()).toMatch(/extract\.corners.*proposals are found on hosts only/);
  await page.close();
});
