//! The material contract: where cloth comes to rest is the material's, whatever computes it.
//!
//! Every scheme with steps of dt, dt/2 and dt/4, and on one thread and two. `hanging-cloth` as it is has
//! folds, and several ways to hang that are millimetres apart: here it is so stiff that it has one.

use crate::support::{
    IMPLICIT, Numbers, PROJECTIVE, SCHEMES, SOLVED, XPBD, fresh_folder, load, named, run_to,
};
use glam::DVec3;
use muslin::integrator::Integrator;
use muslin::scene::{self, Built, LoadedScene};
use muslin::simulation::{Simulation, settle};

/// `hanging-cloth` in `cells` × `cells` cells, near the critical drag of its slowest swing, and a hundred
/// times as stiff in bending. Its corners are held over a cell with their tangents, so that it bends.
fn hanging(cells: u32, more: &[&str]) -> LoadedScene {
    let inner = 0.5 - 1.01 / f64::from(cells);
    let pin = |x: [f64; 2]| {
        let [from, to] = x;
        format!(
            "{{ cloth = \"sheet\", clamp = true, select = {{ box = [[{from}, 1.889, -0.26], [{to}, 1.94, -0.24]] }} }}"
        )
    };
    let size = format!("cloth.0.shape.sheet.cells=[{cells}, {cells}]");
    let pins = format!("pin=[{}, {}]", pin([-0.5, -inner]), pin([inner, 0.5]));
    let mut changes = vec![
        size.as_str(),
        "cloth.0.damping.mass=6.0",
        "cloth.0.material.bend=5.0e-3",
        "cloth.0.bending=discrete-shell",
        &pins,
    ];
    changes.extend(more);
    load("hanging-cloth", &changes)
}

/// The time after which the cloth is at rest (s): 0.3 µm are left of its swing.
const TIME: f64 = 5.0;

/// A scheme by its name, with solves so tight that only its step can be in the way.
fn tight(name: &str) -> Integrator {
    match name {
        "dopri5" => Integrator::Dopri5 { tolerance: 1e-6 },
        "implicit-euler" => IMPLICIT,
        "newton" => Integrator::Newton(SOLVED),
        "implicit-midpoint" => Integrator::ImplicitMidpoint(SOLVED),
        "bdf2" => Integrator::Bdf2(SOLVED),
        "xpbd" => XPBD,
        "projective" => PROJECTIVE,
        _ => named(name),
    }
}

/// The longest of the steps that a scheme is tried with (s): long for what it is.
fn longest(name: &str) -> f64 {
    match name {
        "euler" => 1e-3,
        "symplectic-euler" | "verlet" | "rk4" | "xpbd" => 2e-3,
        _ => 1.0 / 60.0,
    }
}

/// Where a scene's cloth is after some time (s).
fn drape(loaded: &LoadedScene, name: &str, dt: f64, time: f64) -> Vec<DVec3> {
    let Built { model, state, .. } = scene::build(loaded).unwrap();
    let mut run = Simulation::new(model, state, tight(name), dt);
    run_to(&mut run, time);
    run.state().positions.clone()
}

/// Distance of the particle that is farthest from its place in a limit (m).
fn farthest(positions: &[DVec3], limit: &[DVec3]) -> f64 {
    let each = positions.iter().zip(limit).map(|(x, y)| x.distance(*y));
    each.fold(0.0, f64::max)
}

/// How far the final drapes with steps of `first`, `first`/2, … are from a limit (m).
fn errors<const N: usize>(
    loaded: &LoadedScene,
    name: &str,
    first: f64,
    time: f64,
    limit: &[DVec3],
) -> [f64; N] {
    let mut dt = 2.0 * first;
    let errors = [(); N].map(|()| {
        dt *= 0.5;
        farthest(&drape(loaded, name, dt, time), limit)
    });
    println!("{name}, from {first:.2e} s: {errors:?} m");
    errors
}

/// The state of least energy that is found from a start stirred by up to `stir` (m).
fn rest(loaded: &LoadedScene, stir: f64) -> (Built, Vec<DVec3>) {
    let built = scene::build(loaded).unwrap();
    let (mut state, mut numbers) = (built.state.clone(), Numbers(17));
    for (x, w) in state.positions.iter_mut().zip(&built.model.inverse_masses) {
        if *w > 0.0 {
            *x += numbers.vector() * stir;
        }
    }
    let found = settle(&built.model, &mut state, 1e-12);
    assert!(found.found, "{found:?}");
    (built, state.positions)
}

/// The equilibrium from the scene's start, which is the one from others too, and bent.
fn only_rest(loaded: &LoadedScene) -> Vec<DVec3> {
    let (_, limit) = rest(loaded, 0.0);
    for stir in [0.03, 0.06] {
        let off = farthest(&rest(loaded, stir).1, &limit);
        assert!(off < 1e-9, "stirred by {stir} m: {off} m from the other");
    }
    let depth = limit.iter().map(|x| x.z);
    let bulge = depth.clone().fold(f64::MIN, f64::max) - depth.fold(f64::MAX, f64::min);
    assert!(bulge > 0.03, "hangs flat: {bulge} m");
    limit
}

/// Whether a scheme's steps are short, dopri5's own ones too.
fn is_explicit(name: &&str) -> bool {
    tight(name).is_explicit() || *name == "dopri5"
}

