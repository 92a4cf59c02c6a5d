/** What the page and its worker say to each other. Rows, decisions and verdicts are the module's own. */
import type { Rig } from 'monorange-wasm';
import type { FrameResult, SequenceInfo, Shown } from 'monorange-wasm-session';

export {
  BeamColumn as BEAM, BeamKind as BEAM_KIND, CornerColumn as CORNER, Decision as DECISION, LandmarkColumn as LANDMARK, LineColumn as LINE, PredictedColumn as PREDICTED,
  Verdict as VERDICT,
} from 'monorange-wasm';
export type { FrameResult, SequenceInfo, Shown } from 'monorange-wasm-session';

/** A mount that was fitted to floor points: metres and radians. */
export interface FittedMount {
  mount: { height: number; tilt: number; roll: number; yaw: number };
  std: { height: number; tilt: number; roll: number; yaw: number };
  rms: number;
  /** Of height and tilt. */
  correlation: number;
}

/** A printed chessboard: inner corners, and a square's side in metres. */
export interface Board {
  columns: number;
  rows: number;
  square: number;
}

/** What a picture of a board showed. */
export interface BoardPicture {
  name: string;
  /** Why it was left out, as the end of a sentence about it; empty where it was used. */
  reason: string;
  /** Root mean square distance of its corners from where the camera sees them, px; 0 where it was left out. */
  rms: number;
  width: number;
  height: number;
  /** Rows u, v of the corners found. */
  corners: Float64Array;
  /** The picture made small, or null where it could not be read. */
  small: ImageBitmap | null;
}

/** The camera that the pictures of a board tell, or a sentence why they tell none. */
export interface BoardResult {
  camera: Pick<Rig, 'width' | 'height' | 'focal' | 'principal' | 'distortion' | 'pixelStd'> & { std: number[]; rms: number } | null;
  problem: string;
  warnings: string[];
  pictures: BoardPicture[];
}

/** In the order of a result's `stages`. */
export const STAGES = ['decode', 'edges', 'lines', 'motion', 'map'] as const;

/** A dropped file. */
export interface SourceFile {
  path: string;
  blob: Blob;
}

/** A picture's red, green, blue, alpha, as the page hands it over: of a video or a camera. */
export interface RawPicture {
  width: number;
  height: number;
  pixels: Uint8ClampedArray<ArrayBuffer>;
}

/** Settings of a run. */
export interface RunSettings {
  /** Told apart by this number: results of an earlier run may still be on their way. */
  number: number;
  rig: Rig;
}

/** What the page asks, and what it is answered. */
export interface Calls {
  /** The sample's first picture, looked through, and its rig, for the empty page; `scan`: with its scan, for which a module is loaded. */
  preview: { ask: { scan: boolean }; answer: { shown: Shown; result: FrameResult; rig: Rig } };
  sample: { ask: { frames: number; walkers: number; seed: number }; answer: SequenceInfo };
  open: { ask: { files: SourceFile[] }; answer: SequenceInfo };
  openVideo: { ask: { name: string; frames: number; interval: number; width: number; height: number; files: SourceFile[] }; answer: SequenceInfo };
  picture: { ask: { frame: number }; answer: Shown };
  /** `warnings`: what looked wrong in the pictures, a sentence each. */
  run: { ask: RunSettings; answer: { end: 'done' | 'cancelled'; warnings: string[] } };
  startLive: { ask: { rig: Rig }; answer: void };
  live: { ask: { picture: RawPicture; t: number; index: number }; answer: { result: FrameResult; edges: Float32Array } };
  /** The camera is off: what it saw is a sequence now. */
  endLive: { ask: null; answer: SequenceInfo };
  write: { ask: { name: string }; answer: string | Blob };
  /** Pictures of a board, for the camera. */
  board: { ask: { board: Board; files: SourceFile[] }; answer: BoardResult };
  /** The mount from the picture of them in which the board lies on the floor; `along`: a side of it points straight ahead. Deviations of 0: not told. */
  boardMount: { ask: { index: number; along: boolean }; answer: Pick<FittedMount, 'mount' | 'std'> };
  /** Rows u, v, x, y. */
  fitMount: { ask: { rig: Rig; rows: Float64Array }; answer: FittedMount };
}

export type CallName = keyof Calls;

export type Request =
  | { [Name in CallName]: { kind: Name; id: number; ask: Calls[Name]['ask'] } }[CallName]
  /** Ends a run, or what the worker is busy with. */
  | { kind: 'cancel' }
  | { kind: 'ping' }
  | { kind: 'frame'; id: number; picture: RawPicture | null };

export type Reply =
  | { kind: 'alive' }
  | { kind: 'answer'; id: number; answer: unknown }
  | { kind: 'failure'; id: number; sentence: string }
  | { kind: 'results'; run: number; results: FrameResult[]; shown: Shown | null; secondsLeft: number }
  /** How much of something long is done, 0 to 1. */
  | { kind: 'busy'; what: string; share: number }
  /** A frame of a video, which only the page can decode. */
  | { kind: 'wanted'; id: number; frame: number };
