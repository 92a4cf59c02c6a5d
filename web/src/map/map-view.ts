/** The map from above: x to the right, y up, metres. */
import { byId } from '../app/dom.ts';
import { resultOf, type State, type Store } from '../app/state.ts';
import type { Ground } from '../camera-view/ground.ts';
import { LANDMARK, type FrameResult } from '../model/protocol.ts';
import { beamsOf } from '../model/scan.ts';
import { truthOf } from '../model/truth.ts';
import { palette, type Palette } from '../theme/palette.ts';
import { Canvas, font } from '../views/canvas.ts';
import { ellipseOf } from '../views/ellipse.ts';
import { listen } from '../views/gestures.ts';
import { Viewport, type Box, type Point } from '../views/viewport.ts';

const REACH_PX = 12;
const MARGIN_PX = 34;

export class MapView {
  readonly canvas: Canvas;
  readonly #store: Store;
  readonly #ground: () => Ground | null;
  readonly #viewport = new Viewport(true);
  #moved = false;
  #follow = false;
  /** What must be seen, over all frames so far. */
  #extent: Box | null = null;
  #extentOf = 0;

  constructor(store: Store, ground: () => Ground | null) {
    this.#store = store;
    this.#ground = ground;
    this.canvas = new Canvas(byId<HTMLCanvasElement>('map-view'), (context) => this.#draw(context), () => this.#arrange());
    listen(this.canvas.element, {
      pan: (dx, dy) => this.#move(() => this.#viewport.pan(dx, dy)),
      zoom: (factor, at) => this.#move(() => this.#viewport.zoom(factor, at, 0.5, 4000)),
      tap: (at) => this.#tap(at),
      hover: () => undefined,
    });
    this.canvas.element.addEventListener('keydown', (event) => this.#key(event));
    byId('map-fit').addEventListener('click', () => {
      this.#moved = false;
      this.#setFollow(false);
      this.#arrange();
      this.canvas.redraw();
    });
    byId('map-follow').addEventListener('click', () => this.#setFollow(!this.#follow));
    store.on(['sequence'], () => {
      [this.#extent, this.#extentOf, this.#moved] = [null, 0, false];
    });
    store.on(['frame', 'results', 'selected', 'layers', 'sequence', 'rig', 'phase'], () => {
      this.#arrange();
      this.canvas.redraw();
    });
  }

  #setFollow(follow: boolean): void {
    this.#follow = follow;
    byId('map-follow').setAttribute('aria-pressed', String(follow));
    this.#arrange();
    this.canvas.redraw();
  }

  #move(change: () => void): void {
    this.#moved = true;
    if (this.#follow) this.#setFollow(false);
    change();
    this.#viewport.keep(this.#extentNow(this.#store.state), this.canvas.width, this.canvas.height);
    this.canvas.redraw();
  }

  #key(event: KeyboardEvent): void {
    const pans: Record<string, [number, number]> = { ArrowLeft: [40, 0], ArrowRight: [-40, 0], ArrowUp: [0, 40], ArrowDown: [0, -40] };
    const pan = pans[event.key];
    const zooms: Record<string, number> = { '+': 1.25, '=': 1.25, '-': 0.8 };
    const zoom = zooms[event.key];
    const middle = { x: this.canvas.width / 2, y: this.canvas.height / 2 };
    if (pan) this.#move(() => this.#viewport.pan(...pan));
    else if (zoom) this.#move(() => this.#viewport.zoom(zoom, middle, 0.5, 4000));
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  #tap(at: Point): void {
    const result = resultOf(this.#store.state);
    let [best, least]: [number | null, number] = [null, REACH_PX];
    for (let row = 0; result && row < result.landmarks.length; row += LANDMARK.Width) {
      const screen = this.#viewport.toScreen(result.landmarks[row + LANDMARK.X] ?? 0, result.landmarks[row + LANDMARK.Y] ?? 0);
      const distance = Math.hypot(screen.x - at.x, screen.y - at.y);
      if (distance < least) [best, least] = [result.landmarks[row] ?? null, distance];
    }
    this.#store.set({ selected: best === this.#store.state.selected ? null : best });
  }

  /** Fits or follows, unless the person has taken over. */
  #arrange(): void {
    const { state } = this.#store;
    const { width, height } = this.canvas;
    const pose = resultOf(state)?.pose;
    if (this.#follow && pose) return this.#viewport.centre(pose[0] ?? 0, pose[1] ?? 0, width, height);
    if (!this.#moved) this.#viewport.fit(this.#extentNow(state), width, height, MARGIN_PX);
  }

  #extentNow(state: Readonly<State>): Box {
    if (this.#extentOf > state.results.length) [this.#extent, this.#extentOf] = [null, 0];
    if (!state.sequence) return this.#extentOfView();
    const box = (this.#extent ??= extentOfGiven(state));
    for (; this.#extentOf < state.results.length; this.#extentOf += 1) {
      const result = state.results[this.#extentOf];
      if (!result || result.problem) continue;
      include(box, result.pose[0] ?? 0, result.pose[1] ?? 0);
      for (let row = 0; row < result.landmarks.length; row += LANDMARK.Width) {
        // A landmark of metres of uncertainty must not make everything else small.
        const std = Math.sqrt(Math.max(result.landmarks[row + LANDMARK.VarX] ?? 0, result.landmarks[row + LANDMARK.VarY] ?? 0));
        if (std < 1) include(box, result.landmarks[row + LANDMARK.X] ?? 0, result.landmarks[row + LANDMARK.Y] ?? 0);
      }
    }
    return box;
  }

  /** Before there is anything to map: the robot and what it sees. */
  #extentOfView(): Box {
    const box = { left: -0.5, right: 1, low: -0.5, high: 0.5 };
    const rows = this.#ground()?.footprint ?? [];
    for (let row = 0; row + 1 < rows.length; row += 2) include(box, rows[row] ?? 0, rows[row + 1] ?? 0);
    return box;
  }

  #draw(context: CanvasRenderingContext2D): void {
    const { state } = this.#store;
    const { layers } = state;
    const colours = palette();
    this.#drawGrid(context, colours);
    if (layers['laser'] && state.sequence?.laser) this.#drawPoints(context, state.sequence.laser, colours.quiet);
    const result = resultOf(state);
    if (layers['footprint']) this.#drawFootprint(context, result, colours);
    if (result && layers['fan']) this.#drawFan(context, result, colours);
    if (layers['path']) this.#drawPath(context, state, colours);
    const truth = layers['truth'] ? truthOf(state.sequence?.truth ?? null, state.results) : null;
    if (truth) this.#drawTruth(context, truth, colours);
    if (result && layers['landmarks']) this.#drawLandmarks(context, result, state.selected, colours);
    this.#drawRobot(context, result, colours);
    this.#drawScale(context, colours);
  }

  #drawGrid(context: CanvasRenderingContext2D, colours: Palette): void {
    const step = niceStep(90 / this.#viewport.scale);
    const low = this.#viewport.toContent(0, this.canvas.height);
    const high = this.#viewport.toContent(this.canvas.width, 0);
    context.beginPath();
    for (let x = Math.ceil(low.x / step) * step; x < high.x; x += step) {
      const at = Math.round(this.#viewport.toScreen(x, 0).x) + 0.5;
      context.moveTo(at, 0);
      context.lineTo(at, this.canvas.height);
    }
    for (let y = Math.ceil(low.y / step) * step; y < high.y; y += step) {
      const at = Math.round(this.#viewport.toScreen(0, y).y) + 0.5;
      context.moveTo(0, at);
      context.lineTo(this.canvas.width, at);
    }
    context.strokeStyle = colours.line;
    context.globalAlpha = 0.55;
    context.lineWidth = 1;
    context.stroke();
    context.globalAlpha = 1;
  }

  #drawPoints(context: CanvasRenderingContext2D, points: Float32Array, colour: string): void {
    context.fillStyle = colour;
    context.globalAlpha = 0.5;
    for (let row = 0; row + 1 < points.length; row += 2) {
      const at = this.#viewport.toScreen(points[row] ?? 0, points[row + 1] ?? 0);
      context.fillRect(at.x - 0.8, at.y - 0.8, 1.6, 1.6);
    }
    context.globalAlpha = 1;
  }

  #drawTruth(context: CanvasRenderingContext2D, truth: Float32Array, colours: Palette): void {
    context.beginPath();
    let open = false;
    for (let row = 0; row < truth.length; row += 3) {
      const [x, y] = [truth[row] ?? NaN, truth[row + 1] ?? NaN];
      if (Number.isNaN(x)) continue;
      const at = this.#viewport.toScreen(x, y);
      if (open) context.lineTo(at.x, at.y);
      else context.moveTo(at.x, at.y);
      open = true;
    }
    context.setLineDash([5, 4]);
    context.strokeStyle = colours.text;
    context.lineWidth = 1.1;
    context.globalAlpha = 0.75;
    context.stroke();
    context.globalAlpha = 1;
    context.setLineDash([]);
  }

  #drawPath(context: CanvasRenderingContext2D, { results, frame }: Readonly<State>, colours: Palette): void {
    const trace = (from: number, to: number, alpha: number) => {
      context.beginPath();
      let open = false;
      for (let index = from; index <= to; index += 1) {
        const result = results[index];
        if (!result || result.problem) continue;
        const at = this.#viewport.toScreen(result.pose[0] ?? 0, result.pose[1] ?? 0);
        if (open) context.lineTo(at.x, at.y);
        else context.moveTo(at.x, at.y);
        open = true;
      }
      context.strokeStyle = colours.seen;
      context.globalAlpha = alpha;
      context.lineWidth = 2;
      context.lineJoin = 'round';
      context.stroke();
    };
    trace(Math.max(0, frame), results.length - 1, 0.3);
    trace(0, Math.min(frame, results.length - 1), 1);
    context.globalAlpha = 1;
  }

  #drawFootprint(context: CanvasRenderingContext2D, result: FrameResult | undefined, colours: Palette): void {
    const rows = this.#ground()?.footprint;
    if (!rows) return;
    const [x = 0, y = 0, heading = 0] = result?.pose ?? [];
    const [sin, cos] = [Math.sin(heading), Math.cos(heading)];
    context.beginPath();
    for (let row = 0; row + 1 < rows.length; row += 2) {
      const [ahead, left] = [rows[row] ?? 0, rows[row + 1] ?? 0];
      const at = this.#viewport.toScreen(x + cos * ahead - sin * left, y + sin * ahead + cos * left);
      if (row === 0) context.moveTo(at.x, at.y);
      else context.lineTo(at.x, at.y);
    }
    context.closePath();
    context.fillStyle = colours.predicted;
    context.globalAlpha = 0.13;
    context.fill();
    context.globalAlpha = 0.6;
    context.strokeStyle = colours.predicted;
    context.lineWidth = 1;
    context.stroke();
    context.globalAlpha = 1;
  }

  /** The free floor of the scan: between beams that both see some. */
  #drawFan(context: CanvasRenderingContext2D, result: FrameResult, colours: Palette): void {
    const [x = 0, y = 0, heading = 0] = result.pose;
    const { forward, left } = this.#store.state.rig.mount;
    const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
    const lens = { x: x + forward * cos - left * sin, y: y + forward * sin + left * cos };
    const at = (free: number, angle: number) =>
      this.#viewport.toScreen(lens.x + free * Math.cos(angle), lens.y + free * Math.sin(angle));
    const origin = this.#viewport.toScreen(lens.x, lens.y);
    const ends = beamsOf(result).map(({ bearing, free }) => free > 0 ? at(free, heading + bearing) : null);
    context.beginPath();
    ends.forEach((end, index) => {
      const next = ends[index + 1];
      if (!end || !next) return;
      context.moveTo(origin.x, origin.y);
      context.lineTo(end.x, end.y);
      context.lineTo(next.x, next.y);
    });
    context.fillStyle = colours.mapped;
    context.globalAlpha = 0.25;
    context.fill();
    context.globalAlpha = 1;
  }

  #ellipse(context: CanvasRenderingContext2D, x: number, y: number, covariance: [number, number, number], least: number): void {
    const at = this.#viewport.toScreen(x, y);
    const { major, minor, angle } = ellipseOf(...covariance, 3);
    const [rx, ry] = [Math.max(least, major * this.#viewport.scale), Math.max(least, minor * this.#viewport.scale)];
    context.beginPath();
    context.ellipse(at.x, at.y, rx, ry, -angle, 0, 2 * Math.PI);
  }

  #drawLandmarks(context: CanvasRenderingContext2D, result: FrameResult, selected: number | null, colours: Palette): void {
    const rows = result.landmarks;
    for (let row = 0; row < rows.length; row += LANDMARK.Width) {
      const column = (name: keyof typeof LANDMARK) => rows[row + LANDMARK[name]] ?? 0;
      const lit = selected === column('Id');
      this.#ellipse(context, column('X'), column('Y'), [column('VarX'), column('CovXy'), column('VarY')], 2);
      context.fillStyle = colours.mapped;
      context.globalAlpha = lit ? 0.35 : 0.12;
      context.fill();
      context.globalAlpha = 1;
      context.strokeStyle = colours.mapped;
      context.lineWidth = lit ? 2.4 : 1.2;
      // A tentative one is not part of the map yet: dashed, and hollow.
      const confirmed = column('Confirmed') > 0;
      context.setLineDash(confirmed ? [] : [2, 3]);
      context.stroke();
      context.setLineDash([]);
      const at = this.#viewport.toScreen(column('X'), column('Y'));
      context.beginPath();
      context.arc(at.x, at.y, lit ? 3.2 : 1.8, 0, 2 * Math.PI);
      context.fillStyle = colours.mapped;
      if (confirmed) context.fill();
      if (lit) {
        context.font = font(12, 600);
        context.textAlign = 'left';
        context.textBaseline = 'middle';
        context.lineWidth = 3;
        context.strokeStyle = colours.panel;
        const text = `${column('Id')} · seen ${column('Seen')} ×${confirmed ? '' : ' · tentative'}`;
        context.strokeText(text, at.x + 9, at.y);
        context.fillStyle = colours.text;
        context.fillText(text, at.x + 9, at.y);
      }
    }
  }

  #drawRobot(context: CanvasRenderingContext2D, result: FrameResult | undefined, colours: Palette): void {
    const [x = 0, y = 0, heading = 0] = result?.pose ?? [];
    if (result && !result.problem) {
      const c = result.covariance;
      this.#ellipse(context, x, y, [c[0] ?? 0, c[1] ?? 0, c[3] ?? 0], 3);
      context.strokeStyle = colours.text;
      context.lineWidth = 1;
      context.stroke();
    }
    const at = this.#viewport.toScreen(x, y);
    context.save();
    context.translate(at.x, at.y);
    context.rotate(-heading);
    context.beginPath();
    context.moveTo(11, 0);
    context.lineTo(-6, 6.5);
    context.lineTo(-2.5, 0);
    context.lineTo(-6, -6.5);
    context.closePath();
    context.fillStyle = colours.text;
    context.strokeStyle = colours.panel;
    context.lineWidth = 1.5;
    context.stroke();
    context.fill();
    context.restore();
  }

