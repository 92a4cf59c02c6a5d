import { expect, test } from 'vitest';
import { DEGREE, guessedRig } from './rig.ts';
import { rigToml } from './rig-toml.ts';

test('a rig file has whole sizes, degrees, and says what is guessed', () => {
  const text = rigToml(guessedRig(320, 240));
  expect(text).toContain('# The camera is not calibrated');
  expect(text).toContain('width = 320\n');
  expect(text).toContain('tilt_deg = 12.0\n');
  expect(text).toContain('distortion = [0.0, 0.0, 0.0, 0.0, 0.0]');
});

test('a deviation that the rig file left out stays out until someone sets it', () => {
  const rig = guessedRig(320, 240);
  const left = { ...rig, mountStd: { ...rig.mountStd, height: 0.01 }, assumedStd: { height: 0.01 } };
  expect(rigToml(left)).not.toContain('height_std');
  expect(rigToml({ ...left, mountStd: { ...left.mountStd, height: 0.002 } })).toContain('height_std = 0.002\n');
});

test('a number is read as the very same one', () => {
  const rig = guessedRig(320, 240);
  const odd = { ...rig, focal: [365.14844999999997, 1 / 3] as [number, number], mount: { ...rig.mount, height: 0.1 + 0.2, tilt: 12.3 * DEGREE, yaw: 0.012345678901234567 } };
  const text = rigToml(odd);
  const read = (name: string) => Number(new RegExp(`^${name} = (.*)$`, 'm').exec(text.split('[mount]')[1]!)![1]);
  expect(JSON.parse(/^focal = (.*)$/m.exec(text)![1]!)).toEqual(odd.focal);
  expect([read('height'), read('yaw_deg') * DEGREE]).toEqual([odd.mount.height, odd.mount.yaw]);
  expect(text).toContain('tilt_deg = 12.3\n');
});
