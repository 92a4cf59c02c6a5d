/** A phone of 390 pixels' width. */
import { afterAll, beforeAll, expect, test } from 'vitest';
import { openSite, waitForPhase, type Site } from './browser.ts';

let site: Site;
beforeAll(async () => {
  site = await openSite({ width: 390, height: 844, touch: true });
});
afterAll(() => site.close());

test('one column, nothing wider than the screen, targets of 44 px', async () => {
  const page = await site.context.newPage();
  await page.goto(site.address);
  await waitForPhase(page, 'empty');
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(390);
  const tops = await page.evaluate(() => ['camera-view', 'map-view'].map((id) => document.getElementById(id)!.getBoundingClientRect().top));
  expect(tops[0]).toBeLessThan(tops[1]!);
  const small = await page.evaluate(() =>
    [...document.querySelectorAll('button')]
      .filter((button) => button.checkVisibility())
      .map((button) => [button.textContent, button.getBoundingClientRect().height] as const)
      .filter(([, height]) => height < 43.5));
  expect(small).toEqual([]);
  await page.tap('#empty-sample');
  await waitForPhase(page, 'done');
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(390);
});
