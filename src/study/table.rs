//! A study as a CSV table and in words.

use super::front::{cheapest, is_dominated, observed_order, order, series};
use super::sweep::{Error, Row};
use super::{MARGIN, Outcome, Reference, Subject, digits};
use crate::scene::Shape;
use std::fmt::Write as _;

/// The columns of `study.csv`.
pub const HEADER: &str = "scheme,step_s,iterations,tolerance_m,cells,threads,seconds_per_second,rms_m,largest_m,strain_ever,energy_drift,dominated,outcome\n";

/// Errors for which the cheapest setting is named (m).
pub const GOALS: [f64; 4] = [0.1, 0.01, 0.001, 0.0001];

/// Every row; numbers round-trip, and what doesn't apply or can't be told is empty.
pub fn csv(subject: &Subject<'_>, rows: &[Row]) -> String {
    let mut text = HEADER.to_owned();
    let cells = cells(subject);
    for row in rows {
        let (rms, largest) = match row.error {
            Error::Known(distance) => (Some(distance.rms), Some(distance.largest)),
            _ => (None, None),
        };
        let outcome = match row.error {
            Error::Below(_) => "below-reference",
            _ => row.outcome.name(),
        };
        // Writing to a string can't fail.
        let _ = writeln!(
            text,
            "{},{:?},{},{},{cells},{},{:?},{},{},{:?},{:?},{},{outcome}",
            row.setting.integrator.name(),
            row.setting.dt,
            row.setting
                .iterations()
                .map_or_else(String::new, |n| n.to_string()),
            number(row.setting.tolerance()),
            subject.threads,
            row.seconds_per_second,
            number(rms),
            number(largest),
            row.strain,
            row.drift,
            is_dominated(row, rows),
        );
    }
    text
}

/// A number that round-trips, if there is one.
pub(super) fn number(x: Option<f64>) -> String {
    x.map_or_else(String::new, |x| format!("{x:?}"))
}

/// How finely the cloths are divided.
fn cells(subject: &Subject<'_>) -> String {
    let each = subject
        .loaded
        .scene
        .cloth
        .iter()
        .map(|cloth| match &cloth.shape {
            Shape::Sheet(sheet) => sheet.cells.map(|n| n.to_string()).join("x"),
            Shape::Block(block) => block.cells.map(|n| n.to_string()).join("x"),
            Shape::Chain(chain) => chain.links.to_string(),
            Shape::Obj(_) => "obj".to_owned(),
        });
    each.collect::<Vec<_>>().join("+")
}

/// The study in words: the reference, what each goal costs at least, the order of each scheme, and every
/// row.
pub fn markdown(subject: &Subject<'_>, reference: &Reference, rows: &[Row]) -> String {
    let mut text = format!("# {}: what accuracy costs\n\n", subject.loaded.scene.name);
    about(&mut text, subject, reference);
    goals(&mut text, subject, reference, rows);
    orders(&mut text, rows);
    all(&mut text, rows);
    text
}

fn about(text: &mut String, subject: &Subject<'_>, reference: &Reference) {
    let _ = writeln!(
        text,
        "Errors are distances of the particles to the reference, RMS over particles and over {} times up to {} s; times are wall seconds a simulated second on {} thread(s), the least of repeated runs. They are errors of the time step: mesh {} is the same in all runs, and what it is off by is another question (`--cells`).\n",
        subject.times,
        digits(subject.duration),
        subject.threads,
        cells(subject),
    );
    let [own, largest] = [reference.error.rms, reference.error.largest].map(|x| digits(1000.0 * x));
    let _ = writeln!(
        text,
        "Reference: {} at {}, checked against {} at {} and against itself at twice the step: {own} mm RMS apart at most, {largest} mm anywhere. Errors below {} mm can't be told by it.\n",
        reference.setting.series(),
        reference.setting.dial(),
        reference.second.series(),
        reference.second.dial(),
        digits(1000.0 * reference.smallest()),
    );
    if !reference.converged {
        let _ = writeln!(
            text,
            "**The reference is not as exact as was asked**: its time (`--patience`) was over before; smaller errors than these need more of it.\n"
        );
    }
    if let Some(cut) = reference.cut {
        let _ = writeln!(
            text,
            "**Nothing is compared from {} s on**: there the reference itself is {} mm off, and halving its steps didn't mend it. What decides then (folds that may buckle either way, friction that holds or doesn't) depends on the least detail.\n",
            digits(cut.time),
            digits(1000.0 * cut.error),
        );
    }
}

fn goals(text: &mut String, subject: &Subject<'_>, reference: &Reference, rows: &[Row]) {
    let _ = writeln!(
        text,
        "| error of at most | cheapest setting | error (mm) | s per s | ms per 1/60 s |\n|---|---|---|---|---|"
    );
    for goal in GOALS {
        let name = length(goal);
        match cheapest(rows, goal) {
            _ if goal < reference.smallest() => {
                let _ = writeln!(text, "| {name} | less than the reference can tell | | | |");
            }
            Some(row) => {
                let _ = writeln!(
                    text,
                    "| {name} | {}, {} | {} | {} | {} |",
                    row.setting.series(),
                    row.setting.dial(),
                    error(row),
                    digits(row.seconds_per_second),
                    digits(row.seconds_per_second * 1000.0 / 60.0),
                );
            }
            None => {
                let _ = writeln!(text, "| {name} | none of these | | | |");
            }
        }
    }
    let _ = writeln!(
        text,
        "\n{MARGIN} times the reference's own error counts as the smallest that can be told; `muslin study {}` makes this table again.\n",
        subject.loaded.file,
    );
}

fn length(metres: f64) -> String {
    if metres >= 0.01 {
        format!("{} cm", digits(100.0 * metres))
    } else {
        format!("{} mm", digits(1000.0 * metres))
    }
}

fn orders(text: &mut String, rows: &[Row]) {
    let _ = writeln!(
        text,
        "| scheme | observed order, by halving | over the finest two |\n|---|---|---|"
    );
    for (name, list) in series(rows) {
        let steps: Vec<String> = list
            .windows(2)
            .map(|pair| order(pair[0], pair[1]).map_or("–".to_owned(), |p| format!("{p:.2}")))
            .collect();
        let mean = observed_order(&list).map_or("–".to_owned(), |p| format!("{p:.2}"));
        let _ = writeln!(text, "| {name} | {} | {mean} |", steps.join(", "));
    }
    text.push('\n');
}

fn all(text: &mut String, rows: &[Row]) {
    let _ = writeln!(
        text,
        "| scheme | step | ms per 1/60 s | RMS (mm) | largest (mm) | largest strain (%) | energy drift (%) | |\n|---|---|---|---|---|---|---|---|"
    );
    for row in rows {
        let largest = match row.error {
            Error::Known(distance) => digits(1000.0 * distance.largest),
            _ => String::new(),
        };
        let said = match &row.outcome {
            Outcome::Completed if !is_dominated(row, rows) => "**front**",
            Outcome::Completed => "dominated",
            failed => failed.name(),
        };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {largest} | {} | {} | {said} |",
            row.setting.series(),
            row.setting.dial(),
            digits(row.seconds_per_second * 1000.0 / 60.0),
            error(row),
            digits(100.0 * row.strain),
            digits(100.0 * row.drift),
        );
    }
}

fn error(row: &Row) -> String {
    match row.error {
        Error::Known(distance) => digits(1000.0 * distance.rms),
        Error::Below(bound) => format!("< {}", digits(1000.0 * bound)),
        Error::None => "–".to_owned(),
    }
}
