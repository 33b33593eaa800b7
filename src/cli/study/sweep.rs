//! Time against error: every scheme over its steps.

use super::failure;
use crate::cli::args::StudyArgs;
use crate::cli::{Failure, folder};
use crate::study::{
    self, Dials, MARGIN, Reference, Row, Setting, Subject, diagram, digits, ladder, reference,
    sweep, table,
};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal as _;
use std::path::Path;

pub(super) fn run(
    subject: &mut Subject<'_>,
    args: &StudyArgs,
    out: &Path,
) -> Result<String, Failure> {
    let dials = Dials {
        schemes: args.schemes.clone(),
        steps: args.steps.clone(),
        iterations: args.iterations.clone(),
        tolerances: args.tolerance.clone(),
    };
    let settings = ladder::settings(subject, &dials).map_err(failure)?;
    let reference = find_reference(subject, args)?;
    let rows = measure(subject, &reference, &settings, out)?;
    if rows.is_empty() {
        return Err(Failure::run("stopped before the first run was done"));
    }
    diagram(&out.join("work-precision.png"), subject, &reference, &rows).map_err(Failure::run)?;
    let recorded = record(subject, &reference, &rows, out)?;
    if subject.is_stopped() {
        eprintln!(
            "stopped: {} runs of {} are kept",
            rows.len(),
            settings.len()
        );
    }
    let text = table::markdown(subject, &reference, &rows);
    Ok(format!(
        "{text}\n{}: study.csv, study.md, work-precision.png{recorded}\n",
        out.display()
    ))
}

fn find_reference(subject: &mut Subject<'_>, args: &StudyArgs) -> Result<Reference, Failure> {
    let goal = args.smallest / MARGIN;
    reference(subject, goal, args.patience, &mut |said| {
        eprintln!("{said}");
    })
    .map_err(failure)
}

/// Runs every setting; the tables on disk are those of the rows so far.
fn measure(
    subject: &Subject<'_>,
    reference: &Reference,
    settings: &[Setting],
    out: &Path,
) -> Result<Vec<Row>, Failure> {
    let bar = bar(settings.len());
    let mut written = Ok(());
    let rows = sweep(subject, reference, settings, &mut |rows| {
        if let Some(row) = rows.last() {
            say(&bar, row);
        }
        if written.is_ok() {
            written = write_tables(subject, reference, rows, out);
        }
    });
    bar.finish_and_clear();
    written?;
    rows.map_err(failure)
}

/// A bar with the time left; silent where there is no terminal.
pub(super) fn bar(settings: usize) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(settings as u64);
    let style = ProgressStyle::with_template("{bar:30} {pos} of {len} runs, {eta} left, {msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

fn say(bar: &ProgressBar, row: &Row) {
    let error = match row.error {
        study::Error::Known(distance) => format!("{} mm", digits(1000.0 * distance.rms)),
        study::Error::Below(bound) => format!("less than {} mm", digits(1000.0 * bound)),
        study::Error::None => row.outcome.name().to_owned(),
    };
    let line = format!(
        "{}, {}: {error}, {} ms per 1/60 s",
        row.setting.series(),
        row.setting.dial(),
        digits(row.seconds_per_second * 1000.0 / 60.0)
    );
    bar.inc(1);
    if bar.is_hidden() {
        eprintln!("{line}");
    } else {
        bar.set_message(line);
    }
}

fn write_tables(
    subject: &Subject<'_>,
    reference: &Reference,
    rows: &[Row],
    out: &Path,
) -> Result<(), Failure> {
    folder::write(out, "study.csv", &table::csv(subject, rows))?;
    folder::write(out, "study.md", &table::markdown(subject, reference, rows))
}

/// Records the best runs laid over each other; returns what to say of it.
#[cfg(feature = "rerun")]
fn record(
    subject: &Subject<'_>,
    reference: &Reference,
    rows: &[Row],
    out: &Path,
) -> Result<&'static str, Failure> {
    use crate::recorder::{Recorder as _, RerunRecorder, Targets};
    use crate::study::overlay::{overlay, shown};
    if subject.is_stopped() {
        return Ok("");
    }
    let overlay = overlay(subject, reference, &shown(rows)).map_err(failure)?;
    if subject.is_stopped() {
        return Ok(""); // the last runs are not whole
    }
    let targets = Targets {
        save: Some(out.join("study.rrd")),
        force: true, // like all files of the folder, which are a study's together
        ..Targets::default()
    };
    let mut recorder = RerunRecorder::new(&overlay.header, &targets).map_err(Failure::run)?;
    for frame in &overlay.frames {
        recorder.record(frame).map_err(Failure::run)?;
    }
    recorder.finish().map_err(Failure::run)?;
    Ok(" and study.rrd")
}

/// Without Rerun there is no recording.
#[cfg(not(feature = "rerun"))]
#[expect(clippy::unnecessary_wraps, reason = "as with Rerun")]
fn record(_: &Subject<'_>, _: &Reference, _: &[Row], _: &Path) -> Result<&'static str, Failure> {
    Ok("")
}
