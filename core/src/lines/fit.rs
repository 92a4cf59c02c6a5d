use super::edge::STEEP_STRIDES;
use super::extraction::Line;
use crate::image::{GRADIENT_SCALE, NOISE_GAIN, correlation_length};
use nalgebra::Vector2;

/// Effective degrees of freedom that the picture's noise counts for, against the points' scatter.
const PRIOR_WEIGHT: f32 = 10.0;

/// A point on an edge, as a line is fitted to it.
pub(crate) trait EdgeSample {
    /// Where an ideal camera would see it, px.
    fn place(&self) -> Vector2<f32>;
    /// Grey levels per pixel.
    fn gradient(&self) -> f32;
    /// Curvature of the logarithm of the gradient's profile across the edge, in 256ths of 1/px².
    fn curvature(&self) -> u8;
}

/// What the frame as a whole says about the points of a line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampling {
    /// Standard deviation of the picture's noise, grey levels.
    pub(crate) noise_std: f32,
    /// Pixels along a flat edge from one point to the next.
    pub(crate) stride: usize,
}

impl Sampling {
    /// Pixels along the dominant axis, from one point to the next, of an edge with this normal.
    pub(super) fn stride(&self, normal: Vector2<f32>) -> usize {
        if normal.x.abs() >= normal.y.abs() { self.steep_stride() } else { self.stride }
    }

    /// The same for a steep edge.
    pub(super) fn steep_stride(&self) -> usize {
        STEEP_STRIDES * self.stride
    }
}

/// The weighted total least squares line through the points, or `None` for fewer than three or coinciding points.
///
/// With weights w = s² (gradient s, to which a point's deviation is inversely proportional) and the weighted mean
/// as origin, the angle φ that the line turns from the seed's direction t, n is
///
/// ```text
/// φ = ½ atan2(2 S_tn, S_tt − S_nn)
/// ```
///
/// A point's variance follows from the noise σ of the picture by first order, through the parabola of
/// [`maximum`](super::edge::maximum) with curvature D: σ_p² = V σ² e^D/(4 s² D²), V = [`NOISE_GAIN`]. Smoothing makes
/// neighbours along the edge alike, so that c of them count as one:
///
/// ```text
/// var(position) = c κ σ_p² s² / Σ w        var(angle) = c κ σ_p² s² / Σ w t²
/// ```
///
/// κ is the points' scatter against the one expected, taken with the degrees of freedom left and mixed with
/// [`PRIOR_WEIGHT`] times 1: a textured edge is less certain than a clean one.
pub(crate) fn fit<'p, P: EdgeSample + 'p>(
    points: impl Iterator<Item = &'p P> + Clone,
    seed: Vector2<f32>,
    sampling: Sampling,
) -> Option<Line> {
    let weight = |point: &P| {
        let gradient = point.gradient();
        gradient * gradient
    };
    let (mut count, mut total, mut mean, mut curvature) = (0_u16, 0.0, Vector2::zeros(), 0.0);
    let origin = points.clone().next()?.place();
    for point in points.clone() {
        let w = weight(point);
        count = count.saturating_add(1);
        total += w;
        mean += (point.place() - origin) * w;
        curvature += f32::from(point.curvature());
    }
    if count < 3 || total <= 0.0 {
        return None;
    }
    let centroid = origin + mean / total;
    let tangent = Vector2::new(-seed.y, seed.x);
    let (mut s_tt, mut s_tn, mut s_nn) = (0.0, 0.0, 0.0);
    let mut extent = [f32::MAX, f32::MIN];
    for point in points {
        let (w, offset) = (weight(point), point.place() - centroid);
        let (t, n) = (tangent.dot(&offset), seed.dot(&offset));
        s_tt += w * t * t;
        s_tn += w * t * n;
        s_nn += w * n * n;
        // Not `min` and `max`: where the processor has none they are calls.
        let [least, most] = extent;
        extent = [if t < least { t } else { least }, if t > most { t } else { most }];
    }
    // The scatter left after the turn is the smaller eigenvalue, in a form without cancellation.
    let root = libm::sqrtf((s_tt - s_nn) * (s_tt - s_nn) + 4.0 * s_tn * s_tn);
    let along = 0.5 * (s_tt + s_nn + root);
    if along.is_nan() || along <= 0.0 {
        return None;
    }
    let across = ((s_tt * s_nn - s_tn * s_tn) / along).max(0.0);
    let (sin, cos) = libm::sincosf(0.5 * libm::atan2f(2.0 * s_tn, s_tt - s_nn));
    let normal = seed * cos - tangent * sin;

    let number = f32::from(count);
    let longer = normal.amax();
    let independent = (correlation_length(sampling.stride(normal)) * longer).max(1.0);
    // D is stored in 256ths.
    let curvature = (curvature / number / 256.0).max(0.05);
    let slope = GRADIENT_SCALE * curvature;
    // The outer samples are weaker than the middle one by e^(−D/2), and their logarithms noisier.
    let noise = sampling.noise_std * sampling.noise_std * libm::expf(curvature);
    let point_variance = NOISE_GAIN * noise / (4.0 * slope * slope);
    // Off the axes, samples along an axis carry noise along the edge too; it cancels over the line.
    let tangential = 1.0 + (1.0 / (longer * longer) - 1.0) / 3.0;
    let freedom = (number / independent - 2.0).max(0.0);
    let scatter = across / (point_variance * tangential * independent);
    let excess = (PRIOR_WEIGHT + scatter) / (PRIOR_WEIGHT + freedom);
    let variance = point_variance * independent * excess;
    Some(Line {
        normal,
        centroid,
        extent,
        ends: [centroid; 2],
        var_position_px2: variance / total,
        var_angle: variance / along,
        points: count,
        residual_px: libm::sqrtf(across / total),
        width_px: libm::sqrtf(1.0 / curvature),
    })
}
