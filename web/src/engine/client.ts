/** The page's end of the worker: calls with answers, and what the worker says of its own accord. */
import type { CallName, Calls, Reply, Request } from './protocol.ts';

type Results = Extract<Reply, { kind: 'results' }>;

interface Waiting {
  resolve(answer: unknown): void;
  reject(reason: Error): void;
}

export class Engine {
  readonly #worker: Worker;
  readonly #waiting = new Map<number, Waiting>();
  #next = 0;
  /** Called with the results of a run as they come. */
  onResults: (results: Results) => void = () => undefined;
  /** Called for a frame that only the page can decode. */
  onWanted: (frame: number) => Promise<ImageBitmap | null> = async () => null;

  constructor() {
    this.#worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module', name: 'monorange' });
    this.#worker.addEventListener('message', (event: MessageEvent<Reply>) => this.#heard(event.data));
    this.#worker.addEventListener('error', (event) => {
      const reason = new Error(`The worker has stopped: ${event.message || 'it could not be loaded'}. Reload the page.`);
      for (const { reject } of this.#waiting.values()) reject(reason);
      this.#waiting.clear();
    });
  }

  call<Name extends CallName>(kind: Name, ask: Calls[Name]['ask'], transfer: Transferable[] = []): Promise<Calls[Name]['answer']> {
    const id = this.#next++;
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
    if (reply.kind === 'results') return this.onResults(reply);
    if (reply.kind === 'wanted') {
      const give = (picture: ImageBitmap | null) =>
        this.#send({ kind: 'frame', id: reply.id, picture }, picture ? [picture] : []);
      this.onWanted(reply.frame).then(give, () => give(null));
      return;
    }
    const waiting = this.#waiting.get(reply.id);
    this.#waiting.delete(reply.id);
    if (reply.kind === 'answer') waiting?.resolve(reply.answer);
    else waiting?.reject(new Error(reply.sentence));
  }
}
