use std::cmp::Ordering;

/// The order in which a person would put names: runs of digits by their value, the rest by characters.
pub fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    loop {
        match (split_number(left), split_number(right)) {
            (Some((x, rest_x)), Some((y, rest_y))) => {
                // Without leading zeros the longer number is the larger one, however long.
                let by_value = x.len().cmp(&y.len()).then_with(|| x.cmp(y));
                if by_value != Ordering::Equal {
                    return by_value;
                }
                (left, right) = (rest_x, rest_y);
            }
            _ => {
                let (mut chars_x, mut chars_y) = (left.chars(), right.chars());
                match (chars_x.next(), chars_y.next()) {
                    (Some(x), Some(y)) if x == y => (left, right) = (chars_x.as_str(), chars_y.as_str()),
                    (None, None) => return a.cmp(b), // equal but for leading zeros
                    (x, y) => return x.cmp(&y),
                }
            }
        }
    }
}

/// Puts things into the order in which a person would put their names. Where all names are decimal numbers, such as
/// times, they go by value: .15 comes before .2, which the runs of digits alone do not say.
pub fn sort_names<T>(things: &mut [T], name: impl Fn(&T) -> String) {
    match things.iter().map(|thing| decimals(&name(thing))).collect::<Option<Vec<_>>>() {
        Some(all) if are_numbers(&all) => things.sort_by_cached_key(|thing| {
            let name = name(thing);
            let (whole, fraction) = decimals(&name).unwrap_or_default();
            (whole.len(), whole, fraction, name)
        }),
        _ => things.sort_by(|a, b| natural_order(&name(a), &name(b))),
    }
}

/// The digits before (without leading zeros) and behind the point of a name that is a decimal number but for its extension.
fn decimals(name: &str) -> Option<(String, String)> {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let (whole, fraction) = stem.split_once('.').unwrap_or((stem, ""));
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let number = !whole.is_empty() && digits(whole) && digits(fraction);
    number.then(|| (whole.trim_start_matches('0').to_owned(), fraction.to_owned()))
}

/// Whether names are numbers rather than numbered twice (1.9, 1.10): a number whose digits vary in count is written
/// without a zero at its end.
fn are_numbers(names: &[(String, String)]) -> bool {
    let lengths = names.iter().map(|(_, fraction)| fraction.len());
    let same = lengths.clone().min() == lengths.max();
    same || !names.iter().any(|(_, fraction)| fraction.len() > 1 && fraction.ends_with('0'))
}

/// The digits that a text begins with, without leading zeros, and what follows them.
fn split_number(text: &str) -> Option<(&str, &str)> {
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let (digits, rest) = text.split_at(end);
    (end > 0).then(|| (digits.trim_start_matches('0'), rest))
}

#[cfg(test)]
mod tests {
    use super::{natural_order, sort_names};

    fn sorted<const N: usize>(mut names: [&'static str; N]) -> [&'static str; N] {
        sort_names(&mut names, |name| (*name).to_owned());
        names
    }

    #[test]
    fn names_that_are_times_go_by_value() {
        let times = [
            "1305031102.1.png",
            "1305031102.15.png",
            "1305031102.2.png",
            "1305031102.25.png",
            "1305031103.png",
        ];
        let mut shuffled = times;
        shuffled.reverse();
        assert_eq!(sorted(shuffled), times);
        assert_eq!(sorted(["10.0.png", "9.5.png", "9.25.png"]), ["9.25.png", "9.5.png", "10.0.png"]);
        assert_eq!(
            sorted(["1.10.png", "1.9.png", "1.2.png"]),
            ["1.2.png", "1.9.png", "1.10.png"],
            "numbered twice"
        );
        assert_eq!(sorted(["a1.15.png", "a1.2.png"]), ["a1.2.png", "a1.15.png"]);
    }

    #[test]
    fn names_are_in_the_order_a_person_expects() {
        let mut names =
            ["f10.png", "f9.png", "f2b.png", "f2.png", "f02.png", "a", "f100000000000000000000000.png"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(
            names,
            ["a", "f02.png", "f2.png", "f2b.png", "f9.png", "f10.png", "f100000000000000000000000.png"]
        );
    }
}
