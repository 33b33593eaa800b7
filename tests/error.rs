//! The estimated error of the time step against the true one, and that a run doesn't notice.

use crate::support::{SCHEMES, distance, load, named, run_to, simulation, written};
use glam::DVec3;
use muslin::frame::Capture;
use muslin::integrator::{Integrator, Linear, Nonlinear};
use muslin::pipeline::{self, Finished, Plan};
use muslin::recorder::MemoryRecorder;
use muslin::scene;
use muslin::simulation::{ErrorEstimate, Simulation};
use std::sync::atomic::AtomicBool;

/// Runs to a time (s) and estimates the error there (m) for a share of the time.
fn estimate(run: &mut Simulation, time: f64, share: f64) -> (f64, ErrorEstimate) {
    let mut error = ErrorEstimate::new(run, share, None).unwrap();
    let steps = (time / run.dt()).round() as u64;
    while run.stats().steps < steps {
        run.step().unwrap_or_else(|diverged| panic!("{diverged}"));
        error.after_step(run);
    }
    let at = error.at(run.state().time).unwrap();
    (at, error)
}

const LINEAR: Linear = Linear::to(1e-6);
const SOLVED: Nonlinear = Nonlinear {
    residual: 1e-6,
    iterations: 50,
    linear: LINEAR,
};

/// Every scheme with three steps (s) that it is used at; `dopri5` with three tolerances.
fn cases() -> Vec<(Integrator, f64)> {
    let three = |scheme: Integrator, first: u32| {
        [1, 2, 4].map(|halving| (scheme, 1.0 / f64::from(first * halving)))
    };
    let projective = Integrator::Projective {
        iterations: 100,
        residual: 1e-6,
    };
    let mut cases = vec![];
    cases.extend(three(Integrator::Euler, 2000));
    cases.extend(three(Integrator::SymplecticEuler, 800));
    cases.extend(three(Integrator::Verlet, 560));
    cases.extend(three(Integrator::Rk4, 400));
    for tolerance in [1e-3, 1e-4, 1e-5] {
        cases.push((Integrator::Dopri5 { tolerance }, 1.0 / 240.0));
    }
    cases.extend([0.02, 0.01, 0.005].map(|dt| (Integrator::ImplicitEuler(LINEAR), dt)));
    cases.extend([0.004, 0.002, 0.001].map(|dt| (Integrator::Newton(SOLVED), dt)));
    cases.extend([0.004, 0.002, 0.001].map(|dt| (Integrator::ImplicitMidpoint(SOLVED), dt)));
    cases.extend([0.004, 0.002, 0.001].map(|dt| (Integrator::Bdf2(SOLVED), dt)));
    cases.extend(three(Integrator::Xpbd { iterations: 1 }, 1200));
    cases.extend(three(projective, 60));
    cases
}

/// For a tenth of the time, at half a second of a swing that folds the cloth.
#[test]
fn estimates_are_within_a_factor_of_three() {
    let mut reference = simulation("hanging-cloth", &[], Integrator::Rk4, 5e-5);
    run_to(&mut reference, 0.5);
    let at = reference.state();
    let mut off = vec![];
    for (scheme, dt) in cases() {
        let mut run = simulation("hanging-cloth", &[], scheme, dt);
        let (estimate, error) = estimate(&mut run, 0.5, 0.1);
        // 0.5 s is no multiple of some steps.
        let late = run.state().time - at.time;
        let there = at.positions.iter().zip(&at.velocities);
        let there: Vec<DVec3> = there.map(|(x, v)| *x + *v * late).collect();
        let truth = distance(&run.state().positions, &there);
        let ratio = estimate / truth;
        println!(
            "{:18} {dt:.6} s: {:9.5} mm, true {:9.5} mm, ratio {ratio:.2}, {} samples",
            scheme.name(),
            1e3 * estimate,
            1e3 * truth,
            error.samples()
        );
        if !(1.0 / 3.0..=3.0).contains(&ratio) {
            off.push(format!("{scheme:?} at {dt} s: {ratio:.2}"));
        }
    }
    assert!(off.is_empty(), "{off:#?}");
}

