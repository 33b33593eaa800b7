//! Every scheme against what it promises: its order, its energy, its stable step.

use crate::support::{
    IMPLICIT, Numbers, PROJECTIVE, SOLVED, XPBD, distance, fresh_folder, run_to, shuffled,
    simulation, strip, written,
};
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
    assert_eq!(run.stats().damped, 0, "{}", scheme.name());
    run.state().positions.clone()
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
fn xpbd_is_of_first_order() {
    check_order(XPBD, 5e-4, 0.9);
    check_order(Integrator::Xpbd { iterations: 3 }, 5e-4, 0.9);
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
fn newton_is_of_first_order() {
    check_order(Integrator::Newton(SOLVED), 2e-3, 0.9);
}

#[test]
fn implicit_midpoint_is_of_second_order() {
    check_order(Integrator::ImplicitMidpoint(SOLVED), 2e-3, 1.8);
}

#[test]
fn bdf2_is_of_second_order() {
    check_order(Integrator::Bdf2(SOLVED), 2e-3, 1.8);
}

#[test]
fn rk4_is_of_fourth_order() {
    check_order(Integrator::Rk4, 2e-3, 3.6);
}

/// The error is within a factor of ten of what was asked, either way.
#[test]
fn dopri5_meets_its_tolerance() {
    for (what, text) in [("chain", CHAIN), ("sheet", SHEET)] {
        let reference = positions(text, Integrator::Rk4, 2e-5);
        for tolerance in [1e-3, 1e-4, 1e-5, 1e-6, 1e-7] {
            let scheme = Integrator::Dopri5 { tolerance };
            let at = positions(text, scheme, 0.25);
            let each = at.iter().zip(&reference).map(|(a, b)| a.distance(*b));
            let error = each.fold(0.0, f64::max);
            println!("dopri5, {what}, {tolerance} m: {error}");
            assert!(
                error < 10.0 * tolerance && error > 0.1 * tolerance,
                "{what}: {error} against {tolerance} m"
            );
        }
    }
}

/// An undamped sheet that swings for 10,000 steps: kinetic, gravitational and elastic energy together
/// stay within 1 % of what is exchanged.
fn check_energy(scheme: Integrator, dt: f64) {
    let text = SHEET.replace("damping = { mass = 0.5, stiffness = 0.002 }\n", "");
    let mut run = run(&text, scheme, dt);
    let total = |run: &Simulation| Energies::of(run.model(), run.state()).total();
    let (start, mut drift, mut kinetic) = (total(&run), 0.0_f64, 0.0_f64);
    for _ in 0..10_000 {
        run.step().unwrap();
        drift = drift.max((total(&run) - start).abs());
        kinetic = kinetic.max(Energies::of(run.model(), run.state()).kinetic);
    }
    println!("{}: {drift} J of {kinetic} J", scheme.name());
    assert_eq!(run.stats().damped, 0, "{}", scheme.name());
    assert!(
        drift < 0.01 * kinetic,
        "{}: {drift} J of {kinetic} J",
        scheme.name()
    );
}

#[test]
fn verlet_keeps_the_energy() {
    check_energy(Integrator::Verlet, 2e-4);
}

#[test]
fn implicit_midpoint_keeps_the_energy() {
    check_energy(Integrator::ImplicitMidpoint(SOLVED), 5e-4);
}

/// Stiff cloth without damping at steps that see nothing of its springs: some are damped, so that no more
/// than a tenth of its own energy is ever added.
#[test]
fn implicit_midpoint_damps_what_rings() {
    for (stretch, dt) in [
        ("1e4", 1.0 / 60.0),
        ("1e6", 1.0 / 60.0),
        ("1e6", 1.0 / 240.0),
    ] {
        let text = SHEET
            .replace("damping = { mass = 0.5, stiffness = 0.002 }\n", "")
            .replace("stretch = 20.0", &format!("stretch = {stretch}"));
        let mut run = run(&text, Integrator::ImplicitMidpoint(SOLVED), dt);
        let start = Energies::of(run.model(), run.state()).total();
        let (mut added, mut most) = (0.0_f64, 0.0_f64);
        for _ in 0..300 {
            run.step().unwrap();
            let energies = Energies::of(run.model(), run.state());
            added = added.max(energies.total() - start);
            most = most.max(energies.total() - energies.gravitational);
        }
        let damped = run.stats().damped;
        println!("{stretch} N/m at {dt} s: {damped} steps damped, {added} J of {most} J");
        assert!(damped > 0 && damped < 300, "{stretch} N/m: {damped}");
        assert!(added < 0.11 * most, "{stretch} N/m: {added} J of {most} J");
    }
}

/// A cloth that its pins lift by 2 m has energy from them, which is none that the scheme made.
#[test]
fn the_work_of_pins_makes_no_step_damped() {
    let lift = "motion = { keyframes = [{ t = 0.0, translate = [0, 0, 0] }, { t = 0.5, translate = [0, 2, 0] }] }";
    let text = SHEET.replace("damping = { mass = 0.5, stiffness = 0.002 }\n", "") + lift;
    let mut run = run(&text, Integrator::ImplicitMidpoint(SOLVED), 1e-3);
    let start = Energies::of(run.model(), run.state()).total();
    run_to(&mut run, 0.5);
    let gained = Energies::of(run.model(), run.state()).total() - start;
    assert!(
        gained > 0.5 && run.stats().damped == 0,
        "{gained} J, {:?}",
        run.stats()
    );
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
    let mut numbers = Numbers(41);
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
        (Integrator::Newton(SOLVED), 2e-4),
        (Integrator::ImplicitMidpoint(SOLVED), 1e-3),
        (Integrator::Bdf2(SOLVED), 1e-3),
        (XPBD, 5e-5),
        (PROJECTIVE, 2e-4),
        (Integrator::Dopri5 { tolerance: 1e-6 }, 1.0 / 240.0),
    ] {
        let error = distance(&at(scheme, dt), &reference);
        println!("{} at {dt} s: {:.3} mm", scheme.name(), 1e3 * error);
        assert!(error < 1e-3, "{}: {error} m", scheme.name());
    }
}