/// At rest no force moves anything, so that no step matters: all end where the energy is least.
fn check_rest(names: impl Iterator<Item = &'static str>) {
    let loaded = hanging(8, &[]);
    let limit = only_rest(&loaded);
    for name in names {
        let errors = errors::<3>(&loaded, name, longest(name), TIME, &limit);
        let most = errors.into_iter().fold(0.0, f64::max);
        assert!(most < 2e-6, "{name}: {errors:?} m");
    }
}

#[test]
fn explicit_schemes_end_in_one_drape() {
    check_rest(SCHEMES.into_iter().filter(is_explicit));
}

#[test]
fn implicit_schemes_end_in_one_drape() {
    let others = SCHEMES.into_iter().filter(|name| !is_explicit(name));
    check_rest(others.filter(|name| *name != "xpbd"));
}

/// One sweep leaves cloth softer, 1 mm at a step of 2 ms; that is the step's fault, and goes with it.
#[test]
fn xpbd_comes_to_that_drape_as_its_step_goes_to_nothing() {
    let loaded = hanging(8, &[]);
    let limit = only_rest(&loaded);
    let errors = errors::<4>(&loaded, "xpbd", longest("xpbd"), TIME, &limit);
    let halved = errors.windows(2).all(|pair| pair[1] < 0.5 * pair[0]);
    assert!(halved && errors[3] < 1e-4, "{errors:?} m");
}

/// With two chunks of particles two threads have something to share: shaken at rest, every scheme goes
/// the same way on both, to the last bit.
#[test]
fn two_threads_go_where_one_does() {
    let loaded = hanging(32, &[]);
    let (_, limit) = rest(&loaded, 0.0);
    let shaken = |name: &str, threads: usize| {
        let Built {
            model, mut state, ..
        } = scene::build(&loaded).unwrap();
        let mut numbers = Numbers(29);
        state.positions.copy_from_slice(&limit);
        for (v, w) in state.velocities.iter_mut().zip(&model.inverse_masses) {
            if *w > 0.0 {
                *v = numbers.vector() * 0.1;
            }
        }
        let mut run = Simulation::new(model, state, tight(name), longest(name) / 8.0);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| run_to(&mut run, 0.05));
        run.state().clone()
    };
    for name in SCHEMES {
        let [one, two] = [1, 2].map(|threads| shaken(name, threads));
        assert!(one == two, "{name}: two threads go elsewhere");
    }
}

/// Where a step does change the drape: each halving brings it nearer to a limit, until less than
/// `enough` (m) is left.
fn check_approach(loaded: &LoadedScene, limit: &[DVec3], enough: f64, cases: &[(&str, f64)]) {
    for &(name, first) in cases {
        let errors = errors::<3>(loaded, name, first, TIME, limit);
        let nearer = |pair: &[f64]| pair[1] < 0.75 * pair[0] || pair[1] < enough;
        let closer = errors.windows(2).all(nearer);
        assert!(closer && errors[2] < 3e-4, "{name}: {errors:?} m");
    }
}

/// A limit below the strain of the corners at rest. Each step pulls beyond it before it is held back.
#[test]
fn a_strain_limit_ends_in_one_drape() {
    let loaded = hanging(8, &["strain_limit.max=0.04"]);
    let limit = drape(&loaded, "symplectic-euler", 2.5e-4, TIME);
    let free = farthest(&limit, &rest(&loaded, 0.0).1);
    assert!(free > 1e-3, "the limit changes {free} m");
    // Limiting is content with a strain of 5e-5 beyond, in a metre of springs.
    let cases = [
        ("symplectic-euler", 2e-3),
        ("verlet", 2e-3),
        ("implicit-euler", 1.0 / 120.0),
        ("projective", 1.0 / 120.0),
        ("xpbd", 2e-3),
    ];
    check_approach(&loaded, &limit, 6e-5, &cases);
}

/// A box whose upper side is at y = 0.
const BOX: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 0 -1\nv -1 0 -1\nv -1 -1 1\nv 1 -1 1\nv 1 0 1\nv -1 0 1\n\
    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// The cloth leans on a smooth plate, into which explicit schemes fall a little in each step. Friction would hold it where it came to lie, and a mesh that is
/// round has edges on which it may lie either way: neither has one drape.
#[test]
fn contact_ends_in_one_drape() {
    let path = fresh_folder("plate").join("plate.obj");
    std::fs::write(&path, BOX).unwrap();
    let obstacle = format!(
        "obstacle=[{{ name = \"plate\", rotate = [75.0, 0.0, 0.0], translate = [0.0, 1.3, -0.25], friction = 0.0, shape = {{ obj = {{ path = \"{}\" }} }} }}]",
        path.display()
    );
    let loaded = hanging(8, &[&obstacle]);
    let limit = drape(&loaded, "implicit-euler", 1.0 / 240.0, TIME);
    let free = farthest(&limit, &rest(&loaded, 0.0).1);
    assert!(free > 0.05, "the plate moves it by {free} m");
    let cases = [
        ("symplectic-euler", 2e-3),
        ("verlet", 2e-3),
        ("implicit-euler", 1.0 / 60.0),
        ("bdf2", 1.0 / 60.0),
        ("xpbd", 2e-3),
        ("projective", 1.0 / 120.0),
    ];
    check_approach(&loaded, &limit, 5e-6, &cases);
}
