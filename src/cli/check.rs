//! `muslin check`: what a scene models, how long its steps may be, what it costs.

use super::Failure;
use super::args::SceneArgs;
use super::run::{prepare, threads};
use crate::scene::model_list;
use crate::simulation::stable_step;
use std::time::Instant;

/// Steps that are tried to estimate the cost.
const TRIED_STEPS: u32 = 20;

pub(super) fn run(args: &SceneArgs) -> Result<(), Failure> {
    let (loaded, mut simulation, notes) = prepare(args)?;
    let threads = threads(args)?;
    notes.iter().for_each(|note| println!("{note}"));
    println!(
        "{} models\n{}",
        loaded.file,
        model_list(&loaded.scene, simulation.model())
    );
    let (dt, explicit) = (simulation.dt(), simulation.integrator().is_explicit());
    let stable = stable_step(simulation.model(), simulation.state());
    println!(
        "symplectic-euler: stable up to dt = {:.3e} s (fastest mode {:.3e} rad/s)",
        stable.dt, stable.omega
    );
    if let Some((family, [i, j])) = stable.element {
        println!(
            "  set by the {family} element between particles {i} and {j}, or the damping on it"
        );
    }
    println!("implicit-euler: stable at any dt; its error grows with dt");
    println!(
        "chosen: {} with dt = {dt} s",
        simulation.integrator().name()
    );
    if explicit && dt > stable.dt {
        println!(
            "WARNING: this diverges; use --dt {:.1e} or less, or --integrator implicit-euler",
            0.9 * stable.dt
        );
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
        step * loaded.scene.duration / dt,
        loaded.scene.duration,
        1000.0 * step
    );
    Ok(())
}
