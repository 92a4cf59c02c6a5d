/** Three plots over the frames: pose error, NIS, time a stage; each can be had as a table and as a picture. */
import { byId, element } from '../app/dom.ts';
import type { Store } from '../app/state.ts';
import { truthOf } from '../model/truth.ts';
import { axisNumber } from '../model/units.ts';
import { save } from '../app/save.ts';
import { palette, type Palette } from '../theme/palette.ts';
import { Canvas, font } from '../views/canvas.ts';
import { niceStep } from '../map/map-view.ts';
import { COMPONENTS, nis, poseError, stageTimes, type Component, type Series } from './series.ts';
import './plots.css';

type Style = 'error' | 'band' | 'stack';

interface Kind {
  title: string;
  /** What it will show, while there is nothing to show. */
  hint: string;
  style: Style;
  series: () => Series;
}

const LEFT_PX = 40;
/** Okabe–Ito's other colours: those of the legend keep their meaning. */
const STAGE_COLOURS = ['#999999', '#0072b2', '#cc79a7', '#f0e442', '#7a5195'];

export function mountPlots(store: Store, show: (frame: number) => void): void {
  const panel = byId('plots');
  let component: Component = 'x';
  const kinds: Kind[] = [
    { title: 'Pose', hint: 'Position and heading within ±3σ, against the truth where there is one', style: 'error', series: () => poseError(store.state.results, truthOf(store.state.sequence?.truth ?? null, store.state.results), component) },
    { title: 'NIS ÷ degrees of freedom', hint: 'Whether the errors are as large as the filter believes', style: 'band', series: () => nis(store.state.results) },
    { title: 'Time a stage', hint: 'Milliseconds for each picture', style: 'stack', series: () => stageTimes(store.state.results) },
  ];
  const plots = kinds.map((kind) => new Plot(store, kind, show));
  const tabs = COMPONENTS.map((name) =>
    element('button', {
      class: 'tab',
      'aria-pressed': String(name === component),
      click: () => {
        component = name;
        for (const tab of tabs) tab.setAttribute('aria-pressed', String(tab.textContent === name));
        plots[0]?.refresh();
      },
    }, name),
  );
  plots[0]?.heading.append(element('span', { class: 'tabs', role: 'group', 'aria-label': 'Component' }, ...tabs));
  // Folded on a phone, where they would push the rest away; wide screens have room and no summary to press.
  const narrow = matchMedia('(max-width: 760px)');
  const fold = () => byId<HTMLDetailsElement>('plots-fold').toggleAttribute('open', !narrow.matches);
  narrow.addEventListener('change', fold);
  fold();
  panel.replaceChildren(...plots.map((plot) => plot.element));
}

class Plot {
  readonly element: HTMLElement;
  readonly heading: HTMLElement;
  readonly #kind: Kind;
  readonly #store: Store;
  readonly #canvas: Canvas;
  readonly #value = element('output', { class: 'plot-value' });
  readonly #table = element('div', { class: 'plot-table', hidden: true, tabindex: '0' });
  #worked: Series;
  #stale = false;

