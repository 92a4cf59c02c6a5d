/** What the page and its worker say to each other. */
import type { Rig } from '../setup/rig.ts';

/** A dropped file, or one that the sample makes when it is asked for. */
export interface SourceFile {
  path: string;
  blob: Blob;
}

/** Rows of a `Float32Array`, and where each column is. */
export interface Rows {
  data: Float32Array;
  width: number;
}

/** Columns of a corner's row. */
export const CORNER = {
  u: 0, v: 1, varU: 2, covUV: 3, varV: 4, range: 5, bearing: 6, rangeStd: 7, landmark: 8, decision: 9, nis: 10, width: 11,
} as const;

/** What became of a corner. */
export const DECISION = { update: 0, birth: 1, gated: 2, tentative: 3, rejected: 4 } as const;
export const DECISION_NAMES = ['matched', 'new', 'refused: too far from its landmark', 'tentative', 'refused'] as const;

/** Columns of a predicted landmark's row: the pixel and its covariance, and the corner matched (−1: none). */
export const PREDICTED = { landmark: 0, u: 1, v: 2, varU: 3, covUV: 4, varV: 5, corner: 6, width: 7 } as const;

/** Columns of a landmark's row, in the world; `confirmed` is 0 while it is tentative. */
export const LANDMARK = { id: 0, x: 1, y: 2, varX: 3, covXY: 4, varY: 5, seen: 6, confirmed: 7, width: 8 } as const;

/** Columns of a line's row, in pixels. */
export const LINE = { u0: 0, v0: 1, u1: 2, v1: 3, width: 4 } as const;

export const STAGES = ['decode', 'edges', 'lines', 'motion', 'map'] as const;

export interface FrameResult {
  index: number;
  name: string;
  t: number;
  /** Why the frame was skipped, as a sentence; every array is empty then. */
  problem?: string;
  /** x, y, heading of the robot in the world. */
  pose: Float32Array;
  /** var_x, cov_xy, cov_xh, var_y, cov_yh, var_h. */
  covariance: Float32Array;
  corners: Float32Array;
  predicted: Float32Array;
  lines: Float32Array;
  landmarks: Float32Array;
  /** Normalised innovation squared a matched corner, on average, and how many numbers it sums. */
  nis: number;
  nisDegrees: number;
  /** Corners that had no range worth the name, and landmarks for which there was no room. */
  withoutRange: number;
  noRoom: number;
  /** The motion came from the pictures, and this one could not tell it. */
  motionHeld: boolean;
  /** Milliseconds a stage, in the order of `STAGES`. */
  stages: Float32Array;
}

/** A picture for the screen, with the edge points in it as rows u, v where it was looked through. */
export interface Shown {
  picture: ImageBitmap;
  edges: Float32Array | null;
}

export interface SequenceInfo {
  name: string;
  frames: string[];
  times: Float64Array;
  width: number;
  height: number;
  /** The rig that came with the pictures, where one did. */
  rig: Rig | null;
  /** x, y, heading a frame; NaN where there is none. */
  truth: Float32Array | null;
  /** x, y pairs of a laser's hits in the world. */
  laser: Float32Array | null;
  /** Where the motion comes from. */
  motion: 'odometry' | 'pictures' | 'none';
  /** Sentences about files that were left aside. */
  notes: string[];
}

/** Settings of a run. */
export interface RunSettings {
  /** Told apart by this number: results of an earlier run may still be on their way. */
  number: number;
  rig: Rig;
}

/** What the page asks, and what it is answered. */
export interface Calls {
  /** The sample's first picture and rig, for the empty page. */
  preview: { ask: null; answer: { picture: ImageBitmap; rig: Rig } };
  sample: { ask: { frames: number; walkers: number; seed: number }; answer: SequenceInfo };
  open: { ask: { files: SourceFile[] }; answer: SequenceInfo };
  openVideo: { ask: { name: string; frames: number; interval: number; width: number; height: number; files: SourceFile[] }; answer: SequenceInfo };
  picture: { ask: { frame: number }; answer: Shown };
  run: { ask: RunSettings; answer: 'done' | 'cancelled' };
  startLive: { ask: { rig: Rig }; answer: void };
  live: { ask: { picture: ImageBitmap; t: number; index: number }; answer: { result: FrameResult; edges: Float32Array } };
  write: { ask: { name: string }; answer: string };
}

export type CallName = keyof Calls;

export type Request =
  | { [Name in CallName]: { kind: Name; id: number; ask: Calls[Name]['ask'] } }[CallName]
  | { kind: 'cancel' }
  | { kind: 'frame'; id: number; picture: ImageBitmap | null };

export type Reply =
  | { kind: 'answer'; id: number; answer: unknown }
  | { kind: 'failure'; id: number; sentence: string }
  | { kind: 'results'; run: number; results: FrameResult[]; shown: Shown | null; secondsLeft: number }
  /** A frame of a video or a camera, which only the page can decode. */
  | { kind: 'wanted'; id: number; frame: number };
