//! Newton's method for the ray that a lens bends to a point: for one, and for several in vectors' lanes, with the same bits.
use super::lens::inverse;
use crate::Real;
use crate::vectors::widest;
use nalgebra::{Matrix2, Vector2};

/// Iterations after which Newton's method is given up; it needs 3 to 5 within a model's domain.
pub(super) const MAX_ITERATIONS: usize = 20;

/// The rays of several points, with the Jacobian at each, for a lens whose `bend` gives a ray's image and Jacobian.
#[inline(always)]
pub(super) fn newton<T: Real, const N: usize>(
    distorted: [Vector2<T>; N],
    bend: impl Fn(Vector2<T>) -> (Vector2<T>, Matrix2<T>) + Copy,
    max_radius2: T,
) -> [Option<(Vector2<T>, Matrix2<T>)>; N] {
    widest!((distorted, bend, max_radius2), all)
}

#[inline(always)]
fn all<T: Real, const N: usize>(
    (distorted, bend, max_radius2): (
        [Vector2<T>; N],
        impl Fn(Vector2<T>) -> (Vector2<T>, Matrix2<T>) + Copy,
        T,
    ),
) -> [Option<(Vector2<T>, Matrix2<T>)>; N] {
    let mut searches = distorted.map(Search::new);
    for _ in 0..MAX_ITERATIONS {
        if searches.iter().all(|search| search.state != State::Going) {
            break;
        }
        let tried = Tried::at(searches.each_ref().map(|search| search.ray), distorted, bend);
        for (lane, search) in searches.iter_mut().enumerate() {
            if search.state == State::Going {
                search.take(&tried, lane, max_radius2);
            }
        }
    }
    searches.map(Search::found)
}

/// The ray of one point.
pub(super) fn newton_one<T: Real>(
    distorted: Vector2<T>,
    bend: impl Fn(Vector2<T>) -> (Vector2<T>, Matrix2<T>),
    max_radius2: T,
) -> Option<Vector2<T>> {
    let mut search = Search::new(distorted);
    for _ in 0..MAX_ITERATIONS {
        if search.state != State::Going {
            break;
        }
        search.step(&bend, max_radius2);
    }
    search.found().map(|(ray, _)| ray)
}

/// An iteration of several searches, in columns: the compiler makes vectors of them.
struct Tried<T, const N: usize> {
    residual: [[T; N]; 2],
    jacobian: [[T; N]; 4],
    next: [[T; N]; 2],
}

impl<T: Real, const N: usize> Tried<T, N> {
    #[inline(always)]
    #[allow(clippy::indexing_slicing, reason = "a lane counts through arrays of N")]
    fn at(
        rays: [Vector2<T>; N],
        distorted: [Vector2<T>; N],
        bend: impl Fn(Vector2<T>) -> (Vector2<T>, Matrix2<T>),
    ) -> Self {
        let (x, y) = (rays.map(|ray| ray.x), rays.map(|ray| ray.y));
        let (u, v) = (distorted.map(|point| point.x), distorted.map(|point| point.y));
        let [mut residual, mut next] = [[[T::zero(); N]; 2]; 2];
        let mut jacobian = [[T::zero(); N]; 4];
        for lane in 0..N {
            let (seen, by_ray) = bend(Vector2::new(x[lane], y[lane]));
            let (du, dv) = (seen.x - u[lane], seen.y - v[lane]);
            // As `inverse` and the product with it, without a question: where there is none, `take` sees it.
            let determinant = by_ray.m11 * by_ray.m22 - by_ray.m12 * by_ray.m21;
            let [a, b, c, d] = [by_ray.m22, -by_ray.m12, -by_ray.m21, by_ray.m11].map(|m| m / determinant);
            residual[0][lane] = du;
            residual[1][lane] = dv;
            jacobian[0][lane] = by_ray.m11;
            jacobian[1][lane] = by_ray.m12;
            jacobian[2][lane] = by_ray.m21;
            jacobian[3][lane] = by_ray.m22;
            next[0][lane] = x[lane] - (a * du + b * dv);
            next[1][lane] = y[lane] - (c * du + d * dv);
        }
        Self { residual, jacobian, next }
    }
}

/// Newton's method on its way to the ray of a point.
struct Search<T> {
    distorted: Vector2<T>,
    ray: Vector2<T>,
    /// At the ray.
    jacobian: Matrix2<T>,
    /// The best that rounding allows: a few units in the last place of the larger coordinate.
    tolerance: T,
    /// Of the iteration before.
    error: Option<T>,
    state: State,
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    Going,
    Found,
    None,
}

impl<T: Real> Search<T> {
    fn new(distorted: Vector2<T>) -> Self {
        let scale = T::one() + distorted.amax();
        let tolerance = scale * T::default_epsilon() * T::lit(2.0);
        let jacobian = Matrix2::identity();
        Self { distorted, ray: distorted, jacobian, tolerance, error: None, state: State::Going }
    }

    /// One iteration.
    #[inline(always)]
    fn step(&mut self, bend: impl Fn(Vector2<T>) -> (Vector2<T>, Matrix2<T>), max_radius2: T) {
        let (seen, jacobian) = bend(self.ray);
        let residual = seen - self.distorted;
        self.jacobian = jacobian;
        if !self.ends(residual, max_radius2) {
            let inverse = inverse(&self.jacobian);
            self.moves(self.ray - inverse.unwrap_or_default() * residual, inverse.is_some());
        }
    }

    /// One iteration, which was tried in a lane.
    #[inline(always)]
    #[allow(clippy::indexing_slicing, reason = "a lane is below N")]
    fn take<const N: usize>(&mut self, tried: &Tried<T, N>, lane: usize, max_radius2: T) {
        let [m11, m12, m21, m22] = tried.jacobian.each_ref().map(|column| column[lane]);
        self.jacobian = Matrix2::new(m11, m12, m21, m22);
        let pair = |columns: &[[T; N]; 2]| Vector2::new(columns[0][lane], columns[1][lane]);
        if !self.ends(pair(&tried.residual), max_radius2) {
            self.moves(pair(&tried.next), inverse(&self.jacobian).is_some());
        }
    }

    /// Whether the search ends at its ray, by the residual there.
    #[inline(always)]
    fn ends(&mut self, residual: Vector2<T>, max_radius2: T) -> bool {
        let error = residual.amax();
        let settled = error <= self.tolerance;
        // Close to the answer rounding ends the progress: more iterations would only wander.
        let stalled =
            error <= self.tolerance * T::lit(8.0) && self.error.is_some_and(|before| error >= before);
        if settled || stalled {
            let one_to_one =
                self.ray.norm_squared() <= max_radius2 && self.jacobian.determinant() > T::zero();
            self.state = if one_to_one { State::Found } else { State::None };
            return true;
        }
        self.error = Some(error);
        false
    }

    #[inline(always)]
    fn moves(&mut self, ray: Vector2<T>, determined: bool) {
        self.ray = ray;
        if !(determined && ray.x.is_finite() && ray.y.is_finite()) {
            self.state = State::None;
        }
    }

    fn found(self) -> Option<(Vector2<T>, Matrix2<T>)> {
        (self.state == State::Found).then_some((self.ray, self.jacobian))
    }
}
