//! Pairs of pictures with a known homography: the protocol behind the figures of the features.
use crate::Noise;
use monorange_core::homography::{Match, direct_linear_transform};
use nalgebra::{Matrix2, Matrix3, Vector2};

/// A grey picture that owns its pixels.
#[derive(Clone, Debug)]
pub struct Photo {
    /// Row-major.
    pub pixels: Vec<u8>,
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Where a homography carries a point.
pub fn carry(m: &Matrix3<f64>, p: Vector2<f64>) -> Vector2<f64> {
    let q = m * p.push(1.0);
    q.xy() / q.z
}

impl Photo {
    /// Discs and bars of all sizes and greys upon each other: corners, edges and blobs, slightly out of focus.
    pub fn texture(width: usize, height: usize, seed: u64) -> Self {
        let mut random = Noise::new(seed);
        let mut grey = vec![128.0; width * height];
        for n in 0..width * height / 120 {
            let size = 1.5 * (20.0_f64).powf(1.0 - n as f64 * 120.0 / (width * height) as f64);
            let centre = Vector2::new(random.uniform(0.0, width as f64), random.uniform(0.0, height as f64));
            let (angle, long) = (random.uniform(0.0, core::f64::consts::PI), random.uniform(1.0, 3.0));
            let (c, s) = (angle.cos(), angle.sin());
            let (level, round) = (random.uniform(10.0, 245.0), random.uniform(0.0, 1.0) < 0.5);
            let reach = size * long * 1.5 + 2.0;
            let range = |at: f64, limit: usize| {
                (at - reach).max(0.0) as usize..((at + reach).max(0.0) as usize).min(limit)
            };
            for y in range(centre.y, height) {
                for x in range(centre.x, width) {
                    let d = Vector2::new(x as f64, y as f64) - centre;
                    let (u, v) = ((c * d.x + s * d.y) / long, c * d.y - s * d.x);
                    let distance = if round { (u * u + v * v).sqrt() } else { u.abs().max(v.abs()) };
                    let cover = ((size - distance) / 1.2 + 0.5).clamp(0.0, 1.0);
                    let pixel = &mut grey[y * width + x];
                    *pixel += (level - *pixel) * cover;
                }
            }
        }
        Self { pixels: grey.iter().map(|g| g.round() as u8).collect(), width, height }
    }

    /// The picture seen through a homography (its pixel → the new one's): cubic interpolation, 0 outside.
    fn warped(&self, m: &Matrix3<f64>) -> Vec<f64> {
        let back = m.try_inverse().expect("a homography");
        let at = |x: isize, y: isize| {
            let inside = (0..self.width as isize).contains(&x) && (0..self.height as isize).contains(&y);
            if inside { f64::from(self.pixels[y as usize * self.width + x as usize]) } else { 0.0 }
        };
        let weights = |t: f64| {
            // Keys' kernel with a = −3/4.
            let a = -0.75;
            let near = |d: f64| ((a + 2.0) * d - (a + 3.0)) * d * d + 1.0;
            let far = |d: f64| ((a * d - 5.0 * a) * d + 8.0 * a) * d - 4.0 * a;
            [far(1.0 + t), near(t), near(1.0 - t), far(2.0 - t)]
        };
        let sample = |index: usize| {
            let p = carry(&back, Vector2::new((index % self.width) as f64, (index / self.width) as f64));
            let (x, y) = (p.x.floor(), p.y.floor());
            let (across, down) = (weights(p.x - x), weights(p.y - y));
            let mut sum = 0.0;
            for (row, down) in down.into_iter().enumerate() {
                for (column, across) in across.into_iter().enumerate() {
                    sum +=
                        down * across * at(x as isize + column as isize - 1, y as isize + row as isize - 1);
                }
            }
            sum
        };
        (0..self.width * self.height).map(sample).collect()
    }

    /// Another view of the picture: its corners shifted by ±12 %, turned by ±0.5 rad, scaled by 0.75–1.2, with
    /// another gain and offset and noise of 3 grey levels; and the homography that leads there.
    pub fn another_view(&self, random: &mut Noise) -> (Self, Matrix3<f64>) {
        let m = random_homography(self.width as f64, self.height as f64, random);
        let (gain, offset) = (random.uniform(0.8, 1.15), random.uniform(-10.0, 10.0));
        let seen = |grey: f64| (gain * grey + offset + 3.0 * random.normal()).clamp(0.0, 255.0) as u8;
        (Self { pixels: self.warped(&m).into_iter().map(seen).collect(), ..*self }, m)
    }
}

/// Corner shifts of ±12 %, rotation ±0.5 rad, scale 0.75–1.2 about the centre.
fn random_homography(width: f64, height: f64, random: &mut Noise) -> Matrix3<f64> {
    let (angle, scale) = (random.uniform(-0.5, 0.5), random.uniform(0.75, 1.2));
    let turn = Matrix2::new(angle.cos(), -angle.sin(), angle.sin(), angle.cos()) * scale;
    let centre = Vector2::new(width, height) / 2.0;
    let pairs = corners(width, height).map(|corner| {
        let shift = Vector2::new(random.uniform(-0.12, 0.12) * width, random.uniform(-0.12, 0.12) * height);
        Match::new(corner, turn * (corner + shift - centre) + centre, 1.0, 1.0)
    });
    direct_linear_transform(&pairs).expect("four corners")
}

fn corners(width: f64, height: f64) -> [Vector2<f64>; 4] {
    [[0.0, 0.0], [width - 1.0, 0.0], [width - 1.0, height - 1.0], [0.0, height - 1.0]].map(Vector2::from)
}

/// How far a homography carries the picture's corners from where the true one does, in the mean.
pub fn corner_error(found: &Matrix3<f64>, truth: &Matrix3<f64>, photo: &Photo) -> f64 {
    let apart = |corner| (carry(found, corner) - carry(truth, corner)).norm();
    corners(photo.width as f64, photo.height as f64).into_iter().map(apart).sum::<f64>() / 4.0
}
