//! The layouts of the messages that are written, as MCAP's encoding `ros2msg` wants them: a type's fields, then those of
//! every type in it. Facts of ROS 2's `common_interfaces`; their comments are not needed.

/// Types and their fields.
const LAYOUTS: [(&str, &str); 21] = [
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"),
    ("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"),
    ("geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"),
    ("geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"),
    ("geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"),
    ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    ),
    (
        "geometry_msgs/PoseWithCovarianceStamped",
        "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n",
    ),
    (
        "nav_msgs/Odometry",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n\
         geometry_msgs/TwistWithCovariance twist\n",
    ),
    ("tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"),
    (
        "sensor_msgs/RegionOfInterest",
        "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n",
    ),
    (
        "sensor_msgs/CameraInfo",
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\n\
         float64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n",
    ),
    (
        "sensor_msgs/Image",
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\n\
         uint8[] data\n",
    ),
    ("sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"),
    (
        "sensor_msgs/PointField",
        "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\n\
         uint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n",
    ),
    (
        "sensor_msgs/PointCloud2",
        "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\n\
         uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
    ),
    (
        "sensor_msgs/LaserScan",
        "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\n\
         float32 time_increment\nfloat32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\n\
         float32[] intensities\n",
    ),
];

/// The name of a type in MCAP, `nav_msgs/msg/Odometry` for `nav_msgs/Odometry`.
pub(super) fn full_name(kind: &str) -> String {
    kind.replacen('/', "/msg/", 1)
}

/// The layout of a type with those of all types in it.
pub(super) fn layout(kind: &str) -> String {
    let mut kinds = vec![kind];
    let mut text = String::new();
    let mut next = 0;
    while let Some(kind) = kinds.get(next).copied() {
        let fields = LAYOUTS.iter().find(|(name, _)| *name == kind).map_or("", |(_, fields)| fields);
        if next > 0 {
            text += &format!("{}\nMSG: {kind}\n", "=".repeat(80));
        }
        text += fields;
        for line in fields.lines() {
            let inner = line.split([' ', '[']).next().unwrap_or_default();
            if inner.contains('/') && !kinds.contains(&inner) {
                kinds.push(inner);
            }
        }
        next += 1;
    }
    text
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_layout_brings_every_type_in_it_once() {
        for (kind, _) in super::LAYOUTS {
            let text = super::layout(kind);
            for line in text.lines().filter(|line| line.contains('/') && !line.starts_with("MSG")) {
                let inner = line.split([' ', '[']).next().unwrap();
                assert_eq!(text.matches(&format!("MSG: {inner}\n")).count(), 1, "{inner} in {kind}");
            }
        }
        assert_eq!(super::full_name("nav_msgs/Odometry"), "nav_msgs/msg/Odometry");
    }
}
