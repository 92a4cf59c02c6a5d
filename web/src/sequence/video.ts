/** A video file: its frames are sought when they are wanted, so that a long one takes no memory. */
import type { RawPicture } from '../model/protocol.ts';
import { grab } from './grab.ts';

const FRAMES_PER_SECOND = 10;

export class Video {
  readonly #element: HTMLVideoElement;
  readonly frames: number;
  readonly interval = 1 / FRAMES_PER_SECOND;
  #queue: Promise<unknown> = Promise.resolve();

  readonly width: number;
  readonly height: number;

  private constructor(element: HTMLVideoElement, mostPixels: number) {
    this.#element = element;
    const { videoWidth, videoHeight } = element;
    const factor = Math.min(1, Math.sqrt(mostPixels / (videoWidth * videoHeight)));
    [this.width, this.height] = [Math.round(videoWidth * factor), Math.round(videoHeight * factor)];
    this.frames = Math.max(1, Math.floor(element.duration * FRAMES_PER_SECOND));
  }

  /** With at most so many pixels a frame. Throws a sentence where the browser cannot play the file. */
  static async open(name: string, blob: Blob, mostPixels: number): Promise<Video> {
    const element = document.createElement('video');
    element.muted = true;
    element.preload = 'auto';
    element.playsInline = true;
    element.src = URL.createObjectURL(blob);
    await new Promise<void>((done, fail) => {
      element.onloadeddata = () => done();
      element.onerror = () => fail(new Error(`${name} cannot be played by this browser. Save it as MP4 (H.264) or WebM, or as pictures.`));
    });
    // What a browser has recorded says how long it is only once its end was looked for.
    if (!Number.isFinite(element.duration)) await seek(element, Number.MAX_SAFE_INTEGER);
    if (!Number.isFinite(element.duration)) throw new Error(`${name} does not say how long it is. Save it again, or as pictures.`);
    return new Video(element, mostPixels);
  }

  /** One seek at a time: a second one would cancel the first. */
  frame(index: number): Promise<RawPicture> {
    const next = this.#queue.then(() => this.#seek((index + 0.5) * this.interval));
    this.#queue = next.catch(() => undefined);
    return next;
  }

  async #seek(time: number): Promise<RawPicture> {
    const element = this.#element;
    await seek(element, Math.min(time, element.duration));
    return grab(element, this.width, this.height);
  }

  close(): void {
    URL.revokeObjectURL(this.#element.src);
    this.#element.removeAttribute('src');
  }
}

function seek(element: HTMLVideoElement, time: number): Promise<void> {
  return new Promise((done, fail) => {
    element.onseeked = () => done();
    element.onerror = () => fail(new Error('the video is damaged there'));
    element.currentTime = time;
  });
}
