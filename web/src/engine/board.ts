/** A printed chessboard: its pictures are decoded one after another, looked through, and tell the camera and the mount. */
import type { Board, BoardPicture, BoardResult, Calls, SourceFile } from '../model/protocol.ts';
import { decode } from './files.ts';
import type { Work } from './work.ts';

type BoardPictures = InstanceType<(typeof import('monorange-wasm-board'))['BoardPictures']>;

/** Of a small picture's longer side. */
const SMALL = 960;
/** As pictures of a drive have it. */
const MOST_PIXELS = 64_000_000;

/** What the mount is told from, until other pictures come. */
let looked: BoardPictures | null = null;

export async function calibrate(board: Board, files: SourceFile[], work: Work): Promise<BoardResult> {
  const { BoardPictures, init } = await import('monorange-wasm-board');
  await init();
  looked?.free();
  looked = null;
  const found = new BoardPictures(board.columns, board.rows, board.square);
  looked = found;
  const pictures: BoardPicture[] = [];
  for (const [index, { path, blob }] of files.entries()) {
    await work.pause('Looking for the board', index / files.length);
    pictures.push(await look(found, index, path.slice(path.lastIndexOf('/') + 1), blob));
  }
  const answer = { camera: null, warnings: [], pictures };
  try {
    const told = found.calibrate();
    const { width, height, rms, warnings, reasons, std } = told;
    const [focal, principal, pixelStd] = [told.focal, told.principal, told.pixel_std].map((pair) => [...pair] as [number, number]);
    const camera = { width, height, focal: focal!, principal: principal!, pixelStd: pixelStd!, distortion: [...told.distortion], std: [...std], rms };
    const each = told.picture_rms;
    told.free();
    return { camera, problem: '', warnings, pictures: pictures.map((picture, index) => ({ ...picture, reason: reasons[index] ?? '', rms: each[index] ?? 0 })) };
  } catch (error) {
    return { ...answer, problem: error instanceof Error ? error.message : String(error) };
  }
}

export function mountOf(index: number, along: boolean): Calls['boardMount']['answer'] {
  if (!looked) throw new Error('Choose pictures of the board first.');
  const [height = 0, tilt = 0, roll = 0, yaw = 0, ...std] = looked.mount(index, along);
  return { mount: { height, tilt, roll, yaw }, std: { height: std[0] ?? 0, tilt: std[1] ?? 0, roll: std[2] ?? 0, yaw: std[3] ?? 0 } };
}

async function look(found: BoardPictures, index: number, name: string, blob: Blob): Promise<BoardPicture> {
  try {
    const { width, height, data } = await pixelsOf(blob);
    const corners = found.add(name, width, height, new Uint8Array(data.buffer));
    const scale = Math.min(1, SMALL / Math.max(width, height));
    const small = await createImageBitmap(new ImageData(data, width, height), { resizeWidth: Math.round(width * scale), resizeHeight: Math.round(height * scale) });
    return { name, reason: found.reason(index), rms: 0, width, height, corners, small };
  } catch (error) {
    const reason = `cannot be used: ${error instanceof Error ? error.message : String(error)}`;
    return { name, reason, rms: 0, width: 0, height: 0, corners: found.refuse(name, reason), small: null };
  }
}

async function pixelsOf(blob: Blob): Promise<{ width: number; height: number; data: Uint8ClampedArray<ArrayBuffer> }> {
  // Turned upright as the photograph says; no colour conversion, as everywhere on this page.
  const bitmap = await createImageBitmap(blob, { colorSpaceConversion: 'none', premultiplyAlpha: 'none' }).catch(() => null);
  if (!bitmap) {
    const { width, height, pixels } = await decode(new Uint8Array(await blob.arrayBuffer()));
    return { width, height, data: new Uint8ClampedArray(pixels) };
  }
  const { width, height } = bitmap;
  try {
    if (width * height > MOST_PIXELS) throw new Error(`it has ${width} × ${height} pixels; make it smaller`);
    const context = new OffscreenCanvas(width, height).getContext('2d', { willReadFrequently: true });
    if (!context) throw new Error('this browser gives no canvas to decode pictures with');
    context.drawImage(bitmap, 0, 0);
    return { width, height, data: context.getImageData(0, 0, width, height).data };
  } finally {
    bitmap.close();
  }
}
