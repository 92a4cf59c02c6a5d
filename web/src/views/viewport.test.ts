import { expect, test } from 'vitest';
import { Viewport } from './viewport.ts';

test('the screen and the content are each other’s inverse, y up and y down', () => {
  for (const yUp of [true, false]) {
    const view = new Viewport(yUp);
    view.fit({ left: -2, right: 6, low: -1, high: 3 }, 800, 600, 20);
    const screen = view.toScreen(1.5, 2.5);
    const back = view.toContent(screen.x, screen.y);
    expect(back.x).toBeCloseTo(1.5, 12);
    expect(back.y).toBeCloseTo(2.5, 12);
  }
});

test('zooming leaves the point under the pointer where it is', () => {
  const view = new Viewport(true);
  view.fit({ left: 0, right: 10, low: 0, high: 10 }, 500, 500, 0);
  const before = view.toContent(120, 340);
  view.zoom(2.5, { x: 120, y: 340 }, 0.1, 1e4);
  const after = view.toContent(120, 340);
  expect(after.x).toBeCloseTo(before.x, 10);
  expect(after.y).toBeCloseTo(before.y, 10);
});

test('fit shows the whole box', () => {
  const view = new Viewport(true);
  view.fit({ left: -3, right: 5, low: 1, high: 2 }, 300, 400, 10);
  for (const [x, y] of [[-3, 1], [5, 2]] as const) {
    const at = view.toScreen(x, y);
    expect(at.x >= 9.999 && at.x <= 290.001 && at.y >= 9.999 && at.y <= 390.001).toBe(true);
  }
});

test('nothing can be pushed out of sight', () => {
  const view = new Viewport(false);
  const box = { left: 0, right: 320, low: 0, high: 240 };
  view.fit(box, 640, 480, 0);
  view.pan(5000, -7000);
  view.keep(box, 640, 480);
  expect(view.toScreen(0, 0).x).toBeCloseTo(320);
  expect(view.toScreen(0, 240).y).toBeCloseTo(240);
});
