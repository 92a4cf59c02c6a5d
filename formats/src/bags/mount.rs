//! The mount out of the transforms of a recording.
use super::messages::Link;
use crate::{Error, Result};
use monorange_core::geometry::Mount;
use nalgebra::{Isometry3, Matrix3};
use std::collections::BTreeMap;

/// The frame on the floor under the robot, by the convention of ROS (REP-120).
const FLOOR: &str = "base_footprint";

/// How the optical frame `camera` sits on the robot's frame `robot`, by the links between them. The floor is where
/// `base_footprint` is; without such a frame, where the robot's is.
pub(super) fn from_links(links: &BTreeMap<String, Link>, camera: &str, robot: &str) -> Result<Mount<f64>> {
    let floor = if links.contains_key(FLOOR) || links.values().any(|link| link.parent == FLOOR) {
        FLOOR
    } else {
        robot
    };
    let [(robot_root, robot_pose), (camera_root, camera_pose), (floor_root, floor_pose)] =
        [robot, camera, floor].map(|frame| to_root(links, frame));
    if camera_root != robot_root || floor_root != robot_root {
        let cause =
            format!("no transforms lead from the pictures' frame `{camera}` to the robot's, `{robot}`");
        return Err(Error::new(cause).help("record /tf_static, or give --rig with a [mount]"));
    }
    let robot_from_camera = robot_pose.inverse() * camera_pose;
    let height = (floor_pose.inverse() * camera_pose).translation.z;
    let turn = robot_from_camera.rotation.to_rotation_matrix();
    let optical = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let axes = turn.matrix() * optical.transpose(); // R_z(yaw) · R_y(tilt) · R_x(roll)
    if turn.matrix().m33 > 0.7 {
        let cause = format!("by its transforms the frame `{camera}` looks up, as no optical frame does");
        let help =
            "pictures must name their optical frame (z forward, REP-103); or give --rig with a [mount]";
        return Err(Error::new(cause).help(help));
    }
    let tilt = libm::asin((-axes.m31).clamp(-1.0, 1.0));
    let (roll, yaw) = (libm::atan2(axes.m32, axes.m33), libm::atan2(axes.m21, axes.m11));
    let [forward, left] = [robot_from_camera.translation.x, robot_from_camera.translation.y];
    Mount::new([height, tilt, roll, yaw, forward, left]).map_err(|error| {
        let cause = format!("the transforms of the frame `{camera}` give no mount: {error}");
        Error::new(cause)
            .help("record /tf_static with base_footprint on the floor, or give --rig with a [mount]")
    })
}

/// The root of the tree that a frame is in, and the frame's pose there.
fn to_root<'a>(links: &'a BTreeMap<String, Link>, frame: &'a str) -> (&'a str, Isometry3<f64>) {
    let (mut root, mut pose) = (frame, Isometry3::identity());
    for _ in 0..=links.len() {
        let Some(link) = links.get(root) else { break };
        (root, pose) = (&link.parent, link.parent_from_child * pose);
    }
    (root, pose)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Translation3, UnitQuaternion};

    fn link(parent: &str, child: &str, at: [f64; 3], turn: Matrix3<f64>) -> (String, Link) {
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
        let parent_from_child = Isometry3::from_parts(Translation3::from(at), turn);
        (child.to_owned(), Link { parent: parent.to_owned(), child: child.to_owned(), parent_from_child })
    }

    #[test]
    fn the_mount_comes_back_out_of_its_transforms() {
        let parameters = [0.4, 0.2, 0.03, -0.1, 0.15, 0.02];
        let mount = Mount::new(parameters).unwrap();
        let flat = Matrix3::identity();
        let links = BTreeMap::from([
            link("base_footprint", "base_link", [0.0, 0.0, 0.1], flat),
            link("base_link", "camera_optical", [0.15, 0.02, 0.3], mount.robot_from_cam()),
        ]);
        let found = from_links(&links, "camera_optical", "base_link").unwrap();
        for (found, wanted) in found.parameters().into_iter().zip(parameters) {
            assert!((found - wanted).abs() < 1e-12, "{found} for {wanted}");
        }
    }

    #[test]
    fn a_frame_that_hangs_nowhere_or_looks_up_is_named() {
        let links = BTreeMap::from([link("base_link", "camera_link", [0.1, 0.0, 0.3], Matrix3::identity())]);
        let lost = from_links(&links, "front_optical", "base_link").unwrap_err().to_string();
        assert!(lost.contains("`front_optical`") && lost.contains("`base_link`"), "{lost}");
        let up = from_links(&links, "camera_link", "base_link").unwrap_err().to_string();
        assert!(up.contains("looks up"), "{up}");
    }
}
