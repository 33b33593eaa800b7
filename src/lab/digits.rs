//! Numbers as people read them.

/// Share of a size below which a number beside it is rounding.
const ROUNDING: f64 = 1e-5;

/// A number beside others of a size: 0 where it is their rounding.
pub(super) fn clean(x: f64, scale: f64) -> String {
    number(if x.abs() < ROUNDING * scale { 0.0 } else { x })
}

/// A share in percent with its sign.
pub(super) fn percent(share: f64, digits: usize) -> String {
    format!("{:+.digits$} %", 100.0 * share).replace('-', "−")
}

/// Four digits.
pub(super) fn number(x: f64) -> String {
    if !x.is_finite() {
        return if x > 0.0 {
            "∞".to_owned()
        } else {
            "–".to_owned()
        };
    }
    if x.abs() < 1e-9 {
        return "0".to_owned();
    }
    let size = x.abs().log10().floor();
    if !(-4.0..7.0).contains(&size) {
        return format!("{x:.3e}").replace('-', "−");
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and 7"
    )]
    let digits = (3.0 - size).max(0.0) as usize;
    let text = format!("{x:.digits$}");
    let text = if digits > 0 {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits() {
        let cases = [
            (100.000_001, "100"),
            (37.5, "37.5"),
            (0.333_333_3, "0.3333"),
            (-0.25, "−0.25"),
            (1.0e-5, "1.000e−5"),
            (1e-12, "0"),
            (f64::INFINITY, "∞"),
            (f64::NAN, "–"),
            (12345.6, "12346"),
        ];
        for (x, text) in cases {
            assert_eq!(number(x), text);
        }
    }
}
