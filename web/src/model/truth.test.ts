import { expect, test } from 'vitest';
import type { FrameResult } from './protocol.ts';
import { truthOf } from './truth.ts';

const at = (index: number, x: number, y: number, heading: number) => ({ index, pose: Float32Array.of(x, y, heading) }) as FrameResult;

test('a truth that begins later begins at the run’s pose of that time', () => {
  const truth = Float32Array.of(NaN, NaN, NaN, 0, 0, 0, 1, 0, 0.5);
  const moved = truthOf(truth, [at(0, 0, 0, 0), at(1, 2, 3, Math.PI / 2), at(2, 2, 4, Math.PI / 2 + 0.5)])!;
  expect(Number.isNaN(moved[0])).toBe(true);
  [2, 3, Math.PI / 2, 2, 4, Math.PI / 2 + 0.5].forEach((number, place) => expect(moved[3 + place]).toBeCloseTo(number, 5));
});

test('a truth from the start is left as it is, and one that covers nothing is none', () => {
  const truth = Float32Array.of(0, 0, 0, 1, 0, 0);
  expect(truthOf(truth, [at(0, 5, 5, 1)])).toBe(truth);
  expect(truthOf(Float32Array.of(NaN, NaN, NaN), [at(0, 5, 5, 1)])).toBeNull();
});
