/** A video file: its frames are sought when they are wanted, so that a long one takes no memory. */
const FRAMES_PER_SECOND = 10;

export class Video {
  readonly #element: HTMLVideoElement;
  readonly frames: number;
  readonly interval = 1 / FRAMES_PER_SECOND;
  #queue: Promise<unknown> = Promise.resolve();

  private constructor(element: HTMLVideoElement) {
    this.#element = element;
    this.frames = Math.max(1, Math.floor(element.duration * FRAMES_PER_SECOND));
  }

  /** Throws a sentence where the browser cannot play the file. */
  static async open(name: string, blob: Blob): Promise<Video> {
    const element = document.createElement('video');
    element.muted = true;
    element.preload = 'auto';
    element.playsInline = true;
    element.src = URL.createObjectURL(blob);
    await new Promise<void>((done, fail) => {
      element.onloadeddata = () => done();
      element.onerror = () => fail(new Error(`${name} cannot be played by this browser. Save it as MP4 (H.264) or WebM, or as pictures.`));
    });
    if (!Number.isFinite(element.duration)) throw new Error(`${name} does not say how long it is. Save it again, or as pictures.`);
    return new Video(element);
  }

  get width(): number {
    return this.#element.videoWidth;
  }

  get height(): number {
    return this.#element.videoHeight;
  }

  /** One seek at a time: a second one would cancel the first. */
  frame(index: number): Promise<ImageBitmap> {
    const next = this.#queue.then(() => this.#seek((index + 0.5) * this.interval));
    this.#queue = next.catch(() => undefined);
    return next;
  }

  async #seek(time: number): Promise<ImageBitmap> {
    const element = this.#element;
    await new Promise<void>((done, fail) => {
      element.onseeked = () => done();
      element.onerror = () => fail(new Error('the video is damaged there'));
      element.currentTime = Math.min(time, element.duration);
    });
    return createImageBitmap(element);
  }

  close(): void {
    URL.revokeObjectURL(this.#element.src);
    this.#element.removeAttribute('src');
  }
}
