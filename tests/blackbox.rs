//! What is known before a run, and after it has failed: forecast, chosen step, black box.

use crate::support::{IMPLICIT, Numbers, load, written};
use muslin::frame::{Capture, Level};
use muslin::integrator::Integrator;
use muslin::model::Model;
use muslin::pipeline::{self, Plan};
use muslin::recorder::MemoryRecorder;
use muslin::scene::{self, BUILTIN, Built, Step};
use muslin::simulation::{
    AUTO_SHARE, Cause, Diverged, Sign, Simulation, Stage, forecast, step_length,
};
use std::sync::atomic::AtomicBool;

fn built(name: &str, changes: &[&str]) -> Built {
    scene::build(&load(name, changes)).unwrap()
}

/// How far the stable step of symplectic Euler shrinks while cloth moves and stretches: `"auto"` keeps
/// a margin for it.
#[test]
fn auto_keeps_a_margin_for_what_moves() {
    for (name, time) in [
        ("hanging-cloth", 1.0),
        ("drape", 0.4),
        ("chain", 0.5),
        ("thin-shell", 0.1),
        ("block", 0.5),
    ] {
        let changes = ["cloth.0.damping.stiffness=0", "cloth.0.damping.mass=0.5"];
        let built = built(name, &changes);
        let scheme = Integrator::SymplecticEuler;
        let start = forecast(&built.model, &built.state).stable_dt(scheme);
        let mut run = Simulation::new(built.model, built.state, scheme, 0.5 * start);
        let mut least = f64::INFINITY;
        let every = (0.01 / run.dt()).ceil() as u64;
        while run.state().time < time {
            run.step().unwrap_or_else(|error| panic!("{name}: {error}"));
            if run.stats().steps.is_multiple_of(every) {
                least = least.min(forecast(run.model(), run.state()).stable_dt(scheme));
            }
        }
        let strain = run.stats().strain_ever;
        println!(
            "{name}: {:.3} of {start:.3e} s, strain {strain:.3}",
            least / start
        );
        // Springs at twice their length, as the undamped block's where it lands, are stiffer than at rest.
        let share = if strain < 0.5 { AUTO_SHARE } else { 0.88 };
        assert!(least > share * start, "{name}: {}", least / start);
    }
}

#[test]
fn auto_is_a_share_of_the_stable_step_or_what_the_scheme_usually_takes() {
    let built = built("hanging-cloth", &["cloth.0.damping={}"]);
    let forecast = forecast(&built.model, &built.state);
    for scheme in Integrator::EXPLICIT {
        let limit = forecast.stable_dt(scheme);
        match step_length(Step::Auto, scheme, &forecast) {
            Ok(dt) => assert!(dt > 0.5 * limit && dt < limit, "{dt} of {limit}"),
            Err(error) => assert!(
                scheme == Integrator::Euler && error.to_string().contains("damping"),
                "{error}"
            ),
        }
    }
    let implicit = step_length(Step::Auto, IMPLICIT, &forecast);
    assert_eq!(implicit, Ok(1.0 / 240.0));
    let given = step_length(Step::Seconds(0.1), Integrator::Euler, &forecast);
    assert_eq!(given, Ok(0.1));
}

/// A sheet that swings, thrown a little out of shape, with damping that lets even explicit Euler have a
/// stable step: half of critical for the fastest mode.
fn swinging() -> Built {
    let of = |rate: f64| {
        let text = format!(
            "name = \"swing\"\nduration = 1.0\n[[cloth]]\nname = \"sheet\"\nshape = {{ sheet = {{ size = [0.5, 0.5], cells = [8, 8], diagonals = \"both\" }} }}\nmaterial = {{ area_density = 0.2, stretch = 50.0 }}\ndamping = {{ mass = {rate:e} }}\n[[pin]]\ncloth = \"sheet\"\nselect = {{ corner = [\"left-near\", \"right-near\"] }}\n"
        );
        scene::build(&written("swinging", &text)).unwrap()
    };
    let still = of(0.0);
    let omega = forecast(&still.model, &still.state).modes[0].omega;
    let mut built = of(omega);
    let mut numbers = Numbers(7);
    let free = built.model.inverse_masses.iter().map(|w| *w > 0.0);
    for (x, free) in built.state.positions.iter_mut().zip(free) {
        if free {
            *x += numbers.vector() * 1e-5;
        }
    }
    built
}