const FREE: &str = "name = \"fall\"\nduration = 1.0\n[[cloth]]\nname = \"sheet\"\nshape = { sheet = { size = [0.5, 0.5], cells = [4, 4] } }\nmaterial = { area_density = 0.2, stretch = 20.0 }\n";

/// In free fall a step of first order is off by ½ g dt² and nothing else: x is off by ½ g dt t. Of second
/// order it is exact.
#[test]
fn free_fall_is_off_by_half_a_step() {
    let dt = 0.001;
    for (name, order) in [
        ("euler", 1),
        ("symplectic-euler", 1),
        ("implicit-euler", 1),
        ("newton", 1),
        ("xpbd", 1),
        ("projective", 1),
        ("verlet", 2),
        ("rk4", 4),
        ("implicit-midpoint", 2),
    ] {
        let built = scene::build(&written("fall", FREE)).unwrap();
        let mut run = Simulation::new(built.model, built.state, named(name), dt);
        let (found, error) = estimate(&mut run, 0.5, 0.1);
        let exact = if order == 1 {
            0.5 * 9.81 * dt * 0.5
        } else {
            0.0
        };
        println!("{name}: {found} m, exactly {exact} m");
        assert!(error.samples() > 3, "{name}: {} samples", error.samples());
        assert!(
            (found - exact).abs() < 1e-6 * 0.5 * 9.81 * dt,
            "{name}: {found} m, not {exact} m"
        );
        let step = error.per_step().unwrap();
        let exact = exact / 500.0;
        assert!(
            (step - exact).abs() < 1e-11,
            "{name}: {step} m a step, not {exact} m"
        );
    }
}

/// Estimates fall with the step as the error does.
#[test]
fn estimates_have_the_order_of_the_scheme() {
    for (scheme, dt) in [
        (Integrator::SymplecticEuler, 1.0 / 1000.0),
        (Integrator::Verlet, 1.0 / 1000.0),
        (Integrator::Rk4, 1.0 / 1000.0),
        (Integrator::Newton(SOLVED), 0.002),
        (Integrator::ImplicitMidpoint(SOLVED), 0.002),
    ] {
        let [coarse, fine] = [dt, 0.5 * dt].map(|dt| {
            let mut run = simulation("hanging-cloth", &[], scheme, dt);
            estimate(&mut run, 0.25, 0.5).0
        });
        let order = (coarse / fine).log2();
        println!("{}: order {order:.2}", scheme.name());
        assert!(
            (order - f64::from(scheme.order())).abs() < 0.4,
            "{}: order {order}, {coarse} and {fine} m",
            scheme.name()
        );
    }
}

/// A small sheet that swings and lands on a box, limited in strain, with one pin that lets go.
fn busy() -> String {
    let folder = crate::support::fresh_folder("busy");
    let corner = |i: u32| [i & 1, (i >> 1) & 1, i >> 2].map(|bit| 2.0 * f64::from(bit) - 1.0);
    let mut cube: String = (0..8)
        .map(corner)
        .map(|[x, y, z]| format!("v {} {} {}\n", 0.3 * x, 0.2 * y - 0.35, 0.3 * z))
        .collect();
    for [a, b, c, d] in [
        [1, 3, 4, 2],
        [5, 6, 8, 7],
        [1, 2, 6, 5],
        [3, 7, 8, 4],
        [1, 5, 7, 3],
        [2, 4, 8, 6],
    ] {
        cube += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
    }
    std::fs::write(folder.join("box.obj"), cube).unwrap();
    format!(
        "name = \"busy\"\nduration = 1.0\n[[cloth]]\nname = \"sheet\"\nshape = {{ sheet = {{ size = [0.8, 0.8], cells = [8, 8], diagonals = \"both\" }} }}\nmaterial = {{ area_density = 0.2, stretch = 20.0 }}\ndamping = {{ mass = 0.5, stiffness = 0.002 }}\n[[pin]]\ncloth = \"sheet\"\nselect = {{ corner = [\"left-near\", \"right-near\"] }}\nrelease = 0.1\n[[obstacle]]\nname = \"box\"\nshape = {{ obj = {{ path = \"{}\" }} }}\n[strain_limit]\nmax = 0.05\n",
        folder.join("box.obj").display()
    )
}

