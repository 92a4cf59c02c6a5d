/** The rig on show as a range finder, with its outlines; made anew when the rig changes. */
import { RangeFinder, Status, type Sighting } from 'monorange-wasm';
import type { Rig } from '../model/rig.ts';

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

/** Lines of the floor grid that are drawn ahead of the robot. */
export const GRID_LINES = 20;

function look(finder: RangeFinder, u: number, v: number): Seen | string {
  const seen: Sighting = finder.sight(u, v);
  const answer =
    seen.status === Status.Ok
      ? { range: seen.range, bearing: seen.bearing, rangeStd: seen.range_std, bearingStd: seen.bearing_std, x: seen.x, y: seen.y }
      : (REASONS[seen.status] ?? 'no range');
  seen.free();
  return answer;
}

export class Ground {
  readonly rig: Rig;
  readonly #finder: RangeFinder;
  /** Of a guessed camera: the same rig with a focal length one standard deviation longer. */
  readonly #longer: RangeFinder | null;
  #horizon: Float32Array | null = null;
  #grid: { spacing: number; rows: Float32Array } | null = null;
  #footprint: Float32Array | null = null;

  /** Throws a sentence that names the parameter at fault. */
  constructor(rig: Rig) {
    this.rig = rig;
    this.#finder = new RangeFinder(rig);
    const [u, v] = rig.focal.map((focal) => focal * (1 + rig.focalStd)) as [number, number];
    this.#longer = rig.guessed ? new RangeFinder({ ...rig, focal: [u, v] }) : null;
  }

  /** What a pixel measures, or why it measures nothing; ± holds the pixel's noise, the mount's error and, of a guessed camera, the guess's. */
  sight(u: number, v: number): Seen | string {
    const seen = look(this.#finder, u, v);
    const longer = this.#longer && look(this.#longer, u, v);
    if (typeof seen === 'string' || longer === null) return seen;
    // Where the longer focal length sees no floor at all, nothing is known of the range.
    const off = typeof longer === 'string' ? { range: seen.range, bearing: 0 } : { range: longer.range - seen.range, bearing: longer.bearing - seen.bearing };
    return { ...seen, rangeStd: Math.hypot(seen.rangeStd, off.range), bearingStd: Math.hypot(seen.bearingStd, off.bearing) };
  }

  tape(a: { u: number; v: number }, b: { u: number; v: number }): { distance: number; std: number } | null {
    const [distance, std] = this.#finder.tape(a.u, a.v, b.u, b.v) ?? [];
    if (distance === undefined || std === undefined) return null;
    const longer = this.#longer ? (this.#longer.tape(a.u, a.v, b.u, b.v)?.[0] ?? 2 * distance) : distance;
    return { distance, std: Math.hypot(std, longer - distance) };
  }

  /** The pixel that sees a floor point of the robot's frame. */
  project(x: number, y: number): { u: number; v: number } | null {
    const pixel = this.#finder.project(x, y);
    return pixel ? { u: pixel[0] ?? 0, v: pixel[1] ?? 0 } : null;
  }

  /** Metres between grid lines: 1, 2 or 5 times a power of ten, so that a few are seen between the picture's lower edge and the far floor. */
  get spacing(): number {
    const { width, height } = this.rig;
    const [near, far] = [0.97, 0.5].map((share) => this.#rangeBelow(width / 2, height, share));
    const nearest = near ?? far ?? 4 * this.rig.mount.height;
    const wanted = Math.max(0.7 * nearest, 0.002);
    const power = 10 ** Math.floor(Math.log10(wanted));
    return ([1, 2, 5].find((digit) => digit * power >= wanted * 0.999) ?? 10) * power;
  }

  /** The range at a share of the picture's height. */
  #rangeBelow(u: number, height: number, share: number): number | null {
    const seen = look(this.#finder, u, height * share - 0.5);
    return typeof seen === 'string' ? null : seen.range;
  }

  /** Rows u, v. */
  get horizon(): Float32Array {
    return (this.#horizon ??= this.#finder.horizon());
  }

  /** Rows u, v, range; a line ends with NaN, NaN, its distance ahead (NaN along the robot's axis). */
  grid(spacing: number): Float32Array {
    if (this.#grid?.spacing !== spacing) {
      this.#grid = { spacing, rows: this.#finder.grid(spacing, spacing * GRID_LINES) };
    }
    return this.#grid.rows;
  }

  /** Rows x, y in the robot's frame. */
  get footprint(): Float32Array {
    return (this.#footprint ??= this.#finder.footprint(Math.max(4, this.rig.mount.height * 12)));
  }

  free(): void {
    this.#finder.free();
    this.#longer?.free();
  }
}
