/** One tick a frame, its colours what happened to its corners; drag to scrub. */
import { byId } from '../app/dom.ts';
import type { State, Store } from '../app/state.ts';
import { CORNER, type FrameResult } from '../model/protocol.ts';
import { tally } from '../model/tally.ts';
import { palette, type Palette } from '../theme/palette.ts';
import { Canvas } from '../views/canvas.ts';

const EDGE_PX = 5;

export class Timeline {
  readonly #store: Store;
  readonly #canvas: Canvas;

  constructor(store: Store, show: (frame: number) => void) {
    this.#store = store;
    const element = byId<HTMLCanvasElement>('timeline');
    this.#canvas = new Canvas(element, (context) => this.#draw(context));
    const scrub = (event: PointerEvent) => {
      const x = event.clientX - element.getBoundingClientRect().left;
      const share = (x - EDGE_PX) / Math.max(1, this.#canvas.width - 2 * EDGE_PX);
      show(Math.floor(share * this.#frames(store.state)));
    };
    element.addEventListener('pointerdown', (event) => {
      element.setPointerCapture(event.pointerId);
      scrub(event);
    });
    element.addEventListener('pointermove', (event) => {
      if (element.hasPointerCapture(event.pointerId)) scrub(event);
    });
    store.on(['frame', 'results', 'sequence', 'selected', 'phase'], (state) => {
      const frames = this.#frames(state);
      element.setAttribute('aria-valuemax', String(frames));
      element.setAttribute('aria-valuenow', String(frames === 0 ? 0 : state.frame + 1));
      element.setAttribute('aria-valuetext', frames === 0 ? 'no frames' : `frame ${state.frame + 1} of ${frames}`);
      this.#canvas.redraw();
    });
  }

  #frames(state: Readonly<State>): number {
    return Math.max(state.results.length, state.sequence?.frames.length ?? 0);
  }

  #draw(context: CanvasRenderingContext2D): void {
    const { state } = this.#store;
    const colours = palette();
    const frames = this.#frames(state);
    const [width, height] = [this.#canvas.width - 2 * EDGE_PX, this.#canvas.height];
    context.fillStyle = colours.ground;
    context.beginPath();
    context.roundRect(0, 0, this.#canvas.width, height, 4);
    context.fill();
    if (frames === 0) return;
    const step = width / frames;
    const most = state.results.reduce((most, result) => Math.max(most, result.corners.length / CORNER.Width), 8);
    for (const result of state.results) this.#drawTick(context, result, EDGE_PX + result.index * step, step, most, colours, state.selected);
    if (state.results.length > 0 && state.results.length < frames) {
      context.fillStyle = colours.quiet;
      context.fillRect(EDGE_PX + state.results.length * step, height - 3, width - state.results.length * step, 1);
    }
    const at = EDGE_PX + (state.frame + 0.5) * step;
    context.fillStyle = colours.text;
    context.fillRect(at - 1, 0, 2, height);
    context.beginPath();
    context.moveTo(at - 4.5, 0);
    context.lineTo(at + 4.5, 0);
    context.lineTo(at, 6);
    context.fill();
  }

  #drawTick(
    context: CanvasRenderingContext2D,
    result: FrameResult,
    left: number,
    step: number,
    most: number,
    colours: Palette,
    selected: number | null,
  ): void {
    const room = this.#canvas.height - 10;
    const base = this.#canvas.height - 3;
    const width = Math.max(1, step - (step > 3 ? 1 : 0));
    if (result.problem) {
      context.fillStyle = colours.refused;
      context.fillRect(left, 3, width, this.#canvas.height - 6);
      return;
    }
    const lit = selected === null || sees(result, selected);
    context.globalAlpha = lit ? 1 : 0.25;
    const { matched, born, tentative, refused } = tally(result);
    let top = base;
    for (const [number, colour] of [[matched, colours.seen], [born, colours.mapped], [tentative, colours.quiet], [refused, colours.refused]] as const) {
      const size = (number / most) * room;
      top -= size;
      context.fillStyle = colour;
      context.fillRect(left, top, width, size);
    }
    context.fillStyle = colours.quiet;
    context.fillRect(left, base, width, 1);
    context.globalAlpha = 1;
  }
}

function sees(result: FrameResult, landmark: number): boolean {
  for (let row = CORNER.Landmark; row < result.corners.length; row += CORNER.Width) {
    if (result.corners[row] === landmark) return true;
  }
  return false;
}
