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
    /// The strip of floor that it sees where nothing stands in the way.
    pub(super) strip: Strip,
}

/// A pixel's patch of floor, in the robot's axes at the lens: the mount is fixed, so it never changes.
#[derive(Clone, Copy)]
pub(super) struct Strip {
    /// Where the ray meets the floor.
    pub(super) place: Vector2<f32>,
    /// How far that is along the floor; infinite above the horizon.
    pub(super) distance: f32,
    /// From one probe of the texture to the next.
    pub(super) step: Vector2<f32>,
    /// Number of probes.
    pub(super) probes: u32,
    /// Width that a probe stands for, m.
    pub(super) width: f32,
}

/// Most probes of the floor's texture a pixel.
const MAX_PROBES: f64 = 3.0;

impl Strip {
    fn new(direction: Vector3<f64>, height: f64, pixel_angle: f64) -> Self {
        let zero = Vector2::zeros();
        if direction.z >= 0.0 {
            return Self { place: zero, distance: f32::INFINITY, step: zero, probes: 1, width: 1.0 };
        }
        // The strip is distance/height times as long, away from the lens, as it is wide.
        let depth = height / -direction.z;
        let place = direction.xy() * depth;
        let distance = libm::sqrt(place.norm_squared());
        let width = depth * pixel_angle;
        let stretch = libm::sqrt(1.0 + distance * distance / (height * height));
        let probes = (stretch + 0.5).min(MAX_PROBES) as u32;
        let spacing = width * stretch / f64::from(probes);
        let step = place * (spacing / distance.max(1e-6));
        Self {
            place: place.cast(),
            distance: distance as f32,
            step: step.cast(),
            probes,
            width: width.max(spacing) as f32,
        }
    }
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
    /// Unit vectors to both sides of each bin, the margin included.
    pub(super) sides: Vec<[Vector2<f64>; 2]>,
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
                    let strip = Strip::new(Vector3::zeros(), 1.0, 1.0);
                    rays.push(Ray { direction: zero, by_u: zero, by_v: zero, bin: NO_RAY, strip });
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
                    strip: Strip::new(direction, rig.mount().height(), 1.0 / camera.focal().x),
                });
            }
        }
        let pixel_angle = (1.0 / camera.focal().x) as f32;
        let margin = margin.min(core::f64::consts::PI);
        let unit = |azimuth: f64| Vector2::new(libm::cos(azimuth), libm::sin(azimuth));
        let side = |bin| [unit(azimuth_of(bin) - margin), unit(azimuth_of(bin + 1) + margin)];
        let sides = (0..BINS).map(side).collect();
        Self { rays, width, pixel_angle, used, sides, margin }
    }

    pub(super) fn rays(&self) -> &[Ray] {
        &self.rays
    }

    pub(crate) fn width(&self) -> usize {
        self.width
    }

    /// One pixel's share of the ray plane: metres at depth 1 m.
    pub(crate) fn pixel_angle(&self) -> f32 {
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
