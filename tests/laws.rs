//! Laws that every force, and every scheme, has to keep.

use crate::support::{
    IMPLICIT, Numbers, PROJECTIVE, SCHEMES as ALL_SCHEMES, XPBD, fresh_folder, load, named, run_to,
    shuffled, simulation, strip, written,
};
use glam::{DQuat, DVec3};
use muslin::energy::Energies;
use muslin::force::Jacobian;
use muslin::integrator::{Integrator, Linear};
use muslin::linear::{Assembly, PairMatrix};
use muslin::scene::{self, Built, Step};
use muslin::simulation::{Sign, Simulation, forecast, step_length};
use muslin::state::State;
use std::sync::LazyLock;

const SCHEMES: [Integrator; 4] = [Integrator::SymplecticEuler, IMPLICIT, XPBD, PROJECTIVE];

/// Every law on every shape, of a size that the differences can resolve: cells of 5 cm.
const EVERYTHING: &str = r#"
name = "everything"
duration = 1.0

[[cloth]]
name = "both"
shape = { sheet = { size = [0.4, 0.3], cells = [8, 6], diagonals = "both" } }
springs = ["structural", "shear", "bend"]
bending = "edge-spring"
material = { area_density = 0.2, stretch = 100.0, bend = 1.0e-3 }
damping = { mass = 0.5, stiffness = 0.01 }

[[pin]]
cloth = "both"
select = { edge = "left" }
clamp = true

[[cloth]]
name = "one-way"
shape = { sheet = { size = [0.4, 0.3], cells = [8, 6], diagonals = "one-way" } }
bending = "discrete-shell"
material = { area_density = 0.2, stretch = 100.0, bend = 1.0e-3 }
damping = { mass = 0.5, stiffness = 0.01 }

[[cloth]]
name = "shell"
shape = { obj = { path = "SHELL" } }
bending = "discrete-shell"
material = { area_density = 0.2, stretch = 100.0, bend = 1.0e-3 }
damping = { stiffness = 0.01 }

[[cloth]]
name = "gutter"
shape = { obj = { path = "SHELL" } }
bending = "edge-spring"
material = { area_density = 0.2, stretch = 100.0, bend = 1.0e-3 }

[[cloth]]
name = "block"
shape = { block = { size = [0.2, 0.15, 0.1], cells = [4, 3, 2] } }
material = { density = 50.0, stretch = 2000.0 }
damping = { stiffness = 0.01 }

[[cloth]]
name = "chain"
shape = { chain = { length = 1.0, links = 20 } }
springs = ["structural", "bend"]
material = { linear_density = 0.1, stretch = 50.0, bend = 1.0e-3 }
damping = { stiffness = 0.01 }

[[cloth]]
name = "ideal"
shape = { chain = { length = 1.0, links = 20 } }
springs = ["zero-length"]
material = { linear_density = 0.1, spring_constant = 50.0 }
damping = { stiffness = 0.01 }
"#;

/// The scene with every law; its shells are half cylinders of uneven triangles.
fn everything() -> Built {
    let mut numbers = Numbers(3);
    let shell = strip([0.4, 0.3], [8, 6], |u, v| {
        let (u, v) = (u + 0.008 * numbers.next(), v + 0.008 * numbers.next());
        DVec3::new(0.15 * (u / 0.15).sin(), 0.15 * (u / 0.15).cos(), v)
    });
    let path = fresh_folder("everything").join("shell.obj");
    std::fs::write(&path, shell).unwrap();
    let text = EVERYTHING.replace("SHELL", &path.display().to_string());
    scene::build(&written("everything", &text)).unwrap()
}

