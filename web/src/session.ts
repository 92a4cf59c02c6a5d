/** What is open on the page: opening files, a video or a camera, running, settings and their undoing. */
import { clearMessages, say } from './app/messages.ts';
import type { Store } from './app/state.ts';
import { Undo } from './app/undo.ts';
import { hashOf, withHash } from './app/url.ts';
import { defaultLayers } from './camera-view/layers.ts';
import type { Engine } from './engine/client.ts';
import type { SequenceInfo, SourceFile } from './model/protocol.ts';
import { CALIBRATION, CONTAINER, PICTURE, VIDEO } from './model/kinds.ts';
import { byExif, guessedRig, type Rig } from './model/rig.ts';
import { count } from './model/units.ts';
import { LiveCamera } from './sequence/live.ts';
import { Video } from './sequence/video.ts';
import type { Player } from './timeline/player.ts';

/** A video without a calibration is made smaller than this. */
const MOST_VIDEO_PIXELS = 640 * 480;
const SAMPLE = { frames: 300, walkers: 3, seed: 1 };

export class PageSession {
  readonly #store: Store;
  readonly #engine: Engine;
  readonly #player: Player;
  readonly undoing: Undo<Rig>;
  #runs = 0;
  /** The settings of a link are for the first pictures that are opened. */
  #linked = location.hash !== '';
  /** The rig as it was opened; the address says what was changed since. */
  #given = guessedRig(320, 240);
  #video: Video | null = null;
  #live: LiveCamera | null = null;
  /** Opens again what is open, for a worker that has just been started. */
  #again: (() => Promise<SequenceInfo>) | null = null;
  #problems: string[] = [];

  constructor(store: Store, engine: Engine, player: Player, undoable: (steps: number) => void) {
    [this.#store, this.#engine, this.#player] = [store, engine, player];
    this.undoing = new Undo(undoable);
    engine.onWanted = async (frame) => (await this.#video?.frame(frame)) ?? null;
    engine.onResults = ({ run: number, results, shown, secondsLeft }) => {
      if (number !== this.#runs) return shown?.picture.close();
      const last = results.at(-1)?.index ?? 0;
      this.#tellProblems(results.flatMap(({ problem }) => problem ?? []));
      store.set({ results: [...store.state.results, ...results], secondsLeft });
      if (shown && player.following) player.showWith(last, shown);
      else shown?.picture.close();
    };
    engine.onBusy = (busy) => store.set({ busy });
    engine.onRestart = () => void this.#recover();
    addEventListener('hashchange', () => this.#setRig(withHash(location.hash, this.#given, defaultLayers()).rig));
  }

  /** One sentence for all pictures that cannot be used. */
  #tellProblems(problems: string[]): void {
    if (problems.length === 0) return;
    this.#problems.push(...problems);
    const [first = ''] = this.#problems;
    const more = this.#problems.length - 1;
    say(more === 0 ? `${first}. It is skipped.` : `${first}. It is skipped, and so ${more === 1 ? 'is 1 more picture' : `are ${more} more pictures`}: the time line marks them.`, 'problem', 'skipped');
  }

  /** The first frame of the sample, already a range finder. */
  async showEmpty(): Promise<void> {
    const store = this.#store;
    store.set({ phase: 'empty' });
    performance.mark('ready');
    try {
      const { shown, result, rig } = await this.#engine.call('preview', { scan: false });
      if (store.state.phase !== 'empty') return shown.picture.close();
      this.#given = rig;
      store.set({ picture: shown.picture, results: [result], ...withHash(location.hash, rig, store.state.layers) });
      const scanned = await this.#engine.call('preview', { scan: true });
      scanned.shown.picture.close();
      if (store.state.phase === 'empty') store.set({ results: [scanned.result] });
    } catch (error) {
      say(sentence(error));
    }
  }

  /** A setting was changed for good: it goes into the address, can be undone, and the sequence runs again with it. */
  remember(before: Rig): void {
    this.undoing.push(before);
    this.#setRig(this.#store.state.rig);
  }

  undo(): void {
    const before = this.undoing.pop();
    if (before) this.#setRig(before);
  }

  #setRig(rig: Rig): void {
    const { layers, sequence, phase } = this.#store.state;
    this.#store.set({ rig });
    history.replaceState(null, '', hashOf(rig, layers));
    if (sequence && phase !== 'live') void this.#run();
  }

  async openSample(): Promise<void> {
    await this.#begin(() => this.#engine.call('sample', SAMPLE), []);
  }

  async open(files: SourceFile[]): Promise<void> {
    const found = files.find(({ path }) => VIDEO.test(path));
    if (found && !files.some(({ path }) => PICTURE.test(path))) return this.#openVideo(found, files.filter((file) => file !== found));
    if (files.length > 0) await this.#begin(() => this.#engine.call('open', { files }), files);
  }

  /** A rig or camera file that the page has made itself: as if it had been dropped, and it can be undone. */
  async use(file: SourceFile): Promise<void> {
    const before = this.#store.state.rig;
    await this.open([file]);
    if (this.#store.state.rig !== before) this.undoing.push(before);
  }

  async #openVideo({ path, blob }: SourceFile, files: SourceFile[]): Promise<void> {
    await this.#begin(async () => {
      // A calibration is for the pictures as they are; without one they need not be larger than what is looked for in them.
      const calibrated = files.some((file) => CALIBRATION.test(file.path));
      const next = await Video.open(path, blob, calibrated ? Infinity : MOST_VIDEO_PIXELS);
      this.#video?.close();
      this.#video = next;
      const { frames, interval, width, height } = next;
      return this.#engine.call('openVideo', { name: path, frames, interval, width, height, files });
    }, null);
  }

