/** A run: every picture through the pipeline, in order, with word of it several times a second. */
import { init, Pipeline } from 'monorange-wasm';
import { bitmapOf, type Picture } from '../sequence/picture.ts';
import { parameters, type Rig } from '../setup/rig.ts';
import { STAGES, type FrameResult, type RunSettings, type Shown } from './protocol.ts';
import type { Sequence, Wheels } from './sequence.ts';
import type { Written } from './write.ts';

export interface Listener {
  isCancelled(): boolean;
  progress(results: FrameResult[], shown: Shown | null, secondsLeft: number): void;
}

/** Results are handed over this often, with the newest picture. */
const WORD_EVERY_MS = 100;
/** Pictures that are decoded ahead; more would only fill memory. */
const AHEAD = 3;

/** Whether the run came to its end; `written` holds what there is to write in any case. */
export async function run(sequence: Sequence, { rig }: RunSettings, listener: Listener, written: Written): Promise<boolean> {
  await init();
  const { frames, times, motion } = sequence.info;
  const stepper = new Stepper(rig, times[0] ?? 0, motion === 'pictures' ? 'pictures' : sequence.wheels);
  const decoding: Promise<Picture | string>[] = [];
  const begin = performance.now();
  let [word, results]: [number, FrameResult[]] = [0, []];
  const tell = async (picture: Picture | null, done: number) => {
    const elapsed = (performance.now() - begin) / 1000;
    word = performance.now();
    const shown = picture && { picture: await bitmapOf(picture), edges: stepper.edges() };
    listener.progress(results, shown, (elapsed / done) * (frames.length - done));
    results = [];
  };
  try {
    for (let frame = 0; frame < frames.length; frame += 1) {
      for (let next = frame; next < Math.min(frame + AHEAD, frames.length); next += 1) decoding[next] ??= decodeOrSay(sequence, next);
      const start = performance.now();
      const picture = (await decoding[frame]) ?? 'it was lost';
      delete decoding[frame];
      if (listener.isCancelled()) return false;
      const result = stepper.step(picture, frame, frames[frame] ?? '', times[frame] ?? 0, performance.now() - start);
      results.push(result);
      written.results.push(result);
      if (performance.now() - word > WORD_EVERY_MS) await tell(typeof picture === 'string' ? null : picture, frame + 1);
    }
    await tell(null, frames.length);
    return true;
  } finally {
    written.end = stepper.end();
    stepper.free();
  }
}

function decodeOrSay(sequence: Sequence, frame: number): Promise<Picture | string> {
  return sequence.decode(frame).catch((error: unknown) => (error instanceof Error ? error.message : String(error)));
}

const NOTHING = new Float32Array();

/** What there is to say of a whole run when it ends. */
export interface End {
  /** Rows id, x, y, var_x, cov_xy, var_y, seen, first time, last time. */
  map: Float64Array;
  verdict: string;
  meanNis: number;
}

/** The pipeline with its clock, which begins at the first frame; a picture that cannot be used is a result that says so. */
export class Stepper {
  readonly #pipeline: Pipeline;
  readonly #rig: Rig;
  readonly #start: number;
  readonly #motion: Wheels | 'pictures' | null;
  /** The time up to which the robot was moved. */
  #reached: number;
  #pose: Float32Array = new Float32Array(3);
  #covariance: Float32Array = new Float32Array(6);

  constructor(rig: Rig, start: number, motion: Wheels | 'pictures' | null) {
    this.#rig = rig;
    [this.#start, this.#reached, this.#motion] = [start, start, motion];
    this.#pipeline = new Pipeline(parameters(rig), Uint8Array.from(rig.settings), motion === 'pictures');
  }

  step(picture: Picture | string, index: number, name: string, t: number, decodeMs: number): FrameResult {
    const problem = typeof picture === 'string' ? picture : this.#problemOf(picture);
    if (typeof picture === 'string' || problem) return this.#skipped(index, name, t, problem);
    const clock = [performance.now()];
    const time = t - this.#start;
    this.#load(picture);
    clock.push(performance.now());
    this.#move(t);
    clock.push(performance.now());
    this.#pipeline.rows();
    clock.push(performance.now());
    this.#pipeline.lines();
    clock.push(performance.now());
    const report = this.#pipeline.finish(time);
    clock.push(performance.now());
    const [load = 0, motion = 0, edges = 0, lines = 0, map = 0] = clock.slice(1).map((end, stage) => end - (clock[stage] ?? end));
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
      withoutRange: report.withoutRange,
      noRoom: report.noRoom,
      motionHeld: report.held,
      stages: Float32Array.of(decodeMs + load, edges, lines, motion, map),
    };
    report.free();
    return result;
  }

  /** The edge points of a picture; the map does not hear of it. */
  look(picture: Picture): Float32Array | null {
    if (this.#problemOf(picture)) return null;
    this.#load(picture);
    this.#pipeline.rows();
    this.#pipeline.lines();
    return this.#pipeline.edges();
  }

  /** Those of the last picture. */
  edges(): Float32Array {
    return this.#pipeline.edges();
  }

  end(): End {
    return { map: this.#pipeline.map(), verdict: this.#pipeline.verdict(), meanNis: this.#pipeline.meanNis() };
  }

  free(): void {
    this.#pipeline.free();
  }

  #load({ pixels, channels }: Picture): void {
    const bytes = new Uint8Array(pixels.buffer, pixels.byteOffset, pixels.byteLength);
    if (channels === 1) this.#pipeline.load(bytes);
    else this.#pipeline.loadRgba(bytes);
  }

  /** Moves the robot to the time of the picture by its wheels. */
  #move(t: number): void {
    const [from, pipeline] = [this.#reached, this.#pipeline];
    this.#reached = t;
    const rows = this.#motion === 'pictures' ? [] : (this.#motion?.between(from, t) ?? []);
    let at = from;
    for (let row = 0; row < rows.length; row += 5) {
      const [seconds = 0, isStep = 0, a = 0, b = 0, c = 0] = rows.slice(row, row + 5);
      at += seconds;
      if (isStep) pipeline.increment(at - this.#start, a, b, c, seconds);
      else pipeline.velocity(at - this.#start, a, b, seconds);
    }
  }

  #problemOf({ width, height }: Picture): string {
    const { width: w, height: h } = this.#rig;
    return width === w && height === h ? '' : `it is ${width} × ${height}, the camera ${w} × ${h}`;
  }

  #skipped(index: number, name: string, t: number, problem: string): FrameResult {
    return {
      index, name, t, problem: `${name}: ${problem}`, pose: this.#pose, covariance: this.#covariance,
      corners: NOTHING, predicted: NOTHING, lines: NOTHING, landmarks: NOTHING, nis: 0, nisDegrees: 0,
      withoutRange: 0, noRoom: 0, motionHeld: false, stages: new Float32Array(STAGES.length),
    };
  }
}
