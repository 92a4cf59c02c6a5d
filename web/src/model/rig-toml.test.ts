import { expect, test } from 'vitest';
import { guessedRig } from './rig.ts';
import { rigToml } from './rig-toml.ts';

test('a rig file has whole sizes, degrees, and says what is guessed', () => {
  const text = rigToml(guessedRig(320, 240));
  expect(text).toContain('# The camera is not calibrated');
  expect(text).toContain('width = 320\n');
  expect(text).toContain('tilt_deg = 12.0\n');
  expect(text).toContain('distortion = [0.0, 0.0, 0.0, 0.0, 0.0]');
});