  /** `files`: what was given, where the open sequence may stay beside it. */
  async #begin(opening: () => Promise<SequenceInfo>, files: SourceFile[] | null): Promise<void> {
    const store = this.#store;
    clearMessages();
    const { phase: before, sequence: open } = store.state;
    const adds = files !== null && files.length > 0 && open !== null && !files.some(({ path }) => PICTURE.test(path) || CONTAINER.test(path));
    if (!adds) {
      this.stopLive();
      this.#engine.cancel();
    }
    store.set({ phase: 'opening' });
    const back = () => store.set({ phase: before === 'opening' || before === 'running' || before === 'live' ? (open ? 'cancelled' : 'empty') : before });
    try {
      const sequence = await opening();
      store.set({ busy: null });
      for (const note of sequence.notes) say(note, 'note');
      for (const warning of sequence.warnings) say(warning);
      // Files of no use change nothing: what is on show stays, and goes on.
      if (!sequence.used && adds) return store.set({ phase: before });
      if (adds) this.#engine.cancel();
      const rig = this.#rigFor(sequence, adds);
      this.#given = rig;
      if (!adds && (!this.#linked || sequence.frames.length === 0)) history.replaceState(null, '', location.pathname + location.search);
      this.#linked = false;
      if (sequence.frames.length === 0) {
        // Only a rig: it is tried on whatever is on show.
        return store.set({ rig, phase: before === 'opening' ? 'empty' : before, setupOpen: true });
      }
      this.#again = opening;
      this.#player.reset();
      if (!adds) this.undoing.clear();
      const { knownPoints } = store.state;
      store.set({
        sequence, results: [], frame: 0, tape: [], selected: null, pointer: null, knownPoints: adds ? knownPoints : [],
        ...(adds ? { rig } : withHash(location.hash, rig, store.state.layers)),
      });
      this.#player.show(0);
      await this.#run();
    } catch (error) {
      back();
      say(sentence(error));
    } finally {
      store.set({ busy: null });
    }
  }

  /** What was set stays, unless a file brings another. */
  #rigFor(sequence: SequenceInfo, adds: boolean): Rig {
    const now = this.#store.state.rig;
    const given = sequence.rig ?? byExif(guessedRig(sequence.width, sequence.height), sequence.focal);
    if (!adds || sequence.brought === 'rig' || now.width !== given.width || now.height !== given.height) return given;
    if (sequence.brought === 'camera') return { ...given, mount: now.mount, mountStd: now.mountStd, mountGuessed: now.mountGuessed, settings: now.settings, settingsToml: now.settingsToml };
    return now;
  }

