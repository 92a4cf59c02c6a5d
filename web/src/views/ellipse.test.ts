import { expect, test } from 'vitest';
import { ellipseOf } from './ellipse.ts';

test('a turned covariance has the axes and the angle it was turned by', () => {
  const [a, b, angle] = [3, 1, 0.4];
  const [s, c] = [Math.sin(angle), Math.cos(angle)];
  const ellipse = ellipseOf(a * a * c * c + b * b * s * s, (a * a - b * b) * s * c, a * a * s * s + b * b * c * c, 2);
  expect(ellipse.major).toBeCloseTo(2 * a, 10);
  expect(ellipse.minor).toBeCloseTo(2 * b, 10);
  expect(ellipse.angle).toBeCloseTo(angle, 10);
});
