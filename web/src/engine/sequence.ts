/** A sequence of pictures with what came beside them; pictures are decoded when they are asked for. */
import { count } from '../app/units.ts';
import { isLitter, kindOf, mainFolder, type Kind } from '../sequence/kinds.ts';
import { decode, type Picture } from '../sequence/picture.ts';
import { DEGREE, guessedRig, type Mount, type Rig } from '../setup/rig.ts';
import { loadFiles, type Files } from './files.ts';
import type { SequenceInfo } from './protocol.ts';

/** A file: one that was dropped, or one that the sample writes when it is asked for. */
export interface Source {
  path: string;
  blob(): Blob;
}

export interface Frame {
  path: string;
  decode(): Promise<Picture>;
}

/** Pictures of a video, which only the page can decode. */
export interface Stream {
  name: string;
  frames: Frame[];
  /** Seconds between them. */
  interval: number;
  width: number;
  height: number;
}

const BESIDE = ['rig', 'camera', 'times', 'odometry', 'truth', 'laser'] as const;
/** Above this the motion is not looked for in the pictures: a browser has no room for their keypoints. */
const MOST_PIXELS_FOR_MOTION = 2_500_000;
/** More would only be drawn over one another. */
const MOST_LASER_POINTS = 20_000;

/** The odometry's readings between two times. */
export type Wheels = InstanceType<Files['Wheels']>;

/** Files that a report compares the run with. */
export type Beside = Partial<Record<'truth' | 'laser' | 'landmarks', { path: string; content: Uint8Array }>>;

export class Sequence {
  readonly info: SequenceInfo;
  readonly frames: Frame[];
  wheels: Wheels | null = null;
  readonly beside: Beside = {};
  /** As the command line names a run: the folder of frames and the one that it is in. */
  readonly title: string;

  constructor(name: string, frames: Frame[], width: number, height: number) {
    this.frames = frames;
    this.title = frames[0]?.path.split('/').slice(0, -1).slice(-2).join('/') || name;
    this.info = {
      name,
      frames: frames.map(({ path }) => baseName(path)),
      times: Float64Array.from(frames, (_, index) => index / 10),
      width,
      height,
      rig: null,
      truth: null,
      laser: null,
      motion: motionWithoutOdometry(frames.length, width * height),
      notes: [],
    };
  }

  /**
   * The sequence in these files, which may lack pictures when they hold a rig. Throws a sentence where they hold
   * neither, or where one of them is wrong.
   */
  static async of(all: Source[], stream: Stream | null = null): Promise<Sequence> {
    const sources = all.filter(({ path }) => !isLitter(path));
    const byKind = new Map<Kind, Source[]>();
    for (const source of sources) {
      const kind = kindOf(source.path);
      byKind.set(kind, [...(byKind.get(kind) ?? []), source]);
    }
    if (stream) {
      const sequence = new Sequence(stream.name, stream.frames, stream.width, stream.height);
      sequence.info.times = Float64Array.from(stream.frames, (_, frame) => frame * stream.interval);
      await sequence.#readBeside(byKind);
      return sequence;
    }
    const { natural_order: naturalOrder } = await loadFiles();
    const paths = mainFolder((byKind.get('picture') ?? []).map(({ path }) => path)).sort(naturalOrder);
    const byPath = new Map(sources.map((source) => [source.path, source]));
    const frames = paths.map((path): Frame => ({ path, decode: () => decode(path, byPath.get(path)?.blob() ?? new Blob()) }));
    if (frames.length === 0 && !byKind.has('rig') && !byKind.has('camera')) throw new Error(nothingToShow(sources));

    const size = frames.length > 0 ? await firstSize(frames) : { width: 0, height: 0 };
    const folder = paths[0]?.includes('/') ? paths[0].slice(0, paths[0].indexOf('/')) : '';
    const sequence = new Sequence(folder || count(frames.length, 'picture'), frames, size.width, size.height);
    await sequence.#readBeside(byKind);
    if (frames.length > 1 && sequence.info.motion === 'none') {
      sequence.info.notes.push('There is no odometry, and the pictures are too large to find the motion in them: the robot stands still. Make them smaller, or add odometry.csv.');
    }
    for (const { path } of byKind.get('other') ?? []) {
      if (frames.length > 0) sequence.info.notes.push(`${baseName(path)} is not used: it is neither a picture nor a file that a sequence needs.`);
    }
    return sequence;
  }

