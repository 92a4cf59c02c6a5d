use crate::Noise;
use monorange_core::Real;
use monorange_core::geometry::{Camera, Mount, RangeFinder};
use monorange_core::lines::{EdgePoint, ExtractConfig, Extractor, mask_words, point_count, row_words};
use nalgebra::{Matrix2, Rotation2, Vector2};

/// Places in a pixel that a picture averages over.
const PLACES: usize = 233;
/// Directions that these places are turned to.
const TURNS: usize = 37;

/// An extractor on the heap.
pub type HostExtractor = Extractor<Vec<u16>, Vec<u32>, Vec<EdgePoint>>;

/// An extractor for `finder`'s pictures with the memory it should have.
///
/// # Panics
/// When the configuration is not valid.
pub fn host_extractor(config: ExtractConfig, finder: RangeFinder<f32>) -> HostExtractor {
    let (width, height) = (finder.camera().width(), finder.camera().height());
    let words = vec![0; row_words(width, height)];
    let points = vec![EdgePoint::default(); point_count(width, height)];
    Extractor::new(config, finder, words, vec![0; mask_words(width)], points)
        .expect("memory of the right size")
}

/// A level camera of `width` × `height` pixels without distortion.
///
/// # Panics
/// For a size of 0.
pub fn plain_range_finder<T: Real>(width: usize, height: usize) -> RangeFinder<T> {
    let principal = [width, height].map(|size| T::lit(size as f64 / 2.0));
    let focal = [T::lit(365.0); 2];
    let camera = Camera::new(width, height, focal, principal, T::zero(), Default::default()).expect("a size");
    let mount = Mount::new([0.4, 0.0, 0.0, 0.0, 0.0, 0.0].map(T::lit));
    RangeFinder::new(camera, mount.expect("a valid mount"))
}

/// Draws pictures of exact scenes: blurred by a Gaussian, which stands for lens and pixel, before they are sampled.
pub struct Exposure {
    width: usize,
    /// Ideal place of every pixel, and how it moves with the pixel.
    places: Vec<(Vector2<f64>, Matrix2<f64>)>,
    /// Where a pixel looks, with equal weight; neighbours take different ones, so that their errors average out.
    offsets: Vec<Vec<Vector2<f64>>>,
    reach: f64,
}

impl Exposure {
    /// Pictures of this camera, with an edge's blur of deviation `blur_px`.
    ///
    /// # Panics
    /// When a pixel is outside the lens model.
    pub fn new(camera: &Camera<f64>, blur_px: f64) -> Self {
        let (width, height) = (camera.width(), camera.height());
        let places = (0..width * height).map(|index| {
            let pixel = Vector2::new((index % width) as f64, (index / width) as f64);
            let ray = camera.ray_from_pixel(pixel).expect("inside the lens model");
            let ideal_by_ray = Matrix2::from_diagonal(&camera.focal());
            (camera.ideal_from_ray(ray), ideal_by_ray * camera.ray_by_pixel(ray).expect("one to one"))
        });
        // Quantiles of the Gaussian on a Fibonacci lattice: even in every direction.
        let quantiles = quantiles(PLACES);
        let offsets = (0..PLACES).map(|k| Vector2::new(quantiles[k], quantiles[144 * k % PLACES]) * blur_px);
        let offsets: Vec<_> = offsets.collect();
        let turned = |k: usize| Rotation2::new(k as f64 * core::f64::consts::TAU / TURNS as f64);
        let offsets = (0..TURNS).map(|k| offsets.iter().map(|offset| turned(k) * offset).collect());
        Self { width, places: places.collect(), offsets: offsets.collect(), reach: 3.5 * blur_px }
    }

    /// What `grey` gives at ideal pixels, with white noise of deviation `noise`, rounded.
    pub fn expose(&self, grey: impl Fn(Vector2<f64>) -> f64, noise: f64, random: &mut Noise) -> Vec<u8> {
        let around: Vec<Vector2<f64>> = [
            (-1.0, -1.0),
            (0.0, -1.0),
            (1.0, -1.0),
            (-1.0, 0.0),
            (1.0, 0.0),
            (-1.0, 1.0),
            (0.0, 1.0),
            (1.0, 1.0),
        ]
        .map(|(u, v)| Vector2::new(u, v) * self.reach)
        .into();
        let level = |(index, (ideal, by_pixel)): (usize, &(Vector2<f64>, Matrix2<f64>))| {
            let middle = grey(*ideal);
            if around.iter().all(|offset| grey(ideal + by_pixel * offset) == middle) {
                return middle;
            }
            let turn = (index % self.width * 5 + index / self.width * 7) % TURNS;
            let sum: f64 = self.offsets[turn].iter().map(|offset| grey(ideal + by_pixel * offset)).sum();
            sum / PLACES as f64
        };
        let noisy = self.places.iter().enumerate().map(|place| level(place) + noise * random.normal());
        noisy.map(|level| level.round().clamp(0.0, 255.0) as u8).collect()
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }
}

/// The quantiles (k + ½)/n of the standard normal distribution.
fn quantiles(n: usize) -> Vec<f64> {
    let step = 1e-4;
    let density = |x: f64| (-0.5 * x * x).exp() / core::f64::consts::TAU.sqrt();
    let (mut x, mut below, mut quantiles) = (-6.0, 0.0, Vec::with_capacity(n));
    while quantiles.len() < n {
        below += density(x + 0.5 * step) * step;
        x += step;
        while quantiles.len() < n && below >= (quantiles.len() as f64 + 0.5) / n as f64 {
            quantiles.push(x);
        }
    }
    quantiles
}

/// The same range finder in `f32`, as the extractor takes it.
///
/// # Panics
/// When a value is beyond what `f32` can hold.
pub fn narrow(finder: &RangeFinder<f64>) -> RangeFinder<f32> {
    finder.cast().expect("was valid")
}
