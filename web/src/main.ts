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
import { guessedRig } from './setup/rig.ts';
import { Setup } from './setup/setup.ts';
import { mountTheme } from './theme/switch.ts';
import { Player } from './timeline/player.ts';
import { Timeline } from './timeline/timeline.ts';

const SAMPLE = { frames: 300, walkers: 3, seed: 1 };

const store = new Store({
  phase: 'starting',
  sequence: null,
  results: [],
  frame: 0,
  picture: null,
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
const player = new Player(store, (frame) => engine.call('picture', { frame }));

async function start(): Promise<void> {
  mountTheme();
  mountLayers(store);
  mountStatus(store);
  await init();
  performance.mark('wasm-ready');
  const camera = new CameraView(store);
  const map = new MapView(store, () => camera.ground);
  new Timeline(store, (frame) => player.show(frame));
  mountPlots(store, (frame) => player.show(frame));
  new Setup(store, () => camera.ground, remember);
  mountExport(store, engine, { 'camera.png': camera.canvas, 'map.png': map.canvas });
  mountKeys(store, player, () => camera.fit());
  mountIncoming((files) => void open(files));
  for (const id of ['sample', 'empty-sample']) byId(id).addEventListener('click', () => void openSample());
  byId('cancel').addEventListener('click', () => engine.cancel());
  engine.onResults = ({ results, picture, secondsLeft }) => {
    const last = results.at(-1)?.index ?? 0;
    store.set({ results: [...store.state.results, ...results], secondsLeft });
    if (picture && player.following) player.showWith(last, picture);
    else picture?.close();
  };
  store.on(['phase', 'results', 'sequence'], ({ phase, results, sequence }) => {
    byId('empty').hidden = phase !== 'empty' && phase !== 'starting';
    byId('camera-frame').classList.toggle('is-empty', phase === 'empty' || phase === 'starting');
    byId('cancel').hidden = phase !== 'running';
    byId('progress').textContent = phase === 'running' ? `${Math.round((100 * results.length) / (sequence?.frames.length ?? 1))} %` : '';
  });
  addEventListener('hashchange', () => store.set(withHash(location.hash, store.state.rig, store.state.layers)));
  await showEmpty();
}

/** The first frame of the sample, already a range finder. */
async function showEmpty(): Promise<void> {
  store.set({ phase: 'empty' });
  try {
    const { picture, rig } = await engine.call('preview', null);
    if (store.state.phase !== 'empty') return picture.close();
    store.set({ picture, ...withHash(location.hash, rig, store.state.layers) });
  } catch (error) {
    say(sentence(error));
  }
}

function remember(): void {
  const hash = hashOf(store.state.rig, store.state.layers);
  if (hash !== location.hash) history.pushState(null, '', hash);
}

async function openSample(): Promise<void> {
  await begin(() => engine.call('sample', SAMPLE));
}

async function open(files: SourceFile[]): Promise<void> {
  if (files.length === 0) return;
  await begin(() => engine.call('open', { files }));
}

async function begin(opening: () => Promise<SequenceInfo>): Promise<void> {
  clearMessages();
  engine.cancel();
  const before = store.state.phase;
  store.set({ phase: 'opening' });
  try {
    const sequence = await opening();
    player.reset();
    const rig = sequence.rig ?? guessedRig(sequence.width, sequence.height);
    store.set({ sequence, results: [], frame: 0, tape: [], selected: null, knownPoints: [], rig });
    for (const note of sequence.notes) say(note, 'note');
    player.show(0);
    await run();
  } catch (error) {
    store.set({ phase: before === 'opening' ? 'empty' : before });
    say(sentence(error));
  }
}

async function run(): Promise<void> {
  player.following = true;
  store.set({ phase: 'running', results: [], secondsLeft: null });
  const end = await engine.call('run', { rig: store.state.rig, motion: 'auto' });
  store.set({ phase: end, secondsLeft: null });
}

function sentence(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

registerOffline();
void start().catch((error: unknown) => say(`The page could not start: ${sentence(error)}`));