  constructor(store: Store, kind: Kind, show: (frame: number) => void) {
    this.#kind = kind;
    this.#store = store;
    this.#worked = kind.series();
    const canvas = element('canvas', { role: 'img', 'aria-label': `${kind.title} over the frames` });
    const box = element('div', { class: 'plot-box' }, canvas);
    const toTable = element('button', { class: 'tool', 'aria-pressed': 'false', click: () => {
      this.#table.hidden = !this.#table.hidden;
      canvas.hidden = !this.#table.hidden;
      toTable.setAttribute('aria-pressed', String(canvas.hidden));
      this.#fillTable();
    } }, 'Table');
    const toPicture = element('button', { class: 'tool', title: 'Save this plot as PNG', click: () => {
      // A hidden canvas has no size, and would be saved as nothing.
      if (canvas.hidden) toTable.click();
      void this.#canvas.png().then((blob) => save(`${kind.title.toLowerCase().replaceAll(/[^a-z]+/g, '-')}.png`, blob));
    } }, 'PNG');
    this.heading = element('h2', { class: 'plot-title' }, kind.title);
    box.append(this.#table);
    this.element = element('section', { class: 'plot', 'aria-label': kind.title },
      element('header', { class: 'plot-head' }, this.heading, this.#value, toTable, toPicture), box);
    this.#canvas = new Canvas(canvas, (context) => this.#draw(context));
    const scrub = (event: PointerEvent) => {
      const x = event.clientX - canvas.getBoundingClientRect().left - LEFT_PX;
      show(Math.floor((x / Math.max(1, this.#canvas.width - LEFT_PX - 6)) * this.#frames()));
    };
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      scrub(event);
    });
    canvas.addEventListener('pointermove', (event) => canvas.hasPointerCapture(event.pointerId) && scrub(event));
    store.on(['results', 'sequence'], () => this.refresh());
    store.on(['frame'], () => this.#canvas.redraw());
  }

  refresh(): void {
    this.#stale = true;
    this.#fillTable();
    this.#canvas.redraw();
  }

  /** Worked out when it is looked at: results come faster than anyone can read. */
  get #series(): Series {
    if (this.#stale) this.#worked = this.#kind.series();
    this.#stale = false;
    return this.#worked;
  }

  #frames(): number {
    return Math.max(this.#series.rows.length, this.#store.state.sequence?.frames.length ?? 0, 1);
  }

  /** The numbers of the frame on show. */
  #tell(): void {
    const row = this.#series.rows[this.#store.state.frame];
    const { unit } = this.#series;
    if (!row) this.#value.value = '';
    else if (this.#kind.style === 'error') {
      const [error = NaN, sigma = NaN] = row;
      const words = [Number.isNaN(error) ? '' : axisNumber(error), Number.isNaN(sigma) ? '' : `3σ ${axisNumber(sigma)}`];
      this.#value.value = words.some(Boolean) ? `${words.filter(Boolean).join(' · ')} ${unit}` : '';
    } else if (this.#kind.style === 'stack') {
      this.#value.value = `${row.reduce((sum, value) => sum + value, 0).toFixed(1)} ms`;
    } else this.#value.value = Number.isNaN(row[0]) ? '' : axisNumber(row[0] ?? 0);
  }

  #fillTable(): void {
    if (this.#table.hidden) return;
    const { columns, rows, unit } = this.#series;
    const cell = (value: number) => element('td', {}, Number.isFinite(value) ? axisNumber(value) : '');
    const head = element('tr', {}, ...['frame', ...columns.map((name) => (unit ? `${name} (${unit})` : name))].map((name) => element('th', { scope: 'col' }, name)));
    const body = rows.map((row, index) => element('tr', {}, element('th', { scope: 'row' }, String(index + 1)), ...row.map(cell)));
    this.#table.replaceChildren(element('table', {}, element('thead', {}, head), element('tbody', {}, ...body)));
  }

  #draw(context: CanvasRenderingContext2D): void {
    this.#tell();
    const colours = palette();
    const { rows } = this.#series;
    const { width, height } = this.#canvas;
    if (rows.length === 0) return this.#drawNothing(context, colours);
    const frames = this.#frames();
    const plotWidth = width - LEFT_PX - 6;
    const [low, high] = limits(this.#series, this.#kind.style);
    const x = (frame: number) => LEFT_PX + ((frame + 0.5) / frames) * plotWidth;
    const y = (value: number) => height - 5 - ((value - low) / (high - low)) * (height - 11);
    this.#drawAxis(context, colours, low, high, y);
    const styles = { error: () => drawError(context, rows, x, y, colours), band: () => drawBand(context, rows, x, y, colours), stack: () => drawStack(context, rows, x, y) };
    context.save();
    context.beginPath();
    context.rect(LEFT_PX, 0, plotWidth, height);
    context.clip();
    styles[this.#kind.style]();
    context.restore();
    const at = x(this.#store.state.frame);
    context.fillStyle = colours.text;
    context.globalAlpha = 0.6;
    context.fillRect(at - 0.5, 0, 1, height);
    context.globalAlpha = 1;
    if (this.#kind.style === 'stack') this.#drawKey(context, colours);
  }

  #drawNothing(context: CanvasRenderingContext2D, colours: Palette): void {
    context.font = font(12);
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    context.fillStyle = colours.quiet;
    context.fillText(this.#kind.hint, this.#canvas.width / 2, this.#canvas.height / 2 - 6);
  }

  #drawAxis(context: CanvasRenderingContext2D, colours: Palette, low: number, high: number, y: (value: number) => number): void {
    context.font = font(10.5);
    context.textAlign = 'right';
    context.textBaseline = 'middle';
    const step = niceStep((high - low) / Math.max(2, this.#canvas.height / 26));
    for (let value = Math.ceil(low / step) * step; value <= high + step * 1e-6; value += step) {
      const at = y(value);
      if (at < 5 || at > this.#canvas.height - 3) continue;
      context.fillStyle = colours.line;
      context.fillRect(LEFT_PX, Math.round(at), this.#canvas.width - LEFT_PX - 6, 1);
      context.fillStyle = colours.quiet;
      context.fillText(axisNumber(Math.abs(value) < step * 1e-6 ? 0 : value), LEFT_PX - 6, at);
    }
  }

  #drawKey(context: CanvasRenderingContext2D, colours: Palette): void {
    context.font = font(10.5, 500);
    context.textAlign = 'left';
    context.textBaseline = 'middle';
    let left = LEFT_PX + 6;
    this.#series.columns.forEach((name, index) => {
      const width = context.measureText(name).width;
      context.globalAlpha = 0.85;
      context.fillStyle = colours.panel;
      context.fillRect(left - 2, 2, width + 18, 14);
      context.globalAlpha = 1;
      context.fillStyle = STAGE_COLOURS[index] ?? colours.quiet;
      context.fillRect(left, 5.5, 8, 7);
      context.fillStyle = colours.text;
      context.fillText(name, left + 11, 9.5);
      left += width + 22;
    });
  }
}

/** The range of values shown: symmetric for errors, from zero otherwise; a few outliers are cut. */
function limits({ rows }: Series, style: Style): [number, number] {
  const sizes = rows
    .map((row) => (style === 'stack' ? row.reduce((sum, value) => sum + value, 0) : Math.max(...row.filter(Number.isFinite).map(Math.abs), 0)))
    .sort((a, b) => a - b);
  const most = (sizes[Math.floor(sizes.length * 0.98)] ?? 0) * 1.15 || 1;
  return style === 'error' ? [-most, most] : [0, most];
}

type Scale = (value: number) => number;

function line(context: CanvasRenderingContext2D, rows: number[][], x: Scale, value: (row: number[]) => number): void {
  context.beginPath();
  let open = false;
  rows.forEach((row, frame) => {
    const at = value(row);
    if (!Number.isFinite(at)) open = false;
    else if (open) context.lineTo(x(frame), at);
    else context.moveTo(x(frame), at);
    if (Number.isFinite(at)) open = true;
  });
}

/** The area between two curves. */
function area(context: CanvasRenderingContext2D, rows: number[][], x: Scale, low: (row: number[]) => number, high: (row: number[]) => number): void {
  context.beginPath();
  const drawn = rows.map((row, frame) => ({ row, frame })).filter(({ row }) => Number.isFinite(low(row)) && Number.isFinite(high(row)));
  for (const { row, frame } of drawn) context.lineTo(x(frame), high(row));
  for (const { row, frame } of drawn.reverse()) context.lineTo(x(frame), low(row));
  context.closePath();
  context.fill();
}

function drawError(context: CanvasRenderingContext2D, rows: number[][], x: Scale, y: Scale, colours: Palette): void {
  context.fillStyle = colours.predicted;
  context.globalAlpha = 0.2;
  area(context, rows, x, (row) => y(-(row[1] ?? NaN)), (row) => y(row[1] ?? NaN));
  context.globalAlpha = 1;
  context.strokeStyle = colours.predicted;
  context.lineWidth = 1;
  for (const sign of [1, -1]) {
    line(context, rows, x, (row) => y(sign * (row[1] ?? NaN)));
    context.stroke();
  }
  line(context, rows, x, (row) => y(row[0] ?? NaN));
  context.strokeStyle = colours.text;
  context.lineWidth = 1.4;
  context.lineJoin = 'round';
  context.stroke();
}

function drawBand(context: CanvasRenderingContext2D, rows: number[][], x: Scale, y: Scale, colours: Palette): void {
  context.fillStyle = colours.predicted;
  context.globalAlpha = 0.2;
  area(context, rows, x, (row) => y(row[1] ?? NaN), (row) => y(row[2] ?? NaN));
  context.globalAlpha = 1;
  rows.forEach((row, frame) => {
    const [value = NaN, low = NaN, high = NaN] = row;
    if (!Number.isFinite(value)) return;
    const outside = value < low || value > high;
    context.fillStyle = outside ? colours.refused : colours.text;
    context.beginPath();
    context.arc(x(frame), y(value), outside ? 2 : 1.4, 0, 2 * Math.PI);
    context.fill();
  });
}

function drawStack(context: CanvasRenderingContext2D, rows: number[][], x: Scale, y: Scale): void {
  const width = Math.max(1, x(1) - x(0) - (x(1) - x(0) > 3 ? 1 : 0));
  rows.forEach((row, frame) => {
    let sum = 0;
    row.forEach((value, stage) => {
      context.fillStyle = STAGE_COLOURS[stage] ?? '#999999';
      context.fillRect(x(frame) - width / 2, y(sum + value), width, y(sum) - y(sum + value));
      sum += value;
    });
  });
}