/// States from gently shaken to nearly degenerate, with random velocities.
fn states(start: &State) -> Vec<(&'static str, State)> {
    let mut numbers = Numbers(7);
    let mut shaken = |size: f64, flatten: DVec3| {
        let mut state = start.clone();
        for (x, v) in state.positions.iter_mut().zip(&mut state.velocities) {
            *x = *x * flatten + numbers.vector() * size;
            *v = numbers.vector();
        }
        state
    };
    vec![
        ("gently shaken", shaken(0.002, DVec3::ONE)),
        ("shaken", shaken(0.015, DVec3::ONE)),
        ("crumpled", shaken(0.1, DVec3::ONE)),
        ("pressed flat", shaken(0.001, DVec3::new(1.0, 0.01, 1.0))),
        (
            "pressed to a line",
            shaken(0.001, DVec3::new(1.0, 0.02, 0.02)),
        ),
        ("pressed to a point", shaken(0.001, DVec3::splat(0.02))),
    ]
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

/// Steps for differences, from 10 µm down: each law is asked at the one that suits its curvature.
const STEPS: [f64; 4] = [1e-5, 3e-6, 1e-6, 1e-7];

/// The smallest error of a fourth-order difference over [`STEPS`].
fn difference_error(error: impl Fn(&dyn Fn(f64, f64) -> f64, f64) -> f64) -> f64 {
    // Weights of f(h) − f(−h) and f(2h) − f(−2h).
    let weight = |multiple: f64, h: f64| if multiple == 1.0 { 8.0 } else { -1.0 } / (12.0 * h);
    STEPS
        .iter()
        .map(|&h| error(&weight, h))
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn forces_are_the_gradient_of_their_energy() {
    let Built { model, state, .. } = everything();
    let mut numbers = Numbers(11);
    for (what, state) in states(&state) {
        for force in model.forces() {
            let forces = forces_of(|f| force.add_forces(&state, f), model.particles());
            let scale: f64 = forces.iter().map(|f| f.length()).sum();
            for _ in 0..10 {
                let direction: Vec<DVec3> =
                    (0..model.particles()).map(|_| numbers.vector()).collect();
                let work: f64 = forces.iter().zip(&direction).map(|(f, d)| f.dot(*d)).sum();
                let energy = |way: f64| force.energy(&displaced(&state, &direction, way));
                let error = difference_error(|weight, h| {
                    let pair = |m: f64| weight(m, h) * (energy(m * h) - energy(-m * h));
                    (pair(1.0) + pair(2.0) + work).abs() / scale
                });
                assert!(
                    error < 1e-6,
                    "{}, {what}: dE + f·d = {error:.1e}",
                    force.name()
                );
            }
        }
    }
}

#[test]
fn jacobians_are_the_derivative_of_their_force() {
    let Built { model, state, .. } = everything();
    let mut numbers = Numbers(13);
    for (what, state) in states(&state) {
        for law in model.stiffnesses() {
            let pattern = law.pattern();
            let mut matrix =
                PairMatrix::with_patterns(model.particles(), std::slice::from_ref(&pattern));
            let slots = &matrix.slots(&pattern);
            let filled = &mut matrix;
            let mut assembly = Assembly {
                matrix: filled,
                slots,
            };
            law.add_jacobian(&state, 1.0, Jacobian::Exact, &mut assembly);
            let direction: Vec<DVec3> = (0..model.particles()).map(|_| numbers.vector()).collect();
            let mut product = vec![DVec3::ZERO; model.particles()];
            matrix.multiply(&direction, &mut product);
            let scale = product.iter().map(|p| p.length()).fold(0.0, f64::max);
            let forces = |way: f64| {
                let moved = displaced(&state, &direction, way);
                forces_of(|f| law.add_forces(&moved, f), model.particles())
            };
            let error = difference_error(|weight, h| {
                let at = [1.0, 2.0].map(|m| (weight(m, h), forces(m * h), forces(-m * h)));
                let change = |i: usize| -> DVec3 {
                    at.iter()
                        .map(|(w, plus, minus)| (plus[i] - minus[i]) * *w)
                        .sum()
                };
                let errors = (0..product.len()).map(|i| (change(i) + product[i]).length());
                errors.fold(0.0, f64::max) / scale
            });
            assert!(
                error < 1e-5,
                "{}, {what}: ∂f + J d = {error:.1e}",
                law.name()
            );
        }
    }
}

/// Everything in one point, on a line, in a plane, folded onto itself, or with some of it so: every
/// law is finite.
#[test]
fn degenerate_states_have_finite_forces() {
    let Built { model, state, .. } = everything();
    let mut numbers = Numbers(29);
    let mut with = |what: &'static str, place: &mut dyn FnMut(DVec3, f64) -> DVec3| {
        let mut state = state.clone();
        for (x, v) in state.positions.iter_mut().zip(&mut state.velocities) {
            *x = place(*x, numbers.next());
            *v = numbers.vector();
        }
        (what, state)
    };
    let degenerate = [
        with("one point", &mut |_, _| DVec3::ONE),
        with("the origin", &mut |_, _| DVec3::ZERO),
        with("a line", &mut |x, _| DVec3::new(x.x, 0.0, 0.0)),
        with("a skew line", &mut |x, _| DVec3::new(1.0, 2.0, 3.0) * x.x),
        with("a plane", &mut |x, _| DVec3::new(x.x, 0.0, x.z)),
        with("folded", &mut |x, _| DVec3::new(x.x.abs(), 0.0, x.z)),
        with("half of it in a point", &mut |x, n| {
            if n < 0.0 { DVec3::Y } else { x }
        }),
        with("far away", &mut |x, n| x + DVec3::X * (1e9 * n)),
        with("tiny", &mut |x, _| x * 1e-60),
    ];
    for (what, state) in degenerate {
        for law in model.forces() {
            let forces = forces_of(|f| law.add_forces(&state, f), model.particles());
            let finite = forces.iter().all(|f| f.is_finite()) && law.energy(&state).is_finite();
            assert!(finite, "{}, {what}", law.name());
        }
        for law in model.dampings() {
            let forces = forces_of(|f| law.add_forces(&state, f), model.particles());
            let finite = forces.iter().all(|f| f.is_finite()) && law.power(&state).is_finite();
            assert!(finite, "{}, {what}", law.name());
        }
        for law in model.stiffnesses() {
            for kind in [Jacobian::Exact, Jacobian::Definite] {
                let pattern = law.pattern();
                let one = std::slice::from_ref(&pattern);
                let mut matrix = PairMatrix::with_patterns(model.particles(), one);
                let slots = &matrix.slots(&pattern);
                let filled = &mut matrix;
                let mut assembly = Assembly {
                    matrix: filled,
                    slots,
                };
                law.add_jacobian(&state, 1.0, kind, &mut assembly);
                let finite = matrix.off_diagonal().all(|block| block.is_finite());
                assert!(finite, "{}, {what}, {kind:?}", law.name());
            }
        }
    }
}

#[test]
fn inner_forces_and_damping_have_no_resultant_and_no_torque() {
    let Built { model, state, .. } = everything();
    for (what, state) in states(&state) {
        let check = |name: &str, forces: &[DVec3]| {
            let scale: f64 = forces.iter().map(|f| f.length()).sum();
            let turned = state.positions.iter().zip(forces).map(|(x, f)| x.cross(*f));
            let (sum, torque) = (forces.iter().sum::<DVec3>(), turned.sum::<DVec3>());
            assert!(
                sum.length() < 1e-12 * scale && torque.length() < 1e-11 * scale,
                "{name}, {what}: {sum}, {torque}, of {scale} N"
            );
        };
        for law in model.stiffnesses() {
            let forces = forces_of(|f| law.add_forces(&state, f), model.particles());
            check(law.name(), &forces);
        }
        for law in model.dampings().filter(|law| law.name() != "mass_damping") {
            let forces = forces_of(|f| law.add_forces(&state, f), model.particles());
            check(law.name(), &forces);
        }
    }
}

#[test]
fn damping_takes_the_power_that_it_reports() {
    let Built { model, state, .. } = everything();
    let mut laws = 0;
    for (what, state) in states(&state) {
        for law in model.dampings() {
            laws += 1;
            let forces = forces_of(|f| law.add_forces(&state, f), model.particles());
            let pairs = forces.iter().zip(&state.velocities);
            let work: f64 = pairs.map(|(f, v)| f.dot(*v)).sum();
            let power = law.power(&state);
            assert!(
                power > 0.0 && (power + work).abs() < 1e-10 * power,
                "{}, {what}: {power} W against {work}",
                law.name()
            );
        }
    }
    let each = "drag, the damping of four families of springs, and that of hinges";
    assert_eq!(laws, 6 * states(&state).len(), "{each}");
}

#[test]
fn elastic_energy_does_not_see_rigid_motion() {
    let Built { model, state, .. } = everything();
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -1.1, 2.0);
    let mut laws = 0;
    for (what, state) in states(&state) {
        let mut moved = state.clone();
        for x in &mut moved.positions {
            *x = turn * *x + DVec3::new(3.0, -2.0, 1.0);
        }
        for law in model.stiffnesses() {
            laws += 1;
            let (before, after) = (law.energy(&state), law.energy(&moved));
            assert!(
                (before - after).abs() < 1e-10 * before,
                "{}, {what}: {before} J, moved {after} J",
                law.name()
            );
        }
    }
    let each = "four families of springs and two laws of bending";
    assert_eq!(laws, 6 * states(&state).len(), "{each}");
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
        let built = scene::build(&load("drape", &changes)).unwrap();
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
        let mut run = Simulation::new(built.model, state, scheme, 2e-4);
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
    let orders = orders(Integrator::ImplicitEuler(Linear::to(1e-6)), 2e-3, 16.0);
    assert!(orders.iter().all(|order| *order >= 0.9), "{orders:?}");
}

