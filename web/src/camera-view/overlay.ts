/** What is drawn over the picture. All coordinates go from pixels to the screen through the viewport. */
import { CORNER, DECISION, LINE, PREDICTED, type FrameResult } from '../model/protocol.ts';
import type { Palette } from '../theme/palette.ts';
import { ellipseOf } from '../views/ellipse.ts';
import { font } from '../views/canvas.ts';
import type { Viewport } from '../views/viewport.ts';
import { GRID_LINES, type Ground } from './ground.ts';
import { place, type Rectangle, type Wanted } from './labels.ts';

export interface Scene {
  context: CanvasRenderingContext2D;
  viewport: Viewport;
  colours: Palette;
  width: number;
  height: number;
  /** The part of the screen that the picture covers. */
  shown: Rectangle;
}

export function drawGrid(scene: Scene, ground: Ground): void {
  const { context } = scene;
  const { spacing } = ground;
  const rows = ground.grid(spacing);
  const labels: { text: string; x: number; y: number }[] = [];
  context.save();
  let start = 0;
  for (let row = 0; row < rows.length; row += 3) {
    if (!Number.isNaN(rows[row] ?? NaN)) continue;
    const ahead = rows[row + 2] ?? NaN;
    const across = !Number.isNaN(ahead);
    const bold = across && Math.round(ahead / spacing) % 5 === 0;
    strokeFading(scene, rows.subarray(start, row), spacing, bold);
    if (across && isLabelled(ahead / spacing)) {
      const at = middleOf(rows, start, row);
      if (at) labels.push({ text: `${Number(ahead.toFixed(2))} m`, ...scene.viewport.toScreen(at.u, at.v) });
    }
    start = row + 3;
  }
  context.restore();
  drawGridLabels(scene, labels);
}

/** Steps of the fading: vertices of one step are one stroke, which is what drawing costs. */
const FADE_STEPS = 12;

/** One line of the grid, fading with distance: light with a dark edge. */
function strokeFading({ context, viewport }: Scene, vertices: Float32Array, spacing: number, bold: boolean): void {
  const step = (at: number) => Math.ceil(FADE_STEPS * Math.max(0, 1 - (vertices[at + 2] ?? 0) / (GRID_LINES * spacing)));
  const stroke = (level: number) => {
    const alpha = (level / FADE_STEPS) ** 2 * (bold ? 0.9 : 0.55);
    context.strokeStyle = `rgb(0 0 0 / ${alpha * 0.5})`;
    context.lineWidth = bold ? 2.8 : 2;
    context.stroke();
    context.strokeStyle = `rgb(255 255 255 / ${alpha})`;
    context.lineWidth = bold ? 1.5 : 0.9;
    context.stroke();
  };
  let level = -1;
  for (let at = 0; at < vertices.length; at += 3) {
    const { x, y } = viewport.toScreen(vertices[at] ?? 0, vertices[at + 1] ?? 0);
    if (level >= 0) context.lineTo(x, y);
    const next = step(at);
    if (next === level) continue;
    if (level > 0) stroke(level);
    level = next;
    context.beginPath();
    context.moveTo(x, y);
  }
  if (level > 0) stroke(level);
}

/** 1 to 5, 10 and 20 lines: farther ones would meet one another and the horizon. */
function isLabelled(lines: number): boolean {
  const line = Math.round(lines);
  return (line > 0 && line <= 5) || line === 10 || line === 20;
}

/** The vertex of a line that is nearest to straight ahead: the one of least range. */
function middleOf(rows: Float32Array, start: number, end: number): { u: number; v: number } | null {
  let best: { u: number; v: number } | null = null;
  let least = Infinity;
  for (let at = start; at < end; at += 3) {
    const range = rows[at + 2] ?? Infinity;
    if (range < least) [least, best] = [range, { u: rows[at] ?? 0, v: rows[at + 1] ?? 0 }];
  }
  return best;
}

function drawGridLabels({ context, width, height }: Scene, labels: { text: string; x: number; y: number }[]): void {
  context.font = font(12, 550);
  context.textAlign = 'center';
  context.textBaseline = 'bottom';
  let lowest = Infinity;
  // From near to far, as long as they do not meet.
  for (const { text, x, y } of labels.sort((a, b) => b.y - a.y)) {
    if (y > height - 4 || y < 14 || x < 14 || x > width - 14 || y > lowest - 17) continue;
    lowest = y;
    halo(context, text, x, y - 2, 'rgb(255 255 255 / 85%)');
  }
}

function halo(context: CanvasRenderingContext2D, text: string, x: number, y: number, colour: string): void {
  context.lineJoin = 'round';
  context.lineWidth = 3;
  context.strokeStyle = 'rgb(0 0 0 / 60%)';
  context.strokeText(text, x, y);
  context.fillStyle = colour;
  context.fillText(text, x, y);
}

