import './theme/theme.css';
import './theme/layout.css';
import { init } from 'monorange-wasm';
import { byId } from './app/dom.ts';
import { mountKeys } from './app/keys.ts';
import { clearMessages, say } from './app/messages.ts';
import { Store } from './app/state.ts';
import { mountStatus } from './app/status.ts';
import { hashOf, withHash } from './app/url.ts';
import { CameraView } from './camera-view/camera-view.ts';
import { defaultLayers, mountLayers } from './camera-view/layers.ts';
import { Engine } from './engine/client.ts';
import type { SequenceInfo, SourceFile } from './engine/protocol.ts';
import { mountExport } from './export/menu.ts';
import { MapView } from './map/map-view.ts';
import { registerOffline } from './offline/register.ts';
import { mountPlots } from './plots/plots.ts';
import { mountIncoming } from './sequence/incoming.ts';
import { kindOf } from './sequence/kinds.ts';
import { LiveCamera } from './sequence/live.ts';
import { Video } from './sequence/video.ts';
import { guessedRig } from './setup/rig.ts';
import { Setup } from './setup/setup.ts';
import { mountTheme } from './theme/switch.ts';
import { Player } from './timeline/player.ts';
import { Timeline } from './timeline/timeline.ts';

/** A video without a calibration is made smaller than this. */
const MOST_VIDEO_PIXELS = 640 * 480;
const SAMPLE = { frames: 300, walkers: 3, seed: 1 };

const store = new Store({
  phase: 'starting',
  sequence: null,
  results: [],
  frame: 0,
  picture: null,
  edges: null,
  playing: false,
  ...withHash(location.hash, guessedRig(320, 240), defaultLayers()),
  selected: null,
  pointer: null,
  tape: [],
  setupOpen: false,
  knownPoints: [],
  pickingPoints: false,
  secondsLeft: null,
});

const engine = new Engine();
let runs = 0;
/** The settings of a link are for the first pictures that are opened. */
let linked = location.hash !== '';
/** The rig as it was opened; the address says what was changed since. */
let given = guessedRig(320, 240);
let video: Video | null = null;
let live: LiveCamera | null = null;
const player = new Player(store, (frame) => engine.call('picture', { frame }));

async function start(): Promise<void> {
  mountTheme();
  // A layer goes into the address too, but is no step back.
  mountLayers(store, () => history.replaceState(null, '', hashOf(store.state.rig, store.state.layers)));
  mountStatus(store);
  await init();
  const camera = new CameraView(store);
  const map = new MapView(store, () => camera.ground);
  new Timeline(store, (frame) => player.show(frame));
  mountPlots(store, (frame) => player.show(frame));
  new Setup(store, () => camera.ground, remember);
  mountExport(store, engine, { 'camera.png': camera.canvas, 'map.png': map.canvas });
  mountKeys(store, player, () => camera.fit());
  mountIncoming((files) => void open(files));
  for (const id of ['sample', 'empty-sample']) byId(id).addEventListener('click', () => void openSample());
  byId('cancel').addEventListener('click', () => (live ? stopLive() : engine.cancel()));
  for (const id of ['camera', 'empty-camera']) byId(id).addEventListener('click', () => void openLive());
  engine.onWanted = async (frame) => (await video?.frame(frame)) ?? null;
  engine.onResults = ({ run: number, results, shown, secondsLeft }) => {
    if (number !== runs) return shown?.picture.close();
    const last = results.at(-1)?.index ?? 0;
    for (const { problem } of results) if (problem) say(`${problem}. It is skipped.`);
    store.set({ results: [...store.state.results, ...results], secondsLeft });
    if (shown && player.following) player.showWith(last, shown);
    else shown?.picture.close();
  };
  store.on(['phase', 'results', 'sequence'], ({ phase, results, sequence }) => {
    document.body.dataset['phase'] = phase;
    byId('empty').hidden = phase !== 'empty' && phase !== 'starting';
    byId('camera-frame').classList.toggle('is-empty', phase === 'empty' || phase === 'starting');
    byId('cancel').hidden = phase !== 'running' && phase !== 'live';
    byId('cancel').textContent = phase === 'live' ? 'Stop' : 'Cancel';
    byId('progress').textContent = phase === 'running' ? `${Math.round((100 * results.length) / (sequence?.frames.length ?? 1))} %` : '';
  });
  addEventListener('hashchange', () => undo());
  await showEmpty();
}

/** The first frame of the sample, already a range finder. */
async function showEmpty(): Promise<void> {
  store.set({ phase: 'empty' });
  performance.mark('ready');
  try {
    const { picture, rig } = await engine.call('preview', null);
    if (store.state.phase !== 'empty') return picture.close();
    given = rig;
    store.set({ picture, ...withHash(location.hash, rig, store.state.layers) });
  } catch (error) {
    say(sentence(error));
  }
}

