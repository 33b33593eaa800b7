//! Laws that every force, and every scheme, has to keep.

use crate::support::{IMPLICIT, Numbers, run_to, simulation};
use glam::{DQuat, DVec3};
use muslin::integrator::Integrator;
use muslin::linear::{Assembly, PairMatrix};
use muslin::model::Model;
use muslin::state::State;

const SCHEMES: [Integrator; 2] = [Integrator::SymplecticEuler, IMPLICIT];

/// A small poncho with every kind of spring and both dampings, shaken out of its rest shape.
fn shaken() -> (Model, State) {
    let changes = ["cloth.0.shape.sheet.cells=[16, 16]", "obstacle=[]"];
    let built = muslin::scene::build(&crate::support::load("drape", &changes)).unwrap();
    let mut numbers = Numbers(7);
    let mut state = built.state;
    for i in 0..state.positions.len() {
        // Cells are 8 cm wide: strains of −40 … 60 %.
        state.positions[i] += numbers.vector() * 0.015;
        state.velocities[i] = numbers.vector();
    }
    (built.model, state)
}

/// A state moved along a direction of the whole state.
fn displaced(state: &State, direction: &[DVec3], way: f64) -> State {
    let mut moved = state.clone();
    let pairs = moved.positions.iter_mut().zip(direction);
    pairs.for_each(|(x, d)| *x += *d * way);
    moved
}

fn forces_of(add: impl Fn(&mut [DVec3]), particles: usize) -> Vec<DVec3> {
    let mut forces = vec![DVec3::ZERO; particles];
    add(&mut forces);
    forces
}

#[test]
fn forces_are_the_gradient_of_their_energy() {
    let (model, state) = shaken();
    let mut numbers = Numbers(11);
    for force in model.forces() {
        let forces = forces_of(|f| force.add_forces(&state, f), model.particles());
        // Along a random direction of the whole state; the step balances h² with ε/h.
        let h = 1e-6;
        for _ in 0..20 {
            let direction: Vec<DVec3> = (0..model.particles()).map(|_| numbers.vector()).collect();
            let moved = |sign: f64| {
                let moved = displaced(&state, &direction, sign * h);
                force.energy(&moved)
            };
            let slope = (moved(1.0) - moved(-1.0)) / (2.0 * h);
            let work: f64 = forces.iter().zip(&direction).map(|(f, d)| f.dot(*d)).sum();
            let scale: f64 = forces.iter().map(|f| f.length()).sum();
            assert!(
                (slope + work).abs() < 1e-6 * scale,
                "{}: dE = {slope}, −f·d = {}",
                force.name(),
                -work
            );
        }
    }
}

#[test]
fn jacobians_are_the_derivative_of_their_force_where_springs_are_stretched() {
    let (model, mut state) = shaken();
    // Twice as large, every spring is stretched, and the definite Jacobian is the exact one.
    state.positions.iter_mut().for_each(|x| *x *= 2.0);
    let mut numbers = Numbers(13);
    for law in model.stiffnesses() {
        let pairs = law.pairs();
        let mut matrix = PairMatrix::with_pattern(model.particles(), pairs.iter().copied());
        matrix.clear(&vec![0.0; model.particles()]);
        let slots: Vec<u32> = pairs
            .iter()
            .map(|&pair| matrix.slot(pair).unwrap())
            .collect();
        law.add_jacobian(
            &state,
            1.0,
            &mut Assembly {
                matrix: &mut matrix,
                slots: &slots,
            },
        );
        let h = 1e-6;
        let direction: Vec<DVec3> = (0..model.particles()).map(|_| numbers.vector()).collect();
        let at = |sign: f64| {
            let moved = displaced(&state, &direction, sign * h);
            forces_of(|f| law.add_forces(&moved, f), model.particles())
        };
        let mut product = vec![DVec3::ZERO; model.particles()];
        matrix.multiply(&direction, &mut product);
        let scale = product.iter().map(|p| p.length()).fold(0.0, f64::max);
        for ((plus, minus), product) in at(1.0).iter().zip(&at(-1.0)).zip(&product) {
            let derivative = (*plus - *minus) / (2.0 * h);
            let error = (derivative + *product).length();
            assert!(
                error < 1e-5 * scale,
                "{}: ∂f = {derivative}, −J d = {}",
                law.name(),
                -*product
            );
        }
    }
}

#[test]
fn inner_forces_and_damping_have_no_resultant_and_no_torque() {
    let (model, state) = shaken();
    let check = |name: &str, forces: &[DVec3]| {
        let scale: f64 = forces.iter().map(|f| f.length()).sum();
        let torque: DVec3 = state
            .positions
            .iter()
            .zip(forces)
            .map(|(x, f)| x.cross(*f))
            .sum();
        let sum: DVec3 = forces.iter().sum();
        assert!(
            sum.length() < 1e-12 * scale && torque.length() < 1e-11 * scale,
            "{name}: {sum}, {torque}"
        );
    };
    for law in model.stiffnesses() {
        check(
            law.name(),
            &forces_of(|f| law.add_forces(&state, f), model.particles()),
        );
    }
    for law in model.dampings().filter(|law| law.name() != "mass_damping") {
        check(
            law.name(),
            &forces_of(|f| law.add_forces(&state, f), model.particles()),
        );
    }
}

