/** The sample: a simulated drive as the files that `monorange simulate` writes, made when they are read. */
import type { Source } from 'monorange-wasm-session';
import { loadFiles } from './files.ts';

export async function sampleFiles(frames: number, walkers: number, seed: number): Promise<Source[]> {
  const { Sample } = await loadFiles();
  const sample = new Sample(frames, walkers, seed);
  const pictures = Array.from({ length: frames }, (_, frame) => ({
    path: `sample/frames/${String(frame).padStart(6, '0')}.pgm`,
    blob: () => new Blob([sample.picture(frame) as Uint8Array<ArrayBuffer>]),
  }));
  const text = (name: string, write: () => string) => ({ path: `sample/${name}`, blob: () => new Blob([write()]) });
  return [
    ...pictures,
    text('rig.toml', () => sample.rig()),
    text('times.txt', () => sample.times()),
    text('odometry.csv', () => sample.odometry()),
    text('truth.tum', () => sample.truth()),
  ];
}
