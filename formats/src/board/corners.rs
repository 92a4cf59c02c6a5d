//! The grid of corners that belongs to the board.
use super::{Board, saddle};
use calib_targets_chessboard::{
    ChessboardDetector, ChessboardParams, GrayImageView, default_chess_config, detect_corners,
};
use monorange_core::calibration::board::BoardPoint;
use monorange_core::image::Grey;
use nalgebra::Vector2;

/// A corner in the grid that was found, whose origin is anywhere.
struct Labelled {
    place: [i32; 2],
    pixel: Vector2<f64>,
}

pub(super) fn find(board: &Board, grey: &Grey<'_>) -> Result<Vec<BoardPoint>, String> {
    let labelled = search(board, grey);
    if labelled.is_empty() {
        return Err("shows no chessboard".to_owned());
    }
    let (window, count) = window(board, &labelled).ok_or("shows no chessboard")?;
    // A corner beyond the board now and then is a chance one; many are another board.
    if 10 * (labelled.len() - count) > labelled.len() {
        let [columns, rows] = [0, 1].map(|axis| {
            let places = labelled.iter().filter_map(|corner| corner.place.get(axis));
            let (least, greatest) =
                places.fold((i32::MAX, i32::MIN), |(a, b), place| (a.min(*place), b.max(*place)));
            greatest - least + 1
        });
        let (more, fewer) = (columns.max(rows), columns.min(rows));
        return Err(format!(
            "shows a grid of {more} × {fewer} inner corners, more than the board's {} × {}",
            board.columns, board.rows
        ));
    }
    if 2 * count < board.count() {
        return Err(format!("shows only {count} of the board's {} corners", board.count()));
    }
    let points = labelled.iter().filter_map(|corner| {
        let on_board = window.place(corner)?.map(f64::from) * board.square;
        let spacing = window.spacing(&labelled, corner)?;
        Some(BoardPoint { on_board, pixel: saddle::refined(grey, corner.pixel, spacing)? })
    });
    Ok(points.collect())
}

/// A picture is halved down to this many pixels: blurred edges of a large photo are sharp there, and it goes quickly.
const SMALL: usize = 500_000;

/// The grid in the picture: looked for in its halves first, from the smallest up, until all of the board is there; else the fullest.
fn search(board: &Board, grey: &Grey<'_>) -> Vec<Labelled> {
    let mut halves = Vec::new();
    let mut size = grey.width() * grey.height();
    while size > SMALL {
        halves.push(half(halves.last(), grey));
        size /= 4;
    }
    let mut best: Vec<Labelled> = Vec::new();
    for level in (0..=halves.len()).rev() {
        let picture = level.checked_sub(1).and_then(|level| halves.get(level));
        let small = picture.and_then(|(pixels, width, height)| Grey::new(pixels, *width, *height).ok());
        let mut found = labelled(small.as_ref().unwrap_or(grey));
        for corner in &mut found {
            // The centre of a half's pixel lies between two pixels.
            (0..level).for_each(|_| corner.pixel = corner.pixel * 2.0 + Vector2::new(0.5, 0.5));
        }
        let seen = |found: &[Labelled]| window(board, found).map_or(0, |(_, count)| count);
        if seen(&found) > seen(&best) || best.is_empty() {
            best = found;
        }
        if seen(&best) == board.count() {
            break;
        }
    }
    best
}

/// Means of 2 × 2 pixels, with width and height.
fn half(smaller: Option<&(Vec<u8>, usize, usize)>, grey: &Grey<'_>) -> (Vec<u8>, usize, usize) {
    let (pixels, width, height) = match smaller {
        Some((pixels, width, height)) => (pixels.as_slice(), *width, *height),
        None => (grey.pixels(), grey.width(), grey.height()),
    };
    let rows = pixels.chunks_exact(width);
    let pairs = rows.clone().step_by(2).zip(rows.skip(1).step_by(2));
    let sum = |pair: &[u8]| pair.iter().map(|value| u16::from(*value)).sum::<u16>();
    let halved = pairs.flat_map(|(upper, lower)| {
        let (upper, lower) = (upper.chunks_exact(2), lower.chunks_exact(2));
        upper.zip(lower).map(|(upper, lower)| ((sum(upper) + sum(lower) + 2) / 4) as u8)
    });
    (halved.collect(), width / 2, height / 2)
}

fn labelled(grey: &Grey<'_>) -> Vec<Labelled> {
    let view = GrayImageView { width: grey.width(), height: grey.height(), data: grey.pixels() };
    let corners = detect_corners(&view, &default_chess_config());
    let found = ChessboardDetector::new(ChessboardParams::default())
        .ok()
        .and_then(|detector| detector.detect(&corners));
    let corners = found.map(|found| found.corners).unwrap_or_default().into_iter();
    corners
        .map(|corner| Labelled {
            place: [corner.grid.u, corner.grid.v],
            pixel: Vector2::new(f64::from(corner.position.x), f64::from(corner.position.y)),
        })
        .collect()
}

/// Where the board is in the grid.
struct Window {
    origin: [i32; 2],
    size: [i32; 2],
}

impl Window {
    fn place(&self, corner: &Labelled) -> Option<Vector2<i32>> {
        let [u, v] = [corner.place[0] - self.origin[0], corner.place[1] - self.origin[1]];
        let inside = (0..self.size[0]).contains(&u) && (0..self.size[1]).contains(&v);
        inside.then(|| Vector2::new(u, v))
    }

    /// Pixels to the nearest neighbour in the grid.
    fn spacing(&self, all: &[Labelled], corner: &Labelled) -> Option<f64> {
        let apart = |other: &Labelled| {
            let [u, v] = [other.place[0] - corner.place[0], other.place[1] - corner.place[1]];
            (u.abs() + v.abs() == 1).then(|| (other.pixel - corner.pixel).norm())
        };
        all.iter().filter_map(apart).min_by(f64::total_cmp)
    }
}

/// The window of the board's size, either way round, with the most corners.
fn window(board: &Board, labelled: &[Labelled]) -> Option<(Window, usize)> {
    let [columns, rows] = [board.columns as i32, board.rows as i32];
    let counted = |window: Window| {
        let count = labelled.iter().filter(|corner| window.place(corner).is_some()).count();
        (window, count)
    };
    let windows = [[columns, rows], [rows, columns]].into_iter().flat_map(|size| {
        let [us, vs] = [0, 1].map(|axis| {
            let places =
                labelled.iter().map(move |corner| if axis == 0 { corner.place[0] } else { corner.place[1] });
            let least = places.clone().min().unwrap_or_default();
            let greatest = places.max().unwrap_or_default();
            let length = if axis == 0 { size[0] } else { size[1] };
            least..=(greatest - length + 1).max(least)
        });
        us.flat_map(move |u| vs.clone().map(move |v| Window { origin: [u, v], size }))
    });
    windows.map(counted).max_by_key(|(_, count)| *count)
}
