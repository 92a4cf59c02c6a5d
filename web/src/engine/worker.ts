/** The worker: here a session reads every file, decodes every picture and computes every number; this file carries messages. */
import type { Rig } from 'monorange-wasm';
import { Session, type FrameResult, type Source } from 'monorange-wasm-session';
import type { CallName, Calls, RawPicture, Reply, Request, SequenceInfo, SourceFile } from '../model/protocol.ts';
import { CONTAINER, PICTURE } from '../model/kinds.ts';
import { guessedRig } from '../model/rig.ts';
import { contentsOf } from './containers.ts';
import { fit, init, loadFiles, readers } from './files.ts';
import { preview } from './preview.ts';
import { sampleFiles } from './sample.ts';
import { Work } from './work.ts';
import { write } from './write.ts';

type Opening = (sources: Source[], fresh: number) => Promise<Session>;

let session: Session | null = null;
/** What the sequence was opened from, and how. */
let sources: Source[] = [];
let reopen: Opening | null = null;
/** The rig of the last run, which its results are written with. */
let ranWith: Rig | null = null;
const wanted = new Map<number, (picture: RawPicture | null) => void>();
let nextWanted = 0;

function post(reply: Reply, transfer: Transferable[] = []): void {
  (self as unknown as Worker).postMessage(reply, transfer);
}

function imageOf({ width, height, pixels }: RawPicture): ImageData {
  return new ImageData(pixels, width, height);
}

/** A frame that only the page can decode: of a video. */
function fromPage(frame: number): Promise<ImageData> {
  return new Promise((done, fail) => {
    const id = nextWanted++;
    wanted.set(id, (picture) => (picture ? done(imageOf(picture)) : fail(new Error('the video gives no picture there'))));
    post({ kind: 'wanted', id, frame });
  });
}

function opened(): Session {
  if (!session) throw new Error('Open pictures first.');
  return session;
}

let opening: Promise<unknown> = Promise.resolve();

/** One after another: files are lent to their readers through one place. */
function inTurn<T>(work: () => Promise<T>): Promise<T> {
  const turn = opening.then(work);
  opening = turn.catch(() => undefined);
  return turn;
}

const openPictures: Opening = async (files, fresh) => Session.open(files, fresh, await readers());

/** Opens files; those of the sequence that is open stay beside them when they hold no pictures of their own. */
async function open(files: Source[], how: Opening | null): Promise<SequenceInfo> {
  await init();
  (await loadFiles()).forget_all();
  // A rig that came before any picture is for those that come now.
  const waits = session !== null && sources.length > 0 && session.info().frames.length === 0;
  const kept = how && !waits ? [] : sources.filter(({ path }) => !files.some((file) => file.path === path));
  const together = [...files, ...kept];
  const next = await (how ?? reopen ?? openPictures)(together, files.length);
  const info = describe(next);
  // Files of no use change nothing: the results stay.
  if (!info.used && session && !how) return info;
  session?.cancel();
  [session, sources, reopen] = [next, together, how ?? reopen ?? openPictures];
  return info;
}

/** As the page needs it: a camera file alone leaves the mount to be guessed. */
function describe(next: Session): SequenceInfo {
  const info = next.info();
  const { rig, layout } = { rig: info.rig as Partial<Rig> | null, layout: next.layout };
  if (!rig) return info;
  const supposed = guessedRig(rig.width ?? info.width, rig.height ?? info.height);
  const source = layout?.rigSource ?? '';
  return { ...info, rig: { ...supposed, pixelStd: [0.3, 0.3], ...rig, guessed: false, mountGuessed: !rig.mount, source } };
}

/** What takes long outside a run, one at a time. */
let work: Work | null = null;

function begin(): Work {
  work = new Work((what, share) => post({ kind: 'busy', what, share }));
  return work;
}

function sourceOf({ path, blob }: SourceFile): Source {
  return { path, blob: () => blob };
}

const calls: { [Name in CallName]: (ask: Calls[Name]['ask']) => Promise<Calls[Name]['answer']> } = {
  async preview({ scan }) {
    await init();
    return preview(scan);
  },
  sample: ({ frames, walkers, seed }) => inTurn(async () => open(await sampleFiles(frames, walkers, seed), openPictures)),
  open: ({ files }) => inTurn(async () => {
    const { sources: given, notes } = await contentsOf(files, begin());
    const anew = [...files, ...given].some(({ path }) => PICTURE.test(path) || CONTAINER.test(path));
    const info = await open(given, anew ? openPictures : null);
    return { ...info, notes: [...info.notes, ...notes] };
  }),
  openVideo: ({ name, frames, interval, width, height, files }) => inTurn(() => open(files.map(sourceOf), async (beside) =>
    Session.openVideo(name, frames, interval, width, height, fromPage, beside, await readers()))),
  picture: ({ frame }) => opened().picture(frame),
  async run({ number, rig }) {
    ranWith = rig;
    const progress = (results: FrameResult[], shown: Calls['picture']['answer'] | null, secondsLeft: number) =>
      post({ kind: 'results', run: number, results, shown, secondsLeft }, shown ? [shown.picture] : []);
    const end = (await opened().run(number, rig, { progress })) ? 'done' : 'cancelled';
    return { end, warnings: (await loadFiles()).freshWarnings() };
  },
  startLive: ({ rig }) => inTurn(async () => {
    await init();
    session?.cancel();
    [session, sources, reopen, ranWith] = [Session.openCamera(rig, await readers()), [], null, rig];
  }),
  async live({ picture, t, index }) {
    const result = (await opened().live(imageOf(picture), t, index)) as FrameResult & { edges: Float32Array };
    return { result, edges: result.edges };
  },
  async endLive() {
    return opened().info();
  },
  async board({ board, files }) {
    return (await import('./board.ts')).calibrate(board, files, begin());
  },
  async boardMount({ index, along }) {
    return (await import('./board.ts')).mountOf(index, along);
  },
  fitMount: ({ rig, rows }) => fit(rig, rows),
  async write({ name }) {
    if (!ranWith) throw new Error('There is nothing to save yet.');
    return write(name, opened(), ranWith, sources, begin());
  },
};

self.addEventListener('message', (event: MessageEvent<Request>) => {
  const request = event.data;
  if (request.kind === 'cancel') {
    session?.cancel();
    if (work) work.cancelled = true;
  }
  else if (request.kind === 'ping') post({ kind: 'alive' });
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
