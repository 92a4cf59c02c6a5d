import { expect, test } from 'vitest';
import { guessedRig } from '../model/rig.ts';
import { hashOf, withHash } from './url.ts';

test('settings go through the address and back', () => {
  const rig = guessedRig(320, 240);
  rig.mount = { ...rig.mount, height: 0.735, tilt: 0.31, roll: -0.02, yaw: 0.1 };
  const layers = { grid: true, lines: false };
  const back = withHash(hashOf(rig, layers), guessedRig(320, 240), { grid: true, lines: true });
  expect(back.rig.mount.height).toBeCloseTo(0.735, 6);
  expect(back.rig.mount.tilt).toBeCloseTo(0.31, 6);
  expect(back.rig.focal[0]).toBeCloseTo(rig.focal[0], 2);
  expect(back.layers).toEqual(layers);
});

test('an address full of nonsense changes nothing', () => {
  const rig = guessedRig(320, 240);
  const back = withHash('#height=-3&tilt=abc&roll=&view=1e9&x=%ff', rig, { grid: true });
  expect(back.rig.mount).toEqual(rig.mount);
  expect(back.rig.focal).toEqual(rig.focal);
  expect(back.layers).toEqual({ grid: true });
});
