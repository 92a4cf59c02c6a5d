//! Answers as lines of text, for people at a terminal and for boards without a decoder.
//!
//! A line is a word and then `name=value`, in an order that stays: what is new comes at the end. `SPEC.md` has them all.
//! Numbers are written from integers here, since the standard library's formatting of `f32` takes 10 KiB of flash.
use heapless::String;
use monorange_protocol::message::*;
use nalgebra::ComplexField;

/// Bytes of a line, at most.
const LONGEST: usize = 320;
/// Decimals of metres, and of degrees.
const METRES: u32 = 3;
const DEGREES: u32 = 2;

/// The line of a picture. `corners` are all of it, `nearest` that of the least range.
pub fn picture(pose: &Pose, corners: usize, nearest: Option<&Observation>, write: &mut dyn FnMut(&[u8])) {
    let [var_x, _, _, var_y, _, var_heading] = pose.covariance;
    let mut line = Line::new(if pose.predicted_only { "predicted" } else { "pose" });
    line.whole("frame", pose.frame.into());
    line.seconds("t", pose.time_us);
    let [x, y] = pose.position;
    line.number("x", x, METRES).number("y", y, METRES);
    line.number("heading_deg", pose.heading.to_degrees(), DEGREES);
    line.number("std_x", deviation(var_x), METRES).number("std_y", deviation(var_y), METRES);
    line.number("std_heading_deg", deviation(var_heading).to_degrees(), DEGREES);
    line.whole("landmarks", pose.landmarks.into()).whole("reset_count", pose.reset_count.into());
    line.whole("corners", corners as u64);
    if let Some(Observation { range, bearing, covariance: [var_range, ..], .. }) = nearest {
        line.number("nearest", *range, METRES).number("bearing_deg", bearing.to_degrees(), DEGREES);
        line.number("std_nearest", deviation(*var_range), METRES);
    }
    line.end(write);
}

/// The corner of the least range.
pub fn nearest(observations: impl Iterator<Item = Observation>) -> Option<Observation> {
    observations.min_by(|a, b| a.range.total_cmp(&b.range))
}

/// The lines of a message; those of a picture are [`picture`]'s, and what is for machines only has none.
pub fn message(message: &DeviceMessage<'_>, write: &mut dyn FnMut(&[u8])) {
    match message {
        DeviceMessage::Info(info) => {
            let mut line = Line::new("info");
            line.name("board").text(info.board).name("firmware");
            for (number, dot) in info.firmware.into_iter().zip(["", ".", "."]) {
                line.text(dot).digits(number.into(), 1);
            }
            line.whole("reset_count", info.reset_count.into()).whole("configured", info.configured.into());
            line.end(write);
        }
        DeviceMessage::Fault(fault) => {
            let mut line = Line::new("fault");
            line.whole("cause", fault.cause as u64).whole("detail", fault.detail.into());
            line.text(" ").text(reason(fault.cause)).end(write);
        }
        DeviceMessage::Ranges(ranges) => {
            for (number, ranged) in (0..).zip(&ranges.ranges) {
                range(ranges.request, number, ranged).end(write);
            }
        }
        DeviceMessage::Map(map) => map.landmarks.iter().for_each(|one| landmark(one).end(write)),
        DeviceMessage::Statistics(told) => {
            let mut line = Line::new("statistics");
            line.whole("frames", told.frames_done.into()).whole("dropped", told.frames_dropped.into());
            line.whole("unsent", told.unsent.into()).whole("lost", told.link.lost.into());
            line.whole("damaged", told.link.corrupt().into());
            line.whole("stack_used", told.stack_used.into()).whole("stack_size", told.stack_size.into());
            line.seconds("uptime", told.uptime_us).end(write);
        }
        _ => {}
    }
}

fn range(request: u32, number: u64, ranged: &Ranged) -> Line {
    let mut line = Line::new("range");
    line.whole("request", request.into()).whole("number", number).name("sight").text(match ranged.sight {
        Sight::Floor => "floor",
        Sight::AboveHorizon => "above_horizon",
        Sight::OutsideImage => "outside_picture",
        Sight::OutsideLensModel => "outside_lens_model",
    });
    if ranged.sight == Sight::Floor {
        let [var_range, _, var_bearing] = ranged.covariance;
        line.number("range", ranged.range, METRES);
        line.number("bearing_deg", ranged.bearing.to_degrees(), DEGREES);
        line.number("std_range", deviation(var_range), METRES);
        line.number("std_bearing_deg", deviation(var_bearing).to_degrees(), DEGREES);
    }
    line
}

