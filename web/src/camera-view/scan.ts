/** The virtual scan over the picture: the free floor tinted, what bounds it as a line with its ±1σ. */
import { BEAM_KIND, type FrameResult } from '../model/protocol.ts';
import { beamsOf } from '../model/scan.ts';
import type { Point } from '../views/viewport.ts';
import type { Ground } from './ground.ts';
import type { Scene } from './overlay.ts';

export function drawScan(scene: Scene, ground: Ground, result: FrameResult): void {
  const { context, viewport, colours } = scene;
  const bottom = viewport.toScreen(0, ground.rig.height - 0.5).y;
  const at = (bearing: number, range: number): Point | null => {
    const { forward, left } = ground.rig.mount;
    const pixel = ground.project(forward + range * Math.cos(bearing), left + range * Math.sin(bearing));
    return pixel && viewport.toScreen(pixel.u, pixel.v);
  };
  const beams = beamsOf(result).map((beam) => ({
    ...beam,
    end: beam.free > 0 ? at(beam.bearing, beam.free) : null,
    place: beam.range > 0 ? at(beam.bearing, beam.range) : null,
  }));
  const floor = new Path2D();
  const bounds = new Path2D();
  const alone = new Path2D();
  beams.forEach((beam, index) => {
    const next = beams[index + 1];
    if (beam.end && next?.end) {
      floor.moveTo(beam.end.x, bottom);
      floor.lineTo(beam.end.x, beam.end.y);
      floor.lineTo(next.end.x, next.end.y);
      floor.lineTo(next.end.x, bottom);
    }
    const { place } = beam;
    if (!place) return;
    const [near, far] = [at(beam.bearing, Math.max(beam.range - beam.std, 0)), at(beam.bearing, beam.range + beam.std)];
    if (near && far) {
      bounds.moveTo(near.x, near.y);
      bounds.lineTo(far.x, far.y);
    }
    // What stands by itself has a shape of its own.
    if (beam.kind === BEAM_KIND.Obstacle) diamond(alone, place);
    else if (next?.place && next.kind === BEAM_KIND.Boundary) {
      bounds.moveTo(place.x, place.y);
      bounds.lineTo(next.place.x, next.place.y);
    }
  });
  context.save();
  context.globalAlpha = 0.25;
  context.fillStyle = colours.mapped;
  context.fill(floor);
  context.globalAlpha = 1;
  for (const [colour, wider] of [['rgb(0 0 0 / 55%)', 2], [colours.bound, 0]] as const) {
    context.strokeStyle = colour;
    context.lineWidth = 1.6 + wider;
    context.stroke(bounds);
    context.stroke(alone);
  }
  context.fillStyle = colours.bound;
  context.fill(alone);
  context.restore();
}

function diamond(path: Path2D, { x, y }: Point): void {
  const size = 4;
  path.moveTo(x, y - size);
  path.lineTo(x + size, y);
  path.lineTo(x, y + size);
  path.lineTo(x - size, y);
  path.closePath();
}