/** A setting was changed for good: it goes into the address, and the sequence runs again with it. */
function remember(): void {
  const hash = hashOf(store.state.rig, store.state.layers);
  if (hash === location.hash) return;
  history.pushState(null, '', hash);
  if (store.state.sequence && store.state.phase !== 'live') void run();
}

/** Back to the settings that the address names. */
function undo(): void {
  store.set(withHash(location.hash, given, defaultLayers()));
  if (store.state.sequence && store.state.phase !== 'live') void run();
}

async function openSample(): Promise<void> {
  await begin(() => engine.call('sample', SAMPLE));
}

async function open(files: SourceFile[]): Promise<void> {
  const found = files.find(({ path }) => kindOf(path) === 'video');
  if (found && !files.some(({ path }) => kindOf(path) === 'picture')) return openVideo(found, files.filter((file) => file !== found));
  if (files.length > 0) await begin(() => engine.call('open', { files }));
}

async function openVideo({ path, blob }: SourceFile, files: SourceFile[]): Promise<void> {
  await begin(async () => {
    // A calibration is for the pictures as they are; without one they need not be larger than what is looked for in them.
    const calibrated = files.some((file) => ['rig', 'camera'].includes(kindOf(file.path)));
    const next = await Video.open(path, blob, calibrated ? Infinity : MOST_VIDEO_PIXELS);
    video?.close();
    video = next;
    const { frames, interval, width, height } = next;
    return engine.call('openVideo', { name: path, frames, interval, width, height, files });
  });
}

async function begin(opening: () => Promise<SequenceInfo>): Promise<void> {
  clearMessages();
  stopLive();
  engine.cancel();
  const before = store.state.phase;
  store.set({ phase: 'opening' });
  try {
    const sequence = await opening();
    const rig = sequence.rig ?? guessedRig(sequence.width, sequence.height);
    given = rig;
    for (const note of sequence.notes) say(note, 'note');
    if (!linked || sequence.frames.length === 0) history.replaceState(null, '', location.pathname + location.search);
    linked = false;
    if (sequence.frames.length === 0) {
      // Only a rig: it is tried on whatever is on show.
      return store.set({ rig, phase: before === 'opening' ? 'empty' : before, setupOpen: true });
    }
    player.reset();
    store.set({ sequence, results: [], frame: 0, tape: [], selected: null, knownPoints: [], ...withHash(location.hash, rig, store.state.layers) });
    player.show(0);
    await run();
  } catch (error) {
    store.set({ phase: before === 'opening' || before === 'running' || before === 'live' ? (store.state.sequence ? 'cancelled' : 'empty') : before });
    say(sentence(error));
  }
}

async function run(): Promise<void> {
  const number = ++runs;
  player.following = true;
  store.set({ phase: 'running', results: [], secondsLeft: null });
  try {
    const end = await engine.call('run', { number, rig: store.state.rig });
    if (number !== runs) return;
    store.set({ phase: end, secondsLeft: null });
    // The last word of a run comes without a picture.
    if (player.following) player.show(store.state.results.length - 1);
  } catch (error) {
    if (number !== runs) return;
    store.set({ phase: 'cancelled', secondsLeft: null });
    say(sentence(error));
  }
}

/** The camera: pictures one after another, each dealt with before the next is taken. */
async function openLive(): Promise<void> {
  if (live) return stopLive();
  clearMessages();
  engine.cancel();
  try {
    const camera = await LiveCamera.open();
    live = camera;
    const rig = store.state.rig.width === camera.width && store.state.rig.height === camera.height ? store.state.rig : guessedRig(camera.width, camera.height);
    runs += 1;
    player.reset();
    store.set({ phase: 'live', sequence: liveSequence(camera), results: [], frame: 0, tape: [], selected: null, knownPoints: [], rig });
    await engine.call('startLive', { rig });
    const begin = performance.now();
    for (let index = 0; live === camera; index += 1) {
      const [shown, computed] = await Promise.all([camera.frame(), camera.frame()]);
      const { result, edges } = await engine.call('live', { picture: computed, t: (performance.now() - begin) / 1000, index }, [computed]);
      if (live !== camera) return shown.close();
      store.set({ results: [...store.state.results, result] });
      player.showWith(index, { picture: shown, edges });
    }
  } catch (error) {
    stopLive();
    say(sentence(error));
  }
}

function liveSequence({ width, height }: LiveCamera): SequenceInfo {
  return { name: 'Camera', frames: [], times: new Float64Array(), width, height, rig: null, truth: null, laser: null, motion: 'pictures', notes: [] };
}

function stopLive(): void {
  live?.close();
  live = null;
  if (store.state.phase === 'live') store.set({ phase: 'cancelled' });
}

function sentence(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

registerOffline();
void start().catch((error: unknown) => say(`The page could not start: ${sentence(error)}`));
