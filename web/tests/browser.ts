/** A real browser on the built page, served from a sub-path of the loopback address. */
import { existsSync } from 'node:fs';
import { cp, mkdir, mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { chromium, type BrowserContext, type Page } from 'playwright-core';
import { preview, type PreviewServer } from 'vite';

const BROWSERS = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];
const FLAGS = [
  '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking',
  '--js-flags=--expose-gc', '--disable-component-update', '--disable-sync', '--use-fake-device-for-media-stream', '--use-fake-ui-for-media-stream',
];

export interface Site {
  address: string;
  context: BrowserContext;
  server: PreviewServer;
  /** The folder that is served as the page's. */
  folder: string;
  /** A folder on disk with these files, until the site is closed: the page reads them when it needs them. */
  written(files: Record<string, Buffer | string>): Promise<string>;
  close(): Promise<void>;
}

export const browserPath = process.env['CHROMIUM'] ?? BROWSERS.find((path) => existsSync(path));

export async function openSite(options: { width?: number; height?: number; dark?: boolean; touch?: boolean; scale?: number } = {}): Promise<Site> {
  if (!browserPath) throw new Error('No Chromium found: install it (apt-get install chromium) or set CHROMIUM.');
  const root = await mkdtemp(join(tmpdir(), 'monorange-page-'));
  // A sub-path, as on a static host that serves more than this page.
  await cp('dist', join(root, 'dist', 'some', 'folder'), { recursive: true });
  const server = await preview({ root, configFile: false, logLevel: 'error', preview: { host: '127.0.0.1', port: 0 } });
  const origin = server.resolvedUrls?.local[0] ?? '';
  const profile = join(root, 'profile');
  const context = await chromium.launchPersistentContext(profile, {
    executablePath: browserPath,
    headless: true,
    args: FLAGS,
    viewport: { width: options.width ?? 1280, height: options.height ?? 800 },
    colorScheme: options.dark ? 'dark' : 'light',
    hasTouch: options.touch ?? false,
    isMobile: options.touch ?? false,
    deviceScaleFactor: options.scale ?? 1,
  });
  return {
    address: `${origin}some/folder/`,
    context,
    server,
    folder: join(root, 'dist', 'some', 'folder'),
    async written(files) {
      const drive = join(await mkdtemp(join(root, 'written-')), 'drive');
      for (const [path, content] of Object.entries(files)) {
        await mkdir(dirname(join(drive, path)), { recursive: true });
        await writeFile(join(drive, path), content);
      }
      return drive;
    },
    async close() {
      await context.close();
      await server.close();
      await rm(root, { recursive: true, force: true });
    },
  };
}

/** The text of a file that the page's export menu saves. */
export async function exported(page: Page, name: string): Promise<string> {
  return (await exportedBytes(page, name)).toString('utf8');
}

/** A file that the page's export menu saves. */
export async function exportedBytes(page: Page, name: string): Promise<Buffer> {
  await page.click('#export-toggle');
  const [download] = await Promise.all([page.waitForEvent('download'), page.click(`#export-menu button:has-text("${name}")`)]);
  return readFile(await download.path());
}

/** Whether times mean anything: this process gets a processor when it wants one. */
export function isQuiet(): boolean {
  const [cpu, wall] = [process.cpuUsage(), performance.now()];
  while (performance.now() - wall < 150);
  const { user, system } = process.cpuUsage(cpu);
  const share = (user + system) / 1000 / (performance.now() - wall);
  if (share < 0.9) console.warn('Skipped: a time is not judged while other work keeps the processors busy.');
  return share >= 0.9;
}

/** What the page says it is doing. */
export function phase(page: Page): Promise<string> {
  return page.evaluate(() => document.body.dataset['phase'] ?? '');
}

/** Waits until the page is in one of these phases. */
export async function waitForPhase(page: Page, ...phases: string[]): Promise<void> {
  await page.waitForFunction((wanted) => wanted.includes(document.body.dataset['phase'] ?? ''), phases, { timeout: 90_000, polling: 20 });
}
