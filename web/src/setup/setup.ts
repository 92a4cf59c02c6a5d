/** Set-up: which camera, how it sits, and known floor points to fit the mount from; the grid follows live. */
import { byId, element } from '../app/dom.ts';
import { say } from '../app/messages.ts';
import type { FloorPoint, Store } from '../app/state.ts';
import type { Ground } from '../camera-view/ground.ts';
import { save } from '../app/save.ts';
import type { BoardTools } from './board.ts';
import { fitOf, rowsOf, type MountFit } from './fit.ts';
import type { FittedMount } from '../model/protocol.ts';
import { DEGREE, fieldOfView, guessedRig, SET_MOUNT_STD, type Mount, type Rig } from '../model/rig.ts';
import { rigToml } from '../model/rig-toml.ts';
import './setup.css';

type FitMount = (rig: Rig, rows: Float64Array) => Promise<FittedMount>;

interface Slider {
  name: keyof Mount | 'fieldOfView';
  label: string;
  unit: string;
  least: number;
  most: number;
  step: number;
  factor: number;
}

const SLIDERS: Slider[] = [
  { name: 'height', label: 'Height', unit: 'm', least: 0.05, most: 2.5, step: 0.005, factor: 1 },
  { name: 'tilt', label: 'Tilt', unit: '° down', least: -10, most: 80, step: 0.1, factor: DEGREE },
  { name: 'roll', label: 'Roll', unit: '°', least: -15, most: 15, step: 0.1, factor: DEGREE },
  { name: 'yaw', label: 'Yaw', unit: '° left', least: -45, most: 45, step: 0.1, factor: DEGREE },
];
const FIELD_OF_VIEW: Slider = { name: 'fieldOfView', label: 'View angle', unit: '°', least: 20, most: 120, step: 0.5, factor: DEGREE };

export class Setup {
  readonly #store: Store;
  readonly #ground: () => Ground | null;
  readonly #commit: (before: Rig) => void;
  readonly #fitMount: FitMount;
  /** The rig before a slider began to move. */
  #before: Rig | null = null;
  readonly #mountWords = element('p', {});
  readonly undoButton = element('button', { class: 'button' }, 'Undo');
  readonly #camera = element('section', {});
  readonly #cameraWords = element('p', {});
  readonly #points = element('section', {});
  readonly #fields: (() => void)[] = [];
  #fit: MountFit | string | null = null;

