//! `muslin compare`: how far two recordings are apart.

use super::Failure;
use super::args::CompareArgs;
use super::output::same_file;
use crate::recorder::{RecordError, Recorder as _, RerunRecorder, Targets};
use crate::study::compare::{Comparison, Overlaid, compare};
use crate::study::digits;
use anyhow::anyhow;
use std::ops::ControlFlow;

/// Lines of the table.
const LINES: usize = 10;

pub(super) fn run(args: &CompareArgs) -> Result<(), Failure> {
    let CompareArgs { a, b, save, .. } = args;
    if let Some(save) = save
        && [a, b].iter().any(|input| same_file(save, input))
    {
        return Err(Failure::Input(anyhow!(
            "--save {}: that is one of the recordings; choose another",
            save.display()
        )));
    }
    let comparison = compare(a, b).map_err(Failure::input)?;
    say(args, &comparison);
    match save {
        Some(_) => overlay(args, &comparison),
        None => Ok(()),
    }
}

fn say(args: &CompareArgs, comparison: &Comparison) {
    let Comparison {
        times,
        each,
        particles,
        size,
        unseen,
        one_mesh,
    } = comparison;
    let mm = |x: f64| digits(1000.0 * x);
    println!("{:>9} {:>12} {:>12}", "t (s)", "RMS (mm)", "largest (mm)");
    let stride = times.len().div_ceil(LINES);
    let last = times.len() - 1;
    for k in (0..last).step_by(stride).chain([last]) {
        println!(
            "{:>9.4} {:>12} {:>12}",
            times[k],
            mm(each[k].rms),
            mm(each[k].largest)
        );
    }
    let whole = comparison.whole();
    println!(
        "over {} times: RMS {} mm, largest {} mm, {:.3} % and {:.3} % of the cloth's size",
        times.len(),
        mm(whole.rms),
        mm(whole.largest),
        100.0 * whole.rms / size,
        100.0 * whole.largest / size
    );
    if unseen.largest > 0.0 {
        println!(
            "the second run was taken between its frames: RMS and largest may be off by {} and {} mm; record both with --fps whose frames their steps meet",
            mm(unseen.rms),
            mm(unseen.largest)
        );
    }
    if !one_mesh {
        println!(
            "at the {particles} particles of the coarser mesh, found on the finer one by where they are at rest"
        );
    }
    match comparison.parts(args.visible) {
        Some(time) => println!(
            "visibly apart, by more than {} mm, from {time:.4} s on",
            mm(args.visible)
        ),
        None => println!("never apart by more than {} mm", mm(args.visible)),
    }
}

fn overlay(args: &CompareArgs, comparison: &Comparison) -> Result<(), Failure> {
    let overlaid = Overlaid::new(&args.a, &args.b, comparison).map_err(Failure::input)?;
    let targets = Targets {
        save: args.save.clone(),
        force: args.force,
        ..Targets::default()
    };
    let mut recorder = RerunRecorder::new(&overlaid.header, &targets).map_err(Failure::input)?;
    let mut failed: Result<(), RecordError> = Ok(());
    let read = overlaid.for_each_frame(|frame| match recorder.record(frame) {
        Ok(()) => ControlFlow::Continue(()),
        Err(error) => {
            failed = Err(error);
            ControlFlow::Break(())
        }
    });
    let finished = recorder.finish();
    failed.map_err(Failure::run)?;
    read.map_err(Failure::input)?;
    finished.map_err(Failure::run)?;
    Ok(())
}
