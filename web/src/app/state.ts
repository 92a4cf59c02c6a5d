/** What the page shows; every view draws itself from this and nothing else. */
import type { FrameResult, SequenceInfo } from '../model/protocol.ts';
import type { Rig } from '../model/rig.ts';

export type Phase = 'starting' | 'empty' | 'opening' | 'running' | 'done' | 'cancelled' | 'live';

export interface Pixel {
  u: number;
  v: number;
}

export interface FloorPoint extends Pixel {
  x: number;
  y: number;
}

export interface State {
  phase: Phase;
  sequence: SequenceInfo | null;
  /** One a frame that was processed, in order. */
  results: FrameResult[];
  /** The frame on show. */
  frame: number;
  /** Its picture, or null while it is decoded. */
  picture: ImageBitmap | null;
  /** Its edge points, rows u, v. */
  edges: Float32Array | null;
  playing: boolean;
  rig: Rig;
  /** A landmark's number, lit up in every view. */
  selected: number | null;
  pointer: Pixel | null;
  tape: Pixel[];
  setupOpen: boolean;
  /** Floor points of known position, for the mount. */
  knownPoints: FloorPoint[];
  pickingPoints: boolean;
  layers: Record<string, boolean>;
  /** What the worker is busy with outside a run, and how much of it is done, 0 to 1. */
  busy: { what: string; share: number } | null;
  /** Seconds until the run ends, while there is one. */
  secondsLeft: number | null;
}

type Listener = (state: Readonly<State>, changed: ReadonlySet<keyof State>) => void;

/** Holds the state; listeners hear of a change once, after the code that made it has ended. */
export class Store {
  #state: State;
  #listeners: Listener[] = [];
  #changed = new Set<keyof State>();

  constructor(initial: State) {
    this.#state = initial;
  }

  get state(): Readonly<State> {
    return this.#state;
  }

  set(change: Partial<State>): void {
    for (const key of Object.keys(change) as (keyof State)[]) {
      if (Object.is(this.#state[key], change[key]) && key !== 'results') continue;
      if (this.#changed.size === 0) queueMicrotask(() => this.#tell());
      this.#changed.add(key);
    }
    Object.assign(this.#state, change);
  }

  /** Calls `listener` now and whenever one of `keys` has changed (any key where none is named). */
  on(keys: (keyof State)[], listener: Listener): void {
    const heard: Listener = (state, changed) => {
      if (keys.length === 0 || keys.some((key) => changed.has(key))) listener(state, changed);
    };
    this.#listeners.push(heard);
    listener(this.#state, new Set(keys));
  }

  #tell(): void {
    const changed = new Set(this.#changed);
    this.#changed.clear();
    for (const listener of this.#listeners) listener(this.#state, changed);
  }
}

/** The frame on show's result, where it was processed. */
export function resultOf(state: Readonly<State>): FrameResult | undefined {
  return state.results[state.frame];
}
