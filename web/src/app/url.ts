/** Settings in the address: a link or a reload gives them back. */
import { DEGREE, fieldOfView, guessedRig, SET_MOUNT_STD, type Rig } from '../model/rig.ts';

const MOUNT = [['height', 1], ['tilt', DEGREE], ['roll', DEGREE], ['yaw', DEGREE]] as const;

/** The address's part after `#` for these settings. */
export function hashOf(rig: Rig, layers: Record<string, boolean>): string {
  const settings = new URLSearchParams();
  for (const [name, factor] of MOUNT) settings.set(name, String(Number((rig.mount[name] / factor).toPrecision(7))));
  if (rig.guessed) settings.set('view', String(Number(((2 * Math.atan(rig.width / 2 / rig.focal[0])) / DEGREE).toPrecision(5))));
  const off = Object.keys(layers).filter((name) => !layers[name]);
  if (off.length > 0) settings.set('off', off.join('.'));
  return `#${settings}`;
}

/** The rig and layers with the address's settings over them; what is not a number is passed over. */
export function withHash(hash: string, rig: Rig, layers: Record<string, boolean>): { rig: Rig; layers: Record<string, boolean> } {
  const settings = new URLSearchParams(hash.replace(/^#/, ''));
  const read = (name: string): number | null => {
    const text = settings.get(name);
    const value = Number(text);
    return text !== null && text !== '' && Number.isFinite(value) ? value : null;
  };
  const mount = { ...rig.mount };
  for (const [name, factor] of MOUNT) {
    const value = read(name);
    if (value !== null && (name !== 'height' || value > 0)) mount[name] = value * factor;
  }
  const view = read('view');
  // Five digits of what it is are no other angle.
  const other = view !== null && view > 1 && view < 170 && Math.abs(view - fieldOfView(rig) / DEGREE) > 0.01;
  const { focal, principal, focalStd, source } = rig.guessed && other ? guessedRig(rig.width, rig.height, view * DEGREE) : rig;
  const off = new Set((settings.get('off') ?? '').split('.'));
  const told = rig.mountGuessed && (['height', 'tilt'] as const).some((name) => Math.abs(mount[name] - rig.mount[name]) > 1e-6);
  const known = told ? { mountGuessed: false, mountStd: { ...SET_MOUNT_STD } } : {};
  return { rig: { ...rig, mount, focal, principal, focalStd, source, ...known }, layers: Object.fromEntries(Object.keys(layers).map((name) => [name, settings.has('off') ? !off.has(name) : (layers[name] ?? true)])) };
}
