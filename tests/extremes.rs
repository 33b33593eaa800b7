//! Every scheme at the extremes: it completes with a finite state, or it says why it can't go on.
//! Never a panic, a hang or a number that isn't one.

use crate::support::{Numbers, SCHEMES, load, written};
use glam::DVec3;
use muslin::integrator::Integrator;
use muslin::model::{Cloth, Model, Pins};
use muslin::scene;
use muslin::simulation::Simulation;
use muslin::state::State;

/// A sheet with hinges, held at two corners.
const SHEET: &str = "name = \"extreme\"\nduration = 1.0\n[[cloth]]\nname = \"sheet\"\nshape = { sheet = { size = [0.5, 0.5], cells = [8, 8], diagonals = \"both\" } }\nbending = \"discrete-shell\"\nmaterial = { area_density = 0.2, stretch = 100.0, bend = 1.0e-5 }\ndamping = { mass = 0.1, stiffness = 0.001 }\n[[pin]]\ncloth = \"sheet\"\nselect = { corner = [\"left-near\", \"right-near\"] }\n";

/// A scheme as a scene asks for it by name alone.
fn scheme(name: &str) -> Integrator {
    let loaded = load("hanging-cloth", &[&format!("solver.integrator={name}")]);
    let mut solver = loaded.scene.solver;
    solver.linear_tolerance = 1e-4;
    Integrator::of(&solver)
}

/// How a run of some steps ended.
#[derive(Debug, PartialEq)]
enum End {
    Completed,
    Explained,
}

/// Runs some steps and looks at every state.
fn run(what: &str, name: &str, model: Model, state: State, dt: f64, steps: u32) -> End {
    let mut run = Simulation::new(model, state, scheme(name), dt);
    for _ in 0..steps {
        if let Err(diverged) = run.step() {
            let text = diverged.to_string();
            assert!(
                text.contains("step") && text.len() > 60,
                "{what}, {name}: {text}"
            );
            let finite = run.state().first_non_finite().is_none();
            assert!(finite, "{what}, {name}: the last good state isn't");
            return End::Explained;
        }
        let bad = run.state().first_non_finite();
        assert!(bad.is_none(), "{what}, {name}: particle {bad:?}");
    }
    End::Completed
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
            let end = run_scene(name, &text, 1.0 / 60.0, 30);
            if is_implicit(name) && stretch != "1e-2" {
                assert_eq!(end, End::Completed, "{name} at {stretch} N/m");
            }
        }
    }
}

#[test]
fn damping_from_none_to_over_critical() {
    for name in SCHEMES {
        for (mass, stiffness) in [(0.0, 0.0), (100.0, 0.0), (0.0, 1.0), (1e4, 100.0)] {
            let damping = format!("damping = {{ mass = {mass:?}, stiffness = {stiffness:?} }}");
            let text = SHEET.replace("damping = { mass = 0.1, stiffness = 0.001 }", &damping);
            let end = run_scene(name, &text, 1.0 / 240.0, 30);
            if is_implicit(name) {
                assert_eq!(end, End::Completed, "{name}, {damping}");
            }
        }
    }
}

#[test]
fn gravity_none_and_a_hundredfold() {
    for name in SCHEMES {
        for gravity in ["[0.0, 0.0, 0.0]", "[0.0, -981.0, 0.0]"] {
            let text = SHEET.replace(
                "duration = 1.0",
                &format!("duration = 1.0\ngravity = {gravity}"),
            );
            run_scene(name, &text, 1.0 / 240.0, 60);
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

#[test]
fn collapsed_to_a_point_and_all_on_a_line() {
    for name in SCHEMES {
        for collapse in [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 0.0, 1e-12)] {
            let built = scene::build(&written("collapsed", SHEET)).unwrap();
            let mut state = built.state;
            state.positions.iter_mut().for_each(|x| *x *= collapse);
            let what = format!("collapsed by {collapse}");
            run(&what, name, built.model, state, 1.0 / 240.0, 30);
        }
        let built = scene::build(&written("crumpled", SHEET)).unwrap();
        let (mut state, mut numbers) = (built.state, Numbers(3));
        for x in &mut state.positions {
            *x = numbers.vector();
        }
        run(
            "torn to random places",
            name,
            built.model,
            state,
            1.0 / 240.0,
            30,
        );
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
            pins: Pins::default(),
            rest: vec![DVec3::ZERO],
        };
        let mut run = Simulation::new(model, State::at_rest(vec![DVec3::ZERO]), scheme(name), 0.01);
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
    for name in SCHEMES {
        let text = SHEET
            .replace("cells = [8, 8]", "cells = [999, 999]")
            .replace("bending = \"discrete-shell\"\n", "");
        let built = scene::build(&written("million", &text)).unwrap();
        run("a million", name, built.model, built.state, 1e-5, 2);
    }
}
