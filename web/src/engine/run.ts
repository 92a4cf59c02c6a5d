/** A run: every picture through the pipeline, in order, with word of it several times a second. */
import { init, Pipeline } from 'monorange-wasm';
import { bitmapOf, type Picture } from '../sequence/picture.ts';
import { parameters, type Rig } from '../setup/rig.ts';
import type { FrameResult, RunSettings } from './protocol.ts';
import type { Sequence } from './sequence.ts';
import type { Written } from './write.ts';

export interface Listener {
  isCancelled(): boolean;
  progress(results: FrameResult[], picture: ImageBitmap | null, secondsLeft: number): void;
}

/** Results are handed over this often, with the newest picture. */
const WORD_EVERY_MS = 80;
/** Pictures that are decoded ahead; more would only fill memory. */
const AHEAD = 3;

/** Whether the run came to its end; `written` holds what there is to write in any case. */
export async function run(sequence: Sequence, { rig }: RunSettings, listener: Listener, written: Written): Promise<boolean> {
  await init();
  const stepper = new Stepper(rig);
  const { frames, times } = sequence.info;
  const decoding: Promise<Picture | string>[] = [];
  const begin = performance.now();
  let [word, results]: [number, FrameResult[]] = [0, []];
  const tell = async (picture: Picture | null, done: number) => {
    const elapsed = (performance.now() - begin) / 1000;
    word = performance.now();
    listener.progress(results, picture && (await bitmapOf(picture)), (elapsed / done) * (frames.length - done));
    results = [];
  };
  try {
    for (let frame = 0; frame < frames.length; frame += 1) {
      for (let next = frame; next < Math.min(frame + AHEAD, frames.length); next += 1) decoding[next] ??= decodeOrSay(sequence, next);
      const start = performance.now();
      const picture = (await decoding[frame]) ?? 'it was lost';
      delete decoding[frame];
      if (listener.isCancelled()) return false;
      const waited = performance.now() - start;
      const time = times[frame] ?? 0;
      const motions = frame === 0 ? null : (sequence.wheels?.between(times[frame - 1] ?? time, time) ?? null);
      const result = stepper.step(picture, frame, frames[frame] ?? '', time, motions, waited);
      results.push(result);
      written.results.push(result);
      if (performance.now() - word > WORD_EVERY_MS) await tell(typeof picture === 'string' ? null : picture, frame + 1);
    }
    await tell(null, frames.length);
    return true;
  } finally {
    written.map = stepper.map();
    stepper.free();
  }
}

function decodeOrSay(sequence: Sequence, frame: number): Promise<Picture | string> {
  return sequence.decode(frame).catch((error: unknown) => (error instanceof Error ? error.message : String(error)));
}

const NOTHING = new Float32Array();

/** The pipeline with its clock; a picture that cannot be used is a result that says so. */
export class Stepper {
  readonly #pipeline: Pipeline;
  readonly #rig: Rig;
  #pose: Float32Array = new Float32Array(3);
  #covariance: Float32Array = new Float32Array(6);

  constructor(rig: Rig) {
    this.#rig = rig;
    this.#pipeline = new Pipeline(parameters(rig));
  }

  /** `motions`: rows of speed ahead, to the left, turn rate and duration since the picture before. */
  step(picture: Picture | string, index: number, name: string, t: number, motions: Float64Array | null, decodeMs: number): FrameResult {
    let at = t - durationOf(motions);
    for (let row = 0; motions && row < motions.length; row += 4) {
      const [ahead = 0, left = 0, turn = 0, seconds = 0] = motions.subarray(row, row + 4);
      at = row + 4 >= motions.length ? t : at + seconds;
      if (left === 0) this.#pipeline.velocity(at, ahead, turn, seconds);
      else this.#pipeline.increment(at, ahead * seconds, left * seconds, turn * seconds, seconds);
    }
    const problem = typeof picture === 'string' ? picture : this.#problemOf(picture);
    if (typeof picture === 'string' || problem) return this.#skipped(index, name, t, problem || 'it was lost');
    const clock = [performance.now()];
    if (picture.channels === 1) this.#pipeline.rows(picture.pixels as Uint8Array);
    else this.#pipeline.rowsRgba(new Uint8Array(picture.pixels.buffer, picture.pixels.byteOffset, picture.pixels.byteLength));
    clock.push(performance.now());
    this.#pipeline.lines();
    clock.push(performance.now());
    const report = this.#pipeline.finish(t);
    clock.push(performance.now());
    const stages = clock.slice(1).map((time, stage) => time - (clock[stage] ?? time));
    [this.#pose, this.#covariance] = [report.pose, report.covariance];
    const result: FrameResult = {
      index,
      name,
      t,
      pose: this.#pose,
      covariance: this.#covariance,
      corners: report.corners,
      predicted: report.predicted,
      lines: report.lines,
      landmarks: report.landmarks,
      nis: report.nis,
      nisDegrees: report.nisDegrees,
      stages: Float32Array.of(decodeMs, ...stages),
    };
    report.free();
    return result;
  }

  /** Rows id, x, y, var_x, cov_xy, var_y, seen, first time, last time. */
  map(): Float64Array {
    return this.#pipeline.map();
  }

  free(): void {
    this.#pipeline.free();
  }

  #problemOf({ width, height }: Picture): string {
    const { width: w, height: h } = this.#rig;
    return width === w && height === h ? '' : `it is ${width} × ${height}, the camera ${w} × ${h}`;
  }

  #skipped(index: number, name: string, t: number, problem: string): FrameResult {
    return {
      index, name, t, problem: `${name}: ${problem}`, pose: this.#pose, covariance: this.#covariance,
      corners: NOTHING, predicted: NOTHING, lines: NOTHING, landmarks: NOTHING, nis: 0, nisDegrees: 0, stages: new Float32Array(4),
    };
  }
}

function durationOf(motions: Float64Array | null): number {
  let seconds = 0;
  for (let row = 3; motions && row < motions.length; row += 4) seconds += motions[row] ?? 0;
  return seconds;
}
