/** Camera and mount: the module's own type, and what is supposed where nobody has measured. */
import type { Mount, Rig } from 'monorange-wasm';

export type { Mount, Rig } from 'monorange-wasm';

export const DEGREE = Math.PI / 180;

/** How wrong a supposed focal length may be: one standard deviation, as a share of it. */
const GUESSED_FOCAL_STD = 0.2;

/** How a camera may sit that nobody has measured, and how far off that may be. */
const GUESSED_MOUNT: Mount = { height: 0.4, tilt: 12 * DEGREE, roll: 0, yaw: 0, forward: 0, left: 0 };
const GUESSED_MOUNT_STD: Mount = { height: 0.15, tilt: 5 * DEGREE, roll: 2 * DEGREE, yaw: 3 * DEGREE, forward: 0.01, left: 0.01 };

/** Of a mount that someone has set with the sliders. */
export const SET_MOUNT_STD: Mount = { height: 0.01, tilt: DEGREE, roll: DEGREE, yaw: DEGREE, forward: 0.01, left: 0.01 };

/** A camera that nobody has calibrated: this horizontal field of view, centred, without distortion. */
export function guessedRig(width: number, height: number, fieldOfView = 60 * DEGREE): Rig {
  const focal = width / 2 / Math.tan(fieldOfView / 2);
  return {
    width,
    height,
    focal: [focal, focal],
    principal: [(width - 1) / 2, (height - 1) / 2],
    skew: 0,
    lens: 'polynomial',
    distortion: [0, 0, 0, 0, 0],
    pixelStd: [0.5, 0.5],
    mount: { ...GUESSED_MOUNT },
    mountStd: { ...GUESSED_MOUNT_STD },
    assumedStd: {},
    settings: [],
    settingsToml: '',
    guessed: true,
    focalStd: GUESSED_FOCAL_STD,
    mountGuessed: true,
    source: 'a guess',
  };
}

const EXIF = 'the photo’s EXIF';

/** The guess with the focal length that a photo's EXIF data gives, where they do: it and its standard deviation in pixels. */
export function byExif(guess: Rig, given: Float64Array | null): Rig {
  const [focal, std] = given ?? [];
  return focal && std ? { ...guess, focal: [focal, focal], focalStd: std / focal, source: EXIF } : guess;
}

/** The horizontal field of view in radians. */
export function fieldOfView(rig: Rig): number {
  return 2 * Math.atan(rig.width / 2 / rig.focal[0]);
}

/** What of the rig is only supposed, as the end of a sentence; empty where all is measured. */
export function guessWords({ guessed, mountGuessed, source, focalStd }: Rig): string {
  if (guessed && source === EXIF) {
    const focal = `focal from ${EXIF}, ± ${Math.round(100 * focalStd)} %`;
    return mountGuessed ? `${focal}; how the camera sits is a guess` : `the camera is a guess: ${focal}`;
  }
  if (guessed && mountGuessed) return 'camera and mount are guesses';
  return guessed ? 'the camera is a guess' : mountGuessed ? 'how the camera sits is a guess' : '';
}
