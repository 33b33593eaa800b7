//! What rows of a study say together: which settings are worth their time, and how errors fall.

use super::sweep::{Error, Row};

/// A setting is dominated when another one is faster by this share and no less exact: what differs by
/// less is the machine's mood.
pub const FASTER: f64 = 0.1;

/// Whether another row costs clearly less and is at least as exact; rows that failed always are.
pub fn is_dominated(row: &Row, rows: &[Row]) -> bool {
    row.error == Error::None
        || rows.iter().any(|other| {
            other.at_most() <= row.at_most()
                && other.seconds_per_second < (1.0 - FASTER) * row.seconds_per_second
        })
}

/// The cheapest row whose error is at most `goal` (m RMS).
pub fn cheapest(rows: &[Row], goal: f64) -> Option<&Row> {
    rows.iter()
        .filter(|row| row.at_most() <= goal)
        .min_by(|a, b| a.seconds_per_second.total_cmp(&b.seconds_per_second))
}

/// The lines of a diagram: rows of one scheme and dial, long steps first.
pub fn series(rows: &[Row]) -> Vec<(String, Vec<&Row>)> {
    let mut all: Vec<(String, Vec<&Row>)> = Vec::new();
    for row in rows {
        let name = row.setting.series();
        match all.iter_mut().find(|(known, _)| *known == name) {
            Some((_, list)) => list.push(row),
            None => all.push((name, vec![row])),
        }
    }
    all
}

/// Observed order between two rows of a series: log(e₁/e₂) / log(h₁/h₂), with h the step; none where an
/// error is not known or the steps are the same (dopri5's dial is its tolerance).
pub fn order(coarse: &Row, fine: &Row) -> Option<f64> {
    let (e1, e2) = (coarse.rms()?, fine.rms()?);
    let (h1, h2) = (coarse.setting.dt, fine.setting.dt);
    (h1 > h2 && e2 > 0.0).then(|| (e1 / e2).ln() / (h1 / h2).ln())
}

/// Observed order of a series: the mean slope over its two finest segments with known errors.
pub fn observed_order(series: &[&Row]) -> Option<f64> {
    let known: Vec<&&Row> = series.iter().filter(|row| row.rms().is_some()).collect();
    match known.as_slice() {
        [.., a, _, c] => order(a, c),
        [a, c] => order(a, c),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::Integrator;
    use crate::study::{Distance, Outcome, Setting};

    fn row(dt: f64, seconds: f64, rms: f64) -> Row {
        let error = if rms.is_finite() {
            Error::Known(Distance { rms, largest: rms })
        } else {
            Error::None
        };
        Row {
            setting: Setting {
                integrator: Integrator::Verlet,
                dt,
            },
            seconds_per_second: seconds,
            error,
            strain: 0.0,
            drift: 0.0,
            outcome: Outcome::Completed,
        }
    }

    #[test]
    fn what_is_slower_and_no_better_is_dominated() {
        let rows = [
            row(4.0, 1.0, 0.1),
            row(2.0, 2.0, 0.2),
            row(1.0, 4.0, 0.01),
            row(0.5, 4.2, 0.01),
            row(8.0, 0.5, f64::INFINITY),
        ];
        let dominated = rows.each_ref().map(|row| is_dominated(row, &rows));
        // The fourth is 5 % slower than the third: no difference that a second study must find again.
        assert_eq!(dominated, [false, true, false, false, true]);
        let best = rows.iter().filter(|row| !is_dominated(row, &rows));
        let steps: Vec<f64> = best.map(|row| row.setting.dt).collect();
        assert_eq!(steps, [4.0, 1.0, 0.5]);
        assert_eq!(cheapest(&rows, 0.15).map(|row| row.setting.dt), Some(4.0));
        assert_eq!(cheapest(&rows, 0.05).map(|row| row.setting.dt), Some(1.0));
        assert_eq!(cheapest(&rows, 1e-3), None);
    }

    #[test]
    fn an_error_below_the_reference_is_no_point_of_a_slope() {
        let mut rows = [
            row(4.0, 1.0, 0.16),
            row(2.0, 2.0, 0.04),
            row(1.0, 4.0, 0.01),
        ];
        let all: Vec<&Row> = rows.iter().collect();
        assert!((observed_order(&all).unwrap() - 2.0).abs() < 1e-12);
        rows[2].error = Error::Below(0.02);
        let all: Vec<&Row> = rows.iter().collect();
        assert!((observed_order(&all).unwrap() - 2.0).abs() < 1e-12);
        rows[1].error = Error::None;
        let all: Vec<&Row> = rows.iter().collect();
        assert_eq!(observed_order(&all), None);
    }
}
