//! What the session is given by the page and gives back, with their types for TypeScript.
#![allow(missing_docs, reason = "each entry is documented in the types for TypeScript")]

use js_sys::{Function, Object, Promise, Uint8Array};
use wasm_bindgen::prelude::*;
use web_sys::Blob;

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r#"
import type { Pipeline, Rig } from '../../index.js';
import type { Scan } from '../../scan/index.js';

/** A file: one that was dropped, or one that is written when it is read. */
export interface Source {
  path: string;
  /** Throws the end of a sentence about the file where it cannot be read. */
  blob(): Blob;
}

/** A picture that the rare-pictures module has decoded. */
export interface RarePicture {
  width: number;
  height: number;
  /** Red, green, blue, alpha. */
  pixels: Uint8Array;
}

/** What the files of a drop are to one another; made by the module of file formats. */
export interface Layout {
  /** Which of the paths are the pictures, in order. */
  readonly frames: Uint32Array;
  readonly times: Float64Array;
  /** What the sequence is called on the page, and in a report. */
  readonly name: string;
  readonly title: string;
  readonly rig: Rig | null;
  readonly rigSize: Uint32Array | undefined;
  readonly rigSource: string;
  readonly wheels: boolean;
  /** x, y, heading a frame; NaN where there is none. */
  readonly truth: Float32Array | null;
  /** x, y pairs of a laser's hits in the world. */
  readonly laser: Float32Array | null;
  /** Whether any of the fresh files is of use. */
  readonly used: boolean;
  /** What of the rig the fresh files bring. */
  readonly brought: 'rig' | 'camera' | '';
  readonly notes: string[];
  /** What looks wrong in the files and is used all the same. */
  readonly warnings: string[];
  /** The odometry's readings between two times, for the pipeline's module. */
  between(from: number, to: number): Uint8Array;
  /** Length of the way between two times, m. */
  way(from: number, to: number): number;
  /** Motion by the wheels between two times: forward, left, turn; nothing where it is not known. */
  motion(from: number, to: number): Float32Array | undefined;
}

/** The modules that load when they are needed, and functions of the page. */
export interface Readers {
  /** Whether the file is a text file that a sequence may need. */
  wants(path: string): boolean;
  offer(path: string, content: Uint8Array): void;
  layout(paths: string[], fresh: number, streamed: number | undefined, interval: number): Layout;
  /** Width and height of a picture, by the first bytes of its file. */
  sizeOf(head: Uint8Array): Uint32Array | undefined;
  /** Focal length in pixels that a photo's EXIF data gives, and its standard deviation. */
  focalOf(head: Uint8Array, width: number, height: number): Float64Array | undefined;
  /** A pipeline for a rig, of the module that has it. */
  pipeline(rig: Rig, byPictures: boolean): Pipeline;
  /** The virtual scan of a rig's pictures; nothing where its camera sees no floor, or the module is not there yet. */
  scan(rig: Rig): Scan | undefined;
  /** Why a picture's file is not whole, as the end of a sentence. */
  whyCut(file: Uint8Array): string | undefined;
  /** Looks at the pictures of a run for what cannot be meant. */
  watch(): Watch;
  /** Everything that looked wrong since the files were opened, a sentence each. */
  warnings(): string[];
  /** Decodes what no browser knows. */
  decode(file: Uint8Array): Promise<RarePicture>;
}

/** Looks at the pictures of one run. */
export interface Watch {
  look(name: string, pixels: Uint8Array, way: number): void;
  /** Whether the camera froze so often that its pictures check nothing. */
  froze(): boolean;
  /** As `froze`, with a warning of every picture that is the one before. */
  judge(): boolean;
  free(): void;
}

/** A picture for the screen, with the edge points in it as rows u, v where it was looked through. */
export interface Shown {
  picture: ImageBitmap;
  edges: Float32Array | null;
}

