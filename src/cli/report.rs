//! The machine-readable summary of a run.

use crate::frame::mean_strain;
use crate::integrator::Integrator;
use crate::pipeline::{Finished, ms_per_frame};
use crate::simulation::{Account, Cause, Diverged, ErrorEstimate, Part, Stage};
use serde_json::{Map, Value, json};

/// The report of a finished run; its fields keep their names.
pub(super) fn report(scene: &str, threads: usize, finished: &Finished) -> Value {
    let simulation = &finished.simulation;
    let (model, stats) = (simulation.model(), simulation.stats());
    let triangles: usize = model.cloths.iter().map(|cloth| cloth.triangles.len()).sum();
    let simulated = simulation.state().time;
    let mut report = json!({
        "scene": scene,
        "integrator": simulation.integrator().name(),
        "dt": simulation.dt(),
        "threads": threads,
        "particles": model.cloth_particles(),
        "springs": model.spring_count(),
        "hinges": model.hinges().count(),
        "triangles": triangles,
        "simulated_s": simulated,
        "steps": stats.steps,
        "wall_s": finished.wall.as_secs_f64(),
        "ms_per_frame": ms_per_frame(finished.stepping, simulated - finished.began),
        "stage_ms": stage_ms(finished),
        "memory_bytes": simulation.memory().parts,
        "recorded_frames": finished.recorded.frames,
        "dropped_live_frames": finished.recorded.dropped_live_frames,
        "energy": energy(finished),
        "strain": { "max": stats.strain, "max_ever": stats.strain_ever, "mean": mean_strain(simulation) },
        "contact": contact(finished),
        "solver": { "iterations": stats.iterations, "unconverged_solves": stats.unsolved, "damped_steps": stats.damped, "strain_limit_passes": stats.limit_passes },
        "peak_kinetic_j": stats.kinetic_peak,
        "outcome": outcome(finished),
    });
    if let (Some(error), Some(fields)) = (&finished.error, report.as_object_mut()) {
        fields.insert("error".to_owned(), time_step_error(error, finished));
    }
    if let (Some(diverged), Some(fields)) = (&finished.diverged, report.as_object_mut()) {
        fields.insert("reason".to_owned(), json!(diverged.to_string()));
        fields.insert("divergence".to_owned(), divergence(diverged));
    }
    report
}

/// What contact did, and what the audit of the recorded frames found.
fn contact(finished: &Finished) -> Value {
    let simulation = &finished.simulation;
    let (stats, tangled) = (simulation.stats(), simulation.tangled());
    let mut contact = json!({
        "max_depth_m": stats.depth,
        "max_depth_ever_m": stats.depth_ever,
        "count": simulation.contacts().list.len(),
        "impacts": stats.impacts.impacts,
        "zones": stats.impacts.zones,
        "missed": stats.impacts.missed,
        "tangled_at_start": tangled.at_start,
        "tangled": tangled.now,
        "untangled_after_s": tangled.took,
    });
    if let (Some(audited), Some(fields)) = (&finished.audited, contact.as_object_mut()) {
        let found = json!({
            "frames": audited.frames,
            "bad_frames": audited.bad_frames,
            "max_depth_m": audited.depth,
            "max_inside": audited.inside,
            "max_crossings": audited.crossings,
            "max_cloth_crossings": audited.cloth_crossings,
        });
        fields.insert("audit".to_owned(), found);
    }
    contact
}

/// What the time step is estimated to have cost in accuracy.
fn time_step_error(error: &ErrorEstimate, finished: &Finished) -> Value {
    let spent = error.spent().as_secs_f64();
    let all = spent + finished.stepping.as_secs_f64();
    json!({
        "estimate_m": error.at(finished.simulation.state().time),
        "per_step_m": error.per_step(),
        "samples": error.samples(),
        "share_of_time": if all > 0.0 { spent / all } else { 0.0 },
        "sees": "time step; not the mesh",
    })
}

/// The black box of a run that diverged.
fn divergence(diverged: &Diverged) -> Value {
    let Account {
        particle: (cloth, particle),
        spring,
        scheme,
        limited,
        limiting,
        cause,
        last_good,
        ..
    } = diverged.account.as_ref();
    json!({
        "step": diverged.step,
        "time_s": diverged.time,
        "stage": diverged.stage.name(),
        "sign": diverged.sign.name(),
        "particle": { "cloth": cloth, "number": particle },
        "element": spring.as_ref().map(part),
        "scheme": scheme,
        "dt_s": diverged.dt,
        "limit": { "scheme": limited, "dt_s": diverged.stable_dt, "element": limiting.as_ref().map(part) },
        "cause": cause_of(cause),
        "last_good_s": last_good,
        "suggestion": { "dt_s": diverged.suggested_dt(), "text": diverged.remedy() },
    })
}

fn part(part: &Part) -> Value {
    json!({
        "law": part.law,
        "cloth": part.cloth,
        "particles": part.particles,
        "strain": part.strain.map(finite),
    })
}

