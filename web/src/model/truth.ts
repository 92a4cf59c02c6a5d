/** The truth as a run sees it. */
import type { FrameResult } from './protocol.ts';

/**
 * The truth's x, y and heading a picture, in the run's frame, which begins where the robot begins. Where the truth begins later, the run's first
 * pose that it covers is taken for right, as `slam` does; null where it covers none.
 */
export function truthOf(truth: Float32Array | null, results: FrameResult[]): Float32Array | null {
  if (!truth || !Number.isNaN(truth[0] ?? NaN) || results.length === 0) return truth;
  const covered = results.find(({ index, problem }) => !problem && !Number.isNaN(truth[3 * index] ?? NaN));
  if (!covered) return null;
  const [x = 0, y = 0, heading = 0] = covered.pose;
  const [fromX = 0, fromY = 0, fromHeading = 0] = truth.subarray(3 * covered.index, 3 * covered.index + 3);
  const turn = heading - fromHeading;
  const [cos, sin] = [Math.cos(turn), Math.sin(turn)];
  const moved = new Float32Array(truth.length);
  for (let row = 0; row < truth.length; row += 3) {
    const [dx, dy] = [(truth[row] ?? NaN) - fromX, (truth[row + 1] ?? NaN) - fromY];
    moved.set([x + cos * dx - sin * dy, y + sin * dx + cos * dy, (truth[row + 2] ?? NaN) + turn], row);
  }
  return moved;
}
