//! Bending against the heavy elastica, and thin shells that keep their form.

use crate::support::{Numbers, fresh_folder, run_to, strip, written};
use glam::DVec3;
use muslin::integrator::{Integrator, Linear};
use muslin::lab::elastica::elastica;
use muslin::scene::{self, LoadedScene};
use muslin::simulation::{Simulation, settle};

const LAWS: [&str; 2] = ["edge-spring", "discrete-shell"];
const LENGTH: f64 = 0.2;

/// A strip of a shape along x, clamped at −x, that is to bend with Γ = σ g L³/D.
fn cantilever(shape: &str, law: &str, gamma: f64) -> LoadedScene {
    let rigidity = 0.1 * 9.81 * LENGTH.powi(3) / gamma;
    let text = format!(
        "name = \"cantilever\"\nduration = 1.0\n[[cloth]]\nname = \"strip\"\nshape = {shape}\nbending = \"{law}\"\nmaterial = {{ area_density = 0.1, stretch = 500.0, bend = {rigidity:?} }}\n[[pin]]\ncloth = \"strip\"\nselect = {{ box = [[-1.0, -1.0, -1.0], [-0.099999, 1.0, 1.0]] }}\nclamp = true\n"
    );
    written("cantilever", &text)
}

/// H/L of a clamped strip at rest: drop of the mean of its free edge.
fn drop(shape: &str, law: &str, gamma: f64) -> f64 {
    let loaded = cantilever(shape, law, gamma);
    let mut built = scene::build(&loaded).unwrap();
    let starts = built.state.positions.clone();
    let rest = settle(&built.model, &mut built.state, 1e-7);
    assert!(rest.found, "{law}, Γ = {gamma}: {rest:?}");
    let free = (0..starts.len()).filter(|&i| starts[i].x > 0.5 * LENGTH - 1e-6);
    let drops: Vec<f64> = free
        .map(|i| starts[i].y - built.state.positions[i].y)
        .collect();
    drops.iter().sum::<f64>() / drops.len() as f64 / LENGTH
}

fn sheet(cells: u32) -> String {
    format!(
        "{{ sheet = {{ size = [{LENGTH}, 0.04], cells = [{cells}, {}], diagonals = \"alternating\" }} }}",
        cells / 5
    )
}

#[test]
fn clamped_strips_hang_like_the_elastica() {
    for law in LAWS {
        for gamma in [1.0, 3.0, 10.0, 30.0, 100.0] {
            let exact = elastica(gamma).drop;
            let [coarse, middle, fine] = [20, 40, 80].map(|cells| drop(&sheet(cells), law, gamma));
            println!(
                "{law} Γ = {gamma}: H/L {coarse:.5} {middle:.5} {fine:.5}, elastica {exact:.5}: {:+.2} % at 40 cells",
                100.0 * (middle / exact - 1.0)
            );
            assert!(
                (middle / exact - 1.0).abs() < 0.008,
                "{law}, Γ = {gamma}: {middle}, {exact}"
            );
            let (first, second) = ((middle - coarse).abs(), (fine - middle).abs());
            // 2e-4 L is what the search's tolerance and the width's rounding to cells leave.
            assert!(
                second < 0.7 * first || second < 2e-4,
                "{law}, Γ = {gamma}: {coarse}, {middle}, {fine} do not converge"
            );
            assert!(
                (fine / exact - 1.0).abs() < 0.007,
                "{law}, Γ = {gamma}: {fine} at 80 cells, {exact}"
            );
        }
    }
}

/// The same on meshes whose vertices lie anywhere: moved by up to 0.2 and 0.35 of a cell.
#[test]
fn strips_of_uneven_triangles_hang_like_the_elastica() {
    for (jitter, seed) in [(0.2, 5), (0.35, 6)] {
        let mut numbers = Numbers(seed);
        let cell = LENGTH / 40.0;
        let text = strip([LENGTH, 0.04], [40, 8], |u, v| {
            let mut shake = |x: f64, size: f64| {
                let inner = x > 1e-9 && x < size - 1e-9;
                x + if inner {
                    jitter * cell * numbers.next()
                } else {
                    0.0
                }
            };
            let (u, v) = (shake(u, LENGTH), shake(v, 0.04));
            DVec3::new(u - 0.5 * LENGTH, 0.0, v - 0.02)
        });
        let path = fresh_folder("uneven").join("strip.obj");
        std::fs::write(&path, text).unwrap();
        let shape = format!("{{ obj = {{ path = \"{}\" }} }}", path.display());
        for law in LAWS {
            for gamma in [1.0, 3.0, 10.0, 30.0, 100.0] {
                let (drop, exact) = (drop(&shape, law, gamma), elastica(gamma).drop);
                println!(
                    "jitter {jitter}, {law} Γ = {gamma}: {:+.2} %",
                    100.0 * (drop / exact - 1.0)
                );
                assert!(
                    (drop / exact - 1.0).abs() < 0.02,
                    "{law}, Γ = {gamma}: {drop}, {exact}"
                );
            }
        }
    }
}

/// A quarter of a cylinder, clamped at one edge, released from a much flatter form.
#[test]
fn a_thin_shell_springs_back_to_its_form() {
    let radius = 0.1;
    let text = strip(
        [radius * std::f64::consts::FRAC_PI_2, 0.1],
        [16, 10],
        |u, v| DVec3::new(radius * (u / radius).sin(), radius * (u / radius).cos(), v),
    );
    let path = fresh_folder("shell").join("shell.obj");
    std::fs::write(&path, text).unwrap();
    for law in LAWS {
        let scene = format!(
            "name = \"shell\"\nduration = 2.0\ngravity = [0.0, 0.0, 0.0]\n[[cloth]]\nname = \"shell\"\nshape = {{ obj = {{ path = \"{}\" }} }}\nbending = \"{law}\"\nmaterial = {{ area_density = 0.2, stretch = 500.0, bend = 1.0e-3 }}\ndamping = {{ mass = 4.0, stiffness = 0.003 }}\n[[pin]]\ncloth = \"shell\"\nselect = {{ box = [[-0.001, 0.0, -1.0], [0.001, 1.0, 1.0]] }}\nclamp = true\n",
            path.display()
        );
        let built = scene::build(&written("shell", &scene)).unwrap();
        let shape = built.state.positions.clone();
        let mut state = built.state;
        for (x, w) in state.positions.iter_mut().zip(&built.model.inverse_masses) {
            if *w > 0.0 {
                x.y = radius + 0.2 * (x.y - radius);
            }
        }
        let start = (0..shape.len())
            .map(|i| (state.positions[i] - shape[i]).length())
            .fold(0.0, f64::max);
        assert!(start > 0.05, "starts {start} m off");
        let scheme = Integrator::ImplicitEuler(Linear::to(1e-6));
        let mut run = Simulation::new(built.model, state, scheme, 0.004);
        run_to(&mut run, 4.0);
        let off = (0..shape.len()).map(|i| (run.state().positions[i] - shape[i]).length());
        let off = off.fold(0.0, f64::max);
        assert!(off < 0.01 * 0.1, "{law}: {off} m from its rest shape");
    }
}
