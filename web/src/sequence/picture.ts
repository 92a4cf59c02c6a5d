/** Decoding, in the worker: what the browser knows by the browser, plain grey maps here. */
export interface Picture {
  width: number;
  height: number;
  /** Grey, or red, green, blue, alpha. */
  pixels: Uint8Array | Uint8ClampedArray<ArrayBuffer>;
  channels: 1 | 4;
}

/** The picture in a file, or an error that says why there is none. */
export async function decode(path: string, blob: Blob): Promise<Picture> {
  if (/\.(pgm|pnm)$/i.test(path)) {
    const bytes = new Uint8Array(await blob.arrayBuffer());
    return decodePgm(bytes) ?? decodeRare(bytes);
  }
  if (/\.(ppm|pbm|tiff?)$/i.test(path)) return decodeRare(new Uint8Array(await blob.arrayBuffer()));
  let bitmap: ImageBitmap;
  try {
    // No colour conversion: the host tool reads the numbers as they are in the file.
    bitmap = await createImageBitmap(blob, { colorSpaceConversion: 'none', premultiplyAlpha: 'none', imageOrientation: 'none' } as ImageBitmapOptions);
  } catch {
    throw new Error('it cannot be decoded as a picture; it may be damaged or cut short');
  }
  const picture = pixelsOf(bitmap);
  bitmap.close();
  return picture;
}

/** Kinds that no browser knows, by a module that loads when first needed. */
async function decodeRare(bytes: Uint8Array): Promise<Picture> {
  const pictures = await import('monorange-wasm-pictures');
  await pictures.init();
  const picture = new pictures.Picture(bytes);
  try {
    const pixels = new Uint8ClampedArray(picture.rgba() as Uint8Array<ArrayBuffer>);
    return { width: picture.width, height: picture.height, pixels, channels: 4 };
  } finally {
    picture.free();
  }
}

let canvas: OffscreenCanvas | null = null;

/** A bitmap's red, green, blue, alpha. */
export function pixelsOf(bitmap: ImageBitmap): Picture {
  const { width, height } = bitmap;
  if (canvas?.width !== width || canvas.height !== height) canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext('2d', { willReadFrequently: true });
  if (!context) throw new Error('this browser gives no canvas to decode pictures with');
  context.globalCompositeOperation = 'copy';
  context.drawImage(bitmap, 0, 0);
  return { width, height, pixels: context.getImageData(0, 0, width, height).data as Uint8ClampedArray<ArrayBuffer>, channels: 4 };
}

/** Rec. 709 luma in whole numbers, as the command line reads coloured pictures. */
export function luma(rgba: Picture['pixels']): Uint8Array {
  const grey = new Uint8Array(rgba.length / 4);
  for (let at = 0; at < grey.length; at += 1) {
    grey[at] = Math.floor((2126 * (rgba[4 * at] ?? 0) + 7152 * (rgba[4 * at + 1] ?? 0) + 722 * (rgba[4 * at + 2] ?? 0)) / 10_000);
  }
  return grey;
}

/** For the screen. */
export function bitmapOf({ width, height, pixels, channels }: Picture): Promise<ImageBitmap> {
  if (channels === 4) return createImageBitmap(new ImageData(pixels as Uint8ClampedArray<ArrayBuffer>, width, height));
  const shown = new Uint32Array(width * height);
  for (let at = 0; at < shown.length; at += 1) shown[at] = 0xff000000 | ((pixels[at] ?? 0) * 0x010101);
  return createImageBitmap(new ImageData(new Uint8ClampedArray(shown.buffer), width, height));
}

/** A binary grey map of 8 bits, or null for any other kind. */
export function decodePgm(bytes: Uint8Array): Picture | null {
  const head = /^P5\s+(?:#[^\n]*\n\s*)*(\d+)\s+(?:#[^\n]*\n\s*)*(\d+)\s+(?:#[^\n]*\n\s*)*255\s/.exec(
    String.fromCharCode(...bytes.subarray(0, 512)),
  );
  if (!head) return null;
  const [width, height] = [Number(head[1]), Number(head[2])];
  const pixels = bytes.subarray(head[0].length, head[0].length + width * height);
  if (pixels.length < width * height) {
    throw new Error(`it is cut short: ${pixels.length} of ${width * height} pixels`);
  }
  return { width, height, pixels, channels: 1 };
}
