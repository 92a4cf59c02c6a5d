/** Camera and mount, as the rig file names them; angles in radians here, in degrees in the file. */
export interface Rig {
  width: number;
  height: number;
  focal: [number, number];
  principal: [number, number];
  skew: number;
  distortion: [number, number, number, number, number];
  pixelStd: [number, number];
  mount: Mount;
  mountStd: Mount;
  /** The pipeline's settings as its constructor takes them; none for the default ones. */
  settings: readonly number[];
  /** Those of them that differ from the default ones, as sections of a rig file. */
  settingsToml: string;
  /** Nobody has calibrated this camera: focal length, centre and lens are supposed. */
  guessed: boolean;
  /** The file it came from, for messages. */
  source: string;
}

export interface Mount {
  height: number;
  tilt: number;
  roll: number;
  yaw: number;
  forward: number;
  left: number;
}

export const DEGREE = Math.PI / 180;

/** A camera that nobody has calibrated: this horizontal field of view, centred, without distortion. */
export function guessedRig(width: number, height: number, fieldOfView = 60 * DEGREE): Rig {
  const focal = width / 2 / Math.tan(fieldOfView / 2);
  return {
    width,
    height,
    focal: [focal, focal],
    principal: [(width - 1) / 2, (height - 1) / 2],
    skew: 0,
    distortion: [0, 0, 0, 0, 0],
    pixelStd: [0.5, 0.5],
    mount: { height: 0.4, tilt: 12 * DEGREE, roll: 0, yaw: 0, forward: 0, left: 0 },
    mountStd: { height: 0.01, tilt: DEGREE, roll: DEGREE, yaw: DEGREE, forward: 0.01, left: 0.01 },
    settings: [],
    settingsToml: '',
    guessed: true,
    source: 'a guess',
  };
}

/** The horizontal field of view in radians. */
export function fieldOfView(rig: Rig): number {
  return 2 * Math.atan(rig.width / 2 / rig.focal[0]);
}

/** The 26 numbers of the range finder's constructor. */
export function parameters(rig: Rig): Float32Array {
  const six = (mount: Mount) => [mount.height, mount.tilt, mount.roll, mount.yaw, mount.forward, mount.left];
  return Float32Array.from([
    rig.width, rig.height, ...rig.focal, ...rig.principal, rig.skew, ...rig.distortion, ...rig.pixelStd,
    ...six(rig.mount), ...six(rig.mountStd),
  ]);
}
