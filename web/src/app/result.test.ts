import { expect, test } from 'vitest';
import type { FrameResult } from '../model/protocol.ts';
import { guessedRig } from '../model/rig.ts';
import { resultSentence } from './result.ts';
import type { State } from './state.ts';

function ended(verdict: number, reason: string): State {
  const empty = new Float32Array();
  const result: FrameResult = {
    index: 0, name: '0.png', t: 0, pose: new Float32Array(3), covariance: new Float32Array(6), corners: new Float32Array(11),
    predicted: empty, lines: empty, landmarks: empty, nis: 6, nisDegrees: 4, motionHeld: false, verdict, reason, meanNis: 1.8, stages: new Float32Array(5),
  };
  const sequence = { frames: ['0.png', '1.png'], motion: 'odometry', truth: null };
  return { phase: 'done', sequence, results: [result, { ...result, index: 1, pose: Float32Array.of(2, 0, 0) }], rig: { ...guessedRig(320, 240), guessed: false, mountGuessed: false } } as unknown as State;
}

test('the result says what speaks against it', () => {
  expect(resultSentence(ended(2, 'innovations are larger than the noise that was set explains')))
    .toContain('doubtful, not to be relied on: innovations are larger than the noise that was set explains (mean NIS 1.80');
  expect(resultSentence(ended(1, ''))).toContain('consistent: errors are no larger than ± says (mean NIS 1.80');
});