  async #readBeside(byKind: Map<Kind, Source[]>): Promise<void> {
    if (!BESIDE.some((kind) => byKind.has(kind))) return;
    const { info } = this;
    const files = await loadFiles();
    files.forget_all();
    for (const kind of BESIDE) {
      for (const { path, blob } of byKind.get(kind) ?? []) files.offer(path, new Uint8Array(await blob().arrayBuffer()));
    }
    /** The one file of a kind; others of it are said to be left out. */
    const one = (kind: Kind): string | undefined => {
      const [first, ...more] = byKind.get(kind) ?? [];
      for (const { path } of more) info.notes.push(`${baseName(path)} is not used: ${baseName(first?.path ?? '')} came first.`);
      return first?.path;
    };
    const rig = one('rig');
    // A rig may name its camera file itself.
    const camera = rig ? undefined : one('camera');
    if (rig) info.rig = rigFrom(JSON.parse(files.rig(rig)) as RigAnswer, baseName(rig));
    else if (camera) {
      info.rig = rigFrom(JSON.parse(files.camera(camera)) as RigAnswer, baseName(camera));
      info.notes.push(`${baseName(camera)} says nothing of how the camera sits: set its height and tilt in Set-up.`);
    }
    this.#checkSize();
    const times = one('times');
    if (times) this.#setTimes(files.times(times), baseName(times));
    const odometry = one('odometry');
    if (odometry) {
      this.wheels = new files.Wheels(odometry, info.times);
      info.motion = 'odometry';
    }
    const truth = one('truth');
    if (truth) info.truth = Float32Array.from(files.truth(truth, info.times));
    const laser = one('laser');
    if (laser) info.laser = files.laser(laser, truth, info.times[0] ?? 0, MOST_LASER_POINTS);
    for (const [kind, path] of Object.entries({ truth, laser, landmarks: one('landmarks') })) {
      const source = byKind.get(kind as Kind)?.find((file) => file.path === path);
      if (path && source) this.beside[kind as keyof Beside] = { path, content: new Uint8Array(await source.blob().arrayBuffer()) };
    }
  }

  #checkSize(): void {
    const { rig, width, height, frames } = this.info;
    if (!rig || frames.length === 0 || (rig.width === width && rig.height === height)) return;
    throw new Error(
      `The pictures are ${width} × ${height} (${frames[0]}), the camera of ${rig.source} ${rig.width} × ${rig.height}. ` +
        'Open pictures as they were calibrated, or a rig for this size.',
    );
  }

  #setTimes(times: Float64Array, file: string): void {
    const { frames } = this.info;
    if (times.length !== frames.length) {
      throw new Error(`${file} has ${count(times.length, 'time')} for ${count(frames.length, 'picture')}. Give one time a picture, in the order of the pictures’ names.`);
    }
    this.info.times = times;
  }

  decode(frame: number): Promise<Picture> {
    const found = this.frames[frame];
    if (!found) throw new Error(`There is no frame ${frame + 1}.`);
    return found.decode();
  }
}

function motionWithoutOdometry(frames: number, pixels: number): SequenceInfo['motion'] {
  return frames > 1 && pixels <= MOST_PIXELS_FOR_MOTION ? 'pictures' : 'none';
}

type RigAnswer = Pick<Rig, 'width' | 'height' | 'focal' | 'principal' | 'skew' | 'distortion'> & Partial<Pick<Rig, 'settings' | 'settingsToml'>> & {
  pixelStd?: [number, number];
  mount?: number[];
  mountStd?: number[];
};

function rigFrom(answer: RigAnswer, source: string): Rig {
  const supposed = guessedRig(answer.width, answer.height);
  const six = ([height = 0, tilt = 0, roll = 0, yaw = 0, forward = 0, left = 0]: number[]): Mount => ({ height, tilt, roll, yaw, forward, left });
  return {
    ...supposed,
    ...answer,
    pixelStd: answer.pixelStd ?? [0.3, 0.3],
    mount: answer.mount ? six(answer.mount) : supposed.mount,
    mountStd: answer.mountStd ? six(answer.mountStd) : { ...supposed.mountStd, tilt: DEGREE },
    guessed: false,
    source,
  };
}

/** The size of the first picture that can be decoded. */
async function firstSize(frames: Frame[]): Promise<{ width: number; height: number }> {
  let problem = '';
  for (const frame of frames.slice(0, 20)) {
    try {
      return await frame.decode();
    } catch (error) {
      problem ||= `${baseName(frame.path)}: ${error instanceof Error ? error.message : String(error)}.`;
    }
  }
  throw new Error(`No picture could be read. ${problem}`);
}

function nothingToShow(sources: Source[]): string {
  const [first] = sources;
  const help = 'Drop pictures (PNG, JPEG, PGM …), a folder of them or a video.';
  if (!first) return `There was nothing in that. ${help}`;
  if (sources.length === 1) return `${baseName(first.path)} is not a picture. ${help}`;
  return `None of these ${sources.length} files is a picture. ${help}`;
}

function baseName(path: string): string {
  return path.slice(path.lastIndexOf('/') + 1);
}
