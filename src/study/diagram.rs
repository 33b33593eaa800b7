//! A study as a work–precision diagram.

use super::front::{is_dominated, series};
use super::sweep::{Error, Row};
use super::{Reference, Subject, digits};
use crate::picture::{Mark, MarkKind, PictureError, WorkLine, work_precision};
use std::path::Path;

/// Draws the rows of a study.
///
/// # Errors
///
/// When no run came to its end, or the file can't be written.
pub fn diagram(
    path: &Path,
    subject: &Subject<'_>,
    reference: &Reference,
    rows: &[Row],
) -> Result<(), PictureError> {
    let line = |(name, list): (String, Vec<&Row>)| WorkLine {
        name,
        marks: list.iter().map(|row| mark(row, rows)).collect(),
    };
    let lines: Vec<WorkLine> = series(rows).into_iter().map(line).collect();
    let title = format!(
        "{}: time against error over {} s",
        subject.loaded.scene.name,
        digits(subject.duration)
    );
    let axes = [
        "RMS distance to the reference (mm)",
        "wall seconds per simulated second",
    ];
    work_precision(path, &title, axes, &lines, 1000.0 * reference.smallest())
}

fn mark(row: &Row, rows: &[Row]) -> Mark {
    let kind = match row.error {
        Error::None => MarkKind::Failed,
        Error::Below(_) => MarkKind::AtMost,
        Error::Known(_) => MarkKind::Known,
    };
    Mark {
        error: 1000.0 * row.at_most(),
        seconds: row.seconds_per_second,
        kind,
        front: !is_dominated(row, rows),
    }
}
