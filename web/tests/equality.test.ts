/** What the page computes is what the command line computes, byte for byte. */
import { execFileSync } from 'node:child_process';
import { appendFileSync } from 'node:fs';
import { appendFile, mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { exported, openSite, waitForPhase, type Site } from './browser.ts';

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

/** A drive simulated by the command line: its folder. */
function simulate(name: string, frames: number): string {
  const drive = join(folder, name);
  run('simulate', '--scene=corridor', `--frames=${frames}`, '--walkers=2', '--seed=5', `--out=${drive}`);
  // The page finds corners by lines, as every target can.
  appendFileSync(join(drive, 'rig.toml'), '\n[extract]\ncorners = "lines"\n');
  return drive;
}

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
  await page.close();
  return texts;
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
  const outputs = ['trajectory.tum', 'trajectory.csv', 'map.csv', 'map.ply', 'observations.csv', 'report.json', 'report.html'];
  const texts = await expectSame(drive, [`--odometry=${join(drive, 'odometry.csv')}`], outputs);
  expect(texts.get('trajectory.tum')?.trim().split('\n')).toHaveLength(60);
  expect(texts.get('observations.csv')?.split('\n').length).toBeGreaterThan(50);
  expect(texts.get('report.html')).toContain('data:image/jpeg');
});

test.skipIf(!monorange)('without odometry the motion comes from the pictures, byte for byte, past a damaged one', async () => {
  const drive = simulate('by-sight', 12);
  await rm(join(drive, 'odometry.csv'));
  const damaged = join(drive, 'frames', '000006.png');
  await writeFile(damaged, (await readFile(damaged)).subarray(0, 2000));
  const texts = await expectSame(drive, [], ['trajectory.tum', 'trajectory.csv']);
  expect(texts.get('trajectory.tum')?.trim().split('\n')).toHaveLength(11);
});
