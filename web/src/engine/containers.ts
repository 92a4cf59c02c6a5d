/** Files that hold many: a ZIP archive, a recording of ROS 2. What is in them becomes the files of a folder. */
import type { Source } from 'monorange-wasm-session';
import { CONTAINER, PICTURE, RECORDING } from '../model/kinds.ts';
import type { SourceFile } from '../model/protocol.ts';
import type { Work } from './work.ts';

type Containers = typeof import('monorange-wasm-containers');

/** What a drop holds, and sentences about what was chosen and left out. */
export interface Contents {
  sources: Source[];
  notes: string[];
}

/** Bytes of a recording that are read before the worker listens again. */
const STRETCH = 4 << 20;
const LITTER = /(^|\/)(\.|__MACOSX\/)/;

let loading: Promise<Containers> | undefined;

function load(): Promise<Containers> {
  loading ??= import('monorange-wasm-containers').then(async (containers) => {
    await containers.init();
    return containers;
  });
  return loading;
}

const nameOf = (path: string) => path.slice(path.lastIndexOf('/') + 1);
const folderOf = (path: string) => path.slice(0, Math.max(0, path.lastIndexOf('/')));
const fileOf = (bytes: Uint8Array | string) => new Blob([bytes as Uint8Array<ArrayBuffer> | string]);

/** The files of a drop, with a container's contents in its place where there are no pictures beside it. */
export async function contentsOf(files: SourceFile[], work: Work): Promise<Contents> {
  const sources = files.map(({ path, blob }) => ({ path, blob: () => blob }));
  const [first] = files.filter(({ path }) => CONTAINER.test(path) && !LITTER.test(path));
  if (!first || files.some(({ path }) => PICTURE.test(path))) return { sources, notes: [] };
  if (RECORDING.test(first.path)) return recorded(files, first, work);
  const { sources: inside, notes } = await unpacked(first, work);
  return { sources: [...sources.filter(({ path }) => path !== first.path), ...inside], notes };
}

/** The files in an archive; those of a recording in it, where it holds no pictures. */
async function unpacked({ path, blob }: SourceFile, work: Work): Promise<Contents> {
  const archive = new (await load()).Archive(path, blob);
  const inside = archive.paths.map((path, index) => ({ path, blob: () => fileOf(archive.read(index)) }));
  const recording = inside.find(({ path }) => RECORDING.test(path) && !LITTER.test(path));
  if (!recording || inside.some(({ path }) => PICTURE.test(path))) return { sources: inside, notes: archive.notes };
  const files = inside.map(({ path, blob }) => ({ path, blob: RECORDING.test(path) || !CONTAINER.test(path) ? blob() : new Blob() }));
  const { sources, notes } = await recorded(files, files.find(({ path }) => path === recording.path)!, work);
  return { sources, notes: [...archive.notes, ...notes] };
}

/** A recording, of one file or of all in the folder that the first one is in, as pictures with text files beside them. */
async function recorded(files: SourceFile[], first: SourceFile, work: Work): Promise<Contents> {
  const { Recording } = await load();
  const folder = folderOf(first.path);
  const parts = folder ? files.filter(({ path }) => RECORDING.test(path) && folderOf(path) === folder && !LITTER.test(path)) : [first];
  const place = parts.length > 1 ? folder : first.path;
  const recording = new Recording(place, parts.map(({ path }) => path), parts.map(({ blob }) => blob));
  for (let more = true; more; await work.pause(`Reading ${nameOf(place)}`, recording.share)) more = recording.goOn(STRETCH);
  // What lists a recording's files is of no use beside them.
  const beside = files.filter(({ path }) => !CONTAINER.test(path) && nameOf(path) !== 'metadata.yaml');
  const texts: Record<string, string | undefined> = { 'times.txt': recording.times, 'odometry.csv': recording.wheels };
  // A rig that someone gives comes before the recording's own.
  if (!beside.some(({ path }) => path.endsWith('.toml'))) Object.assign(texts, { 'rig.toml': recording.rig, 'camera_info.yaml': recording.cameraInfo });
  const pictures = Array.from({ length: recording.frames }, (_, frame) => ({
    path: `${place}/${String(frame).padStart(6, '0')}.pgm`, blob: () => fileOf(recording.picture(frame)),
  }));
  const given = beside.map(({ path, blob }) => ({ path, blob: () => blob }));
  const own = Object.entries(texts).flatMap(([name, text]) => (text === undefined ? [] : [{ path: `${place}/${name}`, blob: () => fileOf(text) }]));
  const others = files.filter((file) => CONTAINER.test(file.path) && !parts.includes(file) && !LITTER.test(file.path));
  const left = others.map(({ path }) => `${nameOf(path)} is not used: open one recording at a time.`);
  return { sources: [...given, ...own.filter(({ path }) => !given.some((file) => file.path === path)), ...pictures], notes: [...recording.notes, ...left] };
}
