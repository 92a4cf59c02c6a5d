/** The camera's picture with everything that is known about it, and the pointer's range. */
import { byId } from '../app/dom.ts';
import { decisionWords } from '../app/result.ts';
import { resultOf, type Pixel, type State, type Store } from '../app/state.ts';
import { bearing, metres } from '../model/units.ts';
import { CORNER } from '../model/protocol.ts';
import { guessWords } from '../model/rig.ts';
import { palette } from '../theme/palette.ts';
import { Canvas } from '../views/canvas.ts';
import { listen } from '../views/gestures.ts';
import { Viewport, type Box, type Point } from '../views/viewport.ts';
import { Ground } from './ground.ts';
import * as overlay from './overlay.ts';
import { drawScan } from './scan.ts';

/** How close the pointer must come to a corner to ask about it. */
const REACH_PX = 9;

export class CameraView {
  readonly canvas: Canvas;
  readonly #store: Store;
  readonly #viewport = new Viewport(false);
  readonly #readout = byId<HTMLOutputElement>('readout');
  #ground: Ground | null = null;
  readonly #floor = new OffscreenCanvas(1, 1);
  /** What grid and horizon were drawn for. */
  #floorView = '';
  #floorGround: Ground | null = null;
  /** The person has moved the picture; it is fitted no more. */
  #moved = false;
  /** Where a finger rests. */
  #held: Point | null = null;

