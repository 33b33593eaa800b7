//! Starts that are inside something, across it or across other cloth: they get out in the stated time, and
//! nothing is thrown.

use crate::support::{fresh_folder, load, named, written};
use glam::DVec3;
use muslin::collision::TIME;
use muslin::frame::{Audited, Capture};
use muslin::integrator::Integrator;
use muslin::mesh::{TriMesh, ball};
use muslin::scene::{self, LoadedScene};
use muslin::simulation::Simulation;
use std::fmt::Write as _;

const G: f64 = 9.81;

/// OBJ file of a mesh.
fn obj(mesh: &TriMesh) -> String {
    let mut text = String::new();
    for p in &mesh.positions {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
    }
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| i + 1);
        writeln!(text, "f {a} {b} {c}").unwrap();
    }
    let path = fresh_folder("recovery-mesh").join("body.obj");
    std::fs::write(&path, text).unwrap();
    format!(
        "shape = {{ obj = {{ path = {:?} }} }}",
        path.display().to_string()
    )
}

/// A box of half sides around the origin.
fn cuboid(half: DVec3) -> TriMesh {
    let corner = |k: u32| {
        let side = |axis: u32| 2.0 * f64::from(k >> axis & 1) - 1.0;
        half * DVec3::new(side(0), side(1), side(2))
    };
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    TriMesh {
        positions: (0..8).map(corner).collect(),
        triangles: faces
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
    }
}

/// A sheet and a body.
fn scene_of(side: f64, cells: u32, place: &str, body: &str, more: &str) -> LoadedScene {
    written(
        "recovery",
        &format!(
            "name = \"recovery\"\nduration = 1.0\n[[cloth]]\nname = \"sheet\"\n{place}\n\
             shape = {{ sheet = {{ size = [{side:?}, {side:?}], cells = [{cells}, {cells}] }} }}\n\
             material = {{ area_density = 0.2, stretch = 200.0 }}\ndamping = {{ stiffness = 0.002 }}\n\
             [[obstacle]]\nname = \"body\"\nthickness = 0.003\nfriction = 0.3\n{body}\n\
             [solver]\ndt = 0.004\n{more}"
        ),
    )
}

/// How a start went.
#[derive(Debug)]
struct Way {
    found: Audited,
    /// Largest speed of any step, and the most that gravity explains (m/s).
    speed: f64,
    fall: f64,
    kinetic: f64,
    weight_fall: f64,
    unexplained: f64,
    strain: f64,
    start: usize,
    left: usize,
    took: Option<f64>,
    said: Vec<String>,
    bits: Vec<u64>,
}

/// Runs for a while, and audits from a time on.
fn run(loaded: &LoadedScene, scheme: Integrator, dt: f64, clean: f64, end: f64) -> Way {
    let built = scene::build(loaded).unwrap_or_else(|error| panic!("{error}"));
    let mut run = Simulation::new(built.model, built.state, scheme, dt);
    let (mut capture, _) = Capture::new(loaded, &run);
    let (mut speed, mut fall, mut kinetic, mut weight_fall) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    let mass: f64 = run.model().masses.iter().sum();
    let starts = run.state().positions.clone();
    while run.state().time < end - 1e-9 {
        run.step().unwrap_or_else(|diverged| panic!("{diverged}"));
        let state = run.state();
        let speeds = state.velocities.iter().map(|v| v.length());
        speed = speeds.fold(speed, f64::max);
        let sunk = starts.iter().zip(&state.positions).map(|(a, b)| a.y - b.y);
        fall = sunk.fold(fall, f64::max);
        kinetic = kinetic.max(run.balance().energies.kinetic);
        weight_fall = mass * G * fall;
        if state.time > clean {
            capture.frame(&run, Vec::new(), false);
        }
    }
    let state = run.state();
    let all = state.positions.iter().chain(&state.velocities);
    Way {
        found: capture.audited().unwrap(),
        speed,
        fall: (2.0 * G * fall).sqrt(),
        kinetic,
        weight_fall,
        unexplained: run.balance().unexplained(),
        strain: run.stats().strain,
        start: run.tangled().at_start,
        left: run.tangled().now,
        took: run.tangled().took,
        said: run.tangled().said.clone(),
        bits: all.flat_map(|x| x.to_array().map(f64::to_bits)).collect(),
    }
}

const TWO_SIDES: &str = "[strain_limit]\nmax = 0.1\n";

fn starts() -> Vec<(&'static str, LoadedScene)> {
    let round = |radius: f64| obj(&ball(DVec3::ZERO, radius));
    let block = obj(&cuboid(DVec3::new(0.3, 0.2, 0.3)));
    let mannequin = "shape = { obj = { path = \"mannequin.obj\" } }";
    let _ = mannequin;
    vec![
        (
            "ball",
            scene_of(0.8, 40, "translate = [0.0, 0.27, 0.0]", &round(0.3), ""),
        ),
        (
            "ball limited",
            scene_of(
                0.8,
                40,
                "translate = [0.0, 0.27, 0.0]",
                &round(0.3),
                TWO_SIDES,
            ),
        ),
        (
            "in box",
            scene_of(1.0, 40, "translate = [0.0, 0.17, 0.0]", &block, TWO_SIDES),
        ),
        (
            "half box",
            scene_of(0.5, 25, "translate = [0.3, 0.12, 0.01]", &block, TWO_SIDES),
        ),
        (
            "upright box",
            scene_of(
                0.5,
                25,
                "translate = [0.22, 0.2, 0.01]\nrotate = [0.0, 0.0, 90.0]",
                &block,
                TWO_SIDES,
            ),
        ),
        (
            "big ball",
            scene_of(
                0.5,
                25,
                "translate = [0.1, 0.6, 0.0]",
                &round(1.0),
                TWO_SIDES,
            ),
        ),
        (
            "big ball unlimited",
            scene_of(0.5, 25, "translate = [0.1, 0.6, 0.0]", &round(1.0), ""),
        ),
    ]
}

#[test]
fn what_starts_inside_gets_out() {
    let only = std::env::var("ONLY").ok();
    for (name, loaded) in starts() {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        let way = run(&loaded, named("implicit-euler"), 0.004, 1.2 * TIME, 1.0);
        let Way {
            bits: _,
            found,
            speed,
            fall,
            kinetic,
            weight_fall,
            unexplained,
            strain,
            start,
            left,
            took,
            said,
        } = &way;
        println!(
            "{name}: {said:?} {found:?} speed {speed:.3} of {fall:.3}, kinetic {kinetic:.2e} of {weight_fall:.2e}, {unexplained:.1e}, strain {strain:.4}, {start} {left} {took:?}"
        );
    }
}