  /** `commit` is called when a setting has been changed for good, not while a slider moves, with what was before. */
  constructor(store: Store, ground: () => Ground | null, commit: (before: Rig) => void, undo: () => void, fitMount: FitMount, board: BoardTools) {
    [this.#store, this.#ground, this.#commit, this.#fitMount] = [store, ground, commit, fitMount];
    this.undoButton.addEventListener('click', undo);
    const toggle = byId('setup-toggle');
    toggle.addEventListener('click', () => store.set({ setupOpen: !store.state.setupOpen }));
    byId('setup').replaceChildren(
      element('header', { class: 'setup-head' }, element('h2', {}, 'Set-up'),
        element('button', { class: 'button', click: () => store.set({ setupOpen: false, pickingPoints: false }) }, 'Close')),
      this.#camera,
      element('section', {}, element('h3', {}, 'How the camera sits'), this.#mountWords, ...SLIDERS.map((slider) => this.#slider(slider))),
      boardFold(store, board),
      this.#points,
      element('div', { class: 'row' },
        element('button', { class: 'button primary', click: () => save('rig.toml', rigToml(store.state.rig)) }, 'Save rig.toml'),
        this.undoButton),
    );
    const view = this.#slider(FIELD_OF_VIEW);
    this.#camera.append(element('h3', {}, 'Camera'), this.#cameraWords, view, element('div', { class: 'row' },
      element('button', { class: 'button', click: () => byId('files').click() }, 'Open a camera file…')));
    store.on(['setupOpen'], ({ setupOpen }) => {
      byId('setup').hidden = !setupOpen;
      toggle.setAttribute('aria-expanded', String(setupOpen));
    });
    store.on(['rig'], ({ rig }) => {
      this.#cameraWords.textContent = cameraWords(rig);
      this.#mountWords.textContent = mountWords(rig);
      view.hidden = !rig.guessed;
      for (const refresh of this.#fields) refresh();
    });
    store.on(['knownPoints'], () => (this.#fit = null));
    store.on(['knownPoints', 'pickingPoints', 'rig'], () => this.#drawPoints());
  }

  #slider(slider: Slider): HTMLElement {
    const { name, label, unit, least, most, step, factor } = slider;
    const numbers = { min: String(least), max: String(most), step: String(step) };
    const commit = () => this.#done();
    const range = element('input', { type: 'range', 'aria-label': label, ...numbers, change: commit });
    const field = element('input', { type: 'number', 'aria-label': `${label} in ${unit}`, step: String(step) });
    range.addEventListener('input', () => this.#set(name, Number(range.value) * factor));
    field.addEventListener('change', () => {
      const value = Number(field.value);
      if (field.value.trim() === '' || !Number.isFinite(value) || value < least || value > most) {
        say(`${label} must be between ${least} and ${most} ${unit}.`, 'problem', label);
        field.value = shown();
        return;
      }
      this.#set(name, value * factor);
      field.value = shown();
      this.#done();
    });
    const current = () => {
      const { rig } = this.#store.state;
      return (name === 'fieldOfView' ? fieldOfView(rig) : rig.mount[name]) / factor;
    };
    const shown = () => current().toFixed(step < 0.01 ? 3 : 1);
    const refresh = () => {
      range.value = String(current());
      if (document.activeElement !== field) field.value = shown();
    };
    this.#fields.push(refresh);
    return element('div', { class: 'slider' }, element('span', {}, label), range, element('span', { class: 'field' }, field, element('span', {}, unit)));
  }

  #set(name: keyof Mount | 'fieldOfView', value: number): void {
    const { rig } = this.#store.state;
    this.#before ??= rig;
    if (name === 'fieldOfView') {
      const { focal, principal, focalStd, source } = guessedRig(rig.width, rig.height, value);
      this.#store.set({ rig: { ...rig, focal, principal, focalStd, source } });
    } else this.#store.set({ rig: withMount(rig, { ...rig.mount, [name]: value }) });
  }

  /** A setting was changed for good. */
  #done(): void {
    const before = this.#before;
    this.#before = null;
    if (before) this.#commit(before);
  }

  #drawPoints(): void {
    const { knownPoints, pickingPoints } = this.#store.state;
    const pick = element('button', { class: 'button', 'aria-pressed': String(pickingPoints), click: () =>
      this.#store.set({ pickingPoints: !pickingPoints }) }, pickingPoints ? 'Stop clicking' : 'Click floor points');
    const fit = element('button', { class: 'button', click: () => void this.#fitNow() }, 'Fit the mount');
    fit.disabled = knownPoints.length < 2;
    const forget = element('button', { class: 'button', click: () => this.#store.set({ knownPoints: [] }) }, 'Forget them');
    forget.hidden = knownPoints.length === 0;
    this.#points.replaceChildren(
      element('h3', {}, 'I know these points'),
      element('p', {}, pickingPoints
        ? 'Press on a point of the floor in the camera view, then write how far ahead and how far to the left of the robot it is.'
        : 'Floor points of known position tell how the camera really sits: two or more, near and far, left and right.'),
      ...(knownPoints.length > 0 ? [this.#table(knownPoints)] : []),
      element('div', { class: 'row' }, pick, fit, forget),
      ...this.#fitWords(),
    );
  }

  #table(points: FloorPoint[]): HTMLElement {
    const rows = points.map((point, index) => {
      const input = (axis: 'x' | 'y', name: string) => {
        const field = element('input', { type: 'number', step: '0.01', value: String(point[axis]), 'aria-label': `Point ${index + 1}, ${name} in metres` });
        field.addEventListener('change', () => {
          const changed = points.map((other, at) => (at === index ? { ...other, [axis]: Number(field.value) } : other));
          this.#store.set({ knownPoints: changed });
        });
        return element('td', {}, field);
      };
      const seen = this.#ground()?.sight(point.u, point.v);
      const off = typeof seen === 'object' ? `${(Math.hypot(seen.x - point.x, seen.y - point.y) * 100).toFixed(1)} cm` : '–';
      return element('tr', {}, element('th', { scope: 'row' }, String(index + 1)), input('x', 'ahead'), input('y', 'to the left'), element('td', {}, off),
        element('td', {}, element('button', { class: 'tool', 'aria-label': `Remove point ${index + 1}`, click: () =>
          this.#store.set({ knownPoints: points.filter((_, at) => at !== index) }) }, '✕')));
    });
    const head = ['', 'ahead, m', 'left, m', 'off by', ''].map((name) => element('th', { scope: 'col' }, name));
    return element('table', { class: 'points' }, element('thead', {}, element('tr', {}, ...head)), element('tbody', {}, ...rows));
  }

  async #fitNow(): Promise<void> {
    const { rig, knownPoints } = this.#store.state;
    try {
      const fit = fitOf(await this.#fitMount(rig, rowsOf(knownPoints)), rig);
      this.#fit = fit;
      this.#store.set({ rig: { ...rig, mount: fit.mount, mountStd: fit.std, mountGuessed: false } });
      this.#commit(rig);
    } catch (error) {
      this.#fit = error instanceof Error ? error.message : String(error);
    }
    this.#drawPoints();
  }

  #fitWords(): HTMLElement[] {
    const fit = this.#fit;
    if (fit === null) return [];
    if (typeof fit === 'string') return [element('p', { class: 'problem', role: 'alert' }, fit)];
    const { mount, std } = fit;
    const angle = (name: 'tilt' | 'roll' | 'yaw') => `${name} ${(mount[name] / DEGREE).toFixed(2)}° ± ${(std[name] / DEGREE).toFixed(2)}`;
    const words = [`height ${mount.height.toFixed(3)} m ± ${std.height.toFixed(3)}`, angle('tilt'), angle('roll'), angle('yaw')];
    const result = element('p', { class: 'fit-result', role: 'status' }, `Fitted: ${words.join(', ')}. Points are off by ${(fit.rms * 100).toFixed(1)} cm rms.`);
    return fit.warning ? [result, element('p', { class: 'problem' }, fit.warning)] : [result];
  }
}

/** What few need loads when they open it. */
function boardFold(store: Store, tools: BoardTools): HTMLElement {
  const home = element('div', {});
  const fold = element('details', { class: 'board' }, element('summary', {}, element('h3', {}, 'Calibrate with a board')), home);
  fold.addEventListener('toggle', () => {
    import('./board.ts').then(({ BoardPanel }) => new BoardPanel(home, store, tools), () => say('The calibration could not be loaded: reload the page.'));
  }, { once: true });
  return fold;
}

function cameraWords(rig: Rig): string {
  const size = `${rig.width} × ${rig.height}`;
  if (rig.guessed) {
    return `${size}, not calibrated: the view angle is ${rig.source === 'a guess' ? rig.source : `from ${rig.source}, ± ${Math.round(100 * rig.focalStd)} %, a guess`}, and every range with it. Open a camera file (ROS, OpenCV, Kalibr or rig.toml) for real ones.`;
  }
  return `${size}, focal length ${rig.focal[0].toFixed(1)} px, from ${rig.source}.`;
}

/** A mount that someone sets is no guess any more, once height or tilt is theirs. */
export function withMount(rig: Rig, mount: Mount): Rig {
  const told = rig.mountGuessed && (mount.height !== rig.mount.height || mount.tilt !== rig.mount.tilt);
  return told ? { ...rig, mount, mountStd: { ...SET_MOUNT_STD }, mountGuessed: false } : { ...rig, mount };
}

function mountWords({ mountGuessed, mountStd }: Rig): string {
  if (mountGuessed) return 'A guess, and every range with it: measure the height, and tilt the horizon to where it is.';
  return `Height ± ${(mountStd.height * 100).toFixed(1)} cm, tilt ± ${(mountStd.tilt / DEGREE).toFixed(2)}°.`;
}
