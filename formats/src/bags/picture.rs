//! Pictures in messages, as grey pixels; encodings are named as in ROS's `sensor_msgs/image_encodings.hpp`.
use super::messages::Image;
use crate::{Error, Result, pictures::Picture};
use image::{DynamicImage, ImageBuffer};

/// What [`raw`] reads, for messages.
const KNOWN: &str =
    "mono8, mono16, rgb8, bgr8, rgba8, bgra8, rgb16, bgr16, bayer_*8, yuv422, yuv422_yuy2, nv12, nv21, nv24";

/// The grey of a raw picture: colours become luma by the same arithmetic as those of a file.
pub(super) fn raw(image: &Image<'_>) -> Result<Picture> {
    let Image { width, height, encoding, big_endian, step, data, .. } = *image;
    let encoding = encoding.to_lowercase();
    // Bytes of a pixel, and which of them are red, green and blue.
    let (bytes, colours): (usize, Option<[usize; 3]>) = match encoding.as_str() {
        "mono8" | "8uc1" | "nv12" | "nv21" | "nv24" => (1, None),
        "rgb8" => (3, Some([0, 1, 2])),
        "bgr8" | "8uc3" => (3, Some([2, 1, 0])),
        "rgba8" => (4, Some([0, 1, 2])),
        "bgra8" | "8uc4" => (4, Some([2, 1, 0])),
        "mono16" | "16uc1" => (2, None),
        "rgb16" => (6, Some([0, 1, 2])),
        "bgr16" | "16uc3" => (6, Some([2, 1, 0])),
        "yuv422" | "uyvy" | "yuv422_yuy2" | "yuyv" => (2, None),
        "bayer_rggb8" | "bayer_bggr8" | "bayer_gbrg8" | "bayer_grbg8" => (1, None),
        _ => {
            let help = format!("give one of {KNOWN}, or a topic of compressed pictures");
            return Err(Error::new(format!("pictures in the encoding `{encoding}` are not read")).help(help));
        }
    };
    let rows = rows(width * bytes, height, step, data)?;
    let pixels: Vec<u8> = match encoding.as_str() {
        "mono16" | "16uc1" | "rgb16" | "bgr16" | "16uc3" => {
            sixteen_bits(rows, width, height, big_endian, colours)?
        }
        "yuv422" | "uyvy" => rows.skip(1).step_by(2).collect(),
        "yuv422_yuy2" | "yuyv" => rows.step_by(2).collect(),
        bayer if bayer.starts_with("bayer_") => without_mosaic(&rows.collect::<Vec<_>>(), width, height),
        _ => match colours {
            None => rows.collect(),
            Some(places) => {
                let pixels: Vec<u8> = rows.collect();
                let colour = |pixel: &[u8]| places.map(|place| pixel.get(place).copied().unwrap_or_default());
                let pixels: Vec<u8> = pixels.chunks_exact(bytes).flat_map(colour).collect();
                let image = ImageBuffer::from_raw(width as u32, height as u32, pixels);
                DynamicImage::ImageRgb8(image.ok_or_else(|| cut_short(0, 0))?).to_luma8().into_raw()
            }
        },
    };
    Ok(Picture { pixels, width, height })
}

/// The bytes of the rows without what fills them up.
fn rows(row: usize, height: usize, step: usize, data: &[u8]) -> Result<impl Iterator<Item = u8> + '_> {
    let step = step.max(row);
    let needed = (step * height).saturating_sub(step - row);
    if data.len() < needed {
        return Err(cut_short(data.len(), needed));
    }
    let rows = data.chunks(step.max(1)).take(height);
    Ok(rows.flat_map(move |whole| whole.iter().take(row).copied()))
}

fn cut_short(there: usize, needed: usize) -> Error {
    Error::new(format!("the picture is cut short: it has {there} bytes, {needed} are needed"))
        .help("record the drive again")
}

