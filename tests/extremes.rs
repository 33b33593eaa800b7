//! Every scheme at the extremes: it completes with a finite state, or it says why it can't go on.
//! Never a panic, a hang or a number that isn't one.

use crate::support::{Numbers, SCHEMES, load, named, written};
use glam::DVec3;
use muslin::model::{Cloth, Model, Pins};
use muslin::scene;
use muslin::simulation::{Diverged, Sign, Simulation, Stage};
use muslin::state::State;

/// A sheet with hinges, held at two corners.
const SHEET: &str = "name = \"extreme\"\nduration = 1.0\n[[cloth]]\nname = \"sheet\"\nshape = { sheet = { size = [0.5, 0.5], cells = [8, 8], diagonals = \"both\" } }\nbending = \"discrete-shell\"\nmaterial = { area_density = 0.2, stretch = 100.0, bend = 1.0e-5 }\ndamping = { mass = 0.1, stiffness = 0.001 }\n[[pin]]\ncloth = \"sheet\"\nselect = { corner = [\"left-near\", \"right-near\"] }\n";

/// The sheet's damping, to be replaced.
const DAMPING: &str = "damping = { mass = 0.1, stiffness = 0.001 }\n";

/// How a run of some steps ended.
#[derive(Debug, PartialEq)]
enum End {
    Completed,
    Explained,
}

/// Runs some steps and looks at every state.
fn run(what: &str, name: &str, model: Model, state: State, dt: f64, steps: u32) -> End {
    let mut run = Simulation::new(model, state, named(name), dt);
    for _ in 0..steps {
        if let Err(diverged) = run.step() {
            check_explanation(&format!("{what}, {name}"), &diverged, &run);
            return End::Explained;
        }
        let bad = run.state().first_non_finite();
        assert!(bad.is_none(), "{what}, {name}: particle {bad:?}");
    }
    End::Completed
}

/// An explanation tells when, where and why a run ended and what to do, and leaves the last good state.
fn check_explanation(what: &str, diverged: &Diverged, run: &Simulation) {
    let (account, text) = (&diverged.account, diverged.to_string());
    let (state, last) = (run.state(), run.stats().steps);
    assert_eq!(
        state.first_non_finite(),
        None,
        "{what}: the last good state isn't"
    );
    assert!(
        account.last_good.is_finite() && account.last_good == state.time,
        "{what}: {} s, the state is of {} s",
        account.last_good,
        state.time
    );
    assert_eq!(diverged.step, last + 1, "{what}: {text}");
    assert!(
        diverged.time > account.last_good && diverged.dt == run.dt(),
        "{what}: {text}"
    );
    // Nothing but the scheme moves these cloths.
    assert_eq!(diverged.stage, Stage::Integrate, "{what}: {text}");
    if let Sign::Grown(times) = diverged.sign {
        assert!(times > 1.0, "{what}: {text}");
    }
    let (cloth, particle) = &account.particle;
    let cloth = run.model().cloths.iter().find(|other| other.name == *cloth);
    assert!(
        cloth.is_some_and(|cloth| *particle < cloth.particles.len()),
        "{what}: {text}"
    );
    assert_eq!(
        account.explicit,
        run.integrator().is_explicit(),
        "{what}: {text}"
    );
    // Explicit schemes fail only beyond their stable step, and a smaller one is what helps.
    if account.explicit {
        assert!(diverged.stable_dt < run.dt(), "{what}: {text}");
        let less = diverged.suggested_dt().is_some_and(|dt| dt < run.dt());
        assert!(less || diverged.stable_dt == 0.0, "{what}: {text}");
    }
    assert!(
        diverged.remedy().contains("use ") && text.ends_with(&diverged.remedy()),
        "{what}: {text}"
    );
}

/// The same for a scene.
fn run_scene(name: &str, text: &str, dt: f64, steps: u32) -> End {
    let built = scene::build(&written("extreme", text)).unwrap();
    run(text, name, built.model, built.state, dt, steps)
}