/** What became of a frame; rows have the columns of `CornerColumn`, `PredictedColumn`, `LineColumn`, `LandmarkColumn`. */
export interface FrameResult {
  index: number;
  name: string;
  t: number;
  /** Why the frame was skipped, as a sentence; every array is empty then. */
  problem?: string;
  /** x, y, heading of the robot in the world. */
  pose: Float32Array;
  /** var_x, cov_xy, cov_xh, var_y, cov_yh, var_h. */
  covariance: Float32Array;
  corners: Float32Array;
  predicted: Float32Array;
  lines: Float32Array;
  landmarks: Float32Array;
  /** The virtual scan, rows with the columns of `BeamColumn`; empty where there is none. */
  beams: Float32Array;
  /** Sum of the matched corners' normalised innovations squared, and how many numbers it sums. */
  nis: number;
  nisDegrees: number;
  /** The motion came from the pictures, and this one could not tell it. */
  motionHeld: boolean;
  verdict: Verdict;
  /** What speaks against the filter, in words; empty where nothing does. */
  reason: string;
  /** Mean normalised innovation squared a degree of freedom; 1 is right. */
  meanNis: number;
  /** Milliseconds of decoding, edges, lines, motion, map. */
  stages: Float32Array;
}

export interface SequenceInfo {
  name: string;
  frames: string[];
  times: Float64Array;
  width: number;
  height: number;
  /** The rig that came with the pictures, where one did. */
  rig: Rig | null;
  /** Where none did: the first photo's focal length by its EXIF data, and its standard deviation, pixels. */
  focal: Float64Array | null;
  /** x, y, heading a frame; NaN where there is none. */
  truth: Float32Array | null;
  /** x, y pairs of a laser's hits in the world. */
  laser: Float32Array | null;
  /** Where the motion comes from. */
  motion: 'odometry' | 'pictures' | 'none';
  /** Whether any of the files that were just given is of use. */
  used: boolean;
  /** What of the rig they bring. */
  brought: 'rig' | 'camera' | '';
  /** Sentences about files that were left aside. */
  notes: string[];
  /** Sentences about what looks wrong in files and is used all the same. */
  warnings: string[];
}

/** Is told of a run several times a second. */
export interface Listener {
  progress(results: FrameResult[], shown: Shown | null, secondsLeft: number): void;
}
"#;

