/** The rig file of a rig. */
import { DEGREE, type Mount, type Rig } from './rig.ts';

/** In its unit, as short as it can be and still be read as the very same number. */
function number(value: number, unit = 1): string {
  let digits = 9;
  const rounded = () => Number((value / unit).toPrecision(digits));
  while (digits < 17 && rounded() * unit !== value) digits += 1;
  const text = String(rounded());
  return /[.e]/.test(text) ? text : `${text}.0`;
}

function list(values: readonly number[]): string {
  return `[${values.map((value) => number(value)).join(', ')}]`;
}

export function rigToml(rig: Rig): string {
  const { mount, mountStd, assumedStd } = rig;
  /** A deviation that the rig file left out, and nobody has set since, stays out: the default is the same, and is told as one. */
  const std = (name: keyof Mount, key: string, unit = 1) => (assumedStd[name] === mountStd[name] ? [] : [`${key} = ${number(mountStd[name], unit)}`]);
  const lines = [
    ...(rig.guessed ? [`# The camera is not calibrated: focal length (from ${rig.source}), centre and lens are guesses.`] : []),
    '[camera]',
    `width = ${rig.width}`,
    `height = ${rig.height}`,
    `focal = ${list(rig.focal)}`,
    `principal = ${list(rig.principal)}`,
    `skew = ${number(rig.skew)}`,
    ...(rig.lens === 'equidistant' ? ['lens = "equidistant"'] : []),
    `distortion = ${list(rig.distortion)}`,
    `pixel_std = ${list(rig.pixelStd)}`,
    '',
    ...(rig.mountGuessed ? ['# Nobody has measured how the camera sits: height and tilt are guesses.'] : []),
    '[mount]',
    `height = ${number(mount.height)}`,
    ...(['tilt', 'roll', 'yaw'] as const).map((name) => `${name}_deg = ${number(mount[name], DEGREE)}`),
    `forward = ${number(mount.forward)}`,
    `left = ${number(mount.left)}`,
    ...std('height', 'height_std'),
    ...(['tilt', 'roll', 'yaw'] as const).flatMap((name) => std(name, `${name}_std_deg`, DEGREE)),
    ...std('forward', 'forward_std'),
    ...std('left', 'left_std'),
    rig.settingsToml,
  ];
  return lines.join('\n');
}