fn is_implicit(name: &str) -> bool {
    [
        "implicit-euler",
        "newton",
        "implicit-midpoint",
        "bdf2",
        "projective",
    ]
    .contains(&name)
}

#[test]
fn steps_from_a_microsecond_to_a_second() {
    for name in SCHEMES {
        for dt in [1e-6, 1e-4, 1.0 / 60.0, 0.2, 1.0] {
            let end = run_scene(name, SHEET, dt, 20);
            // A microsecond is stable for every scheme.
            assert!(end == End::Completed || dt > 1e-5, "{name} at {dt} s");
        }
    }
}

#[test]
fn stiffness_from_a_hundredth_to_a_hundred_million() {
    for name in SCHEMES {
        for stretch in ["1e-2", "1.0", "1e4", "1e6", "1e8"] {
            let text = SHEET.replace("stretch = 100.0", &format!("stretch = {stretch}"));
            // dopri5 takes up to 100,000 steps of its own in each: seconds.
            let steps = if name == "dopri5" { 1 } else { 10 };
            let end = run_scene(name, &text, 1.0 / 60.0, steps);
            if is_implicit(name) {
                assert_eq!(end, End::Completed, "{name} at {stretch} N/m");
            }
        }
    }
}

/// No implicit scheme needs damping to go on: the midpoint rule, which has none of its own, takes the
/// steps that would make energy by implicit Euler.
#[test]
fn stiff_cloth_without_any_damping() {
    for name in SCHEMES.into_iter().filter(|name| is_implicit(name)) {
        for stretch in ["1e2", "1e4", "1e6", "1e8"] {
            let text = SHEET
                .replace("stretch = 100.0", &format!("stretch = {stretch}"))
                .replace(DAMPING, "");
            let end = run_scene(name, &text, 1.0 / 60.0, 60);
            assert_eq!(end, End::Completed, "{name} at {stretch} N/m");
        }
    }
}

/// A chain that starts pressed together, with more energy than it can ever lose in swinging: what is
/// linearised in a step is far from what it does.
#[test]
fn a_pressed_chain_of_any_stiffness() {
    for name in SCHEMES.into_iter().filter(|name| is_implicit(name)) {
        for stretch in ["1e2", "1e4", "1e6", "1e8"] {
            let built = scene::build(&load(
                "chain",
                &[&format!("cloth.0.material.stretch={stretch}")],
            ))
            .unwrap();
            let what = format!("a pressed chain of {stretch} N");
            let end = run(&what, name, built.model, built.state, 1.0 / 60.0, 60);
            assert_eq!(end, End::Completed, "{name}: {what}");
        }
    }
}

#[test]
fn damping_from_none_to_over_critical() {
    for name in SCHEMES {
        for (mass, stiffness) in [(0.0, 0.0), (100.0, 0.0), (0.0, 1.0), (1e4, 100.0)] {
            let damping = format!("damping = {{ mass = {mass:?}, stiffness = {stiffness:?} }}\n");
            let text = SHEET.replace(DAMPING, &damping);
            let end = run_scene(name, &text, 1.0 / 240.0, 30);
            if is_implicit(name) {
                assert_eq!(end, End::Completed, "{name}, {damping}");
            }
        }
    }
}

const NO_GRAVITY: &str = "[0.0, 0.0, 0.0]";

#[test]
fn gravity_none_and_a_hundredfold() {
    for name in SCHEMES {
        for gravity in [NO_GRAVITY, "[0.0, -981.0, 0.0]"] {
            let text = SHEET.replace(
                "duration = 1.0",
                &format!("duration = 1.0\ngravity = {gravity}"),
            );
            let end = run_scene(name, &text, 1.0 / 240.0, 60);
            // Without weight the sheet is at rest for every scheme; the step is twice what the explicit
            // schemes bear of the sheet in motion.
            let bears = gravity == NO_GRAVITY || !named(name).is_explicit();
            assert!(end == End::Completed || !bears, "{name}, {gravity} m/s²");
        }
    }
}

