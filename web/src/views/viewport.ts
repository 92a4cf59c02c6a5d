/** A similarity between content and screen: screen = content · scale + offset, y turned over for maps. */
export interface Point {
  x: number;
  y: number;
}

export interface Box {
  left: number;
  right: number;
  low: number;
  high: number;
}

/** Of the screen, that what is on show must cover along each side. */
const LEAST_SHARE = 0.5;

export class Viewport {
  scale = 1;
  offset: Point = { x: 0, y: 0 };
  readonly #up: -1 | 1;

  /** `yUp`: content's y axis points up the screen, as on a map. */
  constructor(yUp: boolean) {
    this.#up = yUp ? -1 : 1;
  }

  toScreen(x: number, y: number): Point {
    return { x: x * this.scale + this.offset.x, y: this.#up * y * this.scale + this.offset.y };
  }

  toContent(x: number, y: number): Point {
    return { x: (x - this.offset.x) / this.scale, y: (this.#up * (y - this.offset.y)) / this.scale };
  }

  /** Shows the whole box in the middle of a screen of this size. */
  fit(box: Box, width: number, height: number, margin: number): void {
    const [w, h] = [Math.max(box.right - box.left, 1e-9), Math.max(box.high - box.low, 1e-9)];
    this.scale = Math.max(1e-9, Math.min((width - 2 * margin) / w, (height - 2 * margin) / h));
    this.centre((box.left + box.right) / 2, (box.low + box.high) / 2, width, height);
  }

  /** Puts a point of the content in the middle of the screen. */
  centre(x: number, y: number, width: number, height: number): void {
    this.offset = { x: width / 2 - x * this.scale, y: height / 2 - this.#up * y * this.scale };
  }

  /** Moves the box back so far that it covers a good part of the screen: nothing can be pushed out of sight. */
  keep(box: Box, width: number, height: number): void {
    const [a, b] = [this.toScreen(box.left, box.low), this.toScreen(box.right, box.high)];
    const shift = (low: number, high: number, size: number) => {
      const least = Math.min(LEAST_SHARE * size, high - low);
      if (high < least) return least - high;
      return low > size - least ? size - least - low : 0;
    };
    this.pan(shift(Math.min(a.x, b.x), Math.max(a.x, b.x), width), shift(Math.min(a.y, b.y), Math.max(a.y, b.y), height));
  }

  pan(dx: number, dy: number): void {
    this.offset = { x: this.offset.x + dx, y: this.offset.y + dy };
  }

  /** Magnifies about a point of the screen, which stays where it is. */
  zoom(factor: number, at: Point, least: number, most: number): void {
    const scale = Math.min(most, Math.max(least, this.scale * factor));
    const ratio = scale / this.scale;
    this.offset = { x: at.x - (at.x - this.offset.x) * ratio, y: at.y - (at.y - this.offset.y) * ratio };
    this.scale = scale;
  }
}
