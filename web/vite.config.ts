import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { defineConfig } from 'vitest/config';
import type { Plugin } from 'vite';

/** Writes `sw.js`: the service worker with the list of this build's files, so that the page works offline. */
function offline(): Plugin {
  return {
    name: 'offline',
    apply: 'build',
    enforce: 'post',
    generateBundle(_options, bundle) {
      const files = ['./', './icon.svg', './manifest.webmanifest', ...Object.keys(bundle).filter((name) => name !== 'index.html').map((name) => `./${name}`)];
      const hash = createHash('sha256');
      for (const item of Object.values(bundle)) hash.update(item.type === 'chunk' ? item.code : item.source);
      const source = readFileSync('src/offline/sw.js', 'utf8')
        .replace("'BUILD'", JSON.stringify(hash.digest('hex').slice(0, 16)))
        .replace("['FILES']", JSON.stringify(files));
      this.emitFile({ type: 'asset', fileName: 'sw.js', source });
    },
  };
}

/** What a host should send with every file; the page's own policy cannot say who may frame it. */
export const HEADERS = {
  'Content-Security-Policy': "frame-ancestors 'none'",
  'X-Content-Type-Options': 'nosniff',
  'Referrer-Policy': 'no-referrer',
  'Cross-Origin-Opener-Policy': 'same-origin',
};

const inBrowser = { expect: { poll: { timeout: 20_000 } }, testTimeout: 120_000, hookTimeout: 60_000 };
/** After everything else, one file after the other. */
const alone = { ...inBrowser, maxWorkers: 1, sequence: { groupOrder: 2 } };

export default defineConfig({
  // Relative, so that the page works from any folder of any static host.
  base: './',
  plugins: [offline()],
  worker: { format: 'es' },
  build: { target: 'es2022', assetsInlineLimit: 0, modulePreload: { polyfill: false } },
  preview: { host: '127.0.0.1', port: 4173, headers: HEADERS },
  server: { host: '127.0.0.1' },
  test: {
    projects: [
      { test: { name: 'unit', include: ['src/**/*.test.ts'] } },
      { test: { name: 'browser', include: ['tests/*.test.ts'], exclude: ['tests/alone.test.ts'], ...inBrowser, maxWorkers: 2, sequence: { groupOrder: 1 } } },
      { test: { name: 'alone', include: ['tests/alone.test.ts'], ...alone } },
      // Not tests, but run like them: `npm run screenshots`, `npm run bench`.
      { test: { name: 'screenshots', include: ['tools/screenshots.ts'], ...alone } },
      { test: { name: 'first-picture', include: ['tools/first-picture.ts'] } },
      { test: { name: 'bench', include: ['tools/bench.ts'], ...alone } },
    ],
  },
});
