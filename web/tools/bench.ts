/**
 * How fast the page's module is in this machine's Chromium, beside opencv.js in the same run: `npm run bench`.
 * Ratios count, not milliseconds: the least of many repetitions of each, in turn.
 */
import { cp, mkdir, mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';
import { expect, test } from 'vitest';
import { preview } from 'vite';
import { browserPath } from '../tests/browser.ts';
import type * as Monorange from 'monorange-wasm';
import type * as Files from 'monorange-wasm-files';

const PAGE = `<!doctype html><meta charset="utf-8"><title>bench</title><script type="module">
  import * as files from './wasm/files/index.js';
  import * as simd from './wasm/index.js';
  import * as scalar from './wasm-scalar/index.js';
  Object.assign(window, { files, simd, scalar });
</script>`;
const FRAMES = 60;
const ROUNDS = 5;
/** What OpenCV's own figures are taken with. */
const PHOTO = '../../shared/data/opencv/graf1.png';
/** Least gradients of an edge in the chain, grey levels per pixel: the extractor's own (`extract.edge_threshold`), and a coarser one. */
const LEVELS = [6, 10] as const;

test('speed', async () => {
  const root = await mkdtemp(join(tmpdir(), 'monorange-bench-'));
  const site = join(root, 'dist');
  await mkdir(site);
  // A module is one instance: each build needs its own address.
  for (const folder of ['wasm', 'wasm-scalar']) await cp('../wasm', join(site, folder), { recursive: true });
  await cp('node_modules/@techstark/opencv-js/dist/opencv.js', join(site, 'opencv.js')).catch(() => {
    throw new Error('opencv.js is missing: `npm run bench` installs it.');
  });
  await writeFile(join(site, 'index.html'), PAGE);
  const photo = await cp(PHOTO, join(site, 'photo.png')).then(() => './photo.png', () => null);
  const server = await preview({ root, configFile: false, logLevel: 'error', preview: { host: '127.0.0.1', port: 0 } });
  const browser = await chromium.launch({ executablePath: browserPath!, headless: true, args: ['--no-sandbox', '--disable-gpu'] });
  try {
    const page = await browser.newPage();
    await page.goto(server.resolvedUrls?.local[0] ?? '');
    await page.addScriptTag({ url: './opencv.js' });
    const figures = await page.evaluate(measure, [FRAMES, ROUNDS, LEVELS, photo] as const);
    const { pipeline, withSift, scalar } = figures;
    const rate = (ms: number) => `${ms.toFixed(2)} ms, ${(1000 / ms).toFixed(0)} frames/s`;
    const beside = (what: string, { extraction, chains }: (typeof figures)['sample']) => [
      `  ${what}: floor corners ${extraction.toFixed(3)} ms`,
      ...chains.map((chain, k) => `    opencv.js, edges from ${LEVELS[k]} grey levels a pixel   ${chain.toFixed(3)} ms, ${(chain / extraction).toFixed(1)} ×`),
    ];
    console.log([
      `320 × 240, the least of ${ROUNDS} rounds, a frame; opencv.js ${figures.version} does blur + Sobel + open + Hough:`,
      ...beside(`${FRAMES} frames of the sample`, figures.sample),
      ...(figures.photo ? beside("OpenCV's graf1.png", figures.photo) : ["  skipped: OpenCV's graf1.png is not here"]),
      `  floor corners of the sample without SIMD   ${scalar.toFixed(3)} ms`,
      `  whole pipeline with odometry               ${rate(pipeline)}`,
      `  whole pipeline, motion by SIFT             ${rate(withSift)}`,
    ].join('\n'));
    expect(1000 / withSift, 'frames a second with SIFT').toBeGreaterThan(30);
    expect(1000 / pipeline, 'frames a second without').toBeGreaterThan(150);
    for (const { extraction, chains } of [figures.sample, figures.photo].filter((figure) => figure !== null)) {
      expect(chains[0]! / extraction, 'times as fast as opencv.js with the same edges').toBeGreaterThan(10);
    }
  } finally {
    await browser.close();
    await server.close();
    await rm(root, { recursive: true, force: true });
  }
});

/** Runs in the browser. */
async function measure([frames, rounds, levels, photo]: readonly [number, number, readonly number[], string | null]) {
  type Cv = Record<string, never> & { getBuildInformation(): string };
  const cv = (await (window as unknown as { cv: Cv | Promise<Cv> }).cv) as any;
  if (!cv.Mat) await new Promise<void>((done) => (cv.onRuntimeInitialized = () => done()));
  const { files, simd, scalar } = window as unknown as { files: typeof Files; simd: typeof Monorange; scalar: typeof Monorange };
  await files.init();
  await simd.init({ simd: true });
  const sample = new files.Sample(frames, 3, 1);
  files.offer('rig.toml', new TextEncoder().encode(sample.rig()));
  const rig = files.layout(['rig.toml'], 1, undefined, 0).rig as Monorange.Rig;
  const times = sample.times().trim().split('\n').map(Number);
  const wheels = sample.odometry().trim().split('\n').slice(1).map((line) => line.split(',').map(Number));
  const pictures = times.map((_: number, frame: number) => sample.picture(frame).slice(-rig.width * rig.height));

  /** The least time of a frame's work, over rounds, averaged over frames. */
  const least = (round: () => number[]) => {
    const best: number[] = [];
    for (let n = 0; n < rounds; n += 1) round().forEach((time, frame) => (best[frame] = Math.min(best[frame] ?? Infinity, time)));
    return best.reduce((sum, time) => sum + time, 0) / best.length;
  };
  const timed = (work: () => void) => {
    const start = performance.now();
    work();
    return performance.now() - start;
  };
  const extract = (pipeline: Monorange.Pipeline, pictures: Uint8Array[]) => least(() => pictures.map((pixels: Uint8Array) => timed(() => {
    pipeline.load(pixels);
    pipeline.rows();
    pipeline.lines();
  })));
  const drive = (bySight: boolean) => least(() => {
    const pipeline = new simd.Pipeline(rig, bySight);
    const spent = pictures.map((pixels: Uint8Array, frame: number) => timed(() => {
      const time = times[frame]! - times[0]!;
      pipeline.load(pixels);
      if (!bySight && frame > 0) {
        const [, v = 0, omega = 0] = wheels[frame - 1]!;
        pipeline.velocity(time, v, omega, times[frame]! - times[frame - 1]!);
      }
      pipeline.rows();
      pipeline.lines();
      pipeline.finish(time).free();
    }));
    pipeline.free();
    return spent;
  });

  const input = new cv.Mat(rig.height, rig.width, cv.CV_8UC1);
  const [blurred, gx, gy, ax, ay, edges, opened, lines] = Array.from({ length: 8 }, () => new cv.Mat());
  const kernel = cv.Mat.ones(3, 3, cv.CV_8U);
  // Sobel's kernel has 8 to a grey level a pixel, of which half is kept.
  const chain = (pictures: Uint8Array[], level: number) => least(() => pictures.map((pixels: Uint8Array) => timed(() => {
    input.data.set(pixels);
    cv.GaussianBlur(input, blurred, new cv.Size(5, 5), 1.0);
    cv.Sobel(blurred, gx, cv.CV_16S, 1, 0, 3);
    cv.Sobel(blurred, gy, cv.CV_16S, 0, 1, 3);
    cv.convertScaleAbs(gx, ax, 0.5, 0);
    cv.convertScaleAbs(gy, ay, 0.5, 0);
    cv.addWeighted(ax, 1, ay, 1, 0, edges);
    cv.threshold(edges, edges, 4 * level, 255, cv.THRESH_BINARY);
    cv.morphologyEx(edges, opened, cv.MORPH_OPEN, kernel);
    cv.HoughLines(opened, lines, 1, Math.PI / 180, 60);
  })));

  const extractor = new simd.Pipeline(rig, false);
  const beside = (pictures: Uint8Array[]) => {
    // In turn, so that all meet the same machine.
    const turns = [1, 2].map(() => [extract(extractor, pictures), ...levels.map((level) => chain(pictures, level))]);
    const [extraction = 0, ...chains] = turns[0]!.map((time, k) => Math.min(time, turns[1]![k]!));
    return { extraction, chains };
  };
  const grey = async (address: string) => {
    const canvas = new OffscreenCanvas(rig.width, rig.height).getContext('2d')!;
    canvas.drawImage(await createImageBitmap(await (await fetch(address)).blob()), 0, 0, rig.width, rig.height);
    const { data } = canvas.getImageData(0, 0, rig.width, rig.height);
    return Uint8Array.from({ length: rig.width * rig.height }, (_, k) => (data[4 * k]! + 2 * data[4 * k + 1]! + data[4 * k + 2]!) / 4);
  };
  const figures = {
    sample: beside(pictures),
    photo: photo === null ? null : beside(new Array(10).fill(await grey(photo))),
  };
  await scalar.init({ simd: false });
  return {
    ...figures,
    version: (/OpenCV (\S+)/i.exec(cv.getBuildInformation?.() ?? '') ?? [])[1] ?? '',
    pipeline: drive(false),
    withSift: drive(true),
    scalar: extract(new scalar.Pipeline(rig, false), pictures),
  };
}