/// The forecast's fastest mode against closed forms, within 1 %, where a search for it could go wrong.
mod fastest_mode {
    use super::*;
    use muslin::model::Model;

    fn omega(model: &Model, state: &muslin::state::State) -> f64 {
        let modes = forecast(model, state).modes;
        modes.iter().map(|mode| mode.omega).fold(0.0, f64::max)
    }

    fn built(name: &str, changes: &[&str]) -> scene::Built {
        scene::build(&crate::support::load(name, changes)).unwrap()
    }

    fn check(what: &str, found: f64, exact: f64) {
        println!("{what}: ω {found} rad/s, closed form {exact}");
        let off = found / exact - 1.0;
        // ω² within 1 %.
        assert!(off.abs() < 0.005, "{what}: {found}, {exact}, off by {off}");
    }

    /// A free chain with half masses at its ends swings fastest with ω² = 4 k/m, neighbours against
    /// each other.
    #[test]
    fn of_long_chains() {
        for links in [1, 2, 10, 1000, 20_000] {
            let text = CHAIN
                .replace("links = 10", &format!("links = {links}"))
                .split_once("[[pin]]")
                .map(|(free, _)| free.to_owned())
                .unwrap();
            let built = scene::build(&written("mode", &text)).unwrap();
            let k = built.model.springs[0].springs[0].stiffness;
            let m = 0.1 / f64::from(links);
            check(
                &format!("{links} links"),
                omega(&built.model, &built.state),
                (4.0 * k / m).sqrt(),
            );
        }
    }

    /// In a sheet of structural springs alone every row is such a chain.
    #[test]
    fn of_a_large_sheet() {
        let changes = [
            "cloth.0.shape.sheet.cells=[200, 200]",
            "cloth.0.springs=[\"structural\"]",
            "pin=[]",
        ];
        let built = built("hanging-cloth", &changes);
        let springs = built.model.springs.iter().flat_map(|batch| &batch.springs);
        let own = springs.map(|s| {
            let m = s.ends.map(|i| built.model.masses[i as usize]);
            // Inside a row both ends have the row's mass; at its end one has half of it.
            4.0 * s.stiffness / m[0].max(m[1])
        });
        let exact = own.fold(0.0, f64::max).sqrt();
        check("200 x 200", omega(&built.model, &built.state), exact);
    }

