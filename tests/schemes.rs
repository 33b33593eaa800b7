//! Every scheme against what it promises: its order, its energy, its stable step.

use crate::support::{IMPLICIT, PROJECTIVE, fresh_folder, run_to, simulation, strip, written};
use glam::DVec3;
use muslin::energy::Energies;
use muslin::integrator::Integrator;
use muslin::scene;
use muslin::simulation::{Simulation, forecast};

/// Smooth scenes: a chain that swings down from the horizontal, a small sheet held at its corners.
/// With both dampings, so that velocity-dependent forces count.
const CHAIN: &str = "name = \"swing\"\nduration = 1.0\n[[cloth]]\nname = \"chain\"\nshape = { chain = { length = 1.0, links = 10 } }\nmaterial = { linear_density = 0.1, stretch = 20.0 }\ndamping = { mass = 0.5, stiffness = 0.002 }\n[[pin]]\ncloth = \"chain\"\nselect = { corner = [\"left\"] }\n";
pub(crate) const SHEET: &str = "name = \"swing\"\nduration = 1.0\n[[cloth]]\nname = \"sheet\"\nshape = { sheet = { size = [0.5, 0.5], cells = [4, 4], diagonals = \"both\" } }\nbending = \"discrete-shell\"\nmaterial = { area_density = 0.2, stretch = 20.0, bend = 1.0e-3 }\ndamping = { mass = 0.5, stiffness = 0.002 }\n[[pin]]\ncloth = \"sheet\"\nselect = { corner = [\"left-near\", \"right-near\"] }\n";

fn run(text: &str, scheme: Integrator, dt: f64) -> Simulation {
    let built = scene::build(&written("scheme", text)).unwrap();
    Simulation::new(built.model, built.state, scheme, dt)
}

/// Where particles are at 0.25 s.
fn positions(text: &str, scheme: Integrator, dt: f64) -> Vec<DVec3> {
    let mut run = run(text, scheme, dt);
    run_to(&mut run, 0.25);
    run.state().positions.clone()
}

/// Root of the mean square distance (m).
fn distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| a.distance_squared(*b));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}

/// The least order that is seen while the step is halved three times from `first`.
fn check_order(scheme: Integrator, first: f64, least: f64) {
    for (what, text) in [("chain", CHAIN), ("sheet", SHEET)] {
        let reference = positions(text, Integrator::Rk4, 2e-5);
        let errors: Vec<f64> = (0..4)
            .map(|halving| first / f64::from(1 << halving))
            .map(|dt| distance(&positions(text, scheme, dt), &reference))
            .collect();
        let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
        println!(
            "{}, {what}: {errors:?} m, orders {orders:.2?}",
            scheme.name()
        );
        let lowest = orders.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(
            lowest >= least,
            "{}, {what}: orders {orders:?}, errors {errors:?}",
            scheme.name()
        );
    }
}

#[test]
fn euler_is_of_first_order() {
    check_order(Integrator::Euler, 1e-4, 0.9);
}

#[test]
fn symplectic_euler_is_of_first_order() {
    check_order(Integrator::SymplecticEuler, 1e-3, 0.9);
}

#[test]
fn implicit_euler_is_of_first_order() {
    check_order(IMPLICIT, 5e-4, 0.9);
}

#[test]
fn projective_is_of_first_order() {
    check_order(PROJECTIVE, 5e-4, 0.9);
}

#[test]
fn verlet_is_of_second_order() {
    check_order(Integrator::Verlet, 1e-3, 1.8);
}

#[test]
fn rk4_is_of_fourth_order() {
    check_order(Integrator::Rk4, 2e-3, 3.6);
}

/// An undamped sheet that swings for 10,000 steps: kinetic, gravitational and elastic energy together
/// stay within 1 % of what is exchanged.
#[test]
fn verlet_keeps_the_energy() {
    let text = SHEET.replace("damping = { mass = 0.5, stiffness = 0.002 }\n", "");
    let mut run = run(&text, Integrator::Verlet, 2e-4);
    let total = |run: &Simulation| Energies::of(run.model(), run.state()).total();
    let (start, mut drift, mut kinetic) = (total(&run), 0.0_f64, 0.0_f64);
    for _ in 0..10_000 {
        run.step().unwrap();
        drift = drift.max((total(&run) - start).abs());
        kinetic = kinetic.max(Energies::of(run.model(), run.state()).kinetic);
    }
    assert!(drift < 0.01 * kinetic, "{drift} J of {kinetic} J");
}

