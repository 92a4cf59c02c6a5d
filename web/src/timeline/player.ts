/** Which frame is on show: play, pause, step, scrub; follows a run unless someone has taken over. */
import { byId, icon } from '../app/dom.ts';
import type { Store } from '../app/state.ts';
import type { Shown } from '../model/protocol.ts';

const FRAMES_PER_SECOND = 15;
const PLAY = 'M8 5v14l11-7z';
const PAUSE = 'M7 5h3.4v14H7zM13.6 5H17v14h-3.4z';

export class Player {
  readonly #store: Store;
  readonly #fetch: (frame: number) => Promise<Shown>;
  #timer: ReturnType<typeof setInterval> | undefined;
  /** The picture asked for last, and whether it is still on its way. */
  #wanted = -1;
  #fetching = false;
  following = false;

  constructor(store: Store, fetch: (frame: number) => Promise<Shown>) {
    [this.#store, this.#fetch] = [store, fetch];
    const button = byId('play');
    button.addEventListener('click', () => this.toggle());
    store.on(['playing'], ({ playing }) => {
      button.replaceChildren(icon('', playing ? PAUSE : PLAY));
      button.setAttribute('aria-label', playing ? 'Pause' : 'Play');
    });
    store.on(['sequence', 'results'], () => button.toggleAttribute('disabled', this.#frames() < 2));
  }

  #frames(): number {
    const { sequence, results } = this.#store.state;
    return Math.max(sequence?.frames.length ?? 0, results.length);
  }

  toggle(): void {
    if (this.#timer !== undefined) return this.pause();
    if (this.#frames() < 2) return;
    this.following = false;
    const { frame, phase, results } = this.#store.state;
    const end = phase === 'running' ? results.length : this.#frames();
    if (frame >= end - 1) this.#go(0);
    this.#store.set({ playing: true });
    this.#timer = setInterval(() => {
      const next = this.#store.state.frame + 1;
      if (next >= this.#frames()) this.pause();
      else if (!this.#fetching) this.#go(next);
    }, 1000 / FRAMES_PER_SECOND);
  }

  pause(): void {
    clearInterval(this.#timer);
    this.#timer = undefined;
    this.#store.set({ playing: false });
  }

  /** Shows a frame because a person asked for it. */
  show(frame: number): void {
    this.following = false;
    this.#go(frame);
  }

  step(by: number): void {
    this.pause();
    this.show(this.#store.state.frame + by);
  }

  /** Shows a frame whose picture is at hand. */
  showWith(frame: number, { picture, edges }: Shown): void {
    this.#wanted = frame;
    const before = this.#store.state.picture;
    this.#store.set({ frame, picture, edges });
    before?.close();
  }

  #go(frame: number): void {
    const last = this.#frames() - 1;
    const wanted = Math.min(last, Math.max(0, frame));
    if (last < 0 || wanted === this.#wanted) return;
    this.#wanted = wanted;
    this.#store.set({ frame: wanted });
    if (!this.#fetching) void this.#fetchWanted();
  }

  /** Fetches until what is on show is what was asked for last; scrubbing skips what it has passed. */
  async #fetchWanted(): Promise<void> {
    this.#fetching = true;
    for (let shown = -1; shown !== this.#wanted; ) {
      shown = this.#wanted;
      const { sequence } = this.#store.state;
      const fetched = await this.#fetch(shown).catch(() => null);
      if (sequence !== this.#store.state.sequence) fetched?.picture.close();
      else if (fetched && shown === this.#wanted) this.showWith(shown, fetched);
      else if (fetched) fetched.picture.close();
      else this.#store.set({ picture: null, edges: null });
    }
    this.#fetching = false;
  }

  /** Begins a new sequence. */
  reset(): void {
    this.pause();
    this.#wanted = -1;
    this.following = true;
  }
}
