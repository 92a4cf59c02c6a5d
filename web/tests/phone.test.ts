/** A phone of 390 pixels' width, and fingers. */
import { afterAll, beforeAll, expect, test } from 'vitest';
import type { CDPSession, Page } from 'playwright-core';
import { expectAccessible } from './axe.ts';
import { openSite, waitForPhase, type Site } from './browser.ts';

let site: Site;
let page: Page;
let fingers: CDPSession;
beforeAll(async () => {
  site = await openSite({ width: 390, height: 844, touch: true, scale: 2 });
  page = await site.context.newPage();
  await page.goto(site.address);
  await waitForPhase(page, 'empty');
  fingers = await page.context().newCDPSession(page);
});
afterAll(() => site.close());

const readout = () => page.locator('#readout').innerText();
type Points = [number, number][];
const touch = (type: 'touchStart' | 'touchMove' | 'touchEnd', points: Points = []) =>
  fingers.send('Input.dispatchTouchEvent', { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
async function view(): Promise<{ x: number; y: number; width: number; height: number }> {
  await page.evaluate(() => scrollTo(0, 0));
  return (await page.locator('#camera-view').boundingBox())!;
}

test('one column, nothing wider than the screen, targets of 44 px, every button in sight', async () => {
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(390);
  const tops = await page.evaluate(() => ['camera-view', 'map-view'].map((id) => document.getElementById(id)!.getBoundingClientRect().top));
  expect(tops[0]).toBeLessThan(tops[1]!);
  const buttons = await page.evaluate(() =>
    [...document.querySelectorAll('button')].filter((button) => button.checkVisibility()).map((button) => {
      const { height, right } = button.getBoundingClientRect();
      return { text: button.textContent, height, right, bar: button.closest('.bar') !== null };
    }));
  expect(buttons.filter(({ height }) => height < 43.5)).toEqual([]);
  expect(buttons.filter(({ bar, right }) => bar && right > 390)).toEqual([]);
});

test('a tap is a range and a bearing, a second one a distance', async () => {
  const box = await view();
  await page.touchscreen.tap(box.x + box.width * 0.4, box.y + box.height * 0.8);
  await expect.poll(readout).toMatch(/^\d\.\d+ m ± 0\.\d+, (straight ahead|\d+\.\d° (left|right))/);
  await page.touchscreen.tap(box.x + box.width * 0.6, box.y + box.height * 0.8);
  await expect.poll(readout).toMatch(/tape \d\.\d+ m ± 0\.\d+/);
});

test('a finger that rests looks closer, and reads what it points at while it moves', async () => {
  const box = await view();
  const [x, y] = [box.x + box.width / 2, box.y + box.height * 0.75];
  await touch('touchStart', [[x, y]]);
  await page.waitForTimeout(400);
  const first = await readout();
  await touch('touchMove', [[x + 40, y + 30]]);
  await expect.poll(readout).not.toBe(first);
  expect(await page.evaluate(() => scrollY)).toBe(0);
  await touch('touchEnd');
});

test('one finger scrolls the page, over the picture and over the map', async () => {
  for (const [id, way] of [['#camera-view', -1], ['#map-view', 1]] as const) {
    await page.evaluate((id) => (id === '#map-view' ? document.querySelector(id)!.scrollIntoView({ block: 'center' }) : scrollTo(0, 0)), id);
    const box = (await page.locator(id).boundingBox())!;
    const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
    const before = await page.evaluate(() => scrollY);
    await touch('touchStart', [[x, y]]);
    for (let k = 1; k <= 12; k += 1) await touch('touchMove', [[x, y + way * 12 * k]]);
    await touch('touchEnd');
    await expect.poll(async () => way * (before - (await page.evaluate(() => scrollY))), { message: id }).toBeGreaterThan(50);
  }
});

test('two fingers move the picture, and cannot push it out of sight', async () => {
  const box = await view();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  for (let n = 0; n < 6; n += 1) {
    await touch('touchStart', [[x - 30, y - 60], [x + 30, y - 60]]);
    for (let k = 1; k <= 5; k += 1) await touch('touchMove', [[x - 30, y - 60 + 40 * k], [x + 30, y - 60 + 40 * k]]);
    await touch('touchEnd');
  }
  expect(await page.evaluate(() => scrollY)).toBe(0);
  await page.touchscreen.tap(x, box.y + box.height - 6);
  await expect.poll(readout, { message: 'there is a picture under the finger' }).not.toBe('');
  await page.tap('#camera-fit');
});

test('nothing that WCAG 2.2 AA asks for is missing on a phone', async () => {
  for (const colorScheme of ['light', 'dark'] as const) {
    await page.emulateMedia({ colorScheme });
    await expectAccessible(page, colorScheme);
    await page.tap('#setup-toggle');
    await expectAccessible(page, `set-up, ${colorScheme}`);
    await page.tap('#setup-toggle');
  }
});

test('the sample runs', async () => {
  await page.evaluate(() => scrollTo(0, 0));
  await page.tap('#sample');
  await waitForPhase(page, 'done');
  await expectAccessible(page, 'done');
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(390);
});

test('the keyboard alone scrolls the page', async () => {
  await page.evaluate(() => {
    scrollTo(0, 0);
    (document.activeElement as HTMLElement | null)?.blur();
  });
  await page.keyboard.press('End');
  await expect.poll(() => page.evaluate(() => scrollY)).toBeGreaterThan(100);
});

test('a phone on its side shows picture and set-up beside each other, and the corners beside the card', async () => {
  await page.setViewportSize({ width: 844, height: 390 });
  await page.reload();
  await waitForPhase(page, 'empty');
  await page.evaluate(() => scrollTo(0, 0));
  const bottomOf = (id: string) => page.evaluate((id) => document.querySelector(id)!.getBoundingClientRect().bottom, id);
  const view = await page.locator('#camera-view').boundingBox();
  expect(await bottomOf('#empty')).toBeLessThan(view!.y + view!.height / 3);
  await page.tap('#setup-toggle');
  const field = await page.getByLabel('Height in m').boundingBox();
  expect(field!.y + field!.height).toBeLessThan(390);
  await expectAccessible(page, 'on its side');
  // Nothing that can be tapped lies over another such thing, wherever the page is scrolled to.
  await page.evaluate(() => scrollTo(0, 62));
  await expectAccessible(page, 'on its side, scrolled');
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(844);
});
