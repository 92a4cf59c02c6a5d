import { expect, test } from 'vitest';
import { decodePgm } from './picture.ts';

const file = (head: string, pixels: number[]) => Uint8Array.from([...new TextEncoder().encode(head), ...pixels]);

test('a grey map with a comment is read', () => {
  const picture = decodePgm(file('P5\n# by hand\n3 2\n255\n', [1, 2, 3, 4, 5, 6]));
  expect([picture?.width, picture?.height, ...(picture?.pixels ?? [])]).toEqual([3, 2, 1, 2, 3, 4, 5, 6]);
});

test('a grey map that is cut short says so', () => {
  expect(() => decodePgm(file('P5 3 2 255\n', [1, 2, 3]))).toThrow('3 of 6 pixels');
});

test('other kinds are left to others', () => {
  expect(decodePgm(file('P5 3 2 65535\n', []))).toBeNull();
  expect(decodePgm(file('P6 3 2 255\n', []))).toBeNull();
});
