import './theme/theme.css';
import './theme/layout.css';
import { init } from 'monorange-wasm';
import { byId } from './app/dom.ts';
import { say } from './app/messages.ts';
import { mountResult } from './app/result.ts';
import { Store } from './app/state.ts';
import { mountStatus } from './app/status.ts';
import { hashOf, withHash } from './app/url.ts';
import { CameraView } from './camera-view/camera-view.ts';
import { defaultLayers, mountLayers } from './camera-view/layers.ts';
import { Engine } from './engine/client.ts';
import { mountExport } from './export/menu.ts';
import { MapView } from './map/map-view.ts';
import { guessedRig } from './model/rig.ts';
import { registerOffline } from './offline/register.ts';
import { mountPlots } from './plots/plots.ts';
import { mountIncoming } from './sequence/incoming.ts';
import { PageSession, sentence } from './session.ts';
import { Setup } from './setup/setup.ts';
import { mountTheme } from './theme/switch.ts';
import { mountKeys } from './timeline/keys.ts';
import { Player } from './timeline/player.ts';
import { Timeline } from './timeline/timeline.ts';

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
  busy: null,
  secondsLeft: null,
});

async function start(): Promise<void> {
  mountTheme();
  mountLayers(store, () => history.replaceState(null, '', hashOf(store.state.rig, store.state.layers)));
  mountStatus(store);
  mountResult(store);
  const engine = new Engine();
  await init();
  const player = new Player(store, (frame) => engine.call('picture', { frame }));
  let undoButton: HTMLButtonElement | null = null;
  const session = new PageSession(store, engine, player, (steps) => undoButton && (undoButton.disabled = steps === 0));
  const camera = new CameraView(store);
  const map = new MapView(store, () => camera.ground);
  new Timeline(store, (frame) => player.show(frame));
  mountPlots(store, (frame) => player.show(frame));
  undoButton = new Setup(store, () => camera.ground, (before) => session.remember(before), () => session.undo(),
    (rig, rows) => engine.call('fitMount', { rig, rows }),
    {
      look: (board, files) => engine.call('board', { board, files }),
      mount: (index, along) => engine.call('boardMount', { index, along }),
      use: (file) => session.use(file),
    }).undoButton;
  undoButton.disabled = true;
  mountExport(store, engine, { 'camera.png': camera.canvas, 'map.png': map.canvas });
  mountKeys(store, player, () => camera.fit(), () => session.undo());
  mountIncoming((files) => void session.open(files));
  for (const id of ['sample', 'empty-sample']) byId(id).addEventListener('click', () => void session.openSample());
  byId('cancel').addEventListener('click', () => session.cancel());
  for (const id of ['camera', 'empty-camera']) byId(id).addEventListener('click', () => void session.openLive());
  store.on(['phase', 'results', 'sequence', 'busy'], ({ phase, results, sequence, busy }) => {
    document.body.dataset['phase'] = phase;
    byId('empty').hidden = phase !== 'empty' && phase !== 'starting';
    byId('camera-frame').classList.toggle('is-empty', phase === 'empty' || phase === 'starting');
    byId('cancel').hidden = phase !== 'running' && phase !== 'live' && !busy;
    byId('cancel').textContent = phase === 'live' ? 'Stop' : 'Cancel';
    byId('progress').textContent = phase === 'running' ? `${Math.round((100 * results.length) / (sequence?.frames.length ?? 1))} %` : '';
  });
  await session.showEmpty();
}

registerOffline();
void start().catch((error: unknown) => say(`The page could not start: ${sentence(error)}`));
