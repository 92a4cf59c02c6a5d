/** The page's end of the worker: calls with answers, what the worker says of its own accord, and a watch over its life. */
import type { CallName, Calls, RawPicture, Reply, Request } from '../model/protocol.ts';

type Results = Extract<Reply, { kind: 'results' }>;

interface Waiting {
  resolve(answer: unknown): void;
  reject(reason: Error): void;
}

/** The longest that the worker may take over one picture before it is taken for dead: a large photo on a slow phone. */
const PATIENCE_MS = 20_000;

export class Engine {
  #worker: Worker;
  readonly #waiting = new Map<number, Waiting>();
  #next = 0;
  #heardAt = performance.now();
  /** Called with the results of a run as they come. */
  onResults: (results: Results) => void = () => undefined;
  /** Called with how much of something long is done. */
  onBusy: (busy: { what: string; share: number }) => void = () => undefined;
  /** Called for a frame that only the page can decode. */
  onWanted: (frame: number) => Promise<RawPicture | null> = async () => null;
  /** Called when the worker was lost and another one has been started, which has nothing open. */
  onRestart: (why: string) => void = () => undefined;

  constructor() {
    this.#worker = this.#start();
    setInterval(() => this.#watch(), 1000);
  }

  #start(): Worker {
    const worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'monorange' });
    worker.addEventListener('message', (event: MessageEvent<Reply>) => this.#heard(event.data));
    worker.addEventListener('error', (event) => this.#restart(event.message || 'it could not be loaded'));
    this.#heardAt = performance.now();
    return worker;
  }

  /** A worker that owes an answer and says nothing is asked whether it lives; one that stays silent is given up. */
  #watch(): void {
    const silent = performance.now() - this.#heardAt;
    // A page in the background is woken seldom, and its silence means nothing.
    if (this.#waiting.size === 0 || document.hidden) {
      this.#heardAt = performance.now();
      return;
    }
    if (silent > PATIENCE_MS) this.#restart('it gave no answer');
    else if (silent > 2000) this.#send({ kind: 'ping' });
  }

  #restart(why: string): void {
    this.#worker.terminate();
    this.#worker = this.#start();
    const waiting = [...this.#waiting.values()];
    this.#waiting.clear();
    const reason = new Error(`The computation stopped (${why}) and was started again.`);
    for (const { reject } of waiting) reject(reason);
    this.onRestart(why);
  }

  call<Name extends CallName>(kind: Name, ask: Calls[Name]['ask'], transfer: Transferable[] = []): Promise<Calls[Name]['answer']> {
    const id = this.#next++;
    if (this.#waiting.size === 0) this.#heardAt = performance.now();
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve: resolve as Waiting['resolve'], reject });
      this.#send({ kind, id, ask } as Request, transfer);
    });
  }

  /** Ends the run; frames already done stay. */
  cancel(): void {
    this.#send({ kind: 'cancel' });
  }

  #send(request: Request, transfer: Transferable[] = []): void {
    this.#worker.postMessage(request, transfer);
  }

  #heard(reply: Reply): void {
    this.#heardAt = performance.now();
    if (reply.kind === 'alive') return;
    if (reply.kind === 'results') return this.onResults(reply);
    if (reply.kind === 'busy') return this.onBusy(reply);
    if (reply.kind === 'wanted') {
      const give = (picture: RawPicture | null) =>
        this.#send({ kind: 'frame', id: reply.id, picture }, picture ? [picture.pixels.buffer] : []);
      this.onWanted(reply.frame).then(give, () => give(null));
      return;
    }
    const waiting = this.#waiting.get(reply.id);
    this.#waiting.delete(reply.id);
    if (reply.kind === 'answer') waiting?.resolve(reply.answer);
    else waiting?.reject(new Error(reply.sentence));
  }
}
