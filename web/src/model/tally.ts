/** What became of a frame's corners, in numbers. */
import { CORNER, DECISION, type FrameResult } from './protocol.ts';

export interface Tally {
  matched: number;
  born: number;
  tentative: number;
  refused: number;
}

/** How many of a frame's corners came to what. */
export function tally(result: FrameResult): Tally {
  const counts = { matched: 0, born: 0, tentative: 0, refused: 0 };
  for (let row = CORNER.Decision; row < result.corners.length; row += CORNER.Width) {
    const decision = result.corners[row];
    if (decision === DECISION.Update) counts.matched += 1;
    else if (decision === DECISION.Birth) counts.born += 1;
    else if (decision === DECISION.Tentative) counts.tentative += 1;
    else counts.refused += 1;
  }
  return counts;
}
