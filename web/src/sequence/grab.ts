/** The pixels that a video element shows: read on the page, since some browsers take seconds to read a bitmap in a worker. */
import type { RawPicture } from '../model/protocol.ts';

let canvas: HTMLCanvasElement | null = null;

export function grab(element: HTMLVideoElement, width: number, height: number): RawPicture {
  canvas ??= document.createElement('canvas');
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  const context = canvas.getContext('2d', { willReadFrequently: true });
  if (!context) throw new Error('this browser gives no canvas to read a video with');
  context.imageSmoothingQuality = 'medium';
  context.drawImage(element, 0, 0, width, height);
  return { width, height, pixels: context.getImageData(0, 0, width, height).data as Uint8ClampedArray<ArrayBuffer> };
}