/// A sheet and a mesh with shuffled numbers, each of several chunks, with every kind of spring, both
/// hinge laws and both dampings, shaken.
fn shaken() -> Built {
    let mut numbers = Numbers(11);
    let text = strip([0.8, 0.8], [45, 45], |u, v| {
        DVec3::new(u, 0.01 * (20.0 * u).sin(), v)
    });
    let path = fresh_folder("shaken").join("shuffled.obj");
    std::fs::write(&path, shuffled(&text, &mut numbers)).unwrap();
    let scene = format!(
        "name = \"shaken\"\nduration = 1.0\n\
        [[cloth]]\nname = \"sheet\"\nshape = {{ sheet = {{ size = [1.0, 1.0], cells = [50, 50], diagonals = \"both\" }} }}\n\
        springs = [\"structural\", \"shear\", \"bend\"]\nbending = \"edge-spring\"\n\
        material = {{ area_density = 0.2, stretch = 100.0, bend = 1.0e-5 }}\ndamping = {{ mass = 0.5, stiffness = 0.001 }}\n\
        [[cloth]]\nname = \"mesh\"\nshape = {{ obj = {{ path = \"{}\" }} }}\nbending = \"discrete-shell\"\n\
        material = {{ area_density = 0.2, stretch = 100.0, bend = 1.0e-5 }}\ndamping = {{ mass = 0.5, stiffness = 0.001 }}\n\
        [[pin]]\ncloth = \"sheet\"\nselect = {{ edge = \"left\" }}\nclamp = true\n",
        path.display()
    );
    let mut built = scene::build(&written("shaken", &scene)).unwrap();
    shake(&mut built, &mut numbers);
    built
}

