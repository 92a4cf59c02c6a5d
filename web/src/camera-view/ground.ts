/** The rig on show as a range finder, with its outlines; made anew when the rig changes. */
import { RangeFinder, Status, type Sighting } from 'monorange-wasm';
import { type Rig, parameters } from '../setup/rig.ts';

export interface Seen {
  range: number;
  bearing: number;
  rangeStd: number;
  bearingStd: number;
  x: number;
  y: number;
}

const REASONS: Record<number, string> = {
  [Status.AboveHorizon]: 'above the horizon',
  [Status.OutsideImage]: 'outside the picture',
  [Status.OutsideLensModel]: 'outside the lens model',
};

type Twelve = [number, number, number, number, number, number, number, number, number, number, number, number];

export class Ground {
  readonly rig: Rig;
  readonly #finder: RangeFinder;
  #horizon: Float32Array | null = null;
  #grid: { spacing: number; rows: Float32Array } | null = null;
  #footprint: Float32Array | null = null;

  /** Throws a sentence that names the parameter at fault. */
  constructor(rig: Rig) {
    this.rig = rig;
    this.#finder = new RangeFinder(parameters(rig));
  }

  /** What a pixel measures, or why it measures nothing. */
  sight(u: number, v: number): Seen | string {
    const seen: Sighting = this.#finder.sight(u, v);
    const answer =
      seen.status === Status.Ok
        ? { range: seen.range, bearing: seen.bearing, rangeStd: seen.range_std, bearingStd: seen.bearing_std, x: seen.x, y: seen.y }
        : (REASONS[seen.status] ?? 'no range');
    seen.free();
    return answer;
  }

  tape(a: { u: number; v: number }, b: { u: number; v: number }): { distance: number; std: number } | null {
    const measured = this.#finder.tape(a.u, a.v, b.u, b.v);
    return measured ? { distance: measured[0] ?? 0, std: measured[1] ?? 0 } : null;
  }

  /** The pixel that sees a floor point of the robot's frame. */
  project(x: number, y: number): { u: number; v: number } | null {
    const pixel = this.#finder.project(x, y);
    return pixel ? { u: pixel[0] ?? 0, v: pixel[1] ?? 0 } : null;
  }

  /** The mount from known points; throws a sentence where they do not determine it. */
  fit(points: { u: number; v: number; x: number; y: number }[]): Twelve {
    const rows = Float64Array.from(points.flatMap(({ u, v, x, y }) => [u, v, x, y]));
    return [...this.#finder.fitMount(rows)] as Twelve;
  }

  /** Rows u, v. */
  get horizon(): Float32Array {
    return (this.#horizon ??= this.#finder.horizon());
  }

  /** Rows u, v, range; a line ends with NaN, NaN, its distance ahead (NaN along the robot's axis). */
  grid(spacing: number): Float32Array {
    if (this.#grid?.spacing !== spacing) {
      this.#grid = { spacing, rows: this.#finder.grid(spacing, spacing * 20) };
    }
    return this.#grid.rows;
  }

  /** Rows x, y in the robot's frame. */
  get footprint(): Float32Array {
    return (this.#footprint ??= this.#finder.footprint(Math.max(4, this.rig.mount.height * 12)));
  }

  free(): void {
    this.#finder.free();
  }
}
