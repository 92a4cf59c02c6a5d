/** What the plots show, worked out of the frames' results; pure, so that tests can check the numbers. */
import { STAGES, type FrameResult } from '../model/protocol.ts';

export interface Series {
  name: string;
  unit: string;
  /** Names of `values`' columns. */
  columns: string[];
  /** One row a frame; NaN where there is nothing. */
  rows: number[][];
}

export const COMPONENTS = ['x', 'y', 'heading'] as const;
export type Component = (typeof COMPONENTS)[number];

const VARIANCE_OF: Record<Component, number> = { x: 0, y: 3, heading: 5 };

function wrap(angle: number): number {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

/** Pose error and 3σ a frame: degrees for the heading, centimetres for the position; no error without truth. */
export function poseError(results: FrameResult[], truth: Float32Array | null, component: Component): Series {
  const at = COMPONENTS.indexOf(component);
  const factor = component === 'heading' ? 180 / Math.PI : 100;
  const rows = results.map((result) => {
    if (result.problem) return [NaN, NaN];
    const sigma3 = 3 * Math.sqrt(result.covariance[VARIANCE_OF[component]] ?? NaN) * factor;
    const is = result.pose[at] ?? NaN;
    const should = truth?.[result.index * 3 + at] ?? NaN;
    const error = component === 'heading' ? wrap(is - should) : is - should;
    return [error * factor, sigma3];
  });
  return { name: `${component} error`, unit: component === 'heading' ? '°' : 'cm', columns: ['error', '3σ'], rows };
}

/** Normalised innovation squared over its degrees of freedom, with the band that holds 95 % of them. */
export function nis(results: FrameResult[]): Series {
  const rows = results.map((result) => {
    const degrees = result.nisDegrees;
    if (result.problem || !(degrees > 0)) return [NaN, NaN, NaN];
    return [result.nis / degrees, chiSquaredQuantile(-1.95996, degrees) / degrees, chiSquaredQuantile(1.95996, degrees) / degrees];
  });
  return { name: 'NIS', unit: '', columns: ['NIS ÷ degrees of freedom', '2.5 %', '97.5 %'], rows };
}

/** Milliseconds a stage. */
export function stageTimes(results: FrameResult[]): Series {
  const rows = results.map((result) => Array.from(result.stages));
  return { name: 'Time', unit: 'ms', columns: [...STAGES], rows };
}

/** The χ² quantile of a normal quantile, after Wilson and Hilferty: within 1 % from 2 degrees on. */
export function chiSquaredQuantile(normal: number, degrees: number): number {
  const spread = 2 / (9 * degrees);
  return degrees * Math.max(0, 1 - spread + normal * Math.sqrt(spread)) ** 3;
}
