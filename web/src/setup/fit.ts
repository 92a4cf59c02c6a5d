/** The mount from floor points of known position. */
import type { FloorPoint } from '../app/state.ts';
import type { FittedMount } from '../model/protocol.ts';
import type { Mount, Rig } from '../model/rig.ts';

export interface MountFit {
  mount: Mount;
  std: Mount;
  /** Root mean square distance of the points from where the fitted mount sees them, m. */
  rms: number;
  warning: string | null;
}

/** Above this correlation height and tilt are hardly told apart. */
const HARDLY = 0.98;

/** What was fitted to points, in a set-up's terms. */
export function fitOf({ mount: fitted, std, rms, correlation }: FittedMount, { mount, mountStd }: Rig): MountFit {
  const warning =
    Math.abs(correlation) > HARDLY ? 'These points can hardly tell height from tilt: add one much nearer or much farther.' : null;
  return { mount: { ...mount, ...fitted }, std: { ...mountStd, ...std }, rms, warning };
}

/** Rows u, v, x, y. */
export function rowsOf(points: FloorPoint[]): Float64Array {
  return Float64Array.from(points.flatMap(({ u, v, x, y }) => [u, v, x, y]));
}
