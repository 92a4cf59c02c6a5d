/** What settings were before, step by step: the page's own, since the browser's way back leads off the page. */
export class Undo<T> {
  readonly #before: T[] = [];
  readonly #changed: (steps: number) => void;

  constructor(changed: (steps: number) => void) {
    this.#changed = changed;
    changed(0);
  }

  push(before: T): void {
    this.#before.push(before);
    this.#changed(this.#before.length);
  }

  /** The settings of one step before, or null where there is none. */
  pop(): T | null {
    const before = this.#before.pop() ?? null;
    this.#changed(this.#before.length);
    return before;
  }

  clear(): void {
    this.#before.length = 0;
    this.#changed(0);
  }
}
