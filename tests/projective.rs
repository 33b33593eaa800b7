//! The scheme `projective`: what its steps solve, and how far one can go with it.

use crate::schemes::SHEET;
use crate::support::{Numbers, PROJECTIVE, written};
use glam::DVec3;
use muslin::collision::Contacts;
use muslin::energy::{Energies, potential};
use muslin::integrator::Integrator;
use muslin::model::Model;
use muslin::scene::{self, Built};
use muslin::simulation::Simulation;
use muslin::state::State;

/// A sheet of either bending law, shaken and folded.
fn shaken(law: &str) -> Built {
    let mut built = scene::build(&written(
        "projective",
        &SHEET.replace("discrete-shell", law),
    ))
    .unwrap();
    let mut numbers = Numbers(7);
    for i in 0..built.model.particles() {
        if !built.model.is_pinned(i) {
            built.state.positions[i] += numbers.vector() * 0.02;
            built.state.velocities[i] = numbers.vector();
        }
    }
    built
}

/// √(Σ |M (v₁ − v₀)/dt − f(x₁, v₁)|²/m) over free particles, relative to the larger of the same norms
/// of the weight and of M (v₁ − v₀)/dt.
fn residual(model: &Model, before: &State, after: &State, dt: f64) -> f64 {
    let mut forces = vec![DVec3::ZERO; model.particles()];
    for law in model.forces() {
        law.add_forces(after, &mut forces);
    }
    for damping in model.dampings() {
        damping.add_forces(after, &mut forces);
    }
    let [mut left, mut gained, mut weight] = [0.0; 3];
    for i in (0..forces.len()).filter(|&i| !model.is_pinned(i)) {
        let m = model.masses[i];
        let gain = (after.velocities[i] - before.velocities[i]) * (m / dt);
        left += (gain - forces[i]).length_squared() / m;
        gained += gain.length_squared() / m;
        weight += m * model.gravity.acceleration.length_squared();
    }
    (left / f64::max(gained, weight)).sqrt()
}

#[test]
fn a_step_solves_the_equation_of_implicit_euler() {
    for law in ["discrete-shell", "edge-spring", "none"] {
        for (dt, tolerance) in [(1e-3, 1e-6), (1.0 / 60.0, 1e-3), (1.0 / 60.0, 1e-9)] {
            let Built { model, state, .. } = shaken(law);
            assert!(!model.spring_damping.is_empty() && model.mass_damping.is_some());
            assert_eq!(model.hinge_damping.is_some(), law != "none");
            let scheme = Integrator::Projective {
                iterations: 2000,
                residual: tolerance,
            };
            let mut run = Simulation::new(model, state, scheme, dt);
            for step in 0..20 {
                let before = run.state().clone();
                let solve = run.step().unwrap().solve;
                let left = residual(run.model(), &before, run.state(), dt);
                assert!(
                    solve.converged && left <= 1.001 * tolerance,
                    "{law}, {dt} s, step {step}: {left}, {solve:?}"
                );
            }
        }
    }
}

/// What is reported is what is left, also when the iterations don't suffice.
#[test]
fn a_residual_is_reached_or_reported() {
    let dt = 1.0 / 60.0;
    let mut last = f64::INFINITY;
    for iterations in [1, 2, 4, 8] {
        let Built { model, state, .. } = shaken("discrete-shell");
        let scheme = Integrator::Projective {
            iterations,
            residual: 1e-12,
        };
        let before = state.clone();
        let mut run = Simulation::new(model, state, scheme, dt);
        let solve = run.step().unwrap().solve;
        let left = residual(run.model(), &before, run.state(), dt);
        assert!(
            !solve.converged && solve.iterations == iterations,
            "{solve:?}"
        );
        assert_eq!(run.stats().unsolved, 1);
        assert!(
            (solve.residual / left - 1.0).abs() < 1e-6,
            "{left}, {solve:?}"
        );
        assert!(left < last, "{iterations}: {left} after {last}");
        last = left;
    }
}

