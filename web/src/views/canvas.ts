/** A canvas as sharp as the screen, redrawn at most once a display frame. */
import { onThemeChange } from '../theme/palette.ts';

/** Milliseconds of a display frame that drawing may take; what is left over is drawn in the next one. */
const BUDGET_MS = 8;

/** Canvases that are to be redrawn, those that have waited longest first. */
const waiting = new Set<Canvas>();

function paintSome(): void {
  const start = performance.now();
  for (const canvas of waiting) {
    waiting.delete(canvas);
    canvas.paint();
    if (performance.now() - start > BUDGET_MS) break;
  }
  if (waiting.size > 0) requestAnimationFrame(paintSome);
}

export class Canvas {
  readonly element: HTMLCanvasElement;
  width = 0;
  height = 0;
  readonly #context: CanvasRenderingContext2D;
  readonly #draw: (context: CanvasRenderingContext2D) => void;

  constructor(element: HTMLCanvasElement, draw: (context: CanvasRenderingContext2D) => void, resized?: () => void) {
    const context = element.getContext('2d');
    if (!context) throw new Error('this browser gives no 2D canvas');
    this.element = element;
    this.#context = context;
    this.#draw = draw;
    new ResizeObserver(() => {
      this.#measure();
      resized?.();
      // At once: a resized canvas is blank until it is drawn.
      this.paint();
    }).observe(element);
    this.#measure();
    onThemeChange(() => this.redraw());
  }

  redraw(): void {
    if (waiting.size === 0) requestAnimationFrame(paintSome);
    waiting.add(this);
  }

  /** The picture as PNG. */
  async png(): Promise<Blob> {
    // It may have been hidden until now, and had no size.
    this.#measure();
    this.paint();
    const blob = await new Promise<Blob | null>((done) => this.element.toBlob(done, 'image/png'));
    if (!blob) throw new Error('the picture is too large to be saved');
    return blob;
  }

  #measure(): void {
    const box = this.element.getBoundingClientRect();
    [this.width, this.height] = [box.width, box.height];
    const ratio = Math.min(devicePixelRatio || 1, 3);
    this.element.width = Math.max(1, Math.round(box.width * ratio));
    this.element.height = Math.max(1, Math.round(box.height * ratio));
  }

  /** Draws now. */
  paint(): void {
    if (this.width === 0 || this.height === 0) return;
    const context = this.#context;
    context.setTransform(this.element.width / this.width, 0, 0, this.element.height / this.height, 0, 0);
    context.clearRect(0, 0, this.width, this.height);
    this.#draw(context);
  }
}

/** The canvas's font at this size in CSS pixels; canvases know no tabular figures but system fonts have them. */
export function font(size: number, weight = 400): string {
  return `${weight} ${size}px system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif`;
}