#[test]
fn neighbours_of_a_millionfold_mass() {
    for name in SCHEMES {
        for factor in [1e3, 1e-3] {
            let built = scene::build(&written("masses", SHEET)).unwrap();
            let mut model = built.model;
            for i in (0..model.particles()).step_by(2) {
                let factors = [factor, 1.0 / factor];
                model.masses[i] *= factors[i / 2 % 2];
                model.gravity.masses[i] = model.masses[i];
                if model.inverse_masses[i] > 0.0 {
                    model.inverse_masses[i] = 1.0 / model.masses[i];
                }
            }
            let end = run("masses", name, model, built.state, 1.0 / 240.0, 30);
            if is_implicit(name) {
                assert_eq!(end, End::Completed, "{name}, factor {factor}");
            }
        }
    }
}

/// Whether a scheme goes on from a sheet that was collapsed onto a line or torn to random places, which
/// has thousands of times the energy that it ever has as cloth.
fn survives(name: &str, what: &str) -> bool {
    match name {
        "implicit-euler" | "implicit-midpoint" | "xpbd" | "projective" => true,
        // Folded hinges of no width pull without bound, which ends Newton's steps.
        "newton" | "bdf2" => what != "a line",
        "dopri5" => !what.contains("line"),
        _ => false,
    }
}

#[test]
fn collapsed_to_a_point_and_all_on_a_line() {
    for name in SCHEMES {
        for what in ["a point", "a line", "almost a line", "random places"] {
            let built = scene::build(&written("collapsed", SHEET)).unwrap();
            let (mut state, mut numbers) = (built.state, Numbers(3));
            for x in &mut state.positions {
                *x = match what {
                    "a point" => DVec3::ZERO,
                    "a line" => *x * DVec3::X,
                    "almost a line" => *x * DVec3::new(1.0, 0.0, 1e-12),
                    _ => numbers.vector(),
                };
            }
            let end = run(what, name, built.model, state, 1.0 / 240.0, 30);
            assert!(
                end == End::Completed || !survives(name, what),
                "{name}: {what}"
            );
        }
    }
}

/// One particle and nothing else falls as a stone does.
#[test]
fn one_particle() {
    for name in SCHEMES {
        let built = scene::build(&written("one", SHEET)).unwrap();
        let model = Model {
            cloths: vec![Cloth {
                name: "stone".to_owned(),
                particles: 0..1,
                triangles: Vec::new(),
            }],
            masses: vec![0.3],
            inverse_masses: vec![1.0 / 0.3],
            gravity: muslin::force::Gravity {
                masses: vec![0.3],
                ..built.model.gravity
            },
            springs: Vec::new(),
            edge_springs: None,
            discrete_shells: None,
            mass_damping: None,
            spring_damping: Vec::new(),
            hinge_damping: None,
            strain_limit: None,
            obstacles: Vec::new(),
            self_collision: None,
            pins: Pins::default(),
            rest: vec![DVec3::ZERO],
        };
        let mut run = Simulation::new(model, State::at_rest(vec![DVec3::ZERO]), named(name), 0.01);
        crate::support::run_to(&mut run, 0.5);
        let (fallen, exact) = (-run.state().positions[0].y, 0.5 * 9.81 * 0.25);
        // First-order schemes are off by g t dt/2.
        assert!(
            (fallen - exact).abs() < 0.5 * 9.81 * 0.5 * 0.01 + 1e-9,
            "{name}: {fallen} m, {exact} m"
        );
    }
}

#[test]
fn a_million_particles() {
    let text = SHEET
        .replace("cells = [8, 8]", "cells = [999, 999]")
        .replace("bending = \"discrete-shell\"\n", "")
        // In cells of half a millimetre a stiffness damping of 1 ms would bind dopri5 to steps of
        // 0.2 µs, a hundred passes.
        .replace("stiffness = 0.001", "stiffness = 1.0e-7");
    let loaded = written("million", &text);
    for name in SCHEMES {
        let built = scene::build(&loaded).unwrap();
        let end = run("a million", name, built.model, built.state, 1e-5, 2);
        assert_eq!(end, End::Completed, "{name}");
    }
}
