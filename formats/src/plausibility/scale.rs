use crate::Error;
use nalgebra::Vector2;

/// Warns when an estimate and its truth are in different units: `pairs` are (estimate, truth), m; `what` they are of.
pub fn check_scale(what: &str, pairs: &[(Vector2<f64>, Vector2<f64>)]) {
    let Some((first, true_first)) = pairs.first() else { return };
    let (extent, true_extent) =
        pairs.iter().fold((0.0_f64, 0.0_f64), |(extent, true_extent), (place, truth)| {
            (extent.max((place - first).norm()), true_extent.max((truth - true_first).norm()))
        });
    // A centimetre of an estimate that stands still is no scale.
    if extent < 0.1 || true_extent < 0.1 {
        return;
    }
    let ratio = true_extent / extent;
    let of = |factor: f64, unit| {
        let near = |ratio: f64| (0.7 * factor..1.4 * factor).contains(&ratio);
        match (near(ratio), near(1.0 / ratio)) {
            (true, _) => Some(format!("the true {what} looks like {unit}")),
            (_, true) => Some(format!("the true {what} looks like metres, the estimate's like {unit}")),
            _ => None,
        }
    };
    if let Some(words) = of(100.0, "centimetres").or_else(|| of(1000.0, "millimetres")) {
        let cause =
            format!("the true {what} spans {true_extent:.1} m, the estimate's {extent:.1} m: {words}");
        Error::new(cause).help("lengths are metres in all files").warn();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warnings;

    #[test]
    fn units_are_told_from_errors() {
        let said = |factor: f64| {
            warnings::forget();
            let pairs =
                [0.0, 1000.0, 2000.0].map(|x| (Vector2::new(x, 0.0), Vector2::new(0.9 * factor * x, 0.1)));
            check_scale("path", &pairs);
            warnings::fresh()
        };
        assert!(said(100.0)[0].contains("path looks like centimetres"));
        assert!(said(0.001)[0].contains("the estimate's like millimetres"));
        assert!(said(1.0).is_empty() && said(3.0).is_empty());
    }
}
