//! What a simulated sixtieth of a second costs under each scheme, on one sheet: `cargo bench --bench schemes`.

use criterion::{Criterion, criterion_group, criterion_main};
use muslin::integrator::Integrator;
use muslin::scene;
use muslin::simulation::Simulation;
use std::time::{Duration, Instant};

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

fn run(simulation: &mut Simulation, steps: u32) {
    for _ in 0..steps {
        let done = simulation.step();
        done.unwrap_or_else(|diverged| panic!("{diverged}"));
    }
}

/// Each scheme at the step that suits it, with one thread and two.
fn schemes(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step, per simulated 1/60 s");
    for (scheme, steps) in [(Integrator::Xpbd { iterations: 1 }, 20)] {
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.unwrap_or_else(|error| panic!("{error}"));
            let dt = 1.0 / (60.0 * f64::from(steps));
            let mut simulation = sheet(scheme, dt);
            let name = format!("{}, {steps} steps, {threads} threads", scheme.name());
            group.bench_function(name, |bencher| {
                bencher.iter_custom(|rounds| {
                    let mut spent = Duration::ZERO;
                    for _ in 0..rounds {
                        // From the start again before its corners are torn: some schemes are too soft here.
                        if simulation.state().time > 0.2 {
                            simulation = sheet(scheme, dt);
                        }
                        let start = Instant::now();
                        pool.install(|| run(&mut simulation, steps));
                        spent += start.elapsed();
                    }
                    spent
                });
            });
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = schemes
}
criterion_main!(benches);
