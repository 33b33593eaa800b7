//! Time at equal error: what a simulated sixtieth of a second costs under each scheme, how far it is
//! from the reference then, and how far its springs are stretched. `cargo bench --bench schemes`.

use glam::DVec3;
use muslin::integrator::{Integrator, Linear, Nonlinear};
use muslin::scene;
use muslin::simulation::{Simulation, forecast};
use std::time::Instant;

/// 100 × 100 particles, 1 m², 0.2 kg, held at two corners: 39,402 springs.
const SHEET: &str = r#"
name = "target"
duration = 1.0
[[cloth]]
name = "sheet"
shape = { sheet = { size = [1.0, 1.0], cells = [99, 99], diagonals = "both" } }
material = { area_density = 0.2, stretch = 1000.0 }
[[pin]]
cloth = "sheet"
select = { corner = ["left-near", "right-near"] }
"#;

/// When states are compared (s).
const END: f64 = 0.5;

/// The sheet at its start.
fn sheet(scheme: Integrator, dt: f64) -> Simulation {
    let path = std::env::temp_dir().join(format!("muslin-bench-{}.toml", std::process::id()));
    let loaded = std::fs::write(&path, SHEET).map(|()| scene::load(&path.to_string_lossy(), &[]));
    let loaded = loaded.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    let _ = std::fs::remove_file(path);
    let built = scene::build(&loaded).unwrap_or_else(|error| panic!("{error}"));
    Simulation::new(built.model, built.state, scheme, dt)
}

/// Runs to the end, or as far as it goes; returns the wall time (ms) per simulated 1/60 s.
fn run(simulation: &mut Simulation, threads: usize) -> f64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.unwrap_or_else(|error| panic!("{error}"));
    let start = Instant::now();
    pool.install(|| {
        while simulation.state().time < END - 1e-9 {
            if let Err(diverged) = simulation.step() {
                println!("{diverged}");
                break;
            }
        }
    });
    start.elapsed().as_secs_f64() * 1000.0 / (60.0 * simulation.state().time.max(1e-9))
}

/// Root of the mean square and largest distance (m).
fn distances(a: &[DVec3], b: &[DVec3]) -> [f64; 2] {
    let squares = || a.iter().zip(b).map(|(a, b)| a.distance_squared(*b));
    #[expect(clippy::cast_precision_loss, reason = "ten thousand")]
    let mean = squares().sum::<f64>() / a.len() as f64;
    [mean.sqrt(), squares().fold(0.0, f64::max).sqrt()]
}

fn main() {
    let still = sheet(Integrator::Verlet, 1.0);
    let stable = forecast(still.model(), still.state()).stable_dt(Integrator::Verlet);
    println!("stable step of symplectic-euler and verlet: {stable:.3e} s");
    let mut reference = sheet(Integrator::Rk4, 2.5e-5);
    let ms = run(&mut reference, 2);
    println!("reference: rk4 at 2.5e-5 s, {ms:.0} ms per 1/60 s");
    let linear = Linear::to(1e-4);
    let solved = |residual| Nonlinear {
        residual,
        iterations: 50,
        linear,
    };
    let mut settings: Vec<(Integrator, f64)> = Vec::new();
    for share in [0.9, 0.45] {
        // A whole number of steps to the end.
        let dt = END / (END / (share * stable)).ceil();
        settings.push((Integrator::SymplecticEuler, dt));
        settings.push((Integrator::Verlet, dt));
    }
    settings.push((Integrator::Rk4, 1.0 / 6000.0));
    for tolerance in [1e-3, 1e-4] {
        settings.push((Integrator::Dopri5 { tolerance }, 1.0 / 240.0));
    }
    for steps in [60.0, 240.0, 960.0] {
        settings.push((Integrator::ImplicitEuler(linear), 1.0 / steps));
    }
    settings.push((Integrator::Newton(solved(1e-3)), 1.0 / 240.0));
    for steps in [240.0, 960.0] {
        settings.push((Integrator::ImplicitMidpoint(solved(1e-3)), 1.0 / steps));
        settings.push((Integrator::Bdf2(solved(1e-3)), 1.0 / steps));
    }
    for steps in [1200.0, 4800.0, 19_200.0] {
        settings.push((Integrator::Xpbd { iterations: 1 }, 1.0 / steps));
    }
    let residual = 1e-3;
    for (iterations, steps) in [(10, 60.0), (100, 60.0), (10, 240.0)] {
        let scheme = Integrator::Projective {
            iterations,
            residual,
        };
        settings.push((scheme, 1.0 / steps));
    }
    println!(
        "| scheme | step (ms) | ms per 1/60 s | rms (mm) | largest (mm) | strain at the end, ever (%) |"
    );
    for (scheme, dt) in settings {
        let mut simulation = sheet(scheme, dt);
        let ms = run(&mut simulation, 2);
        let at = &simulation.state().positions;
        let [rms, largest] = distances(at, &reference.state().positions).map(|d| 1000.0 * d);
        let stats = simulation.stats();
        println!(
            "| {scheme:?} | {:.3} | {ms:.1} | {rms:.2} | {largest:.1} | {:.1}, {:.1} |",
            1000.0 * dt,
            100.0 * stats.strain,
            100.0 * stats.strain_ever,
        );
    }
}
