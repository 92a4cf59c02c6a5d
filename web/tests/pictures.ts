/** Small pictures for tests, as files. */
import { crc32, deflateSync } from 'node:zlib';

type Level = (u: number, v: number) => number;

/** A grey PNG. */
export function png(width: number, height: number, level: Level): Buffer {
  const rows = Buffer.alloc(height * (width + 1));
  for (let v = 0; v < height; v += 1) for (let u = 0; u < width; u += 1) rows[v * (width + 1) + 1 + u] = level(u, v);
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(height, 4);
  head.set([8, 0, 0, 0, 0], 8);
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  return Buffer.concat([signature, chunk('IHDR', head), chunk('IDAT', deflateSync(rows)), chunk('IEND', Buffer.alloc(0))]);
}

function chunk(kind: string, data: Buffer): Buffer {
  const body = Buffer.concat([Buffer.from(kind), data]);
  const [length, sum] = [Buffer.alloc(4), Buffer.alloc(4)];
  length.writeUInt32BE(data.length);
  sum.writeUInt32BE(crc32(body));
  return Buffer.concat([length, body, sum]);
}

/** A grey map (PGM). */
export function grey(width: number, height: number, level: Level): Buffer {
  const pixels = Buffer.alloc(width * height);
  for (let at = 0; at < pixels.length; at += 1) pixels[at] = level(at % width, Math.floor(at / width));
  return Buffer.concat([Buffer.from(`P5\n${width} ${height}\n255\n`), pixels]);
}

/** The grey of a corner of a room, of 320×240 pixels. */
export const corner = (u: number, v: number): number => (v > 150 ? 60 : u > 150 ? 180 : 120);

/** A rig for such pictures. */
export const RIG = '[camera]\nwidth = 320\nheight = 240\nfocal = [365.0, 365.0]\nprincipal = [160.0, 120.0]\n[mount]\nheight = 0.4\ntilt_deg = 12.0\n';