  constructor(store: Store) {
    this.#store = store;
    this.canvas = new Canvas(byId<HTMLCanvasElement>('camera-view'), (context) => this.#draw(context), () => this.#fit());
    listen(this.canvas.element, {
      pan: (dx, dy) => this.#move(() => this.#viewport.pan(dx, dy)),
      zoom: (factor, at) => this.#move(() => this.#viewport.zoom(factor, at, this.#least(), 60)),
      tap: (at, byTouch) => this.#tap(at, byTouch),
      hover: (at) => store.set({ pointer: at && this.#pixel(at) }),
      hold: (at) => {
        this.#held = at;
        if (at) store.set({ pointer: this.#pixel(at) });
        this.canvas.redraw();
      },
    });
    this.canvas.element.addEventListener('keydown', (event) => this.#key(event));
    byId('camera-fit').addEventListener('click', () => this.fit());
    byId('tape-clear').addEventListener('click', () => store.set({ tape: [] }));
    store.on(['rig'], ({ rig }) => this.#rigChanged(rig));
    store.on(['tape'], ({ tape }) => (byId('tape-clear').hidden = tape.length === 0));
    store.on(['pointer', 'rig', 'frame', 'results', 'tape'], (state) => this.#read(state));
    store.on([], () => this.canvas.redraw());
  }

  /** The range finder of the rig on show. */
  get ground(): Ground | null {
    return this.#ground;
  }

  fit(): void {
    this.#moved = false;
    this.#fit();
    this.canvas.redraw();
  }

  #rigChanged(rig: State['rig']): void {
    const before = this.#ground?.rig;
    try {
      const ground = new Ground(rig);
      this.#ground?.free();
      this.#ground = ground;
      this.canvas.element.setAttribute('aria-description', `The floor has a grid of ${ground.spacing} m.`);
    } catch {
      return; // The set-up panel says what is wrong; the last good rig stays on show.
    }
    if (before?.width !== rig.width || before.height !== rig.height) this.fit();
  }

  #least(): number {
    const { rig } = this.#store.state;
    return 0.5 * Math.min(this.canvas.width / rig.width, this.canvas.height / rig.height);
  }

  #fit(): void {
    if (this.#moved) return;
    this.#viewport.fit(this.#box(), this.canvas.width, this.canvas.height, 0);
  }

  /** The whole picture. */
  #box(): Box {
    const { width, height } = this.#store.state.rig;
    return { left: -0.5, right: width - 0.5, low: -0.5, high: height - 0.5 };
  }

  #move(change: () => void): void {
    this.#moved = true;
    change();
    this.#viewport.keep(this.#box(), this.canvas.width, this.canvas.height);
    this.canvas.redraw();
  }

  #pixel(at: Point): Pixel {
    const { x, y } = this.#viewport.toContent(at.x, at.y);
    return { u: x, v: y };
  }

  #tap(at: Point, byTouch: boolean): void {
    const pixel = this.#pixel(at);
    // A finger is gone when it has tapped: what it pointed at stays on show.
    if (byTouch) this.#store.set({ pointer: pixel });
    this.#mark(pixel);
  }

  /** A press on the picture: a known point while those are picked, a landmark's corner, an end of the tape. */
  #mark(pixel: Pixel): void {
    const { state } = this.#store;
    const seen = this.#ground?.sight(pixel.u, pixel.v);
    if (typeof seen === 'string' || !seen) return;
    if (state.pickingPoints) {
      const point = { ...pixel, x: Number(seen.x.toFixed(2)), y: Number(seen.y.toFixed(2)) };
      this.#store.set({ knownPoints: [...state.knownPoints, point] });
      return;
    }
    const corner = this.#cornerAt(state, pixel);
    const landmark = corner === null ? -1 : (resultOf(state)?.corners[corner + CORNER.Landmark] ?? -1);
    if (landmark >= 0 && state.tape.length !== 1) {
      this.#store.set({ selected: state.selected === landmark ? null : landmark });
      return;
    }
    this.#store.set({ tape: state.tape.length === 1 ? [...state.tape, pixel] : [pixel] });
  }

  #key(event: KeyboardEvent): void {
    const steps: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const step = steps[event.key];
    const { rig, pointer } = this.#store.state;
    if (step) {
      const from = pointer ?? { u: rig.width / 2, v: rig.height * 0.75 };
      const size = (event.shiftKey ? 20 : 2) / this.#viewport.scale;
      const clamp = (value: number, most: number) => Math.min(most - 1, Math.max(0, value));
      this.#store.set({ pointer: { u: clamp(from.u + step[0] * size, rig.width), v: clamp(from.v + step[1] * size, rig.height) } });
    } else if (event.key === 'Enter' && pointer) {
      this.#mark(pointer);
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** The row of the corner under the pointer. */
  #cornerAt(state: Readonly<State>, pixel: Pixel): number | null {
    const result = resultOf(state);
    let best: number | null = null;
    let least = REACH_PX / this.#viewport.scale;
    for (let row = 0; result && row < result.corners.length; row += CORNER.Width) {
      const [du, dv] = [(result.corners[row] ?? 0) - pixel.u, (result.corners[row + 1] ?? 0) - pixel.v];
      const distance = Math.hypot(du, dv);
      if (distance < least) [best, least] = [row, distance];
    }
    return best;
  }

  #read(state: Readonly<State>): void {
    const text = this.#readoutText(state);
    this.#readout.hidden = text === '';
    if (this.#readout.value !== text) this.#readout.value = text;
  }

  #readoutText(state: Readonly<State>): string {
    return [this.#pointed(state), this.#tapeWords(state)].filter(Boolean).join(' · ');
  }

  #tapeWords({ tape }: Readonly<State>): string {
    const [from, to] = tape;
    const measured = from && to && this.#ground?.tape(from, to);
    return measured ? `tape ${metres(measured.distance, measured.std)}` : '';
  }

  #pointed(state: Readonly<State>): string {
    const { pointer, rig } = state;
    if (!pointer || !this.#ground) return '';
    if (pointer.u < -0.5 || pointer.v < -0.5 || pointer.u > rig.width - 0.5 || pointer.v > rig.height - 0.5) return '';
    const corner = this.#cornerAt(state, pointer);
    if (corner !== null) {
      const row = resultOf(state)?.corners.subarray(corner, corner + CORNER.Width) ?? new Float32Array();
      const name = (row[CORNER.Landmark] ?? -1) >= 0 ? `Corner ${row[CORNER.Landmark]}` : 'Corner';
      const decision = decisionWords(row[CORNER.Decision] ?? 0);
      const nis = (row[CORNER.Nis] ?? NaN) >= 0 ? ` (NIS ${(row[CORNER.Nis] ?? 0).toFixed(1)})` : '';
      return `${name}: ${metres(row[CORNER.Range] ?? 0, row[CORNER.RangeStd])}, ${bearing(row[CORNER.Bearing] ?? 0)} · ${decision}${nis}`;
    }
    const seen = this.#ground.sight(pointer.u, pointer.v);
    if (typeof seen === 'string') return seen === 'above the horizon' ? 'Above the horizon: no floor here' : `No range: ${seen}`;
    const words = `${metres(seen.range, seen.rangeStd)}, ${bearing(seen.bearing)}`;
    const guess = guessWords(rig);
    return guess ? `${words} (${guess})` : words;
  }