    /// One spring a thousand times as stiff as the others swings almost by itself, and so does a
    /// particle of a millionth of the mass.
    #[test]
    fn of_a_single_odd_element() {
        let changes = ["cloth.0.shape.sheet.cells=[60, 60]", "pin=[]"];
        let at = 1717;
        let mut stiff = built("hanging-cloth", &changes);
        let spring = &mut stiff.model.springs[0].springs[at];
        spring.stiffness *= 1e3;
        let [i, j] = spring.ends.map(|i| stiff.model.inverse_masses[i as usize]);
        let exact = (spring.stiffness * (i + j)).sqrt();
        let ends = spring.ends;
        check("stiff spring", omega(&stiff.model, &stiff.state), exact);
        let found = forecast(&stiff.model, &stiff.state).modes[0]
            .element
            .unwrap();
        assert_eq!(found.particles(), ends);

        let mut light = built("hanging-cloth", &changes);
        light.model.masses[at] *= 1e-6;
        light.model.inverse_masses[at] *= 1e6;
        // Its neighbours as good as stand: ω² is the largest eigenvalue of its own block K/m.
        let mut block = glam::DMat3::ZERO;
        let springs = light.model.springs.iter().flat_map(|batch| &batch.springs);
        for spring in springs.filter(|s| s.ends.contains(&(at as u32))) {
            let d = spring.span(&light.state.positions).normalize_or_zero();
            block += glam::DMat3::from_cols(d * d.x, d * d.y, d * d.z) * spring.stiffness;
        }
        let mut x = DVec3::new(0.3, 0.5, 0.7);
        for _ in 0..2000 {
            x = (block * x).normalize_or_zero();
        }
        let exact = (x.dot(block * x) / light.model.masses[at]).sqrt();
        check("light particle", omega(&light.model, &light.state), exact);
        let found = forecast(&light.model, &light.state).modes[0]
            .element
            .unwrap();
        assert!(found.particles().contains(&(at as u32)));
    }

    const RUSTY: [&str; 3] = [
        "cloth.0.damping.mass=1",
        "cloth.1.damping.mass=1",
        "cloth.2.damping.mass=1",
    ];

    /// Damping of one cloth makes no other stable.
    #[test]
    fn and_the_least_damped_cloth_binds() {
        let pairs = built("rusty-and-oiled", &[]);
        let forecast = forecast(&pairs.model, &pairs.state);
        assert_eq!(forecast.stable_dt(Integrator::Euler), 0.0);
        let rusty = built("rusty-and-oiled", &RUSTY);
        assert!(
            muslin::simulation::forecast(&rusty.model, &rusty.state).stable_dt(Integrator::Euler)
                > 0.0
        );
    }
}

/// A strip that was bent, held at one end, with either law of bending: the sheet of an OBJ mesh, folded
/// at rest, so that hinges have rest angles; with bend springs and both dampings on request.
fn gutter(law: &str, damping: &str) -> String {
    let path = fresh_folder("gutter").join("gutter.obj");
    let mesh = strip([0.4, 0.3], [8, 6], |u, v| {
        DVec3::new(0.15 * (u / 0.15).sin(), 0.15 * (u / 0.15).cos(), v)
    });
    std::fs::write(&path, mesh).unwrap();
    format!(
        "name = \"gutter\"\nduration = 1.0\n[[cloth]]\nname = \"gutter\"\nshape = {{ obj = {{ path = \"{}\" }} }}\nbending = \"{law}\"\nmaterial = {{ area_density = 0.2, stretch = 50.0, bend = 3.0e-3 }}\ndamping = {damping}\n[[pin]]\ncloth = \"gutter\"\nselect = {{ box = [[-0.01, 0.0, -1.0], [0.01, 1.0, 1.0]] }}\nclamp = true\n",
        path.display()
    )
}

/// The scene's rest is bent and clamped: every hinge has a rest angle. Twice the error at twice the
/// step, towards the answer of rk4, whatever bends and damps it.
#[test]
fn xpbd_converges_with_either_law_of_bending_and_either_damping() {
    for law in ["edge-spring", "discrete-shell"] {
        for damping in [
            "{ }",
            "{ mass = 3.0 }",
            "{ stiffness = 0.01 }",
            "{ mass = 1.0, stiffness = 0.004 }",
        ] {
            let text = gutter(law, damping);
            let reference = positions(&text, Integrator::Rk4, 5e-5);
            for scheme in [XPBD, Integrator::Xpbd { iterations: 2 }] {
                let errors = [1e-4, 5e-5, 2.5e-5]
                    .map(|dt| distance(&positions(&text, scheme, dt), &reference));
                println!("{law}, {damping}, {scheme:?}: {errors:?} m");
                let fine = errors[2] < 1e-3;
                let ratios = [errors[0] / errors[1], errors[1] / errors[2]];
                assert!(
                    fine && ratios.iter().all(|ratio| *ratio > 1.8),
                    "{law}, {damping}, {scheme:?}: {errors:?} m"
                );
            }
        }
    }
}