fn busy_run(scheme: Integrator, dt: f64) -> Simulation {
    let built = scene::build(&written("busy", &busy())).unwrap();
    Simulation::new(built.model, built.state, scheme, dt)
}

/// Not a bit of the state is another, whatever the scheme, and there is an estimate.
#[test]
fn a_run_does_not_notice() {
    for name in SCHEMES {
        let mut alone = busy_run(named(name), 5e-4);
        let mut watched = busy_run(named(name), 5e-4);
        run_to(&mut alone, 0.3);
        let (error, _) = estimate(&mut watched, 0.3, 0.5);
        println!(
            "{name}: {error} m, {} contacts",
            alone.contacts().list.len()
        );
        assert!(alone.state() == watched.state(), "{name}: another state");
        assert!(!alone.contacts().list.is_empty(), "{name}: touches nothing");
        assert!(error.is_finite() && error > 0.0, "{name}: {error} m");
    }
}

/// With contact, a strain limit and a pin that lets go: the right magnitude.
#[test]
fn contact_limits_and_releases_are_in_it() {
    let mut reference = busy_run(Integrator::SymplecticEuler, 2.5e-5);
    run_to(&mut reference, 0.4);
    for (name, dt) in [
        ("symplectic-euler", 1e-3),
        ("implicit-euler", 4e-3),
        ("xpbd", 1e-3),
    ] {
        let mut run = busy_run(named(name), dt);
        let (estimate, _) = estimate(&mut run, 0.4, 0.1);
        let truth = distance(&run.state().positions, &reference.state().positions);
        println!("{name}: {estimate} m, true {truth} m");
        let ratio = estimate / truth;
        assert!(
            (0.1..10.0).contains(&ratio),
            "{name}: {estimate} m, true {truth} m"
        );
    }
}

fn piped(
    changes: &[&str],
    threads: usize,
    share: f64,
) -> (Finished, Capture, MemoryRecorder, usize) {
    let loaded = load("hanging-cloth", changes);
    let built = scene::build(&loaded).unwrap();
    let run = Simulation::new(
        built.model,
        built.state,
        Integrator::of(&loaded.scene.solver),
        0.004,
    );
    let (capture, header) = Capture::new(&loaded, &run);
    let stop = AtomicBool::new(false);
    let plan = Plan {
        duration: 0.2,
        fps: 60.0,
        checkpoint: 1.0,
        error: share,
        threads,
        notes: Vec::new(),
        stop: &stop,
    };
    let mut recorder = MemoryRecorder::default();
    let again = capture.clone();
    let finished = pipeline::run(run, capture, &mut recorder, &plan, &mut |_| {}).unwrap();
    let series = header
        .series
        .iter()
        .filter(|series| series.path.starts_with("error/"));
    (finished, again, recorder, series.count())
}

/// A series of several chunks, the same on any number of threads; and none where nobody asks.
#[test]
fn recorded_the_same_for_any_number_of_threads() {
    let big = "cloth.0.shape.sheet.cells=[40, 40]";
    let all = [1, 2].map(|threads| {
        let (finished, _, recorder, series) = piped(&[big], threads, 0.1);
        assert_eq!(series, 1);
        let values: Vec<f64> = recorder
            .frames
            .iter()
            .map(|frame| *frame.values.last().unwrap())
            .collect();
        let error = finished.error.unwrap();
        assert!(
            values[0].is_nan(),
            "known before the first step: {}",
            values[0]
        );
        assert_eq!(
            values.last().copied(),
            error.at(finished.simulation.state().time)
        );
        values
            .iter()
            .map(|value| value.to_bits())
            .collect::<Vec<_>>()
    });
    assert_eq!(all[0], all[1]);
    let (finished, _, recorder, series) = piped(&["record.error=0"], 1, 0.0);
    assert!(finished.error.is_none() && series == 0);
    let (_, _, with, _) = piped(&[], 1, 0.1);
    let [without, with] = [recorder, with].map(|recorder| recorder.frames[5].clone());
    assert_eq!(without.values.len() + 1, with.values.len());
    assert_eq!(without.cloths[0].positions, with.cloths[0].positions);
}
