/** What the page computes is what the command line computes, byte for byte. */
import { execFileSync, spawnSync } from 'node:child_process';
import { existsSync } from 'node:fs';
import { mkdtemp, readFile, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { afterAll, beforeAll, expect, test } from 'vitest';
import { exported, openSite, waitForPhase, type Site } from './browser.ts';

const BUILT = ['../target/release/monorange', '../target/debug/monorange'].map((path) => resolve(path));
const monorange = process.env['MONORANGE'] ?? BUILT.find((path) => existsSync(path));

/** A `monorange` of before the command `slam` cannot be compared with. */
const slams = monorange !== undefined && spawnSync(monorange, ['slam', '--help'], { stdio: 'ignore' }).status === 0;
if (!slams) console.warn('Skipped: no monorange with the command slam; build it (cargo build -p monorange) or set MONORANGE.');

let site: Site;
let folder: string;
beforeAll(async () => {
  if (!slams) return;
  folder = await mkdtemp(join(tmpdir(), 'monorange-'));
  site = await openSite();
});
afterAll(async () => {
  await site?.close();
  if (folder) await rm(folder, { recursive: true, force: true });
});

test.skipIf(!slams)('a dropped folder gives the files of `monorange slam`, byte for byte', async () => {
  const [drive, out] = [join(folder, 'drive'), join(folder, 'out')];
  const run = (...words: string[]) => execFileSync(monorange!, words, { stdio: ['ignore', 'ignore', 'inherit'] });
  run('simulate', '--scene=corridor', '--frames=60', '--walkers=2', '--seed=5', `--out=${drive}`);
  const file = (name: string) => join(drive, name);
  run('slam', `--rig=${file('rig.toml')}`, `--frames=${file('frames')}`, `--times=${file('times.txt')}`,
    `--odometry=${file('odometry.csv')}`, `--truth=${file('truth.tum')}`, `--out=${out}`);
  const page = await site.context.newPage();
  await page.goto(site.address);
  await waitForPhase(page, 'empty');
  await page.setInputFiles('#folder', drive);
  await waitForPhase(page, 'done');
  for (const name of ['trajectory.tum', 'trajectory.csv', 'map.csv']) {
    expect(await exported(page, name), name).toBe(await readFile(join(out, name), 'utf8'));
  }
});