#[test]
fn damping_takes_the_power_that_it_reports() {
    let (model, state) = shaken();
    let mut laws = 0;
    for law in model.dampings() {
        laws += 1;
        let forces = forces_of(|f| law.add_forces(&state, f), model.particles());
        let work: f64 = forces
            .iter()
            .zip(&state.velocities)
            .map(|(f, v)| f.dot(*v))
            .sum();
        let power = law.power(&state);
        assert!(
            power > 0.0 && (power + work).abs() < 1e-10 * power,
            "{}: {power} W against {work}",
            law.name()
        );
    }
    assert_eq!(
        laws, 4,
        "drag, and the damping of three families of springs"
    );
}

#[test]
fn elastic_energy_does_not_see_rigid_motion() {
    let (model, state) = shaken();
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -1.1, 2.0);
    let mut moved = state.clone();
    moved
        .positions
        .iter_mut()
        .for_each(|x| *x = turn * *x + DVec3::new(3.0, -2.0, 1.0));
    for law in model.stiffnesses() {
        let (before, after) = (law.energy(&state), law.energy(&moved));
        assert!(
            (before - after).abs() < 1e-10 * before,
            "{}: {before} J, moved {after} J",
            law.name()
        );
    }
}

#[test]
fn momentum_of_a_free_sheet_stays() {
    let changes = [
        "cloth.0.shape.sheet.cells=[16, 16]",
        "obstacle=[]",
        "gravity=[0, 0, 0]",
        "cloth.0.damping.mass=0",
        "cloth.0.damping.stiffness=0.0001",
    ];
    for scheme in SCHEMES {
        let built = muslin::scene::build(&crate::support::load("drape", &changes)).unwrap();
        let mut numbers = Numbers(17);
        let mut state = built.state;
        // A common motion, and a shaking that stretches, so that strain limiting takes part.
        state
            .velocities
            .iter_mut()
            .for_each(|v| *v = DVec3::new(1.0, 2.0, -0.5) + numbers.vector() * 20.0);
        let masses = built.model.masses.clone();
        let momentum = |state: &State| -> DVec3 {
            state
                .velocities
                .iter()
                .zip(&masses)
                .map(|(v, m)| *v * *m)
                .sum()
        };
        let before = momentum(&state);
        let mut run = muslin::simulation::Simulation::new(built.model, state, scheme, 2e-4);
        run_to(&mut run, 0.1);
        assert!(
            run.stats().limit_passes > 0,
            "{}: the limit took no part",
            scheme.name()
        );
        let drift = (momentum(run.state()) - before).length() / before.length();
        assert!(
            drift < 1e-10,
            "{}: momentum drifted by {drift:.1e}",
            scheme.name()
        );
    }
}

/// Observed order of a scheme on `hanging-cloth`: the steps are halved three times against a run
/// with a step `finer` times as small as the last.
///
/// Prints the table that the README shows: `cargo test --release first_order -- --nocapture`.
fn orders(scheme: Integrator, first: f64, finer: f64) -> Vec<f64> {
    let at = |dt: f64| {
        let mut run = simulation("hanging-cloth", &[], scheme, dt);
        let start = std::time::Instant::now();
        run_to(&mut run, 0.5);
        (
            run.state().positions.clone(),
            start.elapsed().as_secs_f64() / 0.5,
        )
    };
    let (reference, _) = at(first / 8.0 / finer);
    let error = |halvings: u32| {
        let dt = first / f64::from(1 << halvings);
        let (positions, cost) = at(dt);
        let square: f64 = positions
            .iter()
            .zip(&reference)
            .map(|(a, b)| (*a - *b).length_squared())
            .sum();
        let rms = (square / positions.len() as f64).sqrt();
        println!(
            "| {} | {:.3} | {:.3} | {cost:.3} |",
            scheme.name(),
            1e3 * dt,
            1e3 * rms
        );
        rms
    };
    let errors: Vec<f64> = (0..4).map(error).collect();
    errors
        .windows(2)
        .map(|pair| (pair[0] / pair[1]).log2())
        .collect()
}

#[test]
fn symplectic_euler_is_of_first_order() {
    let orders = orders(Integrator::SymplecticEuler, 2e-4, 8.0);
    assert!(orders.iter().all(|order| *order >= 0.9), "{orders:?}");
}

#[test]
fn implicit_euler_is_of_first_order() {
    let orders = orders(
        Integrator::ImplicitEuler {
            linear_tolerance: 1e-6,
        },
        2e-3,
        16.0,
    );
    assert!(orders.iter().all(|order| *order >= 0.9), "{orders:?}");
}
