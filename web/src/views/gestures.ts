/**
 * Mouse, pen and fingers on a canvas. A mouse drags and its wheel zooms; two fingers pan and zoom, one scrolls the page;
 * a short press is a tap, and a finger that rests looks closer until it is lifted.
 */
import type { Point } from './viewport.ts';

export interface Gestures {
  pan(dx: number, dy: number): void;
  zoom(factor: number, at: Point): void;
  /** `byTouch`: there is no pointer that stays where it was. */
  tap(at: Point, byTouch: boolean): void;
  hover(at: Point | null): void;
  /** A finger rests there; null when it is lifted. */
  hold?(at: Point | null): void;
}

/** Further than this and a press is a drag. */
const SLOP_PX = { mouse: 5, touch: 9 } as const;
/** A finger that rests as long looks closer. */
const HOLD_MS = 220;

export function listen(canvas: HTMLCanvasElement, gestures: Gestures): void {
  const down = new Map<number, Point>();
  let travelled = 0;
  let fingers = 0;
  let holding = false;
  let timer: ReturnType<typeof setTimeout> | undefined;

  const at = (event: MouseEvent): Point => {
    const box = canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  const isTouch = (event: PointerEvent) => event.pointerType === 'touch';
  const slop = (event: PointerEvent) => (isTouch(event) ? SLOP_PX.touch : SLOP_PX.mouse);
  const letGo = () => {
    clearTimeout(timer);
    if (holding) gestures.hold?.(null);
    holding = false;
  };

  canvas.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    const now = at(event);
    down.set(event.pointerId, now);
    letGo();
    if (down.size > 1) {
      fingers = Math.max(fingers, down.size);
      return;
    }
    [travelled, fingers] = [0, 1];
    if (!isTouch(event) || !gestures.hold) return;
    timer = setTimeout(() => {
      if (fingers !== 1 || travelled > SLOP_PX.touch) return;
      holding = true;
      gestures.hold?.(now);
    }, HOLD_MS);
  });

  canvas.addEventListener('pointermove', (event) => {
    const now = at(event);
    const before = down.get(event.pointerId);
    if (!before) return gestures.hover(now);
    const [dx, dy] = [now.x - before.x, now.y - before.y];
    if (down.size === 1) {
      travelled += Math.hypot(dx, dy);
      if (holding) gestures.hold?.(now);
      else if (!isTouch(event)) {
        if (travelled > slop(event)) gestures.pan(dx, dy);
        gestures.hover(now);
      }
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
    const held = holding;
    letGo();
    if (tapped && fingers === 1 && (held || travelled <= slop(event))) gestures.tap(at(event), isTouch(event));
  };
  canvas.addEventListener('pointerup', (event) => end(event, true));
  canvas.addEventListener('pointercancel', (event) => end(event, false));
  canvas.addEventListener('pointerleave', (event) => event.pointerType === 'mouse' && gestures.hover(null));
  // One finger scrolls the page, unless it rested before; two are ours.
  const keep = (event: TouchEvent) => {
    if (event.cancelable && (holding || event.touches.length > 1)) event.preventDefault();
  };
  canvas.addEventListener('touchstart', keep, { passive: false });
  canvas.addEventListener('touchmove', keep, { passive: false });
  canvas.addEventListener('contextmenu', (event) => (event as PointerEvent).pointerType === 'touch' && event.preventDefault());
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
