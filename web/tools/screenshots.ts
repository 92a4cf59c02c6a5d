/** The page in each of its states, as pictures to look at: `npm run screenshots` writes them to ../out/screenshots. */
import { mkdir } from 'node:fs/promises';
import { resolve } from 'node:path';
import { afterAll, beforeAll, test } from 'vitest';
import type { Page } from 'playwright-core';
import { openSite, waitForPhase, type Site } from '../tests/browser.ts';
import { png } from '../tests/pictures.ts';

/** A frame of the sample with much to see. */
const BUSY = 124;
const OUT = resolve('../out/screenshots');
let sites: Site[] = [];
beforeAll(() => mkdir(OUT, { recursive: true }));
afterAll(() => Promise.all(sites.map((site) => site.close())));

async function opened(options: Parameters<typeof openSite>[0] = {}): Promise<Page> {
  const site = await openSite({ width: 1360, height: 820, ...options });
  sites.push(site);
  const page = await site.context.newPage();
  await page.goto(site.address);
  await waitForPhase(page, 'empty');
  // The first picture and its grid are drawn a moment later.
  await page.waitForTimeout(600);
  return page;
}

async function shoot(page: Page, name: string): Promise<void> {
  await page.waitForTimeout(300);
  await page.screenshot({ path: `${OUT}/${name}.png` });
}

/** Shows a frame of the sample. */
async function showFrame(page: Page, frame: number): Promise<void> {
  const box = (await page.locator('#timeline').boundingBox())!;
  await page.mouse.click(box.x + 5 + ((box.width - 10) * (frame + 0.5)) / 300, box.y + box.height / 2);
}

test('wide', async () => {
  const page = await opened();
  const view = (await page.locator('#camera-view').boundingBox())!;
  await page.mouse.move(view.x + view.width * 0.62, view.y + view.height * 0.8);
  await shoot(page, 'empty');
  await page.click('#sample');
  await waitForPhase(page, 'running', 'done');
  await page.waitForFunction(() => Number(document.querySelector('#timeline')?.getAttribute('aria-valuenow')) > 120);
  await shoot(page, 'running');
  await waitForPhase(page, 'done');
  await showFrame(page, BUSY);
  await page.mouse.move(view.x + view.width * 0.5, view.y + view.height * 0.7);
  await shoot(page, 'done');
  await page.mouse.click(view.x + view.width * 0.42, view.y + view.height * 0.75);
  await page.mouse.click(view.x + view.width * 0.58, view.y + view.height * 0.68);
  await shoot(page, 'tape');
  await page.keyboard.press('Escape');
  await page.click('#export-toggle');
  await shoot(page, 'export');
  await page.keyboard.press('Escape');
  await page.click('#setup-toggle');
  await shoot(page, 'set-up');
  await page.click('#setup-toggle');
  await page.click('[data-layer=edges]');
  await shoot(page, 'edges');
  await page.click('[data-layer=edges]');
});

test('every size, light and dark', { timeout: 600_000 }, async () => {
  for (const [width, height] of [[844, 390], [390, 844], [1280, 720], [1440, 900]] as const) {
    for (const dark of [false, true]) {
      const touch = Math.min(width, height) < 500;
      const page = await opened({ width, height, dark, touch, scale: touch ? 2 : 1 });
      const name = `${width}x${height}-${dark ? 'dark' : 'light'}`;
      await shoot(page, `${name}-empty`);
      await page.click('#sample');
      await waitForPhase(page, 'done');
      await shoot(page, `${name}-done`);
      await page.click('#setup-toggle');
      await shoot(page, `${name}-set-up`);
      await sites.pop()!.close();
    }
  }
});

test('dark', async () => {
  const page = await opened({ dark: true });
  await page.click('#sample');
  await waitForPhase(page, 'done');
  await showFrame(page, BUSY);
  await shoot(page, 'dark');
});

test('error', async () => {
  const page = await opened();
  const good = png(320, 240, (u, v) => (u < 160 ? 90 : v > 150 ? 60 : 170));
  await page.setInputFiles('#files', [
    { name: '1.png', buffer: good, mimeType: 'image/png' },
    { name: '2.png', buffer: good.subarray(0, 80), mimeType: 'image/png' },
    { name: '3.png', buffer: good, mimeType: 'image/png' },
    { name: 'notes.txt', buffer: Buffer.from('hello'), mimeType: 'text/plain' },
  ]);
  await waitForPhase(page, 'done');
  await page.locator('#timeline').focus();
  await page.keyboard.press('Home');
  await page.keyboard.press('ArrowRight');
  await shoot(page, 'error');
});

test('phone', async () => {
  const page = await opened({ width: 390, height: 844, touch: true });
  await shoot(page, 'phone-empty');
  await page.tap('#empty-sample');
  await waitForPhase(page, 'done');
  await shoot(page, 'phone');
  await page.screenshot({ path: `${OUT}/phone-whole.png`, fullPage: true });
});
