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

/// The digits that a text begins with, without leading zeros, and what follows them.
fn split_number(text: &str) -> Option<(&str, &str)> {
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let (digits, rest) = text.split_at(end);
    (end > 0).then(|| (digits.trim_start_matches('0'), rest))
}

#[cfg(test)]
mod tests {
    use super::natural_order;

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
