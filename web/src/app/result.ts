/** The result in words: a sentence that everyone sees, and tables that tell a screen reader what the views show. */
import { CORNER, DECISION, VERDICT, type FrameResult } from '../model/protocol.ts';
import { guessWords } from '../model/rig.ts';
import { truthOf } from '../model/truth.ts';
import { bearing, count, metres, plusMinus } from '../model/units.ts';
import { byId, element } from './dom.ts';
import { resultOf, type State, type Store } from './state.ts';

const DECISIONS = {
  [DECISION.Update]: 'matched', [DECISION.Birth]: 'new', [DECISION.Gated]: 'refused: too far from its landmark',
  [DECISION.Tentative]: 'tentative', [DECISION.Rejected]: 'refused',
} as const;

/** What became of a corner, in words. */
export function decisionWords(decision: number): string {
  return DECISIONS[decision as keyof typeof DECISIONS] ?? 'refused';
}

const VERDICTS = {
  [VERDICT.Unchecked]: 'unchecked: no corner was seen twice, so nothing tells whether ± is right',
  [VERDICT.Consistent]: 'consistent: errors are no larger than ± says',
  [VERDICT.Doubtful]: 'doubtful, not to be relied on',
  [VERDICT.Lost]: 'lost: the pose is not known, and the map is not to be believed',
} as const;

/** In place of "consistent" where the truth speaks against it. */
const BESIDE_TRUTH = 'no innovation shows it: check units, signs and frame of the truth, and of odometry and mount';

export interface Summary {
  /** Metres driven. */
  path: number;
  used: number;
  corners: number;
  landmarks: number;
  /** Standard deviation of the last position, m. */
  std: number;
  verdict: keyof typeof VERDICTS;
  /** What speaks against the filter; empty where nothing does. */
  reason: string;
  meanNis: number;
  /**
   * Distance from the truth of the last position that it covers, in metres, and whether it is inside 3σ; how many pictures it covers, whether the
   * last one is among them, and whether most poses are outside 3σ; null without truth.
   */
  off: { metres: number; inside: boolean; covered: number; atEnd: boolean; against: boolean } | null;
}

export function summaryOf({ results, sequence }: Pick<State, 'results' | 'sequence'>): Summary | null {
  const used = results.filter(({ problem }) => !problem);
  const last = used.at(-1);
  if (!last) return null;
  let path = 0;
  used.forEach(({ pose }, index) => {
    const before = used[index - 1]?.pose ?? pose;
    path += Math.hypot((pose[0] ?? 0) - (before[0] ?? 0), (pose[1] ?? 0) - (before[1] ?? 0));
  });
  const corners = used.reduce((sum, result) => sum + result.corners.length / CORNER.Width, 0);
  return {
    path, corners, used: used.length, landmarks: confirmed(last), std: positionStd(last),
    verdict: last.verdict as keyof typeof VERDICTS, reason: last.reason, meanNis: last.meanNis, off: offTruth(used, sequence?.truth ?? null),
  };
}

function confirmed({ landmarks }: FrameResult): number {
  let number = 0;
  for (let at = 7; at < landmarks.length; at += 8) number += landmarks[at] ?? 0;
  return number;
}

export function positionStd({ covariance }: FrameResult): number {
  return Math.sqrt(Math.max(covariance[0] ?? 0, covariance[3] ?? 0));
}

function offTruth(used: FrameResult[], given: Float32Array | null): Summary['off'] {
  const truth = truthOf(given, used);
  const covered = truth ? used.filter(({ index }) => !Number.isNaN(truth[3 * index] ?? NaN)) : [];
  const end = covered.at(-1);
  if (!truth || !end) return null;
  const known = covered.map((result) => fromTruth(result, truth)).filter(({ known }) => known);
  const inside = known.filter(({ inside }) => inside).length;
  return { ...fromTruth(end, truth), covered: covered.length, atEnd: end === used.at(-1), against: inside < 0.5 * known.length };
}

function fromTruth({ index, pose, covariance }: FrameResult, truth: Float32Array): { metres: number; inside: boolean; known: boolean } {
  const [dx, dy] = [(pose[0] ?? 0) - (truth[3 * index] ?? NaN), (pose[1] ?? 0) - (truth[3 * index + 1] ?? NaN)];
  const [xx = 0, xy = 0, , yy = 0] = covariance;
  const determinant = xx * yy - xy * xy;
  const distance = determinant > 0 ? (dx * dx * yy - 2 * dx * dy * xy + dy * dy * xx) / determinant : 0;
  return { metres: Math.hypot(dx, dy), inside: distance <= 9, known: determinant > 0 };
}

