//! The messages that are read, field by field as ROS 2 lays them out.
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use re_cdr::{BigEndian, ByteOrder, CdrReader, Error, LittleEndian};

type Read<T> = Result<T, Error>;

/// A stamp: seconds and nanoseconds.
pub(super) type Stamp = (i32, u32);

/// Seconds of a stamp, the same number as its decimal text gives.
pub fn seconds(stamp: (i32, u32)) -> f64 {
    let nanoseconds = i64::from(stamp.0) * 1_000_000_000 + i64::from(stamp.1);
    let (sign, size) = (if nanoseconds < 0 { "-" } else { "" }, nanoseconds.unsigned_abs());
    let text = format!("{sign}{}.{:09}", size / 1_000_000_000, size % 1_000_000_000);
    text.parse().unwrap_or(nanoseconds as f64 * 1e-9)
}

/// A picture, `sensor_msgs/msg/Image`.
pub(super) struct Image<'a> {
    pub(super) head: Header<'a>,
    pub(super) height: usize,
    pub(super) width: usize,
    pub(super) encoding: &'a str,
    pub(super) big_endian: bool,
    /// Bytes from a row to the next.
    pub(super) step: usize,
    pub(super) data: &'a [u8],
}

/// A packed picture, `sensor_msgs/msg/CompressedImage`.
pub(super) struct CompressedImage<'a> {
    pub(super) head: Header<'a>,
    pub(super) format: &'a str,
    pub(super) data: &'a [u8],
}

/// `std_msgs/msg/Header`.
#[derive(Clone, Copy)]
pub(super) struct Header<'a> {
    pub(super) stamp: Stamp,
    pub(super) frame: &'a str,
}

/// What `nav_msgs/msg/Odometry` says of a plane motion.
#[derive(Clone, Debug)]
pub(super) struct Moved {
    pub(super) stamp: Stamp,
    /// The robot's frame.
    pub(super) frame: String,
    pub(super) odom_from_robot: Isometry3<f64>,
    /// Forward speed and turn rate: m/s, rad/s.
    pub(super) speeds: [f64; 2],
}

/// A transform of `tf2_msgs/msg/TFMessage`.
#[derive(Clone, Debug)]
pub(super) struct Link {
    pub(super) parent: String,
    pub(super) child: String,
    pub(super) parent_from_child: Isometry3<f64>,
}

/// What `sensor_msgs/msg/CameraInfo` says, as the file of that name says it.
#[derive(Clone, Debug)]
pub(super) struct CameraInfo {
    pub(super) yaml: String,
}

/// Reads a message of either byte order.
macro_rules! either_order {
    ($name:ident, $read:ident, $out:ty) => {
        pub(super) fn $name(data: &[u8]) -> Read<$out> {
            match data {
                [_, 0, _, _, body @ ..] => $read::<BigEndian>(&mut CdrReader::new(body)),
                [_, 1, _, _, body @ ..] => $read::<LittleEndian>(&mut CdrReader::new(body)),
                [_, kind, ..] => Err(Error::Custom(format!("CDR of kind {kind} is not known"))),
                _ => Err(Error::UnexpectedEof),
            }
        }
    };
}
either_order!(image, read_image, Image<'_>);
either_order!(compressed_image, read_compressed, CompressedImage<'_>);
either_order!(odometry, read_odometry, Moved);
either_order!(camera_info, read_camera_info, CameraInfo);
either_order!(transforms, read_transforms, Vec<Link>);

fn read_header<'a, B: ByteOrder>(from: &mut CdrReader<'a, B>) -> Read<Header<'a>> {
    let stamp = (from.read_i32()?, from.read_u32()?);
    Ok(Header { stamp, frame: from.read_str()? })
}

fn read_image<'a, B: ByteOrder>(from: &mut CdrReader<'a, B>) -> Read<Image<'a>> {
    let head = read_header(from)?;
    let (height, width) = (from.read_u32()? as usize, from.read_u32()? as usize);
    let encoding = from.read_str()?;
    let (big_endian, step) = (from.read_u8()? != 0, from.read_u32()? as usize);
    Ok(Image { head, height, width, encoding, big_endian, step, data: from.read_byte_sequence()? })
}

