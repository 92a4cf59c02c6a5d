/** The modules that load when they are first needed: file formats and the sample, the scan, rare pictures. */
import { hasSimd, init as initPipeline, Pipeline, type Rig } from 'monorange-wasm';
import { init as initSession, type Readers } from 'monorange-wasm-session';
import type { FittedMount } from '../model/protocol.ts';

export type Files = typeof import('monorange-wasm-files');

/** Makes the modules ready that every sequence needs. */
export async function init(): Promise<void> {
  await Promise.all([initPipeline(), initSession()]);
}

let loading: Promise<Files> | undefined;

export function loadFiles(): Promise<Files> {
  loading ??= import('monorange-wasm-files').then(async (files) => {
    await files.init();
    return files;
  });
  return loading;
}

let loadingScan: Promise<Readers['scan']> | undefined;

/** What makes the virtual scan. */
export function loadScan(): Promise<Readers['scan']> {
  loadingScan ??= import('monorange-wasm-scan').then(async ({ init, Scan }) => {
    await init({ simd: hasSimd() });
    return (rig: Rig) => {
      try {
        return new Scan(rig);
      } catch {
        return undefined; // The camera sees no floor to be scanned.
      }
    };
  });
  return loadingScan;
}

/** What a session reads files with. */
export async function readers(): Promise<Readers> {
  const scan = loadScan();
  const { wants, offer, layout, sizeOf, focalOf, warnings, whyCut, Watch } = await loadFiles();
  return {
    wants, offer, decode, pipeline, warnings, whyCut,
    scan: await scan,
    watch: () => new Watch(),
    layout: layout as Readers['layout'],
    sizeOf: (head) => sizeOf(head) as Uint32Array | undefined,
    focalOf: (head, width, height) => focalOf(head, width, height) as Float64Array | undefined,
  };
}

export function pipeline(rig: Rig, byPictures: boolean): Pipeline {
  return new Pipeline(rig, byPictures);
}

/** The mount from rows u, v, x, y of clicked points; throws a sentence where they do not determine it. */
export async function fit(rig: Rig, rows: Float64Array): Promise<FittedMount> {
  const fitted = (await loadFiles()).fitMount(rig, rows);
  const { height, tilt, roll, yaw, rms, correlation } = fitted;
  const std = { height: fitted.height_std, tilt: fitted.tilt_std, roll: fitted.roll_std, yaw: fitted.yaw_std };
  fitted.free();
  return { mount: { height, tilt, roll, yaw }, std, rms, correlation };
}

/** A picture that the browser cannot decode. */
export async function decode(file: Uint8Array) {
  const pictures = await import('monorange-wasm-pictures');
  await pictures.init();
  const picture = new pictures.Picture(file);
  try {
    return { width: picture.width, height: picture.height, pixels: picture.rgba() };
  } finally {
    picture.free();
  }
}