/// J = ½ (v₁ − v₀) · M (v₁ − v₀) + U(x₁), which a step makes least, falls with every iteration, also where the
/// first steps go much too far: a sheet that is stretched twofold, folded and shaken.
#[test]
fn each_iteration_lowers_what_a_step_makes_least() {
    let text = SHEET.replace("damping = { mass = 0.5, stiffness = 0.002 }\n", "");
    for stretch in ["20.0", "1.0e5"] {
        let text = text.replace("stretch = 20.0", &format!("stretch = {stretch}"));
        let mut last = f64::INFINITY;
        for iterations in 1..30 {
            let Built {
                model,
                state: mut before,
                ..
            } = scene::build(&written("lower", &text)).unwrap();
            let mut numbers = Numbers(3);
            let free = |i: &usize| !model.is_pinned(*i);
            for i in (0..model.particles()).filter(free) {
                before.positions[i] = before.positions[i] * 2.0 + numbers.vector() * 0.1;
            }
            let start = &before.velocities;
            let mut state = before.clone();
            let scheme = Integrator::Projective {
                iterations,
                residual: 1e-12,
            };
            let mut contacts = Contacts::none(model.particles());
            scheme
                .scheme(&model)
                .advance(&model, &mut contacts, 1.0 / 60.0, &before, &mut state);
            let gains = state.velocities.iter().zip(start).zip(&model.masses);
            let gained: f64 = gains
                .map(|((v, start), m)| 0.5 * m * v.distance_squared(*start))
                .sum();
            let sum = gained + potential(&model, &state);
            // Below this the scheme takes differences for rounding.
            let more = 1e-12 * sum.abs();
            assert!(
                sum <= last + more,
                "{stretch} N/m, {iterations}: {sum} J after {last} J"
            );
            last = sum;
        }
    }
}

#[test]
fn an_undamped_swing_never_gains_energy() {
    let text = SHEET.replace("damping = { mass = 0.5, stiffness = 0.002 }\n", "");
    for (iterations, dt) in [(3, 1.0 / 60.0), (100, 1.0 / 60.0), (100, 2e-3)] {
        let built = scene::build(&written("swing", &text)).unwrap();
        let scheme = Integrator::Projective {
            iterations,
            residual: 1e-6,
        };
        let mut run = Simulation::new(built.model, built.state, scheme, dt);
        let total = |run: &Simulation| Energies::of(run.model(), run.state()).total();
        let (mut before, mut kinetic) = (total(&run), 0.0_f64);
        for step in 0..200 {
            run.step().unwrap();
            let after = total(&run);
            kinetic = kinetic.max(Energies::of(run.model(), run.state()).kinetic);
            assert!(
                iterations == 3 || after <= before + 1e-6 * kinetic,
                "{dt} s, step {step}: {before} J, then {after} J"
            );
            before = after;
        }
        // However few the iterations, nothing blows up.
        assert!(
            before < 1e-6 * kinetic && kinetic > 0.0,
            "{before} J, {kinetic} J"
        );
    }
}

/// Pins with a velocity move with it and keep it, to the last bit.
#[test]
fn pins_are_prescribed() {
    let Built {
        model, mut state, ..
    } = shaken("edge-spring");
    let velocity = DVec3::new(0.1, 0.2, -0.3);
    let pins: Vec<usize> = (0..model.particles())
        .filter(|&i| model.is_pinned(i))
        .collect();
    for &pin in &pins {
        state.velocities[pin] = velocity;
    }
    let dt = 1.0 / 60.0;
    let start = state.clone();
    let mut run = Simulation::new(model, state, PROJECTIVE, dt);
    assert!(run.step().unwrap().solve.converged);
    for pin in pins {
        assert_eq!(run.state().velocities[pin], velocity);
        assert_eq!(
            run.state().positions[pin],
            start.positions[pin] + velocity * dt
        );
    }
    assert!(residual(run.model(), &start, run.state(), dt) < 1e-6);
}

/// Free fall is exact, with the momentum of drag too, in no iteration.
#[test]
fn free_fall_needs_no_iteration() {
    let (text, _) = SHEET.split_once("[[pin]]").unwrap();
    let built = scene::build(&written("fall", text)).unwrap();
    let mut run = Simulation::new(built.model, built.state, PROJECTIVE, 0.01);
    let mut v = 0.0;
    for _ in 0..10 {
        let solve = run.step().unwrap().solve;
        assert!(solve.converged && solve.iterations == 0, "{solve:?}");
        v = (v - 9.81 * 0.01) / (1.0 + 0.5 * 0.01);
        let fastest = run
            .state()
            .velocities
            .iter()
            .map(|u| (*u - DVec3::Y * v).length());
        assert!(fastest.fold(0.0, f64::max) < 1e-13);
    }
}
