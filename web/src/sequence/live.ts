import type { RawPicture } from '../model/protocol.ts';
import { grab } from './grab.ts';

/** A live camera: frames are handed on as fast as they are dealt with, never queued. */
export class LiveCamera {
  readonly #stream: MediaStream;
  readonly #element: HTMLVideoElement;

  private constructor(stream: MediaStream, element: HTMLVideoElement) {
    [this.#stream, this.#element] = [stream, element];
  }

  /** Throws a sentence where there is no camera or no leave to use it. */
  static async open(): Promise<LiveCamera> {
    if (!navigator.mediaDevices) throw new Error('This browser gives no camera to pages that are not served over HTTPS or from this machine.');
    let stream: MediaStream;
    try {
      stream = await navigator.mediaDevices.getUserMedia({ video: { facingMode: 'environment', width: { ideal: 640 } }, audio: false });
    } catch (error) {
      const denied = error instanceof DOMException && error.name === 'NotAllowedError';
      throw new Error(denied ? 'The camera may not be used: allow it in the address bar, then press Camera again.' : 'No camera was found. Plug one in, or open pictures or a video.');
    }
    const element = document.createElement('video');
    element.muted = true;
    element.playsInline = true;
    element.srcObject = stream;
    await element.play();
    return new LiveCamera(stream, element);
  }

  get width(): number {
    return this.#element.videoWidth;
  }

  get height(): number {
    return this.#element.videoHeight;
  }

  /** What it sees now: for the worker, and for the screen. */
  async frame(): Promise<{ pixels: RawPicture; shown: ImageBitmap }> {
    const pixels = grab(this.#element, this.width, this.height);
    return { pixels, shown: await createImageBitmap(new ImageData(pixels.pixels, pixels.width, pixels.height)) };
  }

  close(): void {
    for (const track of this.#stream.getTracks()) track.stop();
    this.#element.srcObject = null;
  }
}