/// How a swinging sheet ends when its model is changed and its step, a share of what was stable before,
/// kept; what is suggested must then hold.
fn fate(scheme: Integrator, share: f64, change: &dyn Fn(&mut Model)) -> Diverged {
    let mut built = swinging();
    let dt = share * forecast(&built.model, &built.state).stable_dt(scheme);
    change(&mut built.model);
    let what = scheme.name();
    let mut run = Simulation::new(built.model, built.state, scheme, dt);
    let diverged = (0..20_000).find_map(|_| run.step().err());
    let diverged = diverged.unwrap_or_else(|| panic!("{what}: {share} of the limit holds"));
    println!("{diverged}");
    assert_eq!(diverged.stage, Stage::Integrate);
    assert_eq!(diverged.account.scheme, what);
    assert_eq!(diverged.account.last_good, run.state().time);
    assert!(run.state().first_non_finite().is_none());
    assert!(diverged.dt > diverged.stable_dt, "{diverged:?}");

    let mut again = swinging();
    change(&mut again.model);
    let dt = diverged.suggested_dt().unwrap();
    let mut run = Simulation::new(again.model, again.state, scheme, dt);
    for _ in 0..5000 {
        run.step()
            .unwrap_or_else(|error| panic!("{what}, as suggested: {error}"));
    }
    diverged
}

fn weigh(model: &mut Model, particles: std::ops::Range<usize>, times: f64) {
    for i in particles {
        model.masses[i] *= times;
        model.mass_damping.as_mut().unwrap().drag[i] *= times;
        model.gravity.masses[i] *= times;
        model.inverse_masses[i] /= times;
    }
}

#[test]
fn a_step_above_the_forecast_is_named() {
    for scheme in Integrator::EXPLICIT {
        let diverged = fate(scheme, 1.2, &|_| ());
        let Cause::LongStep { times } = diverged.account.cause else {
            panic!("{}: {:?}", scheme.name(), diverged.account.cause);
        };
        assert!((times - 1.2).abs() < 0.06, "{}: {times}", scheme.name());
    }
}

#[test]
fn a_cloth_that_is_too_light_is_named() {
    for scheme in Integrator::EXPLICIT {
        let all = 0..81;
        let diverged = fate(scheme, 0.9, &|model| weigh(model, all.clone(), 0.01));
        let Cause::LongStep { times } = diverged.account.cause else {
            panic!("{}: {:?}", scheme.name(), diverged.account.cause);
        };
        // ω is tenfold, so that 2/ω would make it 9; the drag, half of critical before, shortened the
        // step then and hardly does now: symplectic Euler has 0.9 (√5 − 1)/((√401 − 1)/100) = 5.9.
        assert!(times > 5.5, "{}: {times}", scheme.name());
        let softer = diverged.remedy().contains("less stiffness by mass");
        assert_eq!(softer, scheme != Integrator::Euler, "{}", diverged.remedy());
    }
}

#[test]
fn a_particle_that_is_too_light_is_named() {
    for scheme in Integrator::EXPLICIT {
        let diverged = fate(scheme, 0.9, &|model| weigh(model, 40..41, 0.01));
        let account = &diverged.account;
        let Cause::LightParticle { particle, share } = account.cause else {
            panic!("{}: {:?}", scheme.name(), account.cause);
        };
        assert!(particle == 40 && (share - 0.01).abs() < 1e-3, "{account:?}");
        let limiting = account.limiting.as_ref().unwrap();
        assert!(limiting.particles.contains(&40), "{account:?}");
        assert_eq!(account.particle, ("sheet".to_owned(), 40));
    }
}

#[test]
fn a_spring_that_is_too_stiff_is_named() {
    let ends = swinging().model.springs[0].springs[50].ends;
    let stiffen = |model: &mut Model| {
        for batch in &mut model.springs {
            for spring in batch.springs.iter_mut().filter(|s| s.ends == ends) {
                spring.stiffness *= 1e3;
            }
        }
    };
    for scheme in Integrator::EXPLICIT {
        let diverged = fate(scheme, 0.9, &stiffen);
        let account = &diverged.account;
        let Cause::StiffElement { times } = account.cause else {
            panic!("{}: {:?}", scheme.name(), account.cause);
        };
        assert!(times > 400.0 && times < 2100.0, "{account:?}");
        let limiting = account.limiting.as_ref().unwrap();
        assert_eq!(limiting.particles, ends.map(|i| i as usize));
        assert_eq!(limiting.law, "structural");
        let (_, shown) = &account.particle;
        assert!(limiting.particles.contains(shown), "{account:?}");
    }
}