fn read_compressed<'a, B: ByteOrder>(from: &mut CdrReader<'a, B>) -> Read<CompressedImage<'a>> {
    let (head, format) = (read_header(from)?, from.read_str()?);
    Ok(CompressedImage { head, format, data: from.read_byte_sequence()? })
}

fn numbers<const N: usize, B: ByteOrder>(from: &mut CdrReader<'_, B>) -> Read<[f64; N]> {
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        *number = from.read_f64()?;
    }
    Ok(numbers)
}

fn read_pose<B: ByteOrder>(from: &mut CdrReader<'_, B>) -> Read<Isometry3<f64>> {
    let ([x, y, z], [i, j, k, w]) = (numbers(from)?, numbers(from)?);
    let turn = Quaternion::new(w, i, j, k);
    // A quaternion that was never filled in is no turn.
    let turn = UnitQuaternion::try_new(turn, 1e-6).unwrap_or_else(UnitQuaternion::identity);
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), turn))
}

fn read_odometry<B: ByteOrder>(from: &mut CdrReader<'_, B>) -> Read<Moved> {
    let stamp = read_header(from)?.stamp;
    let frame = from.read_string()?;
    let odom_from_robot = read_pose(from)?;
    let _: [f64; 36] = numbers(from)?;
    let [forward, _, _, _, _, turn] = numbers(from)?;
    Ok(Moved { stamp, frame, odom_from_robot, speeds: [forward, turn] })
}

fn read_camera_info<B: ByteOrder>(from: &mut CdrReader<'_, B>) -> Read<CameraInfo> {
    read_header(from)?;
    let (height, width) = (from.read_u32()?, from.read_u32()?);
    let model = from.read_string()?;
    let count = from.read_sequence_length()?;
    let coefficients = (0..count).map(|_| from.read_f64()).collect::<Read<Vec<_>>>()?;
    let matrices: ([f64; 9], [f64; 9], [f64; 12]) = (numbers(from)?, numbers(from)?, numbers(from)?);
    let (matrix, turn, projection) = matrices;
    let mut yaml = format!("image_width: {width}\nimage_height: {height}\ndistortion_model: {model:?}\n");
    let named: [(&str, usize, &[f64]); 4] = [
        ("camera_matrix", 3, &matrix),
        ("distortion_coefficients", 1, &coefficients),
        ("rectification_matrix", 3, &turn),
        ("projection_matrix", 3, &projection),
    ];
    for (name, rows, data) in named {
        yaml += &format!("{name}:\n  rows: {rows}\n  cols: {}\n  data: {data:?}\n", data.len() / rows);
    }
    for key in ["binning_x", "binning_y"] {
        yaml += &format!("{key}: {}\n", from.read_u32()?);
    }
    yaml += "roi:\n";
    for key in ["x_offset", "y_offset", "height", "width"] {
        yaml += &format!("  {key}: {}\n", from.read_u32()?);
    }
    Ok(CameraInfo { yaml })
}

fn read_transforms<B: ByteOrder>(from: &mut CdrReader<'_, B>) -> Read<Vec<Link>> {
    let count = from.read_sequence_length()?;
    let mut links = Vec::new();
    for _ in 0..count {
        let parent = read_header(from)?.frame.to_owned();
        let child = from.read_string()?;
        links.push(Link { parent, child, parent_from_child: read_pose(from)? });
    }
    Ok(links)
}

#[cfg(test)]
mod tests {
    use super::seconds;

    #[test]
    fn a_stamp_is_the_number_that_its_decimal_text_is() {
        for (stamp, text) in [
            ((0, 500_000_000), "0.5"),
            ((12, 345_678_000), "12.345678"),
            ((1_700_000_000, 123_456_789), "1700000000.123456789"),
            ((-1, 750_000_000), "-0.25"),
        ] {
            assert_eq!(seconds(stamp), text.parse::<f64>().unwrap(), "{text}");
        }
    }
}
