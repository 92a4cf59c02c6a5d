//! Whether a JPEG has its end: decoders fill what is missing with grey, and grey has corners.

/// Whether the bytes are a JPEG that ends before its end marker.
///
/// A JPEG is a row of segments, `FF`, a marker and two bytes of length; the scan's data behind the marker `DA` runs to
/// the next marker that is neither `00` (a stuffed byte) nor a restart, `D0` to `D7`. `D9` ends the picture.
pub(super) fn is_cut(bytes: &[u8]) -> bool {
    let Some(mut rest) = bytes.strip_prefix(&[0xff, 0xd8]) else { return false };
    loop {
        // To the next marker; what a scan or a careless writer left before it does not count.
        let Some(start) = rest
            .windows(2)
            .position(|pair| matches!(pair, [0xff, marker] if !matches!(marker, 0 | 0xff | 0xd0..=0xd7)))
        else {
            return true;
        };
        let Some([_, marker, segment @ ..]) = rest.get(start..) else { return true };
        if *marker == 0xd9 {
            return false;
        }
        let length = match segment {
            [high, low, ..] => usize::from(u16::from_be_bytes([*high, *low])),
            _ => return true,
        };
        let Some(next) = segment.get(length.max(2)..) else { return true };
        rest = next;
    }
}

/// Whether the bytes are a JPEG that says to be larger than its data can be: a block of 8 × 8 pixels takes a bit at least. Decoding
/// one takes as long as one of that size, minutes for a kilobyte.
pub(super) fn is_too_short(bytes: &[u8]) -> bool {
    let size = bytes.starts_with(&[0xff, 0xd8]).then(|| super::Picture::size_of(bytes)).flatten();
    size.is_some_and(|[width, height]| width.div_ceil(8).saturating_mul(height.div_ceil(8)) / 8 > bytes.len())
}

#[cfg(test)]
mod tests {
    use super::{is_cut, is_too_short};
    use image::{ExtendedColorType, ImageEncoder, codecs::jpeg::JpegEncoder};

    #[test]
    fn every_jpeg_without_its_end_is_cut() {
        let pixels: Vec<u8> = (0..64 * 48).map(|place| (place * 7 % 251) as u8).collect();
        let mut file = Vec::new();
        JpegEncoder::new(&mut file).write_image(&pixels, 64, 48, ExtendedColorType::L8).unwrap();
        assert!(!is_cut(&file));
        for length in 2..file.len() - 1 {
            assert!(is_cut(&file[..length]), "{length} of {} bytes", file.len());
        }
        assert!(!is_too_short(&file));
        file.extend_from_slice(b"a camera's own trailer");
        assert!(!is_cut(&file) && !is_cut(b"\x89PNG"));
    }

    #[test]
    fn a_jpeg_that_says_to_be_larger_than_its_data_can_be_is_damaged() {
        let mut plain = Vec::new();
        JpegEncoder::new(&mut plain).write_image(&[0; 640 * 480], 640, 480, ExtendedColorType::L8).unwrap();
        assert!(!is_too_short(&plain), "{} bytes of one grey", plain.len());
        // Height and width stand behind the frame's marker, its length and its depth.
        let frame = plain.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
        plain[frame + 5..frame + 9].copy_from_slice(&[0x40, 0, 0x40, 0]);
        assert!(is_too_short(&plain));
    }
}