/// The step at which small vibrations about rest begin to grow, found by running, against the
/// forecast: chain, sheet, and cloth of an OBJ mesh, each stiff against its weight.
#[test]
fn forecasts_meet_the_onset_of_instability() {
    let path = fresh_folder("onset").join("mesh.obj");
    let mesh = strip([0.4, 0.3], [6, 5], |u, v| {
        DVec3::new(u + 0.02 * (9.0 * v).sin(), 0.0, v)
    });
    std::fs::write(&path, mesh).unwrap();
    let shape = format!("shape = {{ obj = {{ path = \"{}\" }} }}", path.display());
    let (before, after) = SHEET.split_once("shape = ").unwrap();
    let (_, after) = after.split_once('\n').unwrap();
    let obj = format!("{before}{shape}\n{after}").replace(
        "corner = [\"left-near\", \"right-near\"]",
        "vertices = [0, 6]",
    );
    for (what, text) in [("chain", CHAIN), ("sheet", SHEET), ("mesh", &obj)] {
        for damping in ["{ }", "{ mass = 0.5, stiffness = 0.002 }"] {
            let text = text
                .replace("{ mass = 0.5, stiffness = 0.002 }", damping)
                .replace(
                    "duration = 1.0",
                    "duration = 1.0\ngravity = [0.0, 0.0, 0.0]",
                );
            for scheme in Integrator::EXPLICIT {
                let still = run(&text, scheme, 1.0);
                let limit = forecast(still.model(), still.state()).stable_dt(scheme);
                if limit == 0.0 {
                    assert_eq!((scheme, damping), (Integrator::Euler, "{ }"));
                    continue;
                }
                for (share, grows) in [(0.95, false), (1.05, true)] {
                    let grew = growth(&text, scheme, share * limit) > 10.0;
                    assert_eq!(
                        grew,
                        grows,
                        "{what}, {}, {damping}: {share} of {limit} s",
                        scheme.name()
                    );
                }
            }
        }
    }
}

/// How much a vibration of a nanometre has grown after 1,500 steps, or before the run failed.
fn growth(text: &str, scheme: Integrator, dt: f64) -> f64 {
    let built = scene::build(&written("growth", text)).unwrap();
    let rest = built.state.positions.clone();
    let mut state = built.state;
    let mut numbers = crate::support::Numbers(41);
    let size = 1e-9;
    for (x, w) in state.positions.iter_mut().zip(&built.model.inverse_masses) {
        if *w > 0.0 {
            *x += numbers.vector() * size;
        }
    }
    let mut run = Simulation::new(built.model, state, scheme, dt);
    for _ in 0..1500 {
        if run.step().is_err() {
            return f64::INFINITY;
        }
    }
    distance(&run.state().positions, &rest) / size
}

/// All schemes, each at a fine step, on the whole of `hanging-cloth`: one answer.
#[test]
fn all_schemes_have_one_answer() {
    let at = |scheme: Integrator, dt: f64| {
        let mut run = simulation("hanging-cloth", &[], scheme, dt);
        run_to(&mut run, 0.5);
        run.state().positions.clone()
    };
    let reference = at(Integrator::Rk4, 5e-5);
    for (scheme, dt) in [
        (Integrator::Euler, 5e-6),
        (Integrator::SymplecticEuler, 1e-4),
        (Integrator::Verlet, 1e-4),
        (IMPLICIT, 2e-4),
        (PROJECTIVE, 2e-4),
    ] {
        let error = distance(&at(scheme, dt), &reference);
        println!("{} at {dt} s: {:.3} mm", scheme.name(), 1e3 * error);
        assert!(error < 1e-3, "{}: {error} m", scheme.name());
    }
}
