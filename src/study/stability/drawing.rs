//! A map as a picture.

use super::{Map, Row, TOLERANCE, Verdict};
use crate::picture::{self, Kind, Panel, PictureError};
use crate::study::digits;
use std::path::Path;

/// Draws a map of `scene`: a panel a scheme, with the forecast as a line.
///
/// # Errors
///
/// When the map has no row, or the file can't be written.
pub fn picture(path: &Path, scene: &str, map: &Map) -> Result<(), PictureError> {
    let mut panels: Vec<Panel> = Vec::new();
    for row in &map.rows {
        let name = row.scheme.name();
        if panels.last().is_none_or(|panel| panel.name != name) {
            panels.push(Panel {
                name: name.to_owned(),
                cells: vec![vec![None; map.steps.len()]; map.factors.len()],
                line: vec![None; map.factors.len()],
            });
        }
        let at = map.factors.iter().position(|f| *f == row.factor);
        if let (Some(panel), Some(at)) = (panels.last_mut(), at) {
            panel.cells[at] = kinds(row);
            panel.line[at] = row.forecast;
        }
    }
    let line = if panels.iter().any(|panel| panel.name == "xpbd") {
        "forecast: largest stable step (xpbd: 10 % softer)"
    } else {
        "forecast: largest stable step"
    };
    picture::map(
        path,
        &picture::Map {
            title: format!("{scene}: outcome by step and {}", map.axis.words()),
            columns: map.steps.clone(),
            rows: map.factors.iter().map(|f| label(*f)).collect(),
            row_axis: map.axis.words().to_owned(),
            kinds: Verdict::ALL.map(|verdict| kind(verdict, map)).to_vec(),
            panels,
            line: line.to_owned(),
        },
    )
}

fn kinds(row: &Row) -> Vec<Option<usize>> {
    let number = |verdict| Verdict::ALL.iter().position(|known| *known == verdict);
    row.cells.iter().map(|cell| number(cell.verdict)).collect()
}

/// Colours that the colour-blind tell apart too (Okabe and Ito 2008), from light to dark as it gets
/// worse; what isn't measured is pale or grey.
fn kind(verdict: Verdict, map: &Map) -> Kind {
    let (name, color) = match verdict {
        Verdict::NotRun => (
            "not run: settled by longer steps".to_owned(),
            [221, 239, 250],
        ),
        Verdict::Completed => ("completed".to_owned(), [86, 180, 233]),
        Verdict::Unsolved => ("completed, steps unsolved".to_owned(), [204, 121, 167]),
        Verdict::Inaccurate => (
            format!(
                "off by > {:.0} % of the size ({} mm RMS) at {} s",
                100.0 * TOLERANCE,
                digits(1000.0 * map.tolerance),
                digits(map.horizon)
            ),
            [240, 228, 66],
        ),
        Verdict::Unjudged => ("completed, no reference".to_owned(), [190, 190, 190]),
        Verdict::Diverged => ("diverged".to_owned(), [213, 94, 0]),
        Verdict::TooSlow => ("too slow".to_owned(), [130, 130, 130]),
    };
    Kind {
        name,
        color,
        crossed: verdict == Verdict::Diverged,
    }
}

/// A factor as a row is called.
fn label(factor: f64) -> String {
    let power = factor.log10();
    if factor > 0.0 && power.fract() == 0.0 && power.abs() >= 3.0 {
        let sign = if power < 0.0 { "⁻" } else { "" };
        let digit = ["³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"];
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number from 3"
        )]
        if let Some(digit) = digit.get(power.abs() as usize - 3) {
            return format!("× 10{sign}{digit}");
        }
    }
    format!("× {}", digits(factor))
}

#[cfg(test)]
mod tests {
    #[test]
    fn factors_are_short() {
        let labels = [1e-6, 0.01, 0.3, 0.0, 1.0, 100.0, 1e4, 2e5].map(super::label);
        let expected = [
            "× 10⁻⁶",
            "× 0.01",
            "× 0.3",
            "× 0",
            "× 1",
            "× 100",
            "× 10⁴",
            "× 2.00e5",
        ];
        assert_eq!(labels, expected);
    }
}
