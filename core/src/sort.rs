//! Shell's sort with Ciura's gaps, for up to some hundred items: the standard library's sort is 5 to 20 kB of code for
//! every type, which a firmware's flash and a page's first load pay for.
use core::cmp::Ordering;

const GAPS: [usize; 8] = [701, 301, 132, 57, 23, 10, 4, 1];

/// Sorts in place; equal items come in any order.
pub(crate) fn sort_small<T>(items: &mut [T], order: impl Fn(&T, &T) -> Ordering) {
    for gap in GAPS {
        for end in gap..items.len() {
            let mut at = end;
            while let Some(before) = at.checked_sub(gap)
                && let Some([first, .., last]) = items.get(before..=at)
                && order(last, first) == Ordering::Less
            {
                items.swap(before, at);
                at = before;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::sort_small;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn as_the_standard_library_sorts(items in proptest::collection::vec(any::<u16>(), 0..900)) {
            let mut expected = items.clone();
            expected.sort_unstable();
            let mut sorted = items;
            sort_small(&mut sorted, u16::cmp);
            prop_assert_eq!(sorted, expected);
        }
    }
}