  async #run(): Promise<void> {
    const store = this.#store;
    const number = ++this.#runs;
    this.#problems = [];
    this.#player.following = true;
    store.set({ phase: 'running', results: [], secondsLeft: null });
    try {
      const { end, warnings } = await this.#engine.call('run', { number, rig: store.state.rig });
      if (number !== this.#runs) return;
      for (const warning of warnings) say(warning);
      store.set({ phase: end, secondsLeft: null });
      // The last word of a run comes without a picture.
      if (this.#player.following) this.#player.show(store.state.results.length - 1);
    } catch (error) {
      if (number !== this.#runs) return;
      store.set({ phase: 'cancelled', secondsLeft: null });
      say(sentence(error));
    }
  }

  /** A worker that was lost has taken its sequence with it: it is opened again, and the person decides whether to run it. */
  async #recover(): Promise<void> {
    this.stopLive();
    if (!this.#again) return;
    try {
      await this.#again();
    } catch (error) {
      say(sentence(error));
    }
  }

  cancel(): void {
    if (this.#live) this.stopLive();
    else this.#engine.cancel();
  }

  /** The camera: pictures one after another, each dealt with before the next is taken, and kept. */
  async openLive(): Promise<void> {
    if (this.#live) return this.stopLive();
    const store = this.#store;
    clearMessages();
    this.#engine.cancel();
    try {
      const camera = await LiveCamera.open();
      this.#live = camera;
      const now = store.state.rig;
      const rig = now.width === camera.width && now.height === camera.height ? now : guessedRig(camera.width, camera.height);
      this.#runs += 1;
      this.#player.reset();
      this.#again = null;
      store.set({ phase: 'live', sequence: liveSequence(camera), results: [], frame: 0, tape: [], selected: null, knownPoints: [], rig });
      await this.#engine.call('startLive', { rig });
      const begin = performance.now();
      for (let index = 0; this.#live === camera; index += 1) {
        const { pixels, shown } = await camera.frame();
        const { result, edges } = await this.#engine.call('live', { picture: pixels, t: (performance.now() - begin) / 1000, index }, [pixels.pixels.buffer]);
        if (this.#live !== camera) {
          shown.close();
          break;
        }
        store.set({ results: [...store.state.results, result] });
        this.#player.showWith(index, { picture: shown, edges });
      }
    } catch (error) {
      this.stopLive();
      say(sentence(error));
    }
  }

  stopLive(): void {
    if (!this.#live) return;
    this.#live.close();
    this.#live = null;
    if (this.#store.state.phase === 'live') void this.#keepLive();
  }

  /** What the camera saw is a sequence now: it can be looked through, saved, and run again with other settings. */
  async #keepLive(): Promise<void> {
    this.#store.set({ phase: 'cancelled' });
    try {
      const sequence = await this.#engine.call('endLive', null);
      if (sequence.frames.length === 0 || this.#store.state.phase !== 'cancelled') return;
      this.#store.set({ phase: 'done', sequence });
      say(`${count(sequence.frames.length, 'picture')} of the camera ${sequence.frames.length === 1 ? 'is' : 'are'} kept until something else is opened.`, 'note');
    } catch (error) {
      say(sentence(error));
    }
  }
}

function liveSequence({ width, height }: LiveCamera): SequenceInfo {
  return {
    name: 'Camera', frames: [], times: new Float64Array(), width, height, rig: null, focal: null, truth: null, laser: null, motion: 'pictures',
    used: true, brought: '', notes: [], warnings: [],
  };
}

export function sentence(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