fn landmark(landmark: &Landmark) -> Line {
    let ([x, y], [var_x, _, var_y]) = (landmark.position, landmark.covariance);
    let mut line = Line::new("landmark");
    line.whole("id", landmark.id.into()).number("x", x, METRES).number("y", y, METRES);
    line.number("std_x", deviation(var_x), METRES).number("std_y", deviation(var_y), METRES);
    line.whole("seen", landmark.seen.into()).whole("confirmed", landmark.confirmed.into());
    line
}

fn deviation(variance: f32) -> f32 {
    ComplexField::sqrt(variance)
}

/// A fault in words.
fn reason(cause: Cause) -> &'static str {
    match cause {
        Cause::Version => "another version of the protocol",
        Cause::NotConfigured => "not configured",
        Cause::Configuration => "the configuration is refused",
        Cause::PictureSize => "the picture does not fit the camera",
        Cause::FrameDropped => "the picture was given up",
        Cause::State => "the state is refused",
        Cause::Odometry => "the motion is refused",
        Cause::NotUnderstood => "the message is not understood",
    }
}

/// A line that grows; what does not fit is cut.
struct Line(String<LONGEST>);

impl Line {
    fn new(word: &str) -> Self {
        let mut line = Self(String::new());
        line.text(word);
        line
    }

    fn text(&mut self, text: &str) -> &mut Self {
        let _ = self.0.push_str(text);
        self
    }

    fn name(&mut self, name: &str) -> &mut Self {
        self.text(" ").text(name).text("=")
    }

    fn whole(&mut self, name: &str, value: u64) -> &mut Self {
        self.name(name).digits(value, 1)
    }

    /// A time in s, to the microsecond.
    fn seconds(&mut self, name: &str, us: u64) -> &mut Self {
        self.name(name).digits(us / 1_000_000, 1).text(".").digits(us % 1_000_000, 6)
    }

    /// A number with so many decimals; `nan` where it is none, or beyond 10¹².
    fn number(&mut self, name: &str, value: f32, decimals: u32) -> &mut Self {
        let scale = 10_u64.pow(decimals);
        let size = value.abs() * scale as f32 + 0.5;
        self.name(name);
        if size.is_nan() || size > 1e15 {
            return self.text("nan");
        }
        let scaled = size as u64;
        self.text(if value < 0.0 && scaled > 0 { "-" } else { "" });
        self.digits(scaled / scale, 1).text(".").digits(scaled % scale, decimals as usize)
    }

    /// The digits of a number, at least so many.
    fn digits(&mut self, mut value: u64, least: usize) -> &mut Self {
        let mut digits = String::<20>::new();
        while value > 0 || digits.len() < least {
            let _ = digits.push(char::from(b'0' + (value % 10) as u8)); // 20 hold any
            value /= 10;
        }
        digits.chars().rev().for_each(|digit| drop(self.0.push(digit)));
        self
    }

    fn end(&mut self, write: &mut dyn FnMut(&[u8])) {
        let _ = self.0.push_str("\r\n");
        write(self.0.as_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{format, string::String as Text};

    fn written(value: f32, decimals: u32) -> Text {
        Line(String::new()).number("n", value, decimals).0.as_str().into()
    }

    #[test]
    fn numbers_are_written_as_the_standard_library_does() {
        for value in [0.0, 0.125, -0.25, 3.5, -17.75, 1234.5, 99.875, 1e6, -0.015625] {
            assert_eq!(written(value, 3), format!(" n={value:.3}"));
        }
        assert_eq!(
            [written(-1e-5, 3), written(0.996, 2), written(f32::NAN, 2)],
            [" n=0.000", " n=1.00", " n=nan"]
        );
        assert_eq!([written(f32::INFINITY, 3), written(-1e30, 3)], [" n=nan", " n=nan"]);
    }

    #[test]
    fn the_longest_line_fits() {
        let pose = Pose {
            frame: u32::MAX,
            time_us: u64::MAX,
            position: [-99_999.0; 2],
            heading: -core::f32::consts::PI,
            covariance: [1e8; 6],
            reset_count: 255,
            predicted_only: true,
            landmarks: u16::MAX,
        };
        let corner = Observation {
            pixel: [0.0; 2],
            range: 9_999.0,
            bearing: -3.0,
            covariance: [1e8; 3],
            landmark: None,
            decision: Decision::Birth,
            nis: None,
        };
        let mut length = 0;
        picture(&pose, 32, Some(&corner), &mut |line| length = line.len());
        assert!(length < LONGEST, "{length}");
    }
}
