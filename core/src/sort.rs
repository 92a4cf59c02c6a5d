//! Shell's sort, for up to some ten thousand items: the standard library's is 5 to 20 kB of program for every type, which a
//! firmware's flash and a page's first load pay for.

/// Sorts in place by a key; what is nearly sorted already costs little. Equal items come in any order.
pub(crate) fn sort_by_key<T: Copy, K: PartialOrd>(items: &mut [T], key: impl Fn(&T) -> K) {
    sort(items, &key, |other, here| key(other) > *here);
}

/// As [`sort_by_key`], where `follows` says whether its first comes behind its second.
pub(crate) fn sort_by<T: Copy>(items: &mut [T], follows: impl Fn(&T, &T) -> bool) {
    sort(items, |item| *item, follows);
}

/// `read` is what an item on its way is compared by, once for all its comparisons.
fn sort<T: Copy, K>(items: &mut [T], read: impl Fn(&T) -> K, follows: impl Fn(&T, &K) -> bool) {
    for gap in [1001, 144, 16, 1] {
        for at in gap..items.len() {
            let Some(moved) = items.get(at).copied() else { return };
            let here = read(&moved);
            let mut to = at;
            while let Some(from) = to.checked_sub(gap)
                && let Some(other) = items.get(from).copied()
                && follows(&other, &here)
                && let Some(slot) = items.get_mut(to)
            {
                *slot = other;
                to = from;
            }
            if let Some(slot) = items.get_mut(to) {
                *slot = moved;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::sort_by_key;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn as_the_standard_library_sorts(items in proptest::collection::vec(any::<u16>(), 0..2500)) {
            let mut expected = items.clone();
            expected.sort_unstable();
            let mut sorted = items;
            sort_by_key(&mut sorted, |item| *item);
            prop_assert_eq!(sorted, expected);
        }
    }
}