/// A sheet whose chunks are gone through in several stages, unevenly stretched at the start.
fn stretched(damping: &str, scheme: Integrator, dt: f64) -> Simulation {
    let text = format!(
        "name = \"large\"\nduration = 1.0\n[[cloth]]\nname = \"sheet\"\nshape = {{ sheet = {{ size = [1.0, 1.0], cells = [219, 219], diagonals = \"both\" }} }}\nbending = \"edge-spring\"\nmaterial = {{ area_density = 0.2, stretch = 100.0, bend = 1.0e-4 }}\ndamping = {damping}\n[[pin]]\ncloth = \"sheet\"\nselect = {{ corner = [\"left-near\", \"right-near\"] }}\n"
    );
    let built = scene::build(&written("large", &text)).unwrap();
    let mut state = built.state;
    for x in &mut state.positions {
        x.x *= 1.0 + 0.2 * (9.0 * x.z).sin();
    }
    Simulation::new(built.model, state, scheme, dt)
}

/// It goes where verlet takes it, the nearer the shorter the step; a step's velocities are its way; and
/// the bits don't depend on the number of threads. Undamped springs are relaxed several at once.
#[test]
fn xpbd_goes_through_a_large_sheet_in_stages() {
    for damping in ["{ }", "{ mass = 1.0, stiffness = 0.0002 }"] {
        let after = |scheme, dt, threads| {
            let mut run = stretched(damping, scheme, dt);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().unwrap().install(|| run_to(&mut run, 1e-3));
            run
        };
        let exact = after(Integrator::Verlet, 5e-6, 2).state().positions.clone();
        let start = stretched(damping, XPBD, 1.0).state().positions.clone();
        let moved = distance(&start, &exact);
        let errors = [1e-5, 5e-6].map(|dt| {
            let mut run = after(XPBD, dt, 1);
            assert!(*run.state() == *after(XPBD, dt, 2).state());
            let before = run.state().positions.clone();
            run.step().unwrap();
            let state = run.state();
            for (i, x) in before.iter().enumerate() {
                let v = (state.positions[i] - *x) / dt;
                assert!(v.distance(state.velocities[i]) < 1e-9, "particle {i}");
            }
            distance(&before, &exact)
        });
        println!("{damping}: {errors:?} m of {moved} m");
        assert!(
            errors[0] / errors[1] > 1.8 && errors[1] < 0.02 * moved,
            "{damping}: {errors:?} m of {moved} m"
        );
    }
}

/// A mesh of several chunks, with hinges and both dampings, its vertices in rows or shuffled: the
/// same bits for any number of threads.
#[test]
fn xpbd_has_the_same_bits_for_any_number_of_threads() {
    let rows = strip([1.0, 1.0], [60, 60], |u, v| DVec3::new(u, 0.0, v));
    for (what, mesh) in [
        ("rows", rows.clone()),
        ("shuffled", shuffled(&rows, &mut Numbers(5))),
    ] {
        let path = fresh_folder("threads").join("mesh.obj");
        std::fs::write(&path, mesh).unwrap();
        let text = format!(
            "name = \"threads\"\nduration = 1.0\n[[cloth]]\nname = \"mesh\"\nshape = {{ obj = {{ path = \"{}\" }} }}\nbending = \"edge-spring\"\nmaterial = {{ area_density = 0.2, stretch = 100.0, bend = 1.0e-4 }}\ndamping = {{ mass = 0.5, stiffness = 0.001 }}\n[[pin]]\ncloth = \"mesh\"\nselect = {{ vertices = [0, 60] }}\n",
            path.display()
        );
        for iterations in [1, 2] {
            let states = [1, 2, 3].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                let mut run = run(&text, Integrator::Xpbd { iterations }, 1e-3);
                pool.build().unwrap().install(|| run_to(&mut run, 0.1));
                run.state().clone()
            });
            let fallen = states[0].positions.iter().map(|x| -x.y).fold(0.0, f64::max);
            assert!(fallen > 0.01, "{what}: has hardly moved, {fallen} m");
            for (threads, state) in states.iter().enumerate() {
                assert!(
                    *state == states[0],
                    "{what}, {iterations} sweeps: {} threads differ",
                    threads + 1
                );
            }
        }
    }
}
