/** The mount from floor points of known position. */
import type { FloorPoint } from '../app/state.ts';
import type { Mount, Rig } from './rig.ts';

export interface MountFit {
  mount: Mount;
  std: Mount;
  /** Root mean square distance of the points from where the fitted mount sees them, m. */
  rms: number;
  warning: string | null;
}

/** Throws a sentence where the points do not say enough. */
export function fitMount(_rig: Rig, _points: FloorPoint[]): MountFit {
  throw new Error('Fitting is not built in yet.');
}
