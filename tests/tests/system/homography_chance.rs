//! Pictures of different places have no homography, and pictures of one place have one.
//! `tests/examples/homography_chance.rs` measures it over more pairs, real ones among them.
use monorange_tests::chance::{Found, corridor, homography, kinds, seen};

#[test]
fn different_corridors_have_no_homography_and_the_next_picture_has() {
    // Not the corridors that the bounds were chosen on.
    let drives = [207, 208].map(|seed| corridor(seed, 562));
    let frames: Vec<_> = (0..560).step_by(70).collect();
    let (mut pairs, mut accepted) = (0, 0);
    for (name, kind) in kinds() {
        let places = drives.each_ref().map(|drive| {
            let pictures = frames.iter().map(|frame| seen(drive, *frame, kind));
            pictures.collect::<Vec<_>>()
        });
        let [one, two] = &places;
        for (frame, a) in frames.iter().zip(one) {
            let next = homography(a, &seen(&drives[0], *frame + 1, kind));
            assert!(next == Found::Confirmed, "{name}, {frame}");
            pairs += two.len();
            accepted += two.iter().filter(|b| homography(a, b) == Found::Confirmed).count();
        }
    }
    println!("{accepted} of {pairs} pairs of different places");
    assert!(100 * accepted <= pairs, "{accepted} of {pairs}");
}
