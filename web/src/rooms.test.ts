import { readdirSync, readFileSync } from 'node:fs';
import { dirname, join, normalize } from 'node:path';
import { expect, test } from 'vitest';

/** The folders in their order: a file imports from its own folder and from those before it. */
const ROOMS = [
  'model', 'app', 'theme', 'views', 'engine', 'sequence', 'camera-view', 'timeline', 'map', 'plots', 'export', 'setup', 'offline',
];
const SOURCE = import.meta.dirname;

function imports(file: string): string[] {
  const text = readFileSync(join(SOURCE, file), 'utf8');
  return [...text.matchAll(/(?:from|import\(?|new URL\() ?'(\.[^']+)'/g)].map(([, path = '']) => normalize(join(dirname(file), path)));
}

test('nothing is imported from a folder above', () => {
  const files = readdirSync(SOURCE, { recursive: true, encoding: 'utf8' }).filter((file) => file.endsWith('.ts') && file.includes('/'));
  const rank = (file: string) => ROOMS.indexOf(file.split('/')[0] ?? '');
  expect(files.filter((file) => rank(file) < 0), 'folders without a place in the order').toEqual([]);
  expect(files.length).toBeGreaterThan(40);
  const upwards = files.flatMap((file) => imports(file).filter((path) => rank(path) > rank(file)).map((path) => `${file} → ${path}`));
  expect(upwards).toEqual([]);
});
