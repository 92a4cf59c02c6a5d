/** The virtual scan of a frame: how far the floor is free, and what bounds it. */
import { BEAM, BEAM_KIND, type FrameResult } from './protocol.ts';
import { bearing, metres } from './units.ts';

/** From the point of the floor under the lens. */
export interface Beam {
  /** Radians, positive to the left. */
  bearing: number;
  /** The floor is seen clear up to here, m. */
  free: number;
  /** What bounds it, m, and its standard deviation; not a number where nothing is known. */
  range: number;
  std: number;
  kind: number;
}

/** From right to left; none where there is no scan. */
export function beamsOf({ beams }: Pick<FrameResult, 'beams'>): Beam[] {
  return Array.from({ length: beams.length / BEAM.Width }, (_, index) => {
    const column = (name: keyof typeof BEAM) => beams[index * BEAM.Width + (BEAM[name] as number)] ?? NaN;
    return { bearing: column('Bearing'), free: column('Free'), range: column('Range'), std: column('RangeStd'), kind: column('Kind') };
  });
}

/** What lies within this to either side counts as ahead, rad: the width of a robot of 0.5 m one metre ahead. */
const AHEAD = 0.25;

/** How far the floor is free ahead, and what bounds it there; empty where there is no scan. */
export function aheadWords(result: Pick<FrameResult, 'beams'>): string {
  const ahead = beamsOf(result).filter((beam) => Math.abs(beam.bearing) <= AHEAD);
  if (ahead.length === 0) return '';
  const free = Math.min(...ahead.map((beam) => beam.free));
  const words = free > 0 ? `floor free for ${metres(free)} ahead` : 'no floor is certain ahead';
  const [nearest] = ahead.filter(({ range }) => range > 0).sort((a, b) => a.range - b.range);
  if (!nearest) return words;
  const what = nearest.kind === BEAM_KIND.Boundary ? 'boundary' : 'obstacle';
  return `${words}, nearest ${what} ${metres(nearest.range, nearest.std)}, ${bearing(nearest.bearing)}`;
}