/// Growth is seen long before anything overflows: an undamped pair under explicit Euler swings wider and
/// wider, never by more than its springs bear.
#[test]
fn energy_that_no_work_explains_is_noticed() {
    let built = built("spring", &["cloth.0.damping={}"]);
    let mut run = Simulation::new(built.model, built.state, Integrator::Euler, 0.02);
    let diverged = (0..100_000).find_map(|_| run.step().err()).unwrap();
    println!("{diverged}");
    assert!(
        matches!(diverged.sign, Sign::Grown(times) if times < 20.0),
        "{diverged:?}"
    );
    assert_eq!(diverged.account.cause, Cause::NoDamping);
    assert!(diverged.remedy().contains("no step is stable"));
}

/// The recording of a run that diverged ends with a checkpoint of the last good state and the reason.
#[test]
fn the_last_good_state_is_kept_as_a_checkpoint() {
    let loaded = load("hanging-cloth", &[]);
    let built = scene::build(&loaded).unwrap();
    let scheme = Integrator::SymplecticEuler;
    let simulation = Simulation::new(built.model, built.state, scheme, 0.003);
    let (capture, _) = Capture::new(&loaded, &simulation);
    let stop = AtomicBool::new(false);
    let plan = Plan {
        duration: 4.0,
        fps: 60.0,
        checkpoint: 1e3,
        error: 0.0,
        threads: 1,
        notes: Vec::new(),
        stop: &stop,
    };
    let mut recorder = MemoryRecorder::default();
    let finished = pipeline::run(simulation, capture, &mut recorder, &plan, &mut |_| {}).unwrap();
    let diverged = finished.diverged.unwrap();
    let frame = recorder.frames.last().unwrap();
    let checkpoint = frame.checkpoint.as_ref().unwrap();
    assert_eq!(checkpoint.time, diverged.account.last_good);
    assert_eq!(checkpoint.step, diverged.step - 1);
    let numbers = checkpoint.cloths.iter().flat_map(|cloth| &cloth.particles);
    assert!(numbers.flatten().all(|x| x.is_finite()));
    assert_eq!(frame.events[0].level, Level::Error);
    assert_eq!(frame.events[0].text, diverged.to_string());
}

/// Runs a scene for some steps of a stable length; no alarm may be raised. Explicit Euler's stable step
/// shrinks when cloth gets taut: its alarm must say so.
fn passes(what: &str, built: Built, scheme: Integrator, dt: f64, steps: u32) {
    let mut run = Simulation::new(built.model, built.state, scheme, dt);
    for _ in 0..steps {
        if let Err(error) = run.step() {
            let true_one = scheme == Integrator::Euler && error.stable_dt < 0.9 * dt;
            assert!(true_one, "{what}, {} at {dt} s: {error}", scheme.name());
            return;
        }
    }
}

#[test]
fn no_scene_raises_a_false_alarm_at_a_stable_step() {
    for (name, _) in BUILTIN {
        for scheme in Integrator::EXPLICIT {
            for share in [0.98, AUTO_SHARE, 0.3] {
                let built = built(name, &[]);
                let limit = forecast(&built.model, &built.state).stable_dt(scheme);
                if limit > 0.0 {
                    passes(name, built, scheme, share * limit, 500);
                }
            }
        }
        let Step::Seconds(own) = load(name, &[]).scene.solver.dt else {
            continue;
        };
        for dt in [own, 0.5 * own] {
            passes(name, built(name, &[]), IMPLICIT, dt, 100);
        }
    }
}

#[test]
fn what_falls_spins_or_starts_stretched_raises_no_false_alarm() {
    let cases: [&[&str]; 5] = [
        &["pin=[]"],
        &["pin=[]", "gravity=[0, -981, 0]"],
        &[
            "pin=[]",
            "gravity=[0, 0, 0]",
            "cloth.0.start.spin=[0, 12, 0]",
        ],
        &["pin=[]", "cloth.0.start.stretch=[1.3, 1, 0.9]"],
        // At 9 m/s the whip of a free corner reaches 124 % of strain, and coarse steps tear it.
        &["cloth.0.start.velocity=[0, 4, 0]"],
    ];
    for changes in cases {
        for damping in ["cloth.0.damping={}", "cloth.0.damping.mass=1"] {
            let changes: Vec<&str> = changes.iter().copied().chain([damping]).collect();
            let what = format!("{changes:?}");
            for scheme in Integrator::EXPLICIT {
                let built = built("hanging-cloth", &changes);
                let limit = forecast(&built.model, &built.state).stable_dt(scheme);
                if limit > 0.0 {
                    passes(&what, built, scheme, AUTO_SHARE * limit, 1000);
                }
            }
            for dt in [0.01, 0.004] {
                passes(&what, built("hanging-cloth", &changes), IMPLICIT, dt, 200);
            }
        }
    }
}
