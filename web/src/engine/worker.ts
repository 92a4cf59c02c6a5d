/** The worker: every file is read, every picture decoded and every number computed here. */
import { init } from 'monorange-wasm';
import { type Picture, bitmapOf, pixelsOf } from '../sequence/picture.ts';
import { guessedRig } from '../setup/rig.ts';
import { kindOf } from '../sequence/kinds.ts';
import type { CallName, Calls, Reply, Request, SequenceInfo } from './protocol.ts';
import { run, Stepper } from './run.ts';
import { sampleFiles } from './sample.ts';
import { Sequence, type Frame, type Source } from './sequence.ts';
import { write, type Written } from './write.ts';

let sequence: Sequence | null = null;
/** What the sequence was opened from. */
let sources: Source[] = [];
/** The run that may go on; any other one ends at its next picture. */
let running = -1;
let live: Stepper | null = null;
let written: Written = { results: [], map: new Float64Array() };
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

/** Opens files, those of the sequence that is open beside them when they hold no pictures of their own. */
async function open(files: Source[]): Promise<SequenceInfo> {
  const complete = files.some(({ path }) => kindOf(path) === 'picture');
  const together = complete ? files : [...files, ...sources.filter(({ path }) => !files.some((file) => kindOf(file.path) === kindOf(path)))];
  const next = await Sequence.of(together);
  [sequence, sources] = [next, together];
  return next.info;
}

const calls: { [Name in CallName]: (ask: Calls[Name]['ask']) => Promise<Calls[Name]['answer']> } = {
  preview: () => inTurn(async () => {
    const shown = await Sequence.of(await sampleFiles(2, 3, 1));
    const picture = await shown.decode(0);
    return { picture: await bitmapOf(picture), rig: shown.info.rig ?? guessedRig(picture.width, picture.height) };
  }),
  sample: ({ frames, walkers, seed }) => inTurn(async () => open(await sampleFiles(frames, walkers, seed))),
  open: ({ files }) => inTurn(() => open(files.map(({ path, blob }) => ({ path, blob: () => blob })))),
  async openStream({ name, frames, interval, width, height }) {
    const list: Frame[] = Array.from({ length: frames }, (_, frame) => ({
      path: `${name}, frame ${frame + 1}`,
      decode: () => fromPage(frame),
    }));
    sequence = new Sequence(name, list, width, height);
    sequence.info.times = Float64Array.from(list, (_, frame) => frame * interval);
    return sequence.info;
  },
  async picture({ frame }) {
    return bitmapOf(await opened().decode(frame));
  },
  async run(settings) {
    running = settings.number;
    const mine: Written = { results: [], map: new Float64Array() };
    written = mine;
    const done = await run(opened(), settings, {
      isCancelled: () => running !== settings.number,
      progress: (results, picture, secondsLeft) =>
        post({ kind: 'results', run: settings.number, results, picture, secondsLeft }, picture ? [picture] : []),
    }, mine);
    return done ? 'done' : 'cancelled';
  },
  async startLive({ rig }) {
    await init();
    live?.free();
    live = new Stepper(rig);
    written = { results: [], map: new Float64Array() };
  },
  async live({ picture, t, index }) {
    if (!live) throw new Error('The camera is off.');
    const pixels = pixelsOf(picture);
    picture.close();
    const result = live.step(pixels, index, `live ${index + 1}`, t, null, 0);
    written.results.push(result);
    return result;
  },
  async write({ name }) {
    if (live) written.map = live.map();
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
      (answer) => post({ kind: 'answer', id, answer }, answer instanceof ImageBitmap ? [answer] : []),
      (error: unknown) => post({ kind: 'failure', id, sentence: error instanceof Error ? error.message : String(error) }),
    );
  }
});