export function drawHorizon(scene: Scene, ground: Ground): void {
  const { context } = scene;
  const rows = ground.horizon;
  context.save();
  for (const [colour, width] of [['rgb(0 0 0 / 45%)', 2.6], ['rgb(255 255 255 / 85%)', 1.2]] as const) {
    context.beginPath();
    for (let row = 0; row + 1 < rows.length; row += 2) {
      const at = scene.viewport.toScreen(rows[row] ?? 0, rows[row + 1] ?? 0);
      if (row === 0) context.moveTo(at.x, at.y);
      else context.lineTo(at.x, at.y);
    }
    context.setLineDash([7, 5]);
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.stroke();
  }
  context.restore();
}

export function drawEdges({ context, viewport, colours }: Scene, rows: Float32Array): void {
  const size = Math.max(2, viewport.scale * 0.8);
  context.fillStyle = colours.predicted;
  for (let row = 0; row + 1 < rows.length; row += 2) {
    const { x, y } = viewport.toScreen(rows[row] ?? 0, rows[row + 1] ?? 0);
    context.fillRect(x - size / 2, y - size / 2, size, size);
  }
}

export function drawLines(scene: Scene, result: FrameResult): void {
  const { context, viewport, colours } = scene;
  for (const [colour, width] of [['rgb(0 0 0 / 40%)', 2.6], [colours.seen, 1.2]] as const) {
    context.beginPath();
    for (let row = 0; row < result.lines.length; row += LINE.Width) {
      const [u0, v0, u1, v1] = result.lines.subarray(row, row + LINE.Width) as unknown as [number, number, number, number];
      const [a, b] = [viewport.toScreen(u0, v0), viewport.toScreen(u1, v1)];
      context.moveTo(a.x, a.y);
      context.lineTo(b.x, b.y);
    }
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.stroke();
  }
}

export function drawPredicted(scene: Scene, result: FrameResult, selected: number | null): void {
  const { context, viewport, colours } = scene;
  const rows = result.predicted;
  for (let row = 0; row < rows.length; row += PREDICTED.Width) {
    const column = (name: keyof typeof PREDICTED) => rows[row + PREDICTED[name]] ?? 0;
    const at = viewport.toScreen(column('U'), column('V'));
    const { major, minor, angle } = ellipseOf(column('VarU'), column('CovUv'), column('VarV'), 2);
    const lit = selected === column('Landmark');
    context.beginPath();
    const [rx, ry] = [Math.max(2, major * viewport.scale), Math.max(2, minor * viewport.scale)];
    context.ellipse(at.x, at.y, rx, ry, angle, 0, 2 * Math.PI);
    const corner = column('Corner');
    if (corner >= 0) {
      const seen = corner * CORNER.Width;
      const to = viewport.toScreen(result.corners[seen + CORNER.U] ?? 0, result.corners[seen + CORNER.V] ?? 0);
      context.moveTo(at.x, at.y);
      context.lineTo(to.x, to.y);
    }
    context.strokeStyle = 'rgb(0 0 0 / 45%)';
    context.lineWidth = lit ? 4 : 2.8;
    context.stroke();
    context.strokeStyle = colours.predicted;
    context.lineWidth = lit ? 2.6 : 1.4;
    context.stroke();
  }
}

/** A refused corner. */
export function isRefused(decision: number): boolean {
  return decision === DECISION.Gated || decision === DECISION.Rejected;
}

export function drawCorners(scene: Scene, result: FrameResult, seen: boolean, refused: boolean, selected: number | null): void {
  const { context, viewport, colours } = scene;
  const rows = result.corners;
  for (let row = 0; row < rows.length; row += CORNER.Width) {
    const decision = rows[row + CORNER.Decision] ?? 0;
    const hollow = isRefused(decision);
    if (hollow ? !refused : !seen) continue;
    const at = viewport.toScreen(rows[row + CORNER.U] ?? 0, rows[row + CORNER.V] ?? 0);
    const lit = selected !== null && rows[row + CORNER.Landmark] === selected;
    const radius = lit ? 6.5 : 4;
    context.beginPath();
    context.arc(at.x, at.y, radius, 0, 2 * Math.PI);
    context.strokeStyle = 'rgb(0 0 0 / 60%)';
    context.lineWidth = hollow ? 3.4 : 2;
    context.stroke();
    if (hollow) {
      context.moveTo(at.x - 2.8, at.y + 2.8);
      context.lineTo(at.x + 2.8, at.y - 2.8);
      context.strokeStyle = colours.refused;
      context.lineWidth = 1.8;
      context.stroke();
    } else {
      context.fillStyle = colours.seen;
      context.fill();
      // New landmarks carry the map's ring, so that colour is not the only sign.
      if (decision === DECISION.Birth) {
        context.beginPath();
        context.arc(at.x, at.y, radius + 3, 0, 2 * Math.PI);
        context.strokeStyle = colours.mapped;
        context.lineWidth = 1.8;
        context.stroke();
      }
    }
  }
}

