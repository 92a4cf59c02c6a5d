/** The worker: every file is read, every picture decoded and every number computed here. */
import { init } from 'monorange-wasm';
import { type Picture, bitmapOf, pixelsOf } from '../sequence/picture.ts';
import { guessedRig } from '../setup/rig.ts';
import { kindOf } from '../sequence/kinds.ts';
import type { CallName, Calls, Reply, Request, SequenceInfo, SourceFile } from './protocol.ts';
import { run, Stepper } from './run.ts';
import { sampleFiles } from './sample.ts';
import { Sequence, type Frame, type Source, type Stream } from './sequence.ts';
import { write, type Written } from './write.ts';

let sequence: Sequence | null = null;
/** What the sequence was opened from. */
let sources: Source[] = [];
let stream: Stream | null = null;
/** The run that may go on; any other one ends at its next picture. */
let running = -1;
let live: Stepper | null = null;
/** Looks at single pictures, beside the run. */
let viewer: Stepper | null = null;
let written: Written | null = null;
const wanted = new Map<number, (picture: ImageBitmap | null) => void>();
let nextWanted = 0;

function post(reply: Reply, transfer: Transferable[] = []): void {
  (self as unknown as Worker).postMessage(reply, transfer);
}

/** A frame that only the page can decode: of a video. */
function fromPage(frame: number): Promise<Picture> {
  return new Promise((done, fail) => {
    const id = nextWanted++;
    wanted.set(id, (bitmap) => {
      if (!bitmap) return fail(new Error('the video gives no picture there'));
      done(pixelsOf(bitmap));
      bitmap.close();
    });
    post({ kind: 'wanted', id, frame });
  });
}

function opened(): Sequence {
  if (!sequence) throw new Error('Open pictures first.');
  return sequence;
}

let opening: Promise<unknown> = Promise.resolve();

/** One after another: files are lent to their readers through one place. */
function inTurn<T>(work: () => Promise<T>): Promise<T> {
  const turn = opening.then(work);
  opening = turn.catch(() => undefined);
  return turn;
}

/** Opens files; those of the sequence that is open stay beside them when they hold no pictures of their own. */
async function open(files: Source[], video: Stream | null = null): Promise<SequenceInfo> {
  const complete = video !== null || files.some(({ path }) => kindOf(path) === 'picture');
  const together = complete ? files : [...files, ...sources.filter(({ path }) => !files.some((file) => kindOf(file.path) === kindOf(path)))];
  const from = complete ? video : stream;
  const next = await Sequence.of(together, from);
  [sequence, sources, stream] = [next, together, from];
  return next.info;
}

function sourceOf({ path, blob }: SourceFile): Source {
  return { path, blob: () => blob };
}

const calls: { [Name in CallName]: (ask: Calls[Name]['ask']) => Promise<Calls[Name]['answer']> } = {
  preview: () => inTurn(async () => {
    const shown = await Sequence.of(await sampleFiles(2, 3, 1));
    const picture = await shown.decode(0);
    return { picture: await bitmapOf(picture), rig: shown.info.rig ?? guessedRig(picture.width, picture.height) };
  }),
  sample: ({ frames, walkers, seed }) => inTurn(async () => open(await sampleFiles(frames, walkers, seed))),
  open: ({ files }) => inTurn(() => open(files.map(sourceOf))),
  openVideo: ({ name, frames, interval, width, height, files }) => inTurn(() => {
    const list = Array.from({ length: frames }, (_, frame): Frame => ({ path: `${name}, frame ${frame + 1}`, decode: () => fromPage(frame) }));
    return open(files.map(sourceOf), { name, frames: list, interval, width, height });
  }),
  async picture({ frame }) {
    const picture = await opened().decode(frame);
    return { picture: await bitmapOf(picture), edges: viewer?.look(picture) ?? null };
  },
  async run(settings) {
    running = settings.number;
    await init();
    viewer?.free();
    viewer = new Stepper(settings.rig, 0, null);
    const mine = opened();
    const { title, info } = mine;
    written = { title, rig: settings.rig, results: [], end: null, sequence: mine, fromPictures: info.motion === 'pictures' };
    const done = await run(mine, settings, {
      isCancelled: () => running !== settings.number,
      progress: (results, shown, secondsLeft) =>
        post({ kind: 'results', run: settings.number, results, shown, secondsLeft }, shown ? [shown.picture] : []),
    }, written);
    return done ? 'done' : 'cancelled';
  },
  async startLive({ rig }) {
    await init();
    live?.free();
    live = new Stepper(rig, 0, 'pictures');
    written = { title: 'camera', rig, results: [], end: null, sequence: null, fromPictures: true };
  },
  async live({ picture, t, index }) {
    if (!live) throw new Error('The camera is off.');
    const pixels = pixelsOf(picture);
    picture.close();
    const result = live.step(pixels, index, `live ${index + 1}`, t, 0);
    written?.results.push(result);
    return { result, edges: live.edges() };
  },
  async write({ name }) {
    if (!written) throw new Error('There is nothing to save yet.');
    if (!written.sequence && live) written.end = live.end();
    return write(name, written);
  },
};

self.addEventListener('message', (event: MessageEvent<Request>) => {
  const request = event.data;
  if (request.kind === 'cancel') running = -1;
  else if (request.kind === 'frame') {
    wanted.get(request.id)?.(request.picture);
    wanted.delete(request.id);
  } else {
    const { id } = request;
    const call = calls[request.kind] as (ask: unknown) => Promise<unknown>;
    call(request.ask).then(
      (answer) => post({ kind: 'answer', id, answer }),
      (error: unknown) => post({ kind: 'failure', id, sentence: error instanceof Error ? error.message : String(error) }),
    );
  }
});
