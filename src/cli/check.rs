//! `muslin check`: what a scene models, how long its steps may be, what it costs.

use super::Failure;
use super::args::SceneArgs;
use super::run::{Prepared, prepare, threads};
use crate::scene::model_list;
use std::time::Instant;

/// Steps that are tried to estimate the cost.
const TRIED_STEPS: u32 = 20;

pub(super) fn run(args: &SceneArgs) -> Result<(), Failure> {
    let Prepared {
        loaded,
        mut simulation,
        foresight,
        notes,
    } = prepare(args, &[])?;
    let threads = threads(args)?;
    notes.iter().for_each(|note| println!("{note}"));
    println!(
        "{} models\n{}",
        loaded.file,
        model_list(&loaded.scene, simulation.model())
    );
    let said = foresight.list(&simulation);
    said.iter().for_each(|line| println!("{line}"));
    if let Some(warning) = foresight.remedy(&simulation) {
        println!("{warning}");
        return Ok(());
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(Failure::run)?;
    let start = Instant::now();
    pool.install(|| (0..TRIED_STEPS).try_for_each(|_| simulation.step().map(drop)))
        .map_err(Failure::run)?;
    let step = start.elapsed().as_secs_f64() / f64::from(TRIED_STEPS);
    println!(
        "about {:.1} s for {} s simulated: {:.2} ms a step on {threads} thread(s), from its first {TRIED_STEPS} steps",
        step * loaded.scene.duration / simulation.dt(),
        loaded.scene.duration,
        1000.0 * step
    );
    Ok(())
}
