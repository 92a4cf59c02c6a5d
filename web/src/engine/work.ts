/** Work of the worker that takes long outside a run: it says how far it is, and ends when it is cancelled. */

/** Word is given this often, and Cancel heard. */
const EVERY_MS = 60;

export class Work {
  readonly #tell: (what: string, share: number) => void;
  #said = performance.now();
  cancelled = false;

  constructor(tell: (what: string, share: number) => void) {
    this.#tell = tell;
  }

  /** Between two stretches; `share` of the work is done, 0 to 1. Throws where it was cancelled. */
  async pause(what: string, share: number): Promise<void> {
    if (performance.now() - this.#said < EVERY_MS) return;
    this.#said = performance.now();
    this.#tell(what, share);
    // Messages come only when the worker waits for them.
    await new Promise((done) => setTimeout(done));
    if (this.cancelled) throw new Error(`${what} was cancelled.`);
  }
}