  #draw(context: CanvasRenderingContext2D): void {
    const { state } = this.#store;
    const { picture, layers, rig, selected } = state;
    const viewport = this.#viewport;
    const corner = viewport.toScreen(-0.5, -0.5);
    const [width, height] = [rig.width * viewport.scale, rig.height * viewport.scale];
    const shown = {
      left: Math.max(corner.x, 0), top: Math.max(corner.y, 0),
      right: Math.min(corner.x + width, this.canvas.width), bottom: Math.min(corner.y + height, this.canvas.height),
    };
    const scene: overlay.Scene = { context, viewport, colours: palette(), width: this.canvas.width, height: this.canvas.height, shown };
    // Dark, so that grid and horizon show without a picture too.
    context.fillStyle = '#3a4047';
    context.fillRect(corner.x, corner.y, width, height);
    if (picture && layers['picture']) {
      context.imageSmoothingEnabled = viewport.scale < 3;
      context.imageSmoothingQuality = 'medium';
      context.drawImage(picture, corner.x, corner.y, width, height);
    }
    context.save();
    context.beginPath();
    context.rect(corner.x, corner.y, width, height);
    context.clip();
    const ground = this.#ground;
    if (ground) this.#drawFloor(scene, ground, layers['grid'] ?? true, layers['horizon'] ?? true);
    const result = resultOf(state);
    if (result && ground && layers['scan']) drawScan(scene, ground, result);
    if (state.edges && layers['edges']) overlay.drawEdges(scene, state.edges);
    if (result) {
      if (layers['lines']) overlay.drawLines(scene, result);
      if (layers['predicted']) overlay.drawPredicted(scene, result, selected);
      overlay.drawCorners(scene, result, layers['corners'] ?? true, layers['refused'] ?? true, selected);
      if (layers['ranges']) overlay.drawRanges(scene, result);
    }
    state.knownPoints.forEach((point, index) => {
      overlay.drawMark(scene, point.u, point.v, scene.colours.seen, String(index + 1));
    });
    this.#drawTape(scene, state);
    context.restore();
    if (state.pointer) {
      const at = viewport.toScreen(state.pointer.u, state.pointer.v);
      overlay.drawCrosshair(scene, at.x, at.y);
    }
    if (this.#held && picture) overlay.drawMagnifier(scene, picture, this.#pixel(this.#held), this.#held);
  }

  /** Grid and horizon, which stay as they are while pictures go by: drawn once for a view of a rig. */
  #drawFloor(scene: overlay.Scene, ground: Ground, grid: boolean, horizon: boolean): void {
    const { element } = this.canvas;
    const { scale, offset } = this.#viewport;
    const view = [element.width, element.height, scale, offset.x, offset.y, grid, horizon].join();
    if (this.#floorView !== view || this.#floorGround !== ground) {
      [this.#floorView, this.#floorGround] = [view, ground];
      [this.#floor.width, this.#floor.height] = [element.width, element.height];
      const context = this.#floor.getContext('2d') as unknown as CanvasRenderingContext2D;
      context.setTransform(element.width / this.canvas.width, 0, 0, element.height / this.canvas.height, 0, 0);
      const floor = { ...scene, context };
      if (grid) overlay.drawGrid(floor, ground);
      if (horizon) overlay.drawHorizon(floor, ground);
    }
    scene.context.drawImage(this.#floor, 0, 0, this.canvas.width, this.canvas.height);
  }

  #drawTape(scene: overlay.Scene, { tape, pointer }: Readonly<State>): void {
    const [from, to = pointer] = tape;
    if (!from || !this.#ground) return;
    const measured = to ? this.#ground.tape(from, to) : null;
    overlay.drawTape(scene, measured && to ? [from, to] : [from], measured ? metres(measured.distance, measured.std) : '');
  }
}