/// Moves every free particle a little, and gives it a velocity.
fn shake(built: &mut Built, numbers: &mut Numbers) {
    let state = &mut built.state;
    for i in 0..state.positions.len() {
        if !built.model.is_pinned(i) {
            state.positions[i] += numbers.vector() * 1e-3;
            state.velocities[i] = numbers.vector() * 0.1;
        }
    }
}

/// A sheet that is beyond the caches, which is gone through in shorter tiles than others, with springs,
/// hinges and both dampings, shaken.
fn large() -> Built {
    let scene = "name = \"large\"\nduration = 1.0\n\
        [[cloth]]\nname = \"sheet\"\nshape = { sheet = { size = [6.0, 5.0], cells = [600, 500], diagonals = \"both\" } }\n\
        bending = \"edge-spring\"\n\
        material = { area_density = 0.2, stretch = 100.0, bend = 1.0e-5 }\ndamping = { mass = 0.5, stiffness = 0.001 }\n\
        [[pin]]\ncloth = \"sheet\"\nselect = { edge = \"left\" }\n";
    let mut built = scene::build(&written("large", scene)).unwrap();
    shake(&mut built, &mut Numbers(13));
    assert!(built.model.particles() > 1 << 18);
    built
}

/// The pass on all threads gives what the laws give one by one, up to rounding, in every scene.
#[test]
fn the_force_pass_is_the_sum_of_the_laws() {
    let mut numbers = Numbers(5);
    let scenes = scene::BUILTIN
        .iter()
        .map(|(name, _)| scene::build(&load(name, &[])).unwrap());
    for mut built in scenes.chain([everything(), shaken(), large()]) {
        shake(&mut built, &mut numbers);
        let (model, state) = (&built.model, &built.state);
        let zero = vec![DVec3::ZERO; model.particles()];
        let (mut laws, mut dampings) = (zero.clone(), zero.clone());
        model
            .forces()
            .for_each(|law| law.add_forces(state, &mut laws));
        model
            .dampings()
            .for_each(|law| law.add_forces(state, &mut dampings));
        let pass = model.force_pass();
        let [mut all, mut of_laws, mut of_dampings] = [(); 3].map(|()| zero.clone());
        pass.set_all(state, &mut all, (), |_, _, ()| {});
        pass.set_laws(state, &mut of_laws, (), |_, _, ()| {});
        pass.set_dampings(state, &mut of_dampings, (), |_, _, ()| {});
        let scale = laws
            .iter()
            .chain(&dampings)
            .map(|f| f.length())
            .fold(0.0, f64::max);
        assert!(scale > 0.0);
        for i in 0..zero.len() {
            let errors = [
                of_laws[i] - laws[i],
                of_dampings[i] - dampings[i],
                all[i] - laws[i] - dampings[i],
            ];
            assert!(
                errors.iter().all(|error| error.length() < 1e-12 * scale),
                "particle {i}: {errors:?} of {scale} N"
            );
        }
    }
}

