use monorange_core::geometry::RangeFinder;
use nalgebra::{Vector2, Vector3};

/// Directions of the plan are sorted into this many bins, the whole turn.
pub(super) const BINS: usize = 4096;

/// The bin of pixels without a ray.
const NO_RAY: u16 = u16::MAX;

/// A pixel's ray in the robot's frame.
#[derive(Clone, Copy)]
pub(crate) struct Ray {
    /// robot_from_cam · (x, y, 1).
    pub(super) direction: Vector3<f32>,
    by_u: Vector3<f32>,
    by_v: Vector3<f32>,
    /// Which bin its direction in the plan falls into.
    pub(super) bin: u16,
}

impl Ray {
    /// The ray `offset` pixels beside the centre.
    #[inline]
    pub(super) fn shifted(&self, offset: &[f32; 2]) -> Vector3<f32> {
        self.direction + self.by_u * offset[0] + self.by_v * offset[1]
    }
}

/// Every pixel's ray, and how much of the plan one pixel covers.
#[derive(Clone)]
pub(crate) struct Lens {
    rays: Vec<Ray>,
    width: usize,
    pixel_angle: f32,
    /// Bins that any pixel uses.
    pub(super) used: Vec<bool>,
    /// By how much a pixel's own rays can leave its bin, rad.
    pub(super) margin: f64,
}

impl Lens {
    pub(crate) fn new(rig: &RangeFinder<f64>) -> Self {
        let camera = rig.camera();
        let (width, height) = (camera.width(), camera.height());
        let turn = rig.robot_from_cam();
        let mut rays = Vec::with_capacity(width * height);
        let mut used = vec![false; BINS];
        let mut margin = 0.0_f64;
        for v in 0..height {
            for u in 0..width {
                let pixel = Vector2::new(u as f64, v as f64);
                let ray = camera.ray_from_pixel(pixel).and_then(|ray| Some((ray, camera.ray_by_pixel(ray)?)));
                let Some((ray, by_pixel)) = ray else {
                    let zero = Vector3::zeros();
                    rays.push(Ray { direction: zero, by_u: zero, by_v: zero, bin: NO_RAY });
                    continue;
                };
                let direction = turn * ray.push(1.0);
                let steps = turn.fixed_columns::<2>(0) * by_pixel;
                let (by_u, by_v) = (steps.column(0).into_owned(), steps.column(1).into_owned());
                let azimuth = libm::atan2(direction.y, direction.x);
                let bin = bin_of(azimuth);
                used[bin] = true;
                // Azimuth changes by (D × dD)_z / |D_xy|².
                let reach = [by_u, by_v].map(|step| direction.xy().perp(&step.xy()).abs());
                let horizontal2 = direction.xy().norm_squared().max(1e-9);
                margin = margin.max(0.5 * (reach[0] + reach[1]) / horizontal2);
                rays.push(Ray {
                    direction: direction.cast(),
                    by_u: by_u.cast(),
                    by_v: by_v.cast(),
                    bin: bin as u16,
                });
            }
        }
        let pixel_angle = (1.0 / camera.focal().x) as f32;
        Self { rays, width, pixel_angle, used, margin: margin.min(core::f64::consts::PI) }
    }

    pub(super) fn rays(&self) -> &[Ray] {
        &self.rays
    }

    pub(crate) fn width(&self) -> usize {
        self.width
    }

    /// One pixel's share of the ray plane: metres at depth 1 m.
    pub(super) fn pixel_angle(&self) -> f32 {
        self.pixel_angle
    }
}

/// The bin of an azimuth in [−π, π].
pub(super) fn bin_of(azimuth: f64) -> usize {
    let turns = azimuth / core::f64::consts::TAU + 0.5;
    ((turns * BINS as f64) as usize).min(BINS - 1)
}

/// The azimuth of a bin's lower edge.
pub(super) fn azimuth_of(bin: usize) -> f64 {
    (bin as f64 / BINS as f64 - 0.5) * core::f64::consts::TAU
}
