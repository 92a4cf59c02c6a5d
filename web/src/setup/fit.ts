/** The mount from floor points of known position. */
import type { FloorPoint } from '../app/state.ts';
import type { Ground } from '../camera-view/ground.ts';
import type { Mount } from './rig.ts';

export interface MountFit {
  mount: Mount;
  std: Mount;
  /** Root mean square distance of the points from where the fitted mount sees them, m. */
  rms: number;
  warning: string | null;
}

/** Above this correlation height and tilt are hardly told apart. */
const HARDLY = 0.98;

/** Throws a sentence where the points do not say enough. */
export function fitMount(ground: Ground, points: FloorPoint[]): MountFit {
  const [height, tilt, roll, yaw, forward, left, heightStd, tiltStd, rollStd, yawStd, rms, correlation] = ground.fit(points);
  const warning =
    Math.abs(correlation) > HARDLY ? 'These points can hardly tell height from tilt: add one much nearer or much farther.' : null;
  const { mountStd } = ground.rig;
  return {
    mount: { height, tilt, roll, yaw, forward, left },
    std: { ...mountStd, height: heightStd, tilt: tiltStd, roll: rollStd, yaw: yawStd },
    rms,
    warning,
  };
}
