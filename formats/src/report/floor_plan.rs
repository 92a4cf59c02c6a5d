//! The map from above: trajectory, landmarks and their 3σ ellipses over the laser (the paper's Figure 6).
use super::{
    chart::thin,
    svg::{coordinate, number, path_data, round_step, ticks},
};
use crate::{
    evaluation::Pair,
    files::{MapPoint, Stamped},
};
use monorange_core::geometry::Pose;
use nalgebra::{Matrix2, Vector2};
use std::{collections::HashSet, fmt::Write as _};

const WIDTH: f64 = 1080.0;
const MAX_HEIGHT: f64 = 720.0;
const MARGIN: f64 = 24.0;
/// Laser echoes closer than this are drawn once, m.
const LASER_CELL: f64 = 0.05;

/// What is drawn; whatever is empty is left out.
#[derive(Clone, Copy, Debug, Default)]
pub struct FromAbove<'a> {
    /// Poses in order.
    pub trajectory: &'a [Stamped],
    /// True poses.
    pub pairs: &'a [Pair],
    /// Landmarks.
    pub map: &'a [MapPoint],
    /// True landmarks.
    pub true_map: &'a [Vector2<f64>],
    /// Laser echoes.
    pub laser: &'a [Vector2<f64>],
}

/// The plane of the drawing.
struct Plan {
    scale: f64,
    height: f64,
    /// Lower left and upper right corner, m.
    low: Vector2<f64>,
    high: Vector2<f64>,
}

impl Plan {
    fn around(run: &FromAbove<'_>) -> Self {
        let poses = run.trajectory.iter().map(|stamped| stamped.pose.position());
        let truth = run.pairs.iter().map(|pair| pair.truth.position());
        let landmarks = run.map.iter().map(|point| point.position);
        let points: Vec<_> = poses.chain(truth).chain(landmarks).collect();
        let mut low = points.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
        let mut high = points.iter().copied().reduce(|a, b| a.sup(&b)).unwrap_or_default();
        // A little floor around, and never a plan so thin that it cannot be read.
        let room = ((high - low).max() * 0.04).max(0.5);
        low.add_scalar_mut(-room);
        high.add_scalar_mut(room);
        let least = (high.x - low.x) * 0.22;
        let missing = (least - (high.y - low.y)).max(0.0) / 2.0;
        (low.y, high.y) = (low.y - missing, high.y + missing);
        let size = high - low;
        let scale = ((WIDTH - 2.0 * MARGIN) / size.x).min((MAX_HEIGHT - 2.0 * MARGIN) / size.y);
        // The whole width is used, for what lies beside.
        let beside = ((WIDTH - 2.0 * MARGIN) / scale - size.x) / 2.0;
        (low.x, high.x) = (low.x - beside, high.x + beside);
        Self { scale, height: size.y * scale + 2.0 * MARGIN, low, high }
    }

    fn place(&self, point: Vector2<f64>) -> (f64, f64) {
        (MARGIN + (point.x - self.low.x) * self.scale, MARGIN + (self.high.y - point.y) * self.scale)
    }

    fn shows(&self, point: &Vector2<f64>) -> bool {
        point.x >= self.low.x && point.y >= self.low.y && point.x <= self.high.x && point.y <= self.high.y
    }

    fn line(&self, points: impl Iterator<Item = Vector2<f64>>) -> String {
        path_data(points.map(|point| self.place(point)))
    }

    fn ellipse(&self, class: &str, centre: Vector2<f64>, covariance: &Matrix2<f64>, title: &str) -> String {
        let axes = covariance.symmetric_eigen();
        let [a, b] = [0, 1].map(|axis| 3.0 * axes.eigenvalues[axis].max(0.0).sqrt() * self.scale);
        let direction = axes.eigenvectors.column(0);
        let turn = -libm::atan2(direction.y, direction.x).to_degrees();
        let (x, y) = self.place(centre);
        format!(
            r#"<ellipse class="{class}" rx="{a:.1}" ry="{b:.1}" transform="translate({x:.1} {y:.1}) rotate({turn:.1})"><title>{title}</title></ellipse>"#
        )
    }
}

