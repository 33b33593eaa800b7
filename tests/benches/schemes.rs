//! Time at equal error: what a simulated sixtieth of a second costs under each scheme, how far it is
//! from the reference then, and how far its springs are stretched. `cargo bench --bench schemes`.
//!
//! With `-- sizes`: what a step costs a particle as the sheet gets finer; three minutes, 3 GB.

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

/// The sheet at its start, with some particles along each side.
fn sheet(side: u32, scheme: Integrator, dt: f64) -> Simulation {
    let cells = side - 1;
    let text = SHEET.replace("[99, 99]", &format!("[{cells}, {cells}]"));
    let path = std::env::temp_dir().join(format!("muslin-bench-{}.toml", std::process::id()));
    let loaded = std::fs::write(&path, text).map(|()| scene::load(&path.to_string_lossy(), &[]));
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

/// Particles along the sheet's side: twice as many particles from each to the next.
const SIDES: [u32; 8] = [88, 125, 177, 250, 354, 500, 707, 1000];

/// Particles times steps in a sample: a tenth of a second and more, at every size.
const SAMPLE: usize = 8_000_000;

/// Samples of each size, taken in turn so that a machine's slow minutes meet all of them.
const SAMPLES: usize = 20;

/// Prints nanoseconds a particle and step on two threads, of schemes whose steps should cost as much at
/// any size; `stable` (s) is the stable step of the coarsest sheet.
fn print_sizes(stable: f64) {
    let schemes = [
        ("symplectic-euler", Integrator::SymplecticEuler),
        ("verlet", Integrator::Verlet),
        ("rk4", Integrator::Rk4),
        ("xpbd", Integrator::Xpbd { iterations: 1 }),
    ];
    println!("ns per particle and step, and the time of a step over that of half the particles");
    println!(
        "| scheme | {} | mean of the doublings |",
        SIDES.map(|side| format!("{side}²")).join(" | ")
    );
    for (name, scheme) in schemes {
        let mut sheets = SIDES.map(|side| {
            // The stable step is as long as a cell.
            sheet(side, scheme, 0.5 * stable * 99.0 / f64::from(side - 1))
        });
        let mut least = [f64::INFINITY; SIDES.len()];
        for _ in 0..SAMPLES {
            for (least, sheet) in least.iter_mut().zip(&mut sheets) {
                *least = least.min(step_time(sheet));
            }
        }
        let particles = SIDES.map(|side| f64::from(side * side));
        let row = std::array::from_fn::<_, { SIDES.len() }, _>(|k| {
            let per_particle = format!("{:.1}", least[k] * 1e9 / particles[k]);
            let ratio = k.checked_sub(1).map(|half| least[k] / least[half]);
            ratio.map_or(per_particle.clone(), |r| format!("{per_particle}, {r:.2}"))
        });
        let (first, last) = (0, SIDES.len() - 1);
        let doublings = (particles[last] / particles[first]).log2();
        let mean = (least[last] / least[first]).powf(doublings.recip());
        println!("| {name} | {} | {mean:.3} |", row.join(" | "));
    }
}

/// Mean time (s) of the steps of a sample.
fn step_time(simulation: &mut Simulation) -> f64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build();
    let pool = pool.unwrap_or_else(|error| panic!("{error}"));
    // Energy is looked at every eighth step.
    let steps = (SAMPLE / simulation.model().particles()).next_multiple_of(8);
    let mut step = || {
        let step = simulation.step();
        step.unwrap_or_else(|diverged| panic!("{diverged}"));
    };
    pool.install(|| {
        step(); // new threads wake up
        let start = Instant::now();
        (0..steps).for_each(|_| step());
        #[expect(clippy::cast_precision_loss, reason = "a thousand")]
        let steps = steps as f64;
        start.elapsed().as_secs_f64() / steps
    })
}

fn main() {
    let still = sheet(100, Integrator::Verlet, 1.0);
    let stable = forecast(still.model(), still.state()).stable_dt(Integrator::Verlet);
    if std::env::args().any(|word| word == "sizes") {
        return print_sizes(stable);
    }
    println!("stable step of symplectic-euler and verlet: {stable:.3e} s");
    let mut reference = sheet(100, Integrator::Rk4, 2.5e-5);
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
        let mut simulation = sheet(100, scheme, dt);
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
