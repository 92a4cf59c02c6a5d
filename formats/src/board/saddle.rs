//! A corner to a few hundredths of a pixel: where four squares meet, every edge's gradient is at right angles to the way from the corner.
//!
//! ```text
//! Σ w g gᵀ (x − q) = 0      over the pixels x around q, with gradients g: two linear equations in q
//! ```
//!
//! (Förstner and Gülch, "A fast operator for detection and precise location of distinct points", 1987.)
use monorange_core::image::Grey;
use nalgebra::{Matrix2, Vector2};

const MAX_ITERATIONS: usize = 20;
const SETTLED_PX: f64 = 1e-3;

/// The corner near `first`, or `None` where the equations lead elsewhere; `spacing` is the distance to the nearest one, px.
pub(super) fn refined(grey: &Grey<'_>, first: Vector2<f64>, spacing: f64) -> Option<Vector2<f64>> {
    // The window ends before the next corner's edges begin.
    let radius = (spacing * 0.4).clamp(2.0, 12.0);
    let mut corner = first;
    for _ in 0..MAX_ITERATIONS {
        let next = step(grey, corner, radius)?;
        let moved = (next - corner).norm();
        corner = next;
        if (corner - first).norm() > radius.min(3.0) {
            return None;
        }
        if moved < SETTLED_PX {
            break;
        }
    }
    Some(corner)
}

fn step(grey: &Grey<'_>, corner: Vector2<f64>, radius: f64) -> Option<Vector2<f64>> {
    let reach = radius.ceil() as i32;
    let (mut matrix, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for (row, column) in (-reach..=reach).flat_map(|row| (-reach..=reach).map(move |column| (row, column))) {
        let away = Vector2::new(f64::from(column), f64::from(row));
        let weight = libm::exp(-away.norm_squared() / (radius * radius / 2.0));
        let at = |u: f64, v: f64| value(grey, corner + away + Vector2::new(u, v));
        let gradient = Vector2::new(at(1.0, 0.0)? - at(-1.0, 0.0)?, at(0.0, 1.0)? - at(0.0, -1.0)?) / 2.0;
        let outer = gradient * gradient.transpose() * weight;
        matrix += outer;
        right += outer * away;
    }
    Some(corner + matrix.try_inverse()? * right)
}

/// The grey value between pixels, bilinear.
fn value(grey: &Grey<'_>, place: Vector2<f64>) -> Option<f64> {
    let (left, top) = (place.x.floor(), place.y.floor());
    if left < 0.0 || top < 0.0 {
        return None;
    }
    let (u, v) = (left as usize, top as usize);
    let pixel = |u: usize, v: usize| {
        let inside = u < grey.width() && v < grey.height();
        let value = inside.then(|| grey.pixels().get(v * grey.width() + u)).flatten();
        value.map(|value| f64::from(*value))
    };
    let (across, down) = (place.x - left, place.y - top);
    let upper = pixel(u, v)? * (1.0 - across) + pixel(u + 1, v)? * across;
    let lower = pixel(u, v + 1)? * (1.0 - across) + pixel(u + 1, v + 1)? * across;
    Some(upper * (1.0 - down) + lower * down)
}
