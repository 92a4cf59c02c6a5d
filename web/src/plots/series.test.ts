import { expect, test } from 'vitest';
import type { FrameResult } from '../model/protocol.ts';
import { chiSquaredQuantile, nis, poseError } from './series.ts';

function result(index: number, pose: number[], variances: number[]): FrameResult {
  const empty = new Float32Array();
  return {
    index, name: '', t: index, pose: Float32Array.from(pose), covariance: Float32Array.from(variances), corners: empty,
    predicted: empty, lines: empty, landmarks: empty, beams: empty, nis: 6, nisDegrees: 4, motionHeld: false, verdict: 0, reason: '', meanNis: 1,
    stages: new Float32Array(5),
  };
}

test('errors are in centimetres beside three standard deviations', () => {
  const series = poseError([result(0, [1.02, 0, 0], [0.0004, 0, 0, 1, 0, 1])], Float32Array.of(1, 0, 0), 'x');
  expect(series.rows[0]?.[0]).toBeCloseTo(2, 3);
  expect(series.rows[0]?.[1]).toBeCloseTo(6, 3);
});

test('a heading error is taken the short way round', () => {
  const series = poseError([result(0, [0, 0, Math.PI - 0.01], [1, 0, 0, 1, 0, 1])], Float32Array.of(0, 0, -Math.PI + 0.01), 'heading');
  expect(series.rows[0]?.[0]).toBeCloseTo((-0.02 * 180) / Math.PI, 3);
});

test('without truth there is no error, only its band', () => {
  const [error, band] = poseError([result(0, [0, 0, 0], [1, 0, 0, 1, 0, 1])], null, 'y').rows[0] ?? [];
  expect(error).toBeNaN();
  expect(band).toBeCloseTo(300, 6);
});

test('χ² quantiles match the tables', () => {
  // 95 % of χ² with 2, 10 and 50 degrees lie between these.
  for (const [degrees, low, high] of [[2, 0.0506, 7.378], [10, 3.247, 20.483], [50, 32.357, 71.42]] as const) {
    expect(Math.abs(chiSquaredQuantile(1.95996, degrees) / high - 1)).toBeLessThan(0.01);
    expect(Math.abs(chiSquaredQuantile(-1.95996, degrees) - low)).toBeLessThan(0.05);
  }
  expect(nis([result(0, [0, 0, 0], [1, 0, 0, 1, 0, 1])]).rows[0]?.[0]).toBe(1.5);
});