/// The bits of positions and velocities after some steps on so many threads.
fn bits(built: Built, scheme: Integrator, dt: f64, steps: u32, threads: usize) -> Vec<[u64; 6]> {
    let mut run = Simulation::new(built.model, built.state, scheme, dt);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build().unwrap().install(|| {
        for _ in 0..steps {
            run.step().unwrap_or_else(|diverged| panic!("{diverged}"));
        }
    });
    let state = run.state();
    let pairs = state.positions.iter().zip(&state.velocities);
    pairs
        .map(|(x, v)| [x.x, x.y, x.z, v.x, v.y, v.z].map(f64::to_bits))
        .collect()
}

/// Every scheme at a step that it bears, for one, two and three threads: the bits after some steps.
fn check_threads(what: &str, build: fn() -> Built, steps: impl Fn(Integrator) -> u32) {
    for name in ALL_SCHEMES {
        let scheme = named(name);
        let start = build();
        let dt = if scheme.is_explicit() {
            let forecast = forecast(&start.model, &start.state);
            step_length(Step::Auto, scheme, &forecast).unwrap()
        } else {
            scheme.usual_step().min(0.004)
        };
        let ends = [1, 2, 3].map(|threads| bits(build(), scheme, dt, steps(scheme), threads));
        let same = |i: &usize| ends[0][*i] == ends[1][*i] && ends[0][*i] == ends[2][*i];
        let other = (0..ends[0].len()).find(|i| !same(i));
        assert_eq!(other, None, "{what}, {name} in steps of {dt} s");
    }
}

/// With every law on meshes of several chunks.
#[test]
fn every_scheme_has_the_same_bits_for_any_number_of_threads() {
    let built = shaken();
    assert!(built.model.particles() > 4 * 1024 && built.model.hinges().count() > 5000);
    check_threads(
        "shaken",
        shaken,
        |scheme| {
            if scheme.is_explicit() { 20 } else { 4 }
        },
    );
}

/// Beyond the caches, too; and what is measured on the way is the state's.
#[test]
fn large_scenes_have_the_same_bits_for_any_number_of_threads() {
    for name in ["symplectic-euler", "verlet", "rk4", "xpbd"] {
        let scheme = named(name);
        let [one, two] = [1, 2].map(|threads| bits(large(), scheme, 1e-5, 2, threads));
        assert!(one == two, "{name}");
        let built = large();
        let mut run = Simulation::new(built.model, built.state, scheme, 1e-5);
        let strain = run.step().unwrap().strain;
        let (model, state) = (run.model(), run.state());
        assert_eq!(strain, model.largest_strain(&state.positions), "{name}");
        let kinetic = Energies::of(model, state).kinetic;
        let off = run.stats().kinetic_peak / kinetic - 1.0;
        assert!(off.abs() < 1e-12, "{name}: {off:.1e}");
    }
}

/// With contact and a strain limit: `drape` from where it lies on the shoulders.
#[test]
fn every_scheme_drapes_with_the_same_bits_for_any_number_of_threads() {
    check_threads(
        "drape",
        draped,
        |scheme| {
            if scheme.is_explicit() { 20 } else { 4 }
        },
    );
}

/// `drape` after 0.2 s, when it touches the body.
fn draped() -> Built {
    static AT: LazyLock<State> = LazyLock::new(|| {
        let mut run = simulation("drape", &[], named("implicit-euler"), 0.004);
        run_to(&mut run, 0.2);
        assert!(!run.contacts().list.is_empty() && run.model().strain_limit.is_some());
        State {
            time: 0.0,
            ..run.state().clone()
        }
    });
    let mut built = scene::build(&load("drape", &[])).unwrap();
    built.state = AT.clone();
    built
}

/// A velocity or position that is no number is noticed in the step in which it comes, wherever it is.
#[test]
fn what_is_no_number_is_noticed_at_once() {
    for scheme in [
        Integrator::SymplecticEuler,
        Integrator::Verlet,
        Integrator::Rk4,
    ] {
        for (particle, value) in [(0, f64::NAN), (2600, f64::INFINITY), (4500, f64::NAN)] {
            for in_position in [false, true] {
                let mut built = shaken();
                let lists = if in_position {
                    &mut built.state.positions
                } else {
                    &mut built.state.velocities
                };
                lists[particle].z = value;
                let mut run = Simulation::new(built.model, built.state, scheme, 1e-5);
                let diverged = run.step().unwrap_err();
                assert!(
                    diverged.step == 1 && diverged.sign == Sign::NotFinite,
                    "{diverged}"
                );
            }
        }
    }
}
