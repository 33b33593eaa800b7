//! Lengths and times as they are typed: a number with its unit.

/// A length in m: `1mm`, `0.5cm`, `1e-3m`; a bare number is in metres.
pub(super) fn length(text: &str) -> Result<f64, String> {
    const UNITS: [(&str, f64); 5] = [
        ("mm", 1e-3),
        ("cm", 1e-2),
        ("um", 1e-6),
        ("µm", 1e-6),
        ("m", 1.0),
    ];
    quantity(text, &UNITS, "length", "1mm, 0.5cm or 1e-3m")
}

/// A time in s: `16ms`, `0.016s`; a bare number is in seconds.
pub(super) fn time(text: &str) -> Result<f64, String> {
    const UNITS: [(&str, f64); 4] = [("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6), ("s", 1.0)];
    quantity(text, &UNITS, "time", "16ms or 0.016s")
}

/// A positive number with one of `units`, whose longer names come first.
fn quantity(text: &str, units: &[(&str, f64)], what: &str, examples: &str) -> Result<f64, String> {
    let text = text.trim();
    let (number, unit) = units
        .iter()
        .find_map(|(name, unit)| Some((text.strip_suffix(name)?, *unit)))
        .unwrap_or((text, 1.0));
    let Ok(value) = number.trim_end().parse::<f64>() else {
        return Err(format!("this is no {what}: write {examples}"));
    };
    let value = value * unit;
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(format!("must be more than nothing: write {examples}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read() {
        let lengths = ["1mm", "0.1cm", "1e-3m", "1e-3", "1000um", " 1 mm"].map(length);
        for read in lengths {
            assert!((read.unwrap() - 1e-3).abs() < 1e-18);
        }
        for read in ["16ms", "0.016s", "0.016", "16000µs"].map(time) {
            assert!((read.unwrap() - 0.016).abs() < 1e-15);
        }
    }

    #[test]
    fn slips_are_errors_that_say_what_to_write() {
        for text in [
            "", "mm", "1 inch", "1,5mm", "16ms", "0mm", "-1mm", "nan", "infm",
        ] {
            let error = length(text).unwrap_err();
            assert!(error.contains("1mm"), "{text}: {error}");
        }
        for text in ["16mm", "16 fps", "0", "-3s"] {
            let error = time(text).unwrap_err();
            assert!(error.contains("16ms"), "{text}: {error}");
        }
    }
}
