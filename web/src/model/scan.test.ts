import { expect, test } from 'vitest';
import { aheadWords } from './scan.ts';
import { BEAM_KIND } from './protocol.ts';

const rows = (...beams: [bearing: number, free: number, range: number, std: number, kind: number][]) => ({ beams: Float32Array.from(beams.flat()) });
const { Boundary, Obstacle, Unknown } = BEAM_KIND;

test('the nearest thing ahead is said with its ±, and the floor is free no further than every beam ahead says', () => {
  const scan = rows([-0.5, 0.2, 0.3, 0.01, Obstacle], [-0.1, 1.5, 1.75, 0.05, Obstacle], [0, 2, 2.5, 0.1, Boundary], [0.1, 0.75, NaN, 0, Unknown]);
  expect(aheadWords(scan)).toBe('floor free for 0.75 m ahead, nearest obstacle 1.75 m ± 0.05, 5.7° right');
});

test('what is not known is not said to be free, and without a scan nothing is said', () => {
  expect(aheadWords(rows([0, 0, NaN, 0, Unknown], [0.1, 1, NaN, 0, Unknown]))).toBe('no floor is certain ahead');
  expect(aheadWords(rows())).toBe('');
});