  #drawScale(context: CanvasRenderingContext2D, colours: Palette): void {
    const metres = niceStep(70 / this.#viewport.scale);
    const length = metres * this.#viewport.scale;
    const [x, y] = [this.canvas.width - 14 - length, this.canvas.height - 14];
    context.beginPath();
    context.moveTo(x, y - 4);
    context.lineTo(x, y);
    context.lineTo(x + length, y);
    context.lineTo(x + length, y - 4);
    context.strokeStyle = colours.text;
    context.lineWidth = 1.4;
    context.stroke();
    context.font = font(11.5, 500);
    context.textAlign = 'center';
    context.textBaseline = 'bottom';
    context.fillStyle = colours.text;
    context.fillText(metres < 1 ? `${Math.round(metres * 100)} cm` : `${metres} m`, x + length / 2, y - 4);
  }
}

/** 1, 2 or 5 times a power of ten, at least `least`. */
export function niceStep(least: number): number {
  const power = 10 ** Math.floor(Math.log10(least));
  return (([1, 2, 5].find((digit) => digit * power >= least * 0.999) ?? 10) * power);
}

function extentOfGiven({ sequence }: Readonly<State>): Box {
  const box = { left: -1, right: 4, low: -1.5, high: 1.5 };
  for (const [points, width] of [[sequence?.truth, 3], [sequence?.laser, 2]] as const) {
    for (let row = 0; points && row < points.length; row += width) {
      const [x, y] = [points[row] ?? NaN, points[row + 1] ?? NaN];
      if (!Number.isNaN(x)) include(box, x, y);
    }
  }
  return box;
}

function include(box: Box, x: number, y: number): void {
  box.left = Math.min(box.left, x);
  box.right = Math.max(box.right, x);
  box.low = Math.min(box.low, y);
  box.high = Math.max(box.high, y);
}
