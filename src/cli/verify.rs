//! `muslin verify`: does the scene of a recording still give the same states?

use super::Failure;
use super::args::VerifyArgs;
use super::job::{stop_on_interrupt, threads};
use super::progress::Display;
use super::resume::go_on;
use super::run::prepare_loaded;
use crate::pipeline::Plan;
use crate::replay::{Layout, Verdict, read_first_checkpoint, state_hashes, verify};
use anyhow::anyhow;
use std::sync::atomic::Ordering;

pub(super) fn run(args: &VerifyArgs) -> Result<(), Failure> {
    let threads = threads(args.threads)?;
    let stop = stop_on_interrupt()?;
    let name = args.recording.display().to_string();
    let layout = Layout::read(&args.recording).map_err(Failure::input)?;
    let first = read_first_checkpoint(&args.recording).map_err(Failure::input)?;
    let hashes = state_hashes(&args.recording).map_err(Failure::input)?;
    let last = hashes.values().map(|hash| hash.time).fold(0.0, f64::max);
    if hashes.is_empty() {
        return Err(Failure::Input(anyhow!(
            "{name} holds no state hashes; give a recording that this version of muslin saved"
        )));
    }
    let loaded = layout.scene(&name).map_err(Failure::input)?;
    let prepared = prepare_loaded(loaded)?;
    let from = (layout.start.as_ref(), &first);
    let (simulation, capture, _) = go_on(&prepared.loaded, prepared.simulation, from, &name)?;
    let record = &prepared.loaded.scene.record;
    let plan = Plan {
        duration: prepared.loaded.scene.duration,
        fps: record.fps,
        checkpoint: record.checkpoint,
        error: 0.0,
        threads,
        notes: Vec::new(),
        stop: &stop,
    };
    let mut display = Display::new(last, args.quiet);
    let verdict = verify(simulation, capture, hashes, &plan, &mut |progress| {
        display.show(progress);
    });
    display.finish();
    let verdict = verdict.map_err(Failure::run)?;
    if stop.load(Ordering::Relaxed) {
        return Err(Failure::run("stopped before all was compared"));
    }
    match verdict {
        Verdict::Same { frames } => {
            println!("{name}: the states of all {frames} frames are the same, bit for bit");
            Ok(())
        }
        Verdict::Parts { frame, time, same } => Err(Failure::run(format!(
            "{name}: the states part at frame {frame}, t = {time} s, after {same} frames that are the same; it was made by another version of muslin, on another kind of machine, or is damaged"
        ))),
    }
}
