//! `muslin check`: what a scene models, how long its steps may be, what it costs.

use super::Failure;
use super::args::SceneArgs;
use super::run::{prepare, threads};
use crate::integrator::Integrator;
use crate::scene::model_list;
use crate::simulation::forecast;
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
    let forecast = forecast(simulation.model(), simulation.state());
    println!(
        "fastest mode: {:.3e} rad/s, damped by {:.3e} 1/s",
        forecast.omega, forecast.damping
    );
    if let Some((family, [i, j])) = forecast.element {
        println!(
            "  set by the {family} element between particles {i} and {j}, or the damping on it"
        );
    }
    for scheme in Integrator::EXPLICIT {
        let (name, limit) = (scheme.name(), forecast.stable_dt(scheme));
        if limit > 0.0 {
            println!("{name}: stable up to dt = {limit:.3e} s");
        } else {
            println!("{name}: stable at no dt, for want of damping");
        }
    }
    println!("implicit-euler: stable at any dt; its error grows with dt");
    println!(
        "chosen: {} with dt = {dt} s",
        simulation.integrator().name()
    );
    let limit = forecast.stable_dt(simulation.integrator());
    if explicit && dt > limit {
        let remedy = if limit > 0.0 {
            format!("--dt {:.1e} or less, or ", 0.9 * limit)
        } else {
            String::new()
        };
        println!("WARNING: this diverges; use {remedy}--integrator implicit-euler");
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