fn sixteen_bits(
    rows: impl Iterator<Item = u8>,
    width: usize,
    height: usize,
    big_endian: bool,
    colours: Option<[usize; 3]>,
) -> Result<Vec<u8>> {
    let bytes: Vec<u8> = rows.collect();
    let values = bytes.as_chunks::<2>().0.iter();
    let values: Vec<u16> = match big_endian {
        true => values.map(|pair| u16::from_be_bytes(*pair)).collect(),
        false => values.map(|pair| u16::from_le_bytes(*pair)).collect(),
    };
    let (width, height) = (width as u32, height as u32);
    let image = match colours {
        None => ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageLuma16),
        Some(places) => {
            let colour = |pixel: &[u16]| places.map(|place| pixel.get(place).copied().unwrap_or_default());
            let values = values.chunks_exact(3).flat_map(colour).collect();
            ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageRgb16)
        }
    };
    Ok(image.ok_or_else(|| cut_short(0, 0))?.to_luma8().into_raw())
}

/// Grey of a colour mosaic: (R + 2 G + B) / 4 about every pixel, whatever its own colour, by weights 1 2 1 down and across.
fn without_mosaic(mosaic: &[u8], width: usize, height: usize) -> Vec<u8> {
    // Beyond the border the pattern goes on as mirrored about it, which keeps its colours.
    let mirrored = |at: usize, offset: usize, size: usize| match (at + offset).checked_sub(1) {
        None => 1.min(size - 1),
        Some(place) if place >= size => size.saturating_sub(2),
        Some(place) => place,
    };
    let mut grey = Vec::with_capacity(mosaic.len());
    for y in 0..height {
        for x in 0..width {
            let mut sum = 8;
            for (down, weight_down) in [1_u32, 2, 1].into_iter().enumerate() {
                let row = mirrored(y, down, height) * width;
                for (across, weight) in [1_u32, 2, 1].into_iter().enumerate() {
                    let place = row + mirrored(x, across, width);
                    sum += weight * weight_down * u32::from(mosaic.get(place).copied().unwrap_or_default());
                }
            }
            grey.push((sum / 16) as u8);
        }
    }
    grey
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bags::messages::Header;

    fn grey(encoding: &str, step: usize, big_endian: bool, data: &[u8]) -> Result<Vec<u8>> {
        let head = Header { stamp: (0, 0), frame: "" };
        raw(&Image { head, height: 2, width: 2, encoding, big_endian, step, data })
            .map(|picture| picture.pixels)
    }

    #[test]
    fn every_encoding_gives_the_same_grey() {
        let want = [10, 20, 30, 40];
        let each = |bytes: &dyn Fn(u8) -> Vec<u8>| want.iter().flat_map(|g| bytes(*g)).collect::<Vec<u8>>();
        assert_eq!(grey("mono8", 3, false, &[10, 20, 99, 30, 40, 99]).unwrap(), want);
        assert_eq!(grey("bgr8", 6, false, &each(&|g| vec![g; 3])).unwrap(), want);
        assert_eq!(grey("rgba8", 8, false, &each(&|g| vec![g, g, g, 7])).unwrap(), want);
        assert_eq!(grey("mono16", 4, true, &each(&|g| vec![g, g])).unwrap(), want);
        assert_eq!(grey("mono16", 4, false, &each(&|g| vec![g, g])).unwrap(), want);
        assert_eq!(grey("yuv422", 4, false, &each(&|g| vec![128, g])).unwrap(), want);
        assert_eq!(grey("yuv422_yuy2", 4, false, &each(&|g| vec![g, 128])).unwrap(), want);
        assert_eq!(grey("bayer_rggb8", 2, false, &[50; 4]).unwrap(), [50; 4]);
    }

    #[test]
    fn red_is_red_whichever_end_it_stands_at() {
        let [rgb, bgr] = [("rgb8", [200, 0, 0]), ("bgr8", [0, 0, 200])]
            .map(|(encoding, pixel)| grey(encoding, 6, false, &pixel.repeat(4)).unwrap());
        assert_eq!(rgb, bgr);
        assert_ne!(rgb, grey("rgb8", 6, false, &[0, 0, 200].repeat(4)).unwrap());
    }

    #[test]
    fn an_unknown_encoding_and_a_short_picture_are_named() {
        let unknown = grey("32FC1", 8, false, &[0; 16]).unwrap_err().to_string();
        assert!(unknown.contains("`32fc1`") && unknown.contains("mono8"), "{unknown}");
        assert!(grey("mono8", 2, false, &[0; 3]).unwrap_err().to_string().contains("3 bytes, 4 are needed"));
    }
}
