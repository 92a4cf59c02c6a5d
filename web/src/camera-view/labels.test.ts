import { expect, test } from 'vitest';
import { place, type Placed, type Wanted } from './labels.ts';

const VIEW = { left: 50, top: 40, right: 350, bottom: 260 };

function crowd(number: number): Wanted[] {
  // A fixed sequence without pattern.
  let seed = 7;
  const next = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
  return Array.from({ length: number }, () => ({ x: 20 + next() * 360, y: 20 + next() * 260, width: 70, height: 17 }));
}

function boxes(wanted: Wanted[], placed: (Placed | null)[]) {
  return placed.flatMap((at, index) => {
    const size = wanted[index];
    return at && size ? [{ left: at.left, top: at.top, right: at.left + size.width, bottom: at.top + size.height }] : [];
  });
}

test('labels never overlap one another, nor leave the view', () => {
  const wanted = crowd(60);
  const drawn = boxes(wanted, place(wanted, VIEW));
  expect(drawn.length).toBeGreaterThan(10);
  for (const [index, a] of drawn.entries()) {
    expect(a.left >= VIEW.left && a.top >= VIEW.top && a.right <= VIEW.right && a.bottom <= VIEW.bottom).toBe(true);
    for (const b of drawn.slice(index + 1)) {
      expect(a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom).toBe(false);
    }
  }
});

test('where two labels compete, the first has its favourite place and the second another or none', () => {
  const [first, second] = place([{ x: 100, y: 100, width: 70, height: 17 }, { x: 100, y: 112, width: 70, height: 17 }], VIEW);
  expect(first).toEqual({ left: 107, top: 91.5 });
  expect(second).not.toEqual({ left: 107, top: 103.5 });
});
