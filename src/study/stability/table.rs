//! Every cell of a map as a row of a CSV table.

use super::Map;
use std::fmt::Write as _;

/// The columns of the table.
pub const HEADER: &str =
    "scheme,axis,factor,step_s,steps,compared_s,outcome,rms_m,forecast_step_s\n";

/// The whole table; numbers round-trip, and what doesn't apply is empty.
///
/// `forecast_step_s` is the largest stable step of an explicit scheme, 0 where no step is stable; of xpbd
/// the step at which cloth is a tenth softer than its material.
pub fn csv(map: &Map) -> String {
    let number = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:?}"));
    let mut text = HEADER.to_owned();
    for row in &map.rows {
        for cell in &row.cells {
            // Writing to a String can't fail.
            let _ = writeln!(
                text,
                "{},{},{:?},{:?},{},{:?},{},{},{}",
                row.scheme.name(),
                map.axis.name(),
                row.factor,
                cell.step,
                cell.steps,
                cell.compared,
                cell.verdict.name(),
                number(cell.rms),
                number(row.forecast)
            );
        }
    }
    text
}
