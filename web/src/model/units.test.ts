import { expect, test } from 'vitest';
import { bearing, metres, plusMinus, timeLeft } from './units.ts';

test('numbers have the digits that their uncertainty leaves', () => {
  expect(metres(2.4681, 0.031)).toBe('2.47 m ± 0.03');
  expect(metres(12.34, 1.6)).toBe('12.3 m ± 1.6');
  expect(metres(0.5, 0.0021)).toBe('0.500 m ± 0.002');
  expect(plusMinus(0.031)).toBe('±3.1 cm');
});

test('bearings say their side in words', () => {
  expect(bearing(0.2147)).toBe('12.3° left');
  expect(bearing(-0.1)).toBe('5.7° right');
  expect(bearing(0)).toBe('straight ahead');
});

test('the time left is rounded up', () => {
  expect(timeLeft(0.4)).toBe('less than 1 s left');
  expect(timeLeft(12.2)).toBe('about 13 s left');
});
