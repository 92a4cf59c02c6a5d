//! Polylines over the picture and the floor: horizon, grid, footprint.
use monorange_core::geometry::RangeFinder;
use nalgebra::Vector2;

/// Vertices of a curve where the lens bends straight lines.
const STEPS: u16 = 48;

/// The horizon as rows u, v, from left to right; empty where the camera sees none.
pub fn horizon(finder: &RangeFinder<f32>) -> Vec<f32> {
    let line = finder.horizon();
    let camera = finder.camera();
    // The point of the line nearest to the axis, and its direction.
    let squared = line.x * line.x + line.y * line.y;
    if squared < 1e-12 {
        return Vec::new();
    }
    let nearest = Vector2::new(line.x, line.y) * (-line.z / squared);
    let mut along = Vector2::new(-line.y, line.x) / libm::sqrtf(squared);
    if along.x < 0.0 {
        along = -along;
    }
    let mut rows = Vec::new();
    for step in 0..=STEPS {
        let fraction = f32::from(step) / f32::from(STEPS) * 2.0 - 1.0;
        if let Some(pixel) = camera.pixel_from_ray(nearest + along * (2.0 * fraction)) {
            rows.extend([pixel.x, pixel.y]);
        }
    }
    rows
}

/// Grid lines every `spacing` metres within `reach`, as rows u, v, range, each line ended by a row NaN, NaN,
/// label: the line's distance ahead for lines across, NaN for lines along the robot's x axis.
pub fn grid(finder: &RangeFinder<f32>, spacing: f32, reach: f32) -> Vec<f32> {
    let mut rows = Vec::new();
    if !(spacing > 0.0 && reach.is_finite()) {
        return rows;
    }
    let lines = (reach / spacing).clamp(0.0, 200.0) as i16;
    for index in -lines..=lines {
        let offset = f32::from(index) * spacing;
        trace(finder, reach, &mut rows, |along| Vector2::new(offset, along), offset);
        trace(finder, reach, &mut rows, |along| Vector2::new(along, offset), f32::NAN);
    }
    rows
}

/// Appends the visible stretches of one floor line, cut to the circle of `reach`.
fn trace(
    finder: &RangeFinder<f32>,
    reach: f32,
    rows: &mut Vec<f32>,
    point: impl Fn(f32) -> Vector2<f32>,
    label: f32,
) {
    let offset = point(0.0).norm();
    if offset >= reach {
        return;
    }
    let half = libm::sqrtf(reach * reach - offset * offset);
    let camera = finder.camera();
    let (width, height) = (camera.width() as f32, camera.height() as f32);
    // A line that leaves the picture by more than its size need not be drawn further.
    let near = |pixel: &Vector2<f32>| {
        (-width..2.0 * width).contains(&pixel.x) && (-height..2.0 * height).contains(&pixel.y)
    };
    let mut open = false;
    for step in -i32::from(STEPS)..=i32::from(STEPS) {
        // Denser close to the robot, where perspective bends and stretches most.
        let fraction = step as f32 / f32::from(STEPS);
        let along = fraction * fraction.abs() * half;
        let at = point(along);
        match finder.pixel_from_floor_unbounded(at).ok().filter(near) {
            Some(pixel) => {
                rows.extend([pixel.x, pixel.y, at.norm()]);
                open = true;
            }
            None if open => {
                rows.extend([f32::NAN, f32::NAN, label]);
                open = false;
            }
            None => {}
        }
    }
    if open {
        rows.extend([f32::NAN, f32::NAN, label]);
    }
}

/// The outline of the floor that the picture shows, as rows x, y in the robot's frame: the picture's border
/// seen on the floor, cut at `reach` metres.
pub fn footprint(finder: &RangeFinder<f32>, reach: f32) -> Vec<f32> {
    let camera = finder.camera();
    let (right, bottom) = (camera.width() as f32 - 1.0, camera.height() as f32 - 1.0);
    let lerp = |step: u16, end: f32| end * f32::from(step) / f32::from(STEPS);
    let mut border = Vec::new();
    border.extend((0..STEPS).map(|step| Vector2::new(0.0, bottom - lerp(step, bottom))));
    border.extend((0..STEPS).map(|step| Vector2::new(lerp(step, right), 0.0)));
    border.extend((0..STEPS).map(|step| Vector2::new(right, lerp(step, bottom))));
    border.extend((0..STEPS).map(|step| Vector2::new(right - lerp(step, right), bottom)));
    let mut rows = Vec::new();
    for pixel in border {
        let Some(ray) = camera.ray_from_pixel(pixel) else { continue };
        let direction = finder.robot_from_cam() * ray.push(1.0);
        let lever = finder.mount().lever_arm();
        let flat = direction.xy();
        let length = flat.norm();
        // Above the horizon, and beyond the reach, the footprint ends on the circle of `reach`.
        let distance = match direction.z < 0.0 {
            true => length * finder.mount().height() / -direction.z,
            false => reach,
        };
        if length > 0.0 {
            let point = lever + flat * (distance.min(reach) / length);
            rows.extend([point.x, point.y]);
        }
    }
    rows
}
