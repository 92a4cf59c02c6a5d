/** A sequence of pictures with what came beside them; pictures are decoded when they are asked for. */
import type { Sample } from 'monorange-wasm-files';
import { isLitter, kindOf, mainFolder, naturalOrder } from '../sequence/kinds.ts';
import { decode, type Picture } from '../sequence/picture.ts';
import { count } from '../app/units.ts';
import type { SequenceInfo, SourceFile } from './protocol.ts';
import { guessedRig } from '../setup/rig.ts';

export interface Frame {
  path: string;
  decode(): Promise<Picture>;
}

async function rare(): Promise<Picture> {
  throw new Error('this kind of picture cannot be read yet; save it as PNG');
}

export class Sequence {
  readonly info: SequenceInfo;
  readonly frames: Frame[];

  constructor(name: string, frames: Frame[], width: number, height: number) {
    this.frames = frames;
    this.info = {
      name,
      frames: frames.map(({ path }) => path.slice(path.lastIndexOf('/') + 1)),
      times: Float64Array.from(frames, (_, index) => index / 10),
      width,
      height,
      rig: null,
      truth: null,
      laser: null,
      hasOdometry: false,
      notes: [],
    };
  }

  /** The files of a simulated drive; its pictures are drawn when they are decoded. */
  static async ofSample(sample: Sample, frames: number): Promise<Sequence> {
    const pictures = Array.from({ length: frames }, (_, frame): Frame => {
      const path = `frames/${String(frame).padStart(6, '0')}.pgm`;
      return {
        path,
        decode: () => decode(path, new Blob([sample.picture(frame) as Uint8Array<ArrayBuffer>]), rare),
      };
    });
    const first = await pictures[0]?.decode();
    const sequence = new Sequence('Sample', pictures, first?.width ?? 0, first?.height ?? 0);
    sequence.info.rig = { ...guessedRig(320, 240), guessed: false, source: 'rig.toml' };
    return sequence;
  }

  /** Throws a sentence where the files hold no picture. */
  static async ofFiles(files: SourceFile[]): Promise<Sequence> {
    const wanted = files.filter(({ path }) => !isLitter(path));
    const byPath = new Map(wanted.map((file) => [file.path, file]));
    const pictures = wanted.map(({ path }) => path).filter((path) => kindOf(path) === 'picture');
    if (pictures.length === 0) throw new Error(nothingToShow(wanted));
    const paths = mainFolder(pictures).sort(naturalOrder);
    const frames = paths.map((path): Frame => {
      const blob = byPath.get(path)?.blob ?? new Blob();
      return { path, decode: () => decode(path, blob, rare) };
    });
    const size = await firstSize(frames);
    const name = paths[0]?.includes('/') ? (paths[0].split('/')[0] ?? 'Pictures') : count(frames.length, 'picture');
    const sequence = new Sequence(name, frames, size.width, size.height);
    for (const { path } of wanted) {
      if (kindOf(path) === 'other') sequence.info.notes.push(`${path} is not used: it is neither a picture nor a file that a sequence needs.`);
    }
    return sequence;
  }

  decode(frame: number): Promise<Picture> {
    const found = this.frames[frame];
    if (!found) throw new Error(`There is no frame ${frame + 1}.`);
    return found.decode();
  }
}

/** The size of the first picture that can be decoded. */
async function firstSize(frames: Frame[]): Promise<{ width: number; height: number }> {
  let problem = '';
  for (const frame of frames.slice(0, 20)) {
    try {
      return await frame.decode();
    } catch (error) {
      problem ||= `${frame.path}: ${error instanceof Error ? error.message : String(error)}.`;
    }
  }
  throw new Error(`No picture could be read. ${problem}`);
}

function nothingToShow(files: SourceFile[]): string {
  const [first] = files;
  if (!first) return 'There was nothing in that. Drop pictures, a folder of pictures or a video.';
  if (files.length === 1) return `${first.path} is not a picture. Drop pictures (PNG, JPEG, PGM …), a folder of them or a video.`;
  return `None of these ${files.length} files is a picture. Drop pictures (PNG, JPEG, PGM …), a folder of them or a video.`;
}
