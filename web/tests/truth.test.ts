/** A truth that does not cover the whole drive is compared where it does. */
import { afterAll, beforeAll, expect, test } from 'vitest';
import { openSite, waitForPhase, type Site } from './browser.ts';
import { png, RIG } from './pictures.ts';

let site: Site;
beforeAll(async () => void (site = await openSite()));
afterAll(() => site.close());

test('a truth that begins late is laid on the run where it begins, and the result says how much it covers', async () => {
  const times = [0, 0.5, 1, 1.5];
  const files: Record<string, Buffer | string> = {
    'rig.toml': RIG,
    'times.txt': times.map((time) => `${time}\n`).join(''),
    'odometry.csv': `t,v,omega\n${times.map((time) => `${time},0.5,0\n`).join('')}`,
    // The robot of the file's world goes along y, and the file knows nothing of the first half.
    'truth.csv': 't,x,y,heading\n1.0,7,3,1.5708\n1.5,7,3.25,1.5708\n',
  };
  times.forEach((_, index) => {
    files[`frames/${index}.png`] = png(320, 240, (u, v) => (v > 150 ? 60 : u > 150 + 9 * index ? 180 : 120));
  });
  const page = await site.context.newPage();
  await page.goto(site.address);
  await waitForPhase(page, 'empty');
  await page.setInputFiles('#folder', await site.written(files));
  await waitForPhase(page, 'done');
  const words = await page.locator('#result').innerText();
  expect(words).toContain('(the truth covers 2 of 4 pictures)');
  expect(Number(/([\d.]+) cm from the truth/.exec(words)?.[1])).toBeLessThan(10);
  await page.close();
});
