/** The sample's first picture, which the page shows before anything is opened: a small file, and at first no module beside the pipeline's. */
import type { Rig } from 'monorange-wasm';
import { Session, type FrameResult, type Layout, type Readers, type Shown } from 'monorange-wasm-session';
import { guessedRig } from '../model/rig.ts';
import { loadScan, pipeline } from './files.ts';
import rig from './first.json';

const FIRST: Rig = { ...guessedRig(rig.width, rig.height), ...(rig as unknown as Partial<Rig>), guessed: false, mountGuessed: false, source: 'rig.toml' };

export async function preview(scan: boolean): Promise<{ shown: Shown; result: FrameResult; rig: Rig }> {
  const picture = await (await fetch(new URL('./first.jpg', import.meta.url))).blob();
  const layout: Layout = {
    frames: Uint32Array.of(0), times: Float64Array.of(0), name: 'sample', title: 'sample', rig: null, rigSize: undefined, rigSource: '',
    wheels: false, truth: null, laser: null, used: true, brought: '', notes: [], warnings: [], between: () => new Uint8Array(), way: () => 0, motion: () => undefined,
  };
  const readers: Readers = {
    whyCut: () => undefined, watch: () => ({ look: () => undefined, froze: () => false, judge: () => false, free: () => undefined }), warnings: () => [],
    wants: () => false, offer: () => undefined, layout: () => layout, sizeOf: () => undefined, focalOf: () => undefined, pipeline, scan: scan ? await loadScan() : () => undefined, decode: () => Promise.reject(new Error('no reader')),
  };
  const session = await Session.open([{ path: 'first.jpg', blob: () => picture }], 1, readers);
  const results: FrameResult[] = [];
  await session.run(0, FIRST, { progress: (some) => results.push(...some) });
  const [result] = results;
  if (!result) throw new Error('The first picture could not be shown.');
  return { shown: await session.picture(0), result, rig: FIRST };
}