fn cause_of(cause: &Cause) -> Value {
    let name = cause.name();
    match cause {
        Cause::StiffElement { times } => json!({ "name": name, "times_median": times }),
        Cause::LightParticle { particle, share } => {
            json!({ "name": name, "particle": particle, "times_median": share })
        }
        Cause::LongStep { times } | Cause::Drag { times } => {
            json!({ "name": name, "times_limit": times })
        }
        Cause::NoDamping | Cause::Unknown => json!({ "name": name }),
    }
}

/// A number in words where JSON has none.
fn finite(x: f64) -> Value {
    if x.is_finite() {
        json!(x)
    } else {
        json!(x.to_string())
    }
}

fn outcome(finished: &Finished) -> &'static str {
    match (&finished.diverged, finished.stopped) {
        (Some(_), _) => "diverged",
        (None, true) => "stopped",
        (None, false) => "completed",
    }
}

/// Mean wall time of each stage in a step (ms).
fn stage_ms(finished: &Finished) -> Value {
    let stats = finished.simulation.stats();
    let steps = f64::from(u32::try_from(stats.timed.max(1)).unwrap_or(u32::MAX));
    let mean = |(stage, name): (Stage, &str)| {
        (
            name.to_owned(),
            json!(stats.times.of(stage).as_secs_f64() * 1000.0 / steps),
        )
    };
    Stage::ALL
        .into_iter()
        .map(mean)
        .collect::<Map<_, _>>()
        .into()
}

fn energy(finished: &Finished) -> Value {
    let balance = finished.simulation.balance();
    let energies = &balance.energies;
    let named = |list: &[(&str, f64)]| {
        list.iter()
            .map(|(name, joules)| ((*name).to_owned(), json!(joules)))
            .collect::<Map<_, _>>()
    };
    json!({
        "kinetic": energies.kinetic,
        "gravitational": energies.gravitational,
        "elastic": named(&energies.elastic),
        "dissipated": named(&balance.dissipated),
        "work": named(&balance.work),
        "residual": balance.residual,
        "exchanged": balance.exchanged,
        "unexplained": balance.unexplained(),
    })
}

/// What a reader of the summary must not miss.
fn warnings(report: &Value, scheme: Integrator) -> String {
    let count = |path: &str| report.pointer(path).and_then(Value::as_u64).unwrap_or(0);
    let mut said = String::new();
    let unsolved = count("/solver/unconverged_solves");
    if let Some(key) = scheme.tolerance_key().filter(|_| unsolved > 0) {
        let more = if scheme.has_most_iterations() {
            ", more solver.iterations,"
        } else {
            ""
        };
        said += &format!(
            "\nWARNING: {unsolved} of {} steps were not solved to their tolerance; use a smaller --dt{more} or a larger solver.{key}",
            report["steps"]
        );
    }
    let tangled = count("/contact/tangled");
    if tangled > 0 {
        said += &format!(
            "\nWARNING: {tangled} of {} particles that started inside or across something still are; start the cloth clear of it",
            report["contact"]["tangled_at_start"]
        );
    }
    let damped = count("/solver/damped_steps");
    if damped > 0 {
        said += &format!(
            "\nWARNING: {damped} of {} steps were solved as implicit Euler's whole equation, since {} would have made energy; use a smaller --dt or more damping.stiffness",
            report["steps"],
            scheme.name()
        );
    }
    said
}

/// What the time step is estimated to have cost, if that was asked.
fn accuracy(report: &Value) -> String {
    let number = |path: &str| report.pointer(path).and_then(Value::as_f64);
    let (Some(error), Some(share)) = (number("/error/estimate_m"), number("/error/share_of_time"))
    else {
        return String::new();
    };
    format!(
        "\nerror of the time step about {:.1e} m, from {} samples in {:.1} % of the time; the mesh's own is not in it",
        error,
        report["error"]["samples"],
        100.0 * share
    )
}

/// A few lines for people.
pub(super) fn summary(report: &Value, scheme: Integrator) -> String {
    let number = |path: &str| {
        report
            .pointer(path)
            .and_then(Value::as_f64)
            .unwrap_or(f64::NAN)
    };
    format!(
        "{}: {} after {:.3} s simulated in {:.1} s, {:.1} ms per 1/60 s\n\
         largest strain ever {:.2} %, deepest penetration ever {:.3} mm, kinetic energy {:.2e} J (peak {:.2e} J){}{}",
        report["scene"].as_str().unwrap_or_default(),
        report["outcome"].as_str().unwrap_or_default(),
        number("/simulated_s"),
        number("/wall_s"),
        number("/ms_per_frame"),
        100.0 * number("/strain/max_ever"),
        1000.0 * number("/contact/max_depth_ever_m"),
        number("/energy/kinetic"),
        number("/peak_kinetic_j"),
        accuracy(report),
        warnings(report, scheme),
    )
}
