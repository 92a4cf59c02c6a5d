/** Results as files, by the command line's writers. */
import { luma, type Picture } from '../sequence/picture.ts';
import { rigToml } from '../setup/rig-toml.ts';
import type { Rig } from '../setup/rig.ts';
import type { FrameResult } from './protocol.ts';
import type { End } from './run.ts';
import type { Beside, Sequence } from './sequence.ts';

/** A run's results, as the writers need them. */
export interface Written {
  title: string;
  rig: Rig;
  results: FrameResult[];
  /** Of a run that has come to its end, or was cancelled. */
  end: End | null;
  /** What was run through; null for a camera, whose pictures are gone. */
  sequence: Sequence | null;
  fromPictures: boolean;
}

/** Throws a sentence where something does not fit. */
export async function write(name: string, written: Written): Promise<string> {
  const { Results, init, offer } = await import('monorange-wasm-results');
  await init();
  const { title, rig, results, end, sequence, fromPictures } = written;
  const frames = sequence?.info.frames.length ?? results.length;
  const writer = new Results(title, 'the page', rigToml(rig), frames, sequence?.info.times[0] ?? results[0]?.t ?? 0);
  try {
    for (const { index, t, pose, covariance, corners, stages, problem } of results) {
      if (problem) writer.leaveOut(problem);
      else writer.addFrame(index, t, pose, covariance, corners, stages);
    }
    const sum = (count: (result: FrameResult) => number) => results.reduce((total, result) => total + count(result), 0);
    const held = fromPictures ? sum(({ motionHeld }) => Number(motionHeld)) : undefined;
    writer.end(end?.map ?? new Float64Array(), sum(({ withoutRange }) => withoutRange), sum(({ noRoom }) => noRoom), held, end?.verdict ?? '', end?.meanNis ?? 1);
    const beside = (kind: keyof Beside): string | undefined => {
      const file = sequence?.beside[kind];
      if (file) offer(file.path, file.content);
      return file?.path;
    };
    if (name.startsWith('report.')) writer.compare(beside('truth'), beside('laser'), beside('landmarks'));
    if (name === 'report.html' && sequence) {
      for (const frame of writer.tellingFrames()) writer.addPicture(frame, grey(await sequence.decode(frame)));
    }
    return writer.write(name);
  } finally {
    writer.free();
  }
}

function grey({ pixels, channels }: Picture): Uint8Array {
  return channels === 1 ? new Uint8Array(pixels) : luma(pixels);
}
