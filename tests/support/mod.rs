//! What several topics need.

#[cfg(feature = "rerun")]
pub(crate) mod background;
pub(crate) mod program;

use glam::DVec3;
use muslin::integrator::{Integrator, Linear, Nonlinear};
use muslin::mesh::TriMesh;
use muslin::scene::{self, LoadedScene};
use muslin::simulation::Simulation;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// A tight implicit Euler: its linear solves are far more exact than its steps.
pub(crate) const IMPLICIT: Integrator = Integrator::ImplicitEuler(Linear::to(1e-9));

/// Nonlinear solves that are far more exact than the steps.
pub(crate) const SOLVED: Nonlinear = Nonlinear {
    residual: 1e-10,
    iterations: 50,
    linear: Linear::to(1e-6),
};

/// Every scheme by its name in scenes.
pub(crate) const SCHEMES: [&str; 11] = [
    "euler",
    "symplectic-euler",
    "verlet",
    "rk4",
    "dopri5",
    "implicit-euler",
    "newton",
    "implicit-midpoint",
    "bdf2",
    "xpbd",
    "projective",
];

/// A scheme as a scene asks for it by name, but for linear solves to 1e-4: what tests of all schemes look
/// at is how far one can go with a scheme, not what its default makes of it.
pub(crate) fn named(name: &str) -> Integrator {
    let loaded = load("hanging-cloth", &[&format!("solver.integrator={name}")]);
    let mut solver = loaded.scene.solver;
    solver.linear_tolerance = 1e-4;
    Integrator::of(&solver)
}

/// XPBD in small steps: one sweep each.
pub(crate) const XPBD: Integrator = Integrator::Xpbd { iterations: 1 };

/// A tight projective scheme: what it leaves of a step's equation is far less than the step's error.
pub(crate) const PROJECTIVE: Integrator = Integrator::Projective {
    iterations: 2000,
    residual: 1e-7,
};

/// A scene with changes.
pub(crate) fn load(name: &str, changes: &[&str]) -> LoadedScene {
    let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
    scene::load(name, &changes).unwrap_or_else(|error| panic!("{error}"))
}

/// An empty folder for a test's files; every call needs a name of its own.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).expect("an old test folder can be removed");
    }
    std::fs::create_dir_all(&folder).expect("a test folder can be made");
    folder
}

/// A folder for one use: its name is never given twice.
pub(crate) fn fresh_folder(name: &str) -> PathBuf {
    static USES: AtomicU32 = AtomicU32::new(0);
    folder(&format!("{name}-{}", USES.fetch_add(1, Ordering::Relaxed)))
}

/// A scene of its own, by its TOML; the paths in it are absolute.
pub(crate) fn written(name: &str, text: &str) -> LoadedScene {
    let path = fresh_folder(name).join("scene.toml");
    std::fs::write(&path, text).unwrap();
    load(&path.display().to_string(), &[])
}

/// OBJ text of a rectangle of `cells` triangulated cells, `at` giving the place of (u, v) (m).
///
/// Each cell is cut along the diagonal that leaves the larger smallest angle (Delaunay's choice).
pub(crate) fn strip(
    size: [f64; 2],
    [columns, rows]: [u32; 2],
    mut at: impl FnMut(f64, f64) -> DVec3,
) -> String {
    let mut points = Vec::new();
    for j in 0..=rows {
        for i in 0..=columns {
            let (u, v) = (
                f64::from(i) / f64::from(columns),
                f64::from(j) / f64::from(rows),
            );
            points.push(at(size[0] * u, size[1] * v));
        }
    }
    let mut text: String = points
        .iter()
        .map(|p| format!("v {} {} {}\n", p.x, p.y, p.z))
        .collect();
    let angle = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [a, b, c].map(|i| points[i as usize]);
        (a - b).angle_between(c - b)
    };
    for j in 0..rows {
        for i in 0..columns {
            let a = j * (columns + 1) + i;
            let [b, c, d] = [a + 1, a + columns + 2, a + columns + 1];
            // The angles opposite the diagonal a–c sum to at most π.
            let triangles = if angle([a, b, c]) + angle([a, d, c]) <= std::f64::consts::PI {
                [[a, c, b], [a, d, c]]
            } else {
                [[a, d, b], [b, d, c]]
            };
            for [p, q, r] in triangles {
                text += &format!("f {} {} {}\n", p + 1, q + 1, r + 1);
            }
        }
    }
    text
}

/// A simulation of a scene with changes.
pub(crate) fn simulation(
    name: &str,
    changes: &[&str],
    integrator: Integrator,
    dt: f64,
) -> Simulation {
    let built = scene::build(&load(name, changes)).unwrap_or_else(|error| panic!("{error}"));
    Simulation::new(built.model, built.state, integrator, dt)
}

/// Steps until `time` (s).
pub(crate) fn run_to(simulation: &mut Simulation, time: f64) {
    let steps = (time / simulation.dt()).round() as u64;
    while simulation.stats().steps < steps {
        simulation
            .step()
            .unwrap_or_else(|diverged| panic!("{diverged}"));
    }
}

/// A box between two corners.
pub(crate) fn cuboid(low: DVec3, high: DVec3) -> TriMesh {
    let corner = |k: u32| {
        let side = |axis: u32| f64::from(k >> axis & 1);
        low + (high - low) * DVec3::new(side(0), side(1), side(2))
    };
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let halves = |&[a, b, c, d]: &[u32; 4]| [[a, b, c], [a, c, d]];
    TriMesh {
        positions: (0..8).map(corner).collect(),
        triangles: faces.iter().flat_map(halves).collect(),
    }
}

/// A sequence of numbers in −1 … 1 that looks random and is the same every time.
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn next(&mut self) -> f64 {
        // Knuth's MMIX generator; its upper bits.
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    }

    pub(crate) fn vector(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }
}

/// Root of the mean square distance (m).
pub(crate) fn distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| a.distance_squared(*b));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}

/// OBJ text with its vertices and its faces in another order.
pub(crate) fn shuffled(text: &str, numbers: &mut Numbers) -> String {
    let (points, mut faces): (Vec<&str>, Vec<&str>) =
        text.lines().partition(|line| line.starts_with("v "));
    let mut order: Vec<(f64, usize)> = (0..points.len()).map(|i| (numbers.next(), i)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    // A reader may number vertices as the faces come: these are shuffled too.
    for i in (1..faces.len()).rev() {
        faces.swap(i, (0.5 * (numbers.next() + 1.0) * i as f64) as usize);
    }
    let mut place = vec![0; points.len()];
    let mut mesh = String::new();
    for (new, &(_, old)) in order.iter().enumerate() {
        place[old] = new + 1;
        mesh += &format!("{}\n", points[old]);
    }
    for face in faces {
        let corners = face.split(' ').skip(1);
        let corners = corners.map(|corner| place[corner.parse::<usize>().unwrap() - 1].to_string());
        mesh += &format!("f {}\n", corners.collect::<Vec<_>>().join(" "));
    }
    mesh
}
