import { expect, test } from 'vitest';
import type { FrameResult } from '../model/protocol.ts';
import { guessedRig } from '../model/rig.ts';
import { resultSentence } from './result.ts';
import type { State } from './state.ts';

function ended(verdict: number, reason: string): State {
  const empty = new Float32Array();
  const result: FrameResult = {
    index: 0, name: '0.png', t: 0, pose: new Float32Array(3), covariance: new Float32Array(6), corners: new Float32Array(11),
    predicted: empty, lines: empty, landmarks: empty, beams: empty, nis: 6, nisDegrees: 4, motionHeld: false, verdict, reason, meanNis: 1.8, stages: new Float32Array(5),
  };
  const sequence = { frames: ['0.png', '1.png'], motion: 'odometry', truth: null };
  return { phase: 'done', sequence, results: [result, { ...result, index: 1, pose: Float32Array.of(2, 0, 0) }], rig: { ...guessedRig(320, 240), guessed: false, mountGuessed: false } } as unknown as State;
}

test('the result says what speaks against it', () => {
  expect(resultSentence(ended(2, 'innovations are larger than the noise that was set explains')))
    .toContain('doubtful, not to be relied on: innovations are larger than the noise that was set explains (mean NIS 1.80');
  expect(resultSentence(ended(1, ''))).toContain('consistent: errors are no larger than ± says (mean NIS 1.80');
});

const driven = (truth: number[]) => {
  const state = ended(1, '');
  const still = state.results[0]!;
  const covariance = Float32Array.of(1e-4, 0, 0, 1e-4, 0, 1e-4);
  const results = [0, 1, 2, 3].map((index) => ({ ...still, index, pose: Float32Array.of(index, 0, 0), covariance }));
  return resultSentence({ ...state, results, sequence: { ...state.sequence, truth: Float32Array.from(truth) } } as unknown as State);
};

test('a truth that begins later is compared from there', () => {
  const words = driven([NaN, NaN, NaN, NaN, NaN, NaN, 0, 0, 0, 1, 0, 0]);
  expect(words).toContain('0 cm from the truth, inside 3σ (the truth covers 2 of 4 pictures)');
});

test('a truth that ends early says nothing of the end', () => {
  const words = driven([0, 0, 0, 1.01, 0, 0, NaN, NaN, NaN, NaN, NaN, NaN]);
  expect(words).toContain('1 cm from the truth, inside 3σ in the last picture that it covers (the truth covers 2 of 4 pictures)');
});

test('where the truth speaks against ±, the result is not called consistent', () => {
  const words = driven([0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
  expect(words).toContain('3.00 m from the truth, outside 3σ; no innovation shows it: check units, signs and frame of the truth');
  expect(words).not.toContain('consistent');
});