/** Number and range with ±σ beside each corner, nearest first, where there is room. */
export function drawRanges(scene: Scene, result: FrameResult): void {
  const { context, viewport, shown } = scene;
  const rows = result.corners;
  const order: number[] = [];
  for (let row = 0; row < rows.length; row += CORNER.Width) {
    if (!isRefused(rows[row + CORNER.Decision] ?? 0)) order.push(row);
  }
  order.sort((a, b) => (rows[a + CORNER.Range] ?? 0) - (rows[b + CORNER.Range] ?? 0));
  context.font = font(12.5, 550);
  context.textAlign = 'left';
  context.textBaseline = 'middle';
  const texts = order.map((row) => {
    const landmark = rows[row + CORNER.Landmark] ?? -1;
    const range = `${(rows[row + CORNER.Range] ?? 0).toFixed(2)} ±${(rows[row + CORNER.RangeStd] ?? 0).toFixed(2)} m`;
    return landmark >= 0 ? `${landmark} · ${range}` : range;
  });
  const wanted: Wanted[] = order.map((row, index) => ({
    ...viewport.toScreen(rows[row + CORNER.U] ?? 0, rows[row + CORNER.V] ?? 0),
    width: context.measureText(texts[index] ?? '').width + 8,
    height: 18,
  }));
  place(wanted, shown).forEach((at, index) => {
    const label = wanted[index];
    if (!at || !label) return;
    context.fillStyle = 'rgb(17 19 22 / 76%)';
    context.beginPath();
    context.roundRect(at.left, at.top, label.width, label.height, 3);
    context.fill();
    context.fillStyle = '#f2f4f6';
    context.fillText(texts[index] ?? '', at.left + 4, at.top + label.height / 2 + 0.5);
  });
}

/** A mark on the floor: an end of the tape, a known point. */
export function drawMark(scene: Scene, u: number, v: number, colour: string, text?: string): void {
  const { context, viewport } = scene;
  const { x, y } = viewport.toScreen(u, v);
  for (const [stroke, width] of [['rgb(0 0 0 / 65%)', 4], [colour, 1.8]] as const) {
    context.beginPath();
    context.moveTo(x - 6, y - 6);
    context.lineTo(x + 6, y + 6);
    context.moveTo(x - 6, y + 6);
    context.lineTo(x + 6, y - 6);
    context.strokeStyle = stroke;
    context.lineWidth = width;
    context.stroke();
  }
  if (text) {
    context.font = font(12, 600);
    context.textAlign = 'left';
    context.textBaseline = 'middle';
    halo(context, text, x + 10, y, '#fff');
  }
}

export function drawTape(scene: Scene, ends: { u: number; v: number }[], text: string): void {
  const { context, viewport } = scene;
  const [from, to] = ends.map((end) => viewport.toScreen(end.u, end.v));
  if (from && to) {
    for (const [stroke, width] of [['rgb(0 0 0 / 65%)', 4], ['#ffffff', 1.8]] as const) {
      context.beginPath();
      context.moveTo(from.x, from.y);
      context.lineTo(to.x, to.y);
      context.strokeStyle = stroke;
      context.lineWidth = width;
      context.stroke();
    }
  }
  for (const end of ends) drawMark(scene, end.u, end.v, '#ffffff');
  if (from && to && text) {
    context.font = font(13, 650);
    const width = context.measureText(text).width + 14;
    const [x, y] = [(from.x + to.x) / 2, (from.y + to.y) / 2 - 16];
    context.fillStyle = 'rgb(17 19 22 / 86%)';
    context.beginPath();
    context.roundRect(x - width / 2, y - 11, width, 22, 4);
    context.fill();
    context.fillStyle = '#fff';
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    context.fillText(text, x, y + 0.5);
  }
}

export function drawCrosshair({ context, width, height }: Scene, x: number, y: number): void {
  for (const [stroke, line] of [['rgb(0 0 0 / 45%)', 2.4], ['rgb(255 255 255 / 90%)', 1]] as const) {
    context.beginPath();
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]] as const) {
      context.moveTo(x + dx * 7, y + dy * 7);
      context.lineTo(x + dx * Math.min(22, width), y + dy * Math.min(22, height));
    }
    context.strokeStyle = stroke;
    context.lineWidth = line;
    context.stroke();
  }
}

/** What is under a finger, larger and beside it. */
export function drawMagnifier({ context, viewport, width }: Scene, picture: ImageBitmap, pixel: { u: number; v: number }, finger: { x: number; y: number }): void {
  const radius = 58;
  const factor = Math.max(3 * viewport.scale, 4);
  const x = Math.min(width - radius - 4, Math.max(radius + 4, finger.x));
  // Above the finger, or below it where there is no room.
  const y = finger.y - radius - 46 > radius * 0.3 ? finger.y - radius - 46 : finger.y + radius + 46;
  context.save();
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = '#3a4047';
  context.fill();
  context.save();
  context.clip();
  context.imageSmoothingEnabled = false;
  context.drawImage(picture, x - (pixel.u + 0.5) * factor, y - (pixel.v + 0.5) * factor, picture.width * factor, picture.height * factor);
  context.restore();
  for (const [stroke, line] of [['rgb(0 0 0 / 60%)', 4], ['#ffffff', 2]] as const) {
    context.strokeStyle = stroke;
    context.lineWidth = line;
    context.stroke();
  }
  drawCrosshair({ context, viewport, width, height: width } as Scene, x, y);
  context.restore();
}