function truthWords({ metres, inside, covered, atEnd }: NonNullable<Summary['off']>, used: number): string {
  const distance = `${metres < 1 ? `${Math.round(metres * 100)} cm` : `${metres.toFixed(2)} m`} from the truth, ${inside ? 'inside' : 'outside'} 3σ`;
  if (covered === used) return distance;
  return `${distance}${atEnd ? '' : ' in the last picture that it covers'} (the truth covers ${covered} of ${count(used, 'picture')})`;
}

/** What came out, or why nothing did and what to do. */
export function resultSentence(state: Readonly<State>): string {
  const { phase, results, sequence, rig } = state;
  if ((phase !== 'done' && phase !== 'cancelled') || !sequence || results.length === 0) return '';
  const summary = summaryOf(state);
  if (!summary) return 'No picture could be used.';
  const { path, used, corners, landmarks, std, verdict, reason, off, meanNis } = summary;
  if (corners === 0) {
    return `No floor corner was found in ${count(used, 'picture')}, so there is no map. A floor corner is where an upright edge of a wall, a door or a box meets the floor: ` +
      'let the camera see some, sharp and a few metres away, and check in Set-up that the horizon lies where it is. Ranges by pointing work all the same.';
  }
  const guess = guessWords(rig);
  if (used === 1) {
    return `${count(corners, 'floor corner')} in one picture${guess ? `; ${guess}, so their ranges are` : ''}. Open a sequence for a map.`;
  }
  const still = path < 0.05 && sequence.motion !== 'odometry';
  const parts = [
    still ? `The pictures show no motion that could be measured, in ${count(used, 'picture')}` : `${path.toFixed(1)} m driven in ${count(used, 'picture')}`,
    count(landmarks, 'landmark'), `position ${plusMinus(std)} at the end`,
    ...(off ? [truthWords(off, used)] : []),
    `${off?.against && verdict === VERDICT.Consistent ? BESIDE_TRUTH : VERDICTS[verdict]}${reason && `: ${reason}`}${verdict === VERDICT.Unchecked ? '' : ` (mean NIS ${meanNis.toFixed(2)}, 1 is right)`}`,
    ...(guess ? [`but ${guess}: ± is no better than that`] : []),
  ];
  return `${parts.join('; ')}.`;
}

export function mountResult(store: Store): void {
  const [line, table] = [byId('result'), byId('corners-table')];
  store.on(['phase', 'results', 'sequence', 'rig'], (state) => {
    const words = resultSentence(state);
    if (line.textContent !== words) line.textContent = words;
    line.hidden = words === '';
  });
  store.on(['sequence', 'phase'], ({ sequence, phase }) => {
    const name = sequence && phase !== 'empty' ? sequence.name : '';
    byId('sequence-name').textContent = name || 'One camera as a range finder, its pictures as a map.';
    document.title = name ? `${name} – monorange` : 'monorange';
  });
  // While pictures go by nobody reads a table, and it would cost time.
  store.on(['frame', 'phase', 'playing', 'results'], (state) => {
    if (state.playing || state.phase === 'running' || state.phase === 'live') return;
    table.replaceChildren(...cornersTable(state));
  });
}

function cornersTable(state: Readonly<State>): HTMLElement[] {
  const result = resultOf(state);
  if (!result) return [];
  const rows: HTMLElement[] = [];
  for (let at = 0; at < result.corners.length; at += CORNER.Width) {
    const column = (name: keyof typeof CORNER) => result.corners[at + (CORNER[name] as number)] ?? 0;
    const landmark = column('Landmark');
    const cells = [landmark >= 0 ? String(landmark) : 'none', metres(column('Range'), column('RangeStd')), bearing(column('Bearing')), decisionWords(column('Decision'))];
    rows.push(element('tr', {}, ...cells.map((text) => element('td', {}, text))));
  }
  const head = ['landmark', 'range', 'bearing', 'what became of it'].map((name) => element('th', { scope: 'col' }, name));
  const caption = `Floor corners of ${result.name}: ${rows.length === 0 ? 'none' : rows.length}`;
  return [element('caption', {}, caption), element('thead', {}, element('tr', {}, ...head)), element('tbody', {}, ...rows)];
}
