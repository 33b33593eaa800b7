//! Closed forms that no simulator made.

use crate::support::{IMPLICIT, SOLVED, run_to, simulation, written};
use glam::DVec3;
use muslin::energy::SCHEME;
use muslin::integrator::{Integrator, Linear};
use muslin::mesh::{Surface, TriMesh};
use muslin::simulation::Simulation;

#[test]
fn free_fall_is_exact_for_both_schemes() {
    for (scheme, dt) in [
        (Integrator::SymplecticEuler, 1e-4),
        (IMPLICIT, 0.004),
        (IMPLICIT, 0.05),
    ] {
        let changes = [
            "obstacle=[]",
            "cloth.0.damping.mass=0",
            "cloth.0.damping.stiffness=0.0001",
        ];
        let mut run = simulation("drape", &changes, scheme, dt);
        let start = run.state().positions.clone();
        for _ in 0..50 {
            run.step().unwrap();
        }
        // v = g n dt, y = ½ g dt² n (n + 1): the schemes' own closed form, not the continuum's.
        let exact = -0.5 * 9.81 * dt * dt * 50.0 * 51.0;
        for (x, x0) in run.state().positions.iter().zip(&start) {
            let error = (*x - *x0 - DVec3::Y * exact).length() / exact.abs();
            // Positions are near 1.5 m, so a fall of 1e-4 m carries a rounding of 1e-12 of its own.
            let rounding = 4.0 * 1.5 * f64::EPSILON * 50.0 / exact.abs();
            assert!(
                error < 1e-12 + rounding,
                "{} at {dt} s: {error:.1e}",
                scheme.name()
            );
        }
    }
}

/// Sag of the middle of `hanging-cloth`'s upper edge and drop of its lower edge below the pins (m).
fn sags(cells: u32) -> [f64; 2] {
    let cells_key = format!("cloth.0.shape.sheet.cells=[{cells}, {cells}]");
    let scheme = Integrator::ImplicitEuler(Linear::to(1e-4));
    let changes = [cells_key.as_str(), "cloth.0.damping.mass=4"];
    let mut run = simulation("hanging-cloth", &changes, scheme, 0.01);
    run_to(&mut run, 5.0);
    let fastest = run
        .state()
        .velocities
        .iter()
        .map(|v| v.length())
        .fold(0.0, f64::max);
    assert!(
        fastest < 5e-3,
        "{cells} cells: still moving at {fastest} m/s"
    );
    let row = cells as usize + 1;
    let positions = &run.state().positions;
    let pins = positions[0].y;
    [
        pins - positions[row / 2].y,
        pins - positions[row * (row - 1) + row / 2].y,
    ]
}

#[test]
fn a_finer_sheet_is_the_same_cloth() {
    let [coarse, middle, fine] = [20, 40, 80].map(sags);
    let (first, second) = ((middle[1] - coarse[1]).abs(), (fine[1] - middle[1]).abs());
    assert!(
        second < first * 2.0 / 3.0,
        "drops {coarse:?}, {middle:?}, {fine:?} m"
    );
    assert!(second < 1e-3, "drops {coarse:?}, {middle:?}, {fine:?} m");
}

/// The stretched length of a chain that hangs from one end: ℓ (1 + λ g ℓ / (2 EA)), exact for a
/// chain of N springs whose last particle has half a mass.
#[test]
fn a_hanging_chain_is_as_long_as_its_weight_makes_it() {
    for links in [4_u32, 50] {
        let links_key = format!("cloth.0.shape.chain.links={links}");
        let changes = [
            links_key.as_str(),
            "pin=[{ cloth = \"chain\", select = { corner = [\"left\"] } }]",
            "cloth.0.start.stretch=[1, 1, 1]",
            "cloth.0.rotate=[0, 0, -90]",
            "cloth.0.material.stretch=20",
            "cloth.0.damping.mass=20",
        ];
        let mut run = simulation("chain", &changes, IMPLICIT, 0.01);
        run_to(&mut run, 10.0);
        let positions = &run.state().positions;
        let length = (positions[0] - positions[links as usize]).length();
        let exact = 1.0 + 0.05 * 9.81 / (2.0 * 20.0);
        assert!(
            (length - exact).abs() < 1e-6,
            "{links} links: {length} m against {exact}"
        );
    }
}

/// Kinetic energy lost to drag alone: a free sheet's velocity decays as exp(−c t).
#[test]
fn drag_decays_exponentially() {
    for (scheme, order_one) in [(Integrator::SymplecticEuler, 1.0), (IMPLICIT, -1.0)] {
        let changes = [
            "obstacle=[]",
            "gravity=[0, 0, 0]",
            "cloth.0.damping.mass=2",
            "cloth.0.damping.stiffness=0",
        ];
        let built = muslin::scene::build(&crate::support::load("drape", &changes)).unwrap();
        let mut state = built.state;
        state.velocities.fill(DVec3::X);
        let dt = 1e-4;
        let mut run = Simulation::new(built.model, state, scheme, dt);
        run_to(&mut run, 0.5);
        // (1 − c dt)ⁿ and (1 + c dt)⁻ⁿ around exp(−c t): off by ∓ c² dt t / 2.
        let exact = (-2.0_f64 * 0.5).exp();
        let expected = exact * (1.0 - order_one * 4.0 * dt * 0.5 / 2.0);
        for v in &run.state().velocities {
            assert!(
                (v.x - expected).abs() < 2e-6,
                "{}: {} against {expected}",
                scheme.name(),
                v.x
            );
        }
        let balance = run.balance();
        let by_itself = balance.dissipated_by(SCHEME) / run.ledger().initial;
        assert!(
            by_itself.abs() < 2e-3,
            "{}: the scheme took {by_itself}",
            scheme.name()
        );
    }
}