/// The drawing.
pub fn svg(run: &FromAbove<'_>) -> String {
    let plan = Plan::around(run);
    let mut svg = format!(
        r#"<svg class="plan" viewBox="0 0 {WIDTH} {:.0}" role="img" aria-label="Map from above with the trajectory and {} landmarks">"#,
        plan.height,
        run.map.len()
    );
    svg += &grid(&plan);
    svg += &laser(&plan, run.laser);
    for point in run.true_map.iter().filter(|point| plan.shows(point)) {
        let (x, y) = plan.place(*point);
        let _ = write!(svg, r#"<path class="true-landmark" d="M{x:.1} {y:.1}m-3.5 0h7m-3.5 -3.5v7"/>"#);
    }
    for point in run.map {
        let [x, y] = [point.position.x, point.position.y].map(number);
        let title = format!("landmark {}: x {x} m, y {y} m, seen {} times", point.id, point.seen);
        if let Some(covariance) = &point.covariance {
            svg += &plan.ellipse("landmark-ellipse", point.position, covariance, &title);
        }
        let (x, y) = plan.place(point.position);
        let _ = write!(
            svg,
            r#"<circle class="landmark" cx="{x:.1}" cy="{y:.1}" r="3"><title>{title}</title></circle>"#
        );
    }
    if !run.pairs.is_empty() {
        let truth = thin(run.pairs).map(|pair| pair.truth.position());
        let _ = write!(svg, r#"<path class="truth" d="{}"/>"#, plan.line(truth));
    }
    let path = thin(run.trajectory).map(|stamped| stamped.pose.position());
    let _ = write!(svg, r#"<path class="trajectory" d="{}"/>"#, plan.line(path));
    if let (Some(first), Some(last)) = (run.trajectory.first(), run.trajectory.last()) {
        let (x, y) = plan.place(first.pose.position());
        let _ = write!(
            svg,
            r#"<circle class="start" cx="{x:.1}" cy="{y:.1}" r="5"><title>start</title></circle>"#
        );
        if let Some(covariance) = last.covariance {
            let covariance = covariance.fixed_view::<2, 2>(0, 0).into_owned();
            svg +=
                &plan.ellipse("robot-ellipse", last.pose.position(), &covariance, "3σ of the last position");
        }
        svg += &robot(&plan, &last.pose);
    }
    svg + &scale_bar(&plan) + "</svg>"
}

fn grid(plan: &Plan) -> String {
    let mut svg = String::new();
    let step = round_step(60.0 / plan.scale);
    let count = |low: f64, high: f64| ((high - low) / step).round().max(1.0) as usize;
    for x in ticks([plan.low.x, plan.high.x], count(plan.low.x, plan.high.x)) {
        let ((x, top), (_, bottom)) =
            (plan.place(Vector2::new(x, plan.high.y)), plan.place(Vector2::new(x, plan.low.y)));
        let _ = write!(svg, r#"<path class="grid" d="M{x:.1} {top:.1}V{bottom:.1}"/>"#);
    }
    for y in ticks([plan.low.y, plan.high.y], count(plan.low.y, plan.high.y)) {
        let ((left, y), (right, _)) =
            (plan.place(Vector2::new(plan.low.x, y)), plan.place(Vector2::new(plan.high.x, y)));
        let _ = write!(svg, r#"<path class="grid" d="M{left:.1} {y:.1}H{right:.1}"/>"#);
    }
    svg
}

fn laser(plan: &Plan, echoes: &[Vector2<f64>]) -> String {
    if echoes.is_empty() {
        return String::new();
    }
    let mut taken = HashSet::new();
    let mut data = String::new();
    for echo in echoes.iter().filter(|echo| plan.shows(echo)) {
        let cell = echo.map(|coordinate| (coordinate / LASER_CELL).round() as i64);
        if taken.insert((cell.x, cell.y)) {
            let (x, y) = plan.place(cell.map(|index| index as f64 * LASER_CELL));
            let _ = write!(data, "M{} {}h0", coordinate(x), coordinate(y));
        }
    }
    format!(r#"<path class="laser" d="{data}"/>"#)
}

fn robot(plan: &Plan, pose: &Pose<f64>) -> String {
    let (x, y) = plan.place(pose.position());
    let turn = -pose.heading.to_degrees();
    format!(
        r#"<path class="robot" transform="translate({x:.1} {y:.1}) rotate({turn:.1})" d="M11 0L-7 -6.5L-3.5 0L-7 6.5Z"><title>last pose</title></path>"#
    )
}

fn scale_bar(plan: &Plan) -> String {
    let metres = round_step(70.0 / plan.scale);
    let (length, y) = (metres * plan.scale, plan.height - 12.0);
    format!(
        r#"<path class="scale" d="M{MARGIN} {:.1}v6h{length:.1}v-6"/><text class="tick" x="{:.1}" y="{:.1}">{} m</text>"#,
        y - 6.0,
        MARGIN + length + 8.0,
        y + 1.0,
        number(metres)
    )
}
