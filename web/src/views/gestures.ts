/** Mouse, pen and fingers on a canvas: drag, pinch and wheel move the view, a short press is a tap. */
import type { Point } from './viewport.ts';

export interface Gestures {
  pan(dx: number, dy: number): void;
  zoom(factor: number, at: Point): void;
  tap(at: Point): void;
  hover(at: Point | null): void;
}

/** Further than this and a press is a drag. */
const SLOP_PX = 5;

export function listen(canvas: HTMLCanvasElement, gestures: Gestures): void {
  const down = new Map<number, Point>();
  let travelled = 0;
  let fingers = 0;

  const at = (event: MouseEvent): Point => {
    const box = canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };

  canvas.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, at(event));
    if (down.size === 1) [travelled, fingers] = [0, 1];
    else fingers = Math.max(fingers, down.size);
  });

  canvas.addEventListener('pointermove', (event) => {
    const now = at(event);
    const before = down.get(event.pointerId);
    if (!before) return gestures.hover(now);
    const [dx, dy] = [now.x - before.x, now.y - before.y];
    if (down.size === 1) {
      travelled += Math.hypot(dx, dy);
      if (travelled > SLOP_PX) gestures.pan(dx, dy);
      gestures.hover(now);
    } else if (down.size === 2) {
      const other = [...down].find(([id]) => id !== event.pointerId)?.[1];
      if (other) {
        const spread = (a: Point) => Math.max(1, Math.hypot(a.x - other.x, a.y - other.y));
        gestures.pan(dx / 2, dy / 2);
        gestures.zoom(spread(now) / spread(before), { x: (now.x + other.x) / 2, y: (now.y + other.y) / 2 });
      }
    }
    down.set(event.pointerId, now);
  });

  const end = (event: PointerEvent, tapped: boolean) => {
    if (!down.delete(event.pointerId)) return;
    if (tapped && fingers === 1 && travelled <= SLOP_PX) gestures.tap(at(event));
  };
  canvas.addEventListener('pointerup', (event) => end(event, true));
  canvas.addEventListener('pointercancel', (event) => end(event, false));
  canvas.addEventListener('pointerleave', (event) => event.pointerType === 'mouse' && gestures.hover(null));
  canvas.addEventListener(
    'wheel',
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
      gestures.zoom(Math.exp(-event.deltaY * lines * 0.0016), at(event));
    },
    { passive: false },
  );
}