/// Distances to a sphere's mesh against the sphere: the mesh lies within its sagitta.
#[test]
fn distances_to_a_fine_sphere_are_those_of_the_sphere() {
    let mut mesh = octahedron();
    for _ in 0..5 {
        mesh = refined(&mesh);
    }
    let surface = Surface::new(&mesh).unwrap();
    // Edges of at most 0.07 on a unit sphere: sagitta a²/8.
    let sagitta = 0.07_f64.powi(2) / 8.0;
    let mut numbers = crate::support::Numbers(23);
    for _ in 0..10_000 {
        let p = numbers.vector() * 1.5;
        let nearest = surface.nearest(p, f64::MAX).unwrap();
        let exact = p.length() - 1.0;
        assert!(
            (nearest.distance - exact).abs() < 2.0 * sagitta,
            "at {p}: {} against {exact}",
            nearest.distance
        );
    }
}

fn octahedron() -> TriMesh {
    let positions = vec![
        DVec3::X,
        -DVec3::X,
        DVec3::Y,
        -DVec3::Y,
        DVec3::Z,
        -DVec3::Z,
    ];
    let triangles = vec![
        [0, 2, 4],
        [2, 1, 4],
        [1, 3, 4],
        [3, 0, 4],
        [2, 0, 5],
        [1, 2, 5],
        [3, 1, 5],
        [0, 3, 5],
    ];
    TriMesh {
        positions,
        triangles,
    }
}

/// Every triangle cut into four, vertices on the unit sphere.
fn refined(mesh: &TriMesh) -> TriMesh {
    let mut text = String::new();
    for &triangle in &mesh.triangles {
        let [a, b, c] = mesh.corners(triangle);
        let [ab, bc, ca] = [(a + b), (b + c), (c + a)].map(|p| p.try_normalize().unwrap());
        for p in [a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca] {
            text += &format!("v {:?} {:?} {:?}\n", p.x, p.y, p.z);
        }
        text += "f -12 -11 -10\nf -9 -8 -7\nf -6 -5 -4\nf -3 -2 -1\n";
    }
    let (mesh, _) = muslin::mesh::read_obj(&text, 1.0).unwrap();
    assert!(
        muslin::mesh::open_edge(&mesh).is_none(),
        "midpoints of shared edges must agree"
    );
    mesh
}

/// The period of a pendulum over that of small swings, 1/AGM(1, cos(A/2)), at four amplitudes: a stiff
/// link with all its weight at the end, from rest to the lowest point and so a quarter of the period.
#[test]
fn a_pendulum_has_the_period_of_its_amplitude() {
    let text = |amplitude: f64| {
        format!(
            "name = \"pendulum\"\nduration = 9.0\n[[cloth]]\nname = \"rod\"\nrotate = [0.0, 0.0, {}]\nshape = {{ chain = {{ length = 1.0, links = 1 }} }}\nmaterial = {{ linear_density = 0.1, stretch = 1.0e6 }}\n[[pin]]\ncloth = \"rod\"\nselect = {{ corner = [\"left\"] }}\n",
            amplitude - 90.0
        )
    };
    let small = std::f64::consts::TAU * (1.0_f64 / 9.81).sqrt();
    for (amplitude, ratio) in [
        (10.0, 1.0019071881),
        (45.0, 1.0399733432),
        (90.0, 1.1803405990),
        (150.0, 1.7622037295),
    ] {
        let scene = written("pendulum", &text(amplitude));
        for (scheme, dt) in [
            (Integrator::Verlet, 2e-4),
            (Integrator::Rk4, 2e-4),
            (Integrator::Dopri5 { tolerance: 1e-7 }, 1e-3),
            (Integrator::ImplicitMidpoint(SOLVED), 1e-3),
            (Integrator::Bdf2(SOLVED), 1e-3),
        ] {
            let built = muslin::scene::build(&scene).unwrap();
            let mut run = Simulation::new(built.model, built.state, scheme, dt);
            let place = |run: &Simulation| {
                let x = &run.state().positions;
                (x[1] - x[0]).x
            };
            let mut before = place(&run);
            while place(&run) > 0.0 {
                before = place(&run);
                run.step().unwrap();
            }
            // The way between two steps is straight: nothing pulls along it at the lowest point.
            let after = place(&run);
            let quarter = run.state().time - dt * after / (after - before);
            let error = 4.0 * quarter / (small * ratio) - 1.0;
            println!("{}, {amplitude}°: {error:.1e}", scheme.name());
            assert!(
                error.abs() < 1e-4,
                "{}, {amplitude}°: {error}",
                scheme.name()
            );
        }
    }
}