#[wasm_bindgen]
extern "C" {
    /// A file of the page.
    #[wasm_bindgen(typescript_type = "Source")]
    #[derive(Clone, Debug)]
    pub type Source;
    #[wasm_bindgen(method, getter)]
    pub fn path(this: &Source) -> String;
    #[wasm_bindgen(method, catch)]
    pub fn blob(this: &Source) -> Result<Blob, JsValue>;

    /// The modules that load when they are needed.
    #[wasm_bindgen(typescript_type = "Readers")]
    #[derive(Clone, Debug)]
    pub type Readers;
    #[wasm_bindgen(method)]
    pub fn wants(this: &Readers, path: &str) -> bool;
    #[wasm_bindgen(method)]
    pub fn offer(this: &Readers, path: &str, content: Uint8Array);
    #[wasm_bindgen(method, catch)]
    pub fn layout(
        this: &Readers,
        paths: Vec<String>,
        fresh: usize,
        streamed: Option<usize>,
        interval: f64,
    ) -> Result<Layout, JsValue>;
    #[wasm_bindgen(method, js_name = sizeOf)]
    pub fn size_of(this: &Readers, head: Uint8Array) -> Option<Vec<u32>>;
    #[wasm_bindgen(method, js_name = focalOf)]
    pub fn focal_of(this: &Readers, head: Uint8Array, width: u32, height: u32) -> Option<Vec<f64>>;
    #[wasm_bindgen(method, catch)]
    pub fn pipeline(this: &Readers, rig: &JsRig, by_pictures: bool) -> Result<Pipeline, JsValue>;
    #[wasm_bindgen(method)]
    pub fn scan(this: &Readers, rig: &JsRig) -> Option<Scan>;
    #[wasm_bindgen(method, js_name = whyCut)]
    pub fn why_cut(this: &Readers, file: Uint8Array) -> Option<String>;
    #[wasm_bindgen(method)]
    pub fn watch(this: &Readers) -> Watch;
    #[wasm_bindgen(method)]
    pub fn warnings(this: &Readers) -> Vec<String>;
    #[wasm_bindgen(method)]
    pub fn decode(this: &Readers, file: Uint8Array) -> Promise;

    /// Looks at the pictures of a run.
    #[wasm_bindgen(typescript_type = "Watch")]
    #[derive(Clone, Debug)]
    pub type Watch;
    #[wasm_bindgen(method)]
    pub fn look(this: &Watch, name: &str, pixels: &[u8], way: f64);
    #[wasm_bindgen(method)]
    pub fn froze(this: &Watch) -> bool;
    #[wasm_bindgen(method)]
    pub fn judge(this: &Watch) -> bool;
    #[wasm_bindgen(method)]
    pub fn free(this: &Watch);

    /// The virtual scan of a run's pictures.
    #[wasm_bindgen(typescript_type = "Scan")]
    #[derive(Clone, Debug)]
    pub type Scan;
    #[wasm_bindgen(method, catch)]
    pub fn look(this: &Scan, pixels: &[u8], moved: Option<Vec<f32>>) -> Result<Vec<f32>, JsValue>;
    #[wasm_bindgen(method)]
    pub fn free(this: &Scan);

    /// A picture that another module has decoded.
    #[wasm_bindgen(typescript_type = "RarePicture")]
    pub type RarePicture;
    #[wasm_bindgen(method, getter)]
    pub fn width(this: &RarePicture) -> usize;
    #[wasm_bindgen(method, getter)]
    pub fn height(this: &RarePicture) -> usize;
    #[wasm_bindgen(method, getter)]
    pub fn pixels(this: &RarePicture) -> Vec<u8>;

    /// What the files of a drop are to one another.
    #[wasm_bindgen(typescript_type = "Layout")]
    #[derive(Clone, Debug)]
    pub type Layout;
    #[wasm_bindgen(method, getter)]
    pub fn frames(this: &Layout) -> Vec<u32>;
    #[wasm_bindgen(method, getter)]
    pub fn times(this: &Layout) -> Vec<f64>;
    #[wasm_bindgen(method, getter)]
    pub fn name(this: &Layout) -> String;
    #[wasm_bindgen(method, getter)]
    pub fn title(this: &Layout) -> String;
    #[wasm_bindgen(method, getter)]
    pub fn rig(this: &Layout) -> JsValue;
    #[wasm_bindgen(method, getter, js_name = rigSize)]
    pub fn rig_size(this: &Layout) -> Option<Vec<u32>>;
    #[wasm_bindgen(method, getter, js_name = rigSource)]
    pub fn rig_source(this: &Layout) -> String;
    #[wasm_bindgen(method, getter)]
    pub fn wheels(this: &Layout) -> bool;
    #[wasm_bindgen(method, getter)]
    pub fn truth(this: &Layout) -> JsValue;
    #[wasm_bindgen(method, getter)]
    pub fn laser(this: &Layout) -> JsValue;
    #[wasm_bindgen(method, getter)]
    pub fn used(this: &Layout) -> bool;
    #[wasm_bindgen(method, getter)]
    pub fn brought(this: &Layout) -> String;
    #[wasm_bindgen(method, getter)]
    pub fn notes(this: &Layout) -> Vec<String>;
    #[wasm_bindgen(method, getter)]
    pub fn warnings(this: &Layout) -> Vec<String>;
    #[wasm_bindgen(method)]
    pub fn way(this: &Layout, from: f64, to: f64) -> f64;
    #[wasm_bindgen(method)]
    pub fn motion(this: &Layout, from: f64, to: f64) -> Option<Vec<f32>>;
    #[wasm_bindgen(method)]
    pub fn between(this: &Layout, from: f64, to: f64) -> Vec<u8>;

    /// A picture for the screen.
    #[wasm_bindgen(typescript_type = "Shown", extends = Object)]
    pub type Shown;
    /// What became of a frame.
    #[wasm_bindgen(typescript_type = "FrameResult", extends = Object)]
    pub type JsResult;
    /// What was opened.
    #[wasm_bindgen(typescript_type = "SequenceInfo", extends = Object)]
    pub type JsInfo;

    /// Is told of a run.
    #[wasm_bindgen(typescript_type = "Listener")]
    pub type Listener;
    #[wasm_bindgen(method)]
    pub fn progress(this: &Listener, results: js_sys::Array, shown: JsValue, seconds_left: f64);

    /// Gives a picture of a video, by its number.
    #[wasm_bindgen(typescript_type = "(frame: number) => Promise<ImageData>", extends = Function)]
    pub type Fetch;

    /// Camera and mount, which only the pipeline looks into.
    #[wasm_bindgen(typescript_type = "Rig")]
    #[derive(Clone, Debug)]
    pub type JsRig;
    #[wasm_bindgen(method, getter)]
    pub fn width(this: &JsRig) -> f64;
    #[wasm_bindgen(method, getter)]
    pub fn height(this: &JsRig) -> f64;

    /// The `Pipeline` of the module that computes.
    #[wasm_bindgen(typescript_type = "Pipeline")]
    #[derive(Clone, Debug)]
    pub type Pipeline;
    #[wasm_bindgen(method, getter)]
    pub fn width(this: &Pipeline) -> usize;
    #[wasm_bindgen(method, getter)]
    pub fn height(this: &Pipeline) -> usize;
    #[wasm_bindgen(method, getter)]
    pub fn carries(this: &Pipeline) -> bool;
    #[wasm_bindgen(method, catch)]
    pub fn load(this: &Pipeline, pixels: &[u8]) -> Result<(), JsValue>;
    #[wasm_bindgen(method, catch)]
    pub fn velocity(this: &Pipeline, time: f64, v: f32, omega: f32, seconds: f32) -> Result<(), JsValue>;
    #[wasm_bindgen(method, catch)]
    pub fn increment(
        this: &Pipeline,
        time: f64,
        forward: f32,
        left: f32,
        turn: f32,
        seconds: f32,
    ) -> Result<(), JsValue>;
    #[wasm_bindgen(method, catch)]
    pub fn rows(this: &Pipeline) -> Result<(), JsValue>;
    #[wasm_bindgen(method, catch)]
    pub fn lines(this: &Pipeline) -> Result<(), JsValue>;
    #[wasm_bindgen(method)]
    pub fn edges(this: &Pipeline) -> Vec<f32>;
    #[wasm_bindgen(method, catch)]
    pub fn finish(this: &Pipeline, time: f64, ended: &Function) -> Result<Report, JsValue>;
    #[wasm_bindgen(method)]
    pub fn verdict(this: &Pipeline) -> u32;
    #[wasm_bindgen(method)]
    pub fn reason(this: &Pipeline) -> String;
    #[wasm_bindgen(method, js_name = meanNis)]
    pub fn mean_nis(this: &Pipeline) -> f32;
    #[wasm_bindgen(method)]
    pub fn confirmed(this: &Pipeline) -> Vec<f64>;
    #[wasm_bindgen(method)]
    pub fn free(this: &Pipeline);

    /// The `Report` of the module that computes.
    #[wasm_bindgen(typescript_type = "Report")]
    pub type Report;
    #[wasm_bindgen(method, getter)]
    pub fn pose(this: &Report) -> Vec<f32>;
    #[wasm_bindgen(method, getter)]
    pub fn covariance(this: &Report) -> Vec<f32>;
    #[wasm_bindgen(method, getter)]
    pub fn corners(this: &Report) -> Vec<f32>;
    #[wasm_bindgen(method, getter)]
    pub fn predicted(this: &Report) -> Vec<f32>;
    #[wasm_bindgen(method, getter)]
    pub fn lines(this: &Report) -> Vec<f32>;
    #[wasm_bindgen(method, getter)]
    pub fn landmarks(this: &Report) -> Vec<f32>;
    #[wasm_bindgen(method, getter)]
    pub fn nis(this: &Report) -> f32;
    #[wasm_bindgen(method, getter, js_name = nisDegrees)]
    pub fn nis_degrees(this: &Report) -> u32;
    #[wasm_bindgen(method, getter, js_name = withoutRange)]
    pub fn without_range(this: &Report) -> u32;
    #[wasm_bindgen(method, getter, js_name = noRoom)]
    pub fn no_room(this: &Report) -> u32;
    #[wasm_bindgen(method, getter)]
    pub fn held(this: &Report) -> bool;
    #[wasm_bindgen(method, getter)]
    pub fn knocked(this: &Report) -> bool;
    #[wasm_bindgen(method, getter, js_name = carriedBy)]
    pub fn carried_by(this: &Report) -> usize;
    #[wasm_bindgen(method)]
    pub fn free(this: &Report);
}
