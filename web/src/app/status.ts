/** The status line: always says in words what is going on; read out seldom enough to be followed. */
import { aheadWords } from '../model/scan.ts';
import { tally } from '../model/tally.ts';
import { byId } from './dom.ts';
import { resultOf, type State, type Store } from './state.ts';
import { guessWords } from '../model/rig.ts';
import { count, milliseconds, plusMinus, timeLeft } from '../model/units.ts';

/** Read out at most this often. */
const SPOKEN_EVERY_MS = 4000;

export function mountStatus(store: Store): void {
  const [line, live] = [byId('status'), byId('live')];
  let spoken = 0;
  let phase = '';
  store.on(['phase', 'frame', 'results', 'sequence', 'secondsLeft', 'playing', 'rig', 'busy'], (state) => {
    const sentence = statusSentence(state);
    line.textContent = sentence;
    const now = performance.now();
    if (state.phase !== phase || (!state.playing && now - spoken > SPOKEN_EVERY_MS)) {
      [spoken, phase] = [now, state.phase];
      live.textContent = sentence;
    }
  });
}

export function statusSentence(state: Readonly<State>): string {
  const { phase, sequence, results } = state;
  if (phase === 'starting') return 'Starting.';
  const busy = state.busy && `${state.busy.what}: ${Math.round(100 * state.busy.share)} %`;
  if (phase === 'opening') return busy ? `${busy}.` : 'Looking at the files.';
  if (phase === 'empty' || !sequence) {
    return touches() ? 'Tap the floor for its range, hold to look closer; a second tap measures. Open pictures or a video to begin.'
      : 'Point at the floor for its range; click twice to measure. Drop pictures, a folder, a video or a recording of ROS 2 to begin.';
  }
  const total = sequence.frames.length;
  const parts = [busy ?? '', frameSentence(state, total)];
  if (phase === 'running') {
    const left = state.secondsLeft === null ? '' : `, ${timeLeft(state.secondsLeft)}`;
    parts.push(`working: ${results.length} of ${count(total, 'frame')}${left}`);
  } else if (phase === 'cancelled') parts.push(`cancelled after ${count(results.length, 'frame')}`);
  else if (phase === 'done' && sequence.name === 'Camera') parts.push('kept from the camera');
  else if (phase === 'live') parts.push('live');
  const guess = guessWords(state.rig);
  if (guess) parts.push(`${guess}, and so are the ranges`);
  return parts.filter(Boolean).join(' · ');
}

function frameSentence(state: Readonly<State>, total: number): string {
  const frame = `Frame ${state.frame + 1} of ${Math.max(total, state.results.length)}`;
  const result = resultOf(state);
  if (!result) return frame;
  if (result.problem) return `${frame} · skipped: ${result.problem}`;
  const { matched, born, tentative, refused } = tally(result);
  const corners = count(matched + born + tentative + refused, 'corner');
  const what = [[matched, 'matched'], [born, 'new'], [tentative, 'tentative'], [refused, 'refused']] as const;
  const words = what.filter(([number]) => number > 0).map(([number, name]) => `${number} ${name}`);
  const time = result.stages.slice(1).reduce((sum, stage) => sum + stage, 0);
  const ahead = aheadWords(result);
  const std = Math.sqrt(Math.max(result.covariance[0] ?? 0, result.covariance[3] ?? 0));
  return `${frame} · ${[corners, ...words].join(', ')} · ${milliseconds(time)} · position ${plusMinus(std)}${guessWords(state.rig) ? ' (from a guess)' : ''}${ahead && ` · ${ahead}`}`;
}

/** Whether the person points with a finger. */
export function touches(): boolean {
  return matchMedia('(pointer: coarse)').matches;
}
