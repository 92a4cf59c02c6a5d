//! Everything that may be a corner of the floor, with all that it is judged by: `proposals LIST OUT.csv`.
//!
//! `LIST` has lines of two paths, a rig and a picture, with a tab between them. Columns: picture, u, v (px), iu, iv (where an
//! ideal camera would see it), range (m), probability, the covariance of the pixel, every feature of `proposals::FEATURE_NAMES`,
//! then 256 grey levels of the patch (16 rows of 16, every two units of 1/370 rad, upright along gravity) and 144 of the
//! context (12 rows of 12, every six units). Candidates with an empty `u` never come; a picture without any has no row.
use monorange_core::proposals::{CONTEXT_SIDE, Candidate, FEATURE_NAMES, OnHeap, PATCH_SIDE, ProposalConfig};
use monorange_formats::{files::Rig, pictures::Picture};
use std::fmt::Write as _;
use std::io::Write as _;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(list), Some(out)) = (arguments.next(), arguments.next()) else {
        return Err("usage: proposals LIST OUT.csv".into());
    };
    let mut out = std::io::BufWriter::new(std::fs::File::create(out)?);
    let patch = (0..PATCH_SIDE * PATCH_SIDE).map(|k| format!("p{k}"));
    let context = (0..CONTEXT_SIDE * CONTEXT_SIDE).map(|k| format!("c{k}"));
    let first = ["picture", "u", "v", "iu", "iv", "range", "probability", "var_u", "cov_uv", "var_v"];
    let names = first.iter().chain(&FEATURE_NAMES).map(ToString::to_string).chain(patch).chain(context);
    writeln!(out, "{}", names.collect::<Vec<_>>().join(","))?;
    for line in std::fs::read_to_string(list)?.lines() {
        let (rig, picture) = line.split_once('\t').ok_or("a line has no tab")?;
        let rig = Rig::read(rig.as_ref())?;
        let mut extractor = OnHeap::on_heap(ProposalConfig::default(), rig.settings.finder)?;
        let pixels = Picture::read(picture.as_ref())?;
        for row in pixels.grey()?.rows() {
            extractor.push_row(row)?;
        }
        let mut text = String::new();
        extractor.finish_and(&mut |candidate| row(&mut text, picture, candidate))?;
        out.write_all(text.as_bytes())?;
    }
    Ok(())
}

fn row(text: &mut String, picture: &str, candidate: &Candidate) {
    let one = &candidate.proposal;
    let c = one.covariance;
    let _ = write!(
        text,
        "{picture},{:.3},{:.3},{:.3},{:.3},{:.4},{:.5},{:.4},{:.4},{:.4}",
        one.pixel.x, one.pixel.y, one.ideal.x, one.ideal.y, one.range, one.probability, c.m11, c.m12, c.m22
    );
    for value in candidate.features.values() {
        let _ = write!(text, ",{value:.5}");
    }
    for grey in candidate.patch.iter().chain(&candidate.context) {
        let _ = write!(text, ",{grey}");
    }
    text.push('\n');
}
