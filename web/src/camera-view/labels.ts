/** Where labels go: beside their point, on nothing else; the first asked for wins. */
export interface Wanted {
  /** The point that the label belongs to, on the screen. */
  x: number;
  y: number;
  width: number;
  height: number;
}

export interface Placed {
  left: number;
  top: number;
}

export interface Rectangle extends Placed {
  right: number;
  bottom: number;
}

const GAP = 7;

/** A place for each label inside the view, or null where there is no room. Points themselves are kept free too. */
export function place(wanted: Wanted[], view: Rectangle): (Placed | null)[] {
  const taken: Rectangle[] = wanted.map(({ x, y }) => ({ left: x - 3, top: y - 3, right: x + 3, bottom: y + 3 }));
  return wanted.map((label) => {
    for (const { left, top } of candidates(label)) {
      const rectangle = { left, top, right: left + label.width, bottom: top + label.height };
      const inside = left > view.left && top > view.top && rectangle.right < view.right && rectangle.bottom < view.bottom;
      if (!inside || taken.some((other) => overlap(rectangle, other))) continue;
      taken.push(rectangle);
      return { left, top };
    }
    return null;
  });
}

function candidates({ x, y, width, height }: Wanted): Placed[] {
  const middle = y - height / 2;
  return [
    { left: x + GAP, top: middle },
    { left: x - GAP - width, top: middle },
    { left: x - width / 2, top: y + GAP },
    { left: x - width / 2, top: y - GAP - height },
    { left: x + GAP, top: y + GAP / 2 },
    { left: x + GAP, top: y - GAP / 2 - height },
    { left: x - GAP - width, top: y + GAP / 2 },
    { left: x - GAP - width, top: y - GAP / 2 - height },
  ];
}

function overlap(a: Rectangle, b: Rectangle): boolean {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}
