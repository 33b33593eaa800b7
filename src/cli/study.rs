//! `muslin study`: what accuracy costs in a scene.

use super::args::StudyArgs;
use super::run::{stop_on_interrupt, threads};
use super::{Failure, folder};
use crate::scene;
use crate::study::{
    self, Dials, MARGIN, Reference, Row, Setting, StudyError, Subject, diagram, digits, ladder,
    reference, sweep, table,
};
use anyhow::anyhow;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};

/// What a study covers of a longer scene (s): swings and contacts, but not yet the folds that a change
/// in the last digit decides.
const LONGEST: f64 = 0.5;

pub(super) fn run(args: &StudyArgs) -> Result<(), Failure> {
    let loaded = scene::load(&args.scene, &args.set).map_err(Failure::input)?;
    let duration = duration(args, loaded.scene.duration)?;
    let threads = threads(args.threads)?;
    let stop = stop_on_interrupt()?;
    let mut subject =
        Subject::new(loaded, duration, args.times, threads, &stop).map_err(failure)?;
    let dials = Dials {
        schemes: args.schemes.clone(),
        steps: args.steps.clone(),
        iterations: args.iterations.clone(),
        tolerances: args.tolerance.clone(),
    };
    let settings = ladder::settings(&subject, &dials).map_err(failure)?;
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{}-study", subject.loaded.scene.name)));
    let made = folder::make_writable(&out)?;
    let reference = find_reference(&mut subject, args);
    if reference.is_err() && made {
        let _ = std::fs::remove_dir(&out); // nothing was put into it
    }
    let reference = reference?;
    let rows = measure(&subject, &reference, &settings, &out)?;
    conclude(&subject, &reference, &rows, settings.len(), &out)
}

fn duration(args: &StudyArgs, whole: f64) -> Result<f64, Failure> {
    let fail = |text: String| Err(Failure::Input(anyhow!("{text}")));
    let positive = |x: f64| x.is_finite() && x > 0.0;
    if args.times == 0 {
        return fail("--times 0: states are compared at one time at least".to_owned());
    }
    for (flag, value) in [("--smallest", args.smallest), ("--patience", args.patience)] {
        if !positive(value) {
            return fail(format!("{flag} {value}: a positive number is needed"));
        }
    }
    match args.duration {
        Some(seconds) if !positive(seconds) => fail(format!(
            "--duration {seconds}: a positive number of seconds is needed"
        )),
        Some(seconds) => Ok(seconds),
        None => Ok(whole.min(LONGEST)),
    }
}

fn find_reference(subject: &mut Subject<'_>, args: &StudyArgs) -> Result<Reference, Failure> {
    let goal = args.smallest / MARGIN;
    reference(subject, goal, args.patience, &mut |said| {
        eprintln!("{said}")
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
fn bar(settings: usize) -> ProgressBar {
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

/// The picture, and the words on the screen.
fn conclude(
    subject: &Subject<'_>,
    reference: &Reference,
    rows: &[Row],
    settings: usize,
    out: &Path,
) -> Result<(), Failure> {
    if rows.is_empty() {
        return Err(Failure::run("stopped before the first run was done"));
    }
    diagram(&out.join("work-precision.png"), subject, reference, rows).map_err(Failure::run)?;
    let recorded = record(subject, reference, rows, out)?;
    let text = table::markdown(subject, reference, rows);
    // Whoever reads no further has seen enough.
    let _ = std::io::stdout().write_all(text.as_bytes());
    let _ = writeln!(
        std::io::stdout(),
        "\n{}: study.csv, study.md, work-precision.png{recorded}",
        out.display()
    );
    if subject.is_stopped() {
        eprintln!("stopped: {} runs of {settings} are kept", rows.len());
    }
    Ok(())
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
    let targets = Targets {
        save: Some(out.join("study.rrd")),
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

/// What was asked for can't be: bad input; a run that failed is a failed run.
fn failure(error: StudyError) -> Failure {
    match error {
        StudyError::Scene(_) | StudyError::Ask(_) => Failure::input(error),
        StudyError::NoReference { .. } | StudyError::Stopped | StudyError::Threads(_) => {
            Failure::run(error)
        }
    }
}
