//! What a sequence of resolutions tends to.

/// The limit of a quantity on ever finer meshes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// The extrapolated value.
    pub value: f64,
    /// The observed order p of the error, ∝ hᵖ; none where the values agree already.
    pub order: Option<f64>,
}

/// Orders below this are no convergence: the limit would be further away than all values from each
/// other.
pub const LEAST_ORDER: f64 = 0.2;

/// Richardson's extrapolation of values at the cell sizes h, h/2 and h/4, with the order that they
/// show themselves: p = log₂((a − b)/(b − c)), limit c + (c − b)/(2ᵖ − 1).
///
/// Values that differ by no more than `rounding` have their limit already. `None` where the
/// differences don't shrink, or change sign.
///
/// Source: Richardson 1911; Roache 1998.
///
/// ```
/// let limit = muslin::lab::limit::limit([3.0, 2.5, 2.25], 1e-9).unwrap();
/// assert_eq!((limit.value, limit.order), (2.0, Some(1.0)));
/// ```
pub fn limit([a, b, c]: [f64; 3], rounding: f64) -> Option<Limit> {
    let (first, second) = (a - b, b - c);
    if second.abs() <= rounding {
        let (value, order) = (c, None);
        return (first.abs() <= 16.0 * rounding.max(second.abs()))
            .then_some(Limit { value, order })
            .or(extrapolated(first, second, c));
    }
    extrapolated(first, second, c)
}

fn extrapolated(first: f64, second: f64, c: f64) -> Option<Limit> {
    let order = (first / second).log2();
    (order.is_finite() && order >= LEAST_ORDER).then(|| Limit {
        value: c - second / (order.exp2() - 1.0),
        order: Some(order),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_sequences_have_their_limit_and_order() {
        for order in [0.5, 1.0, 1.7, 2.0, 4.0] {
            for (value, size) in [(5.0, 1.0), (0.0, -3.0), (-2.0, 1e-3)] {
                let values = [1.0, 0.5, 0.25].map(|h: f64| value + size * h.powf(order));
                let found = limit(values, 1e-14).unwrap();
                assert!((found.value - value).abs() < 1e-10, "{order}: {found:?}");
                assert!((found.order.unwrap() - order).abs() < 1e-8, "{found:?}");
            }
        }
    }

    #[test]
    fn values_that_agree_are_the_limit() {
        let found = limit([1.0, 1.0 + 1e-12, 1.0], 1e-9).unwrap();
        assert_eq!((found.value, found.order), (1.0, None));
        assert_eq!(limit([0.0; 3], 0.0).unwrap().value, 0.0);
    }

    #[test]
    fn what_grows_or_swings_has_no_limit() {
        for values in [[1.0, 2.0, 4.0], [1.0, 2.0, 3.0], [1.0, 2.0, 1.5]] {
            assert_eq!(limit(values, 1e-9), None, "{values:?}");
        }
        assert_eq!(limit([1.0, f64::NAN, 2.0], 1e-9), None);
    }
}
