//! What a run is made of, per element, so that sizes compare: `cargo bench`.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use muslin::collision::{Bodies, Contacts, Detection, Solid};
use muslin::force::Force;
use muslin::integrator::{Integrator, Linear};
use muslin::mesh::DistanceGrid;
use muslin::scene::{self, LoadedScene};
use muslin::simulation::{Simulation, forecast};
use std::hint::black_box;

fn load(name: &str, changes: &[&str]) -> LoadedScene {
    let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
    scene::load(name, &changes).unwrap_or_else(|error| panic!("{error}"))
}

/// The poncho as it lies after a second.
fn draped() -> (LoadedScene, Simulation) {
    let loaded = load("drape", &[]);
    let built = scene::build(&loaded).unwrap_or_else(|error| panic!("{error}"));
    let scheme = Integrator::ImplicitEuler(Linear::to(1e-3));
    let mut simulation = Simulation::new(built.model, built.state, scheme, 0.004);
    for _ in 0..250 {
        simulation
            .step()
            .unwrap_or_else(|diverged| panic!("{diverged}"));
    }
    (loaded, simulation)
}

/// Nanoseconds a spring: one pass over a sheet of 100 × 100 cells with every kind of spring.
fn force_pass(criterion: &mut Criterion) {
    let changes = [
        "cloth.0.shape.sheet.cells=[100, 100]",
        "cloth.0.shape.sheet.diagonals=both",
    ];
    let built = scene::build(&load("drape", &changes)).unwrap_or_else(|error| panic!("{error}"));
    let mut forces = vec![DVec3::ZERO; built.model.particles()];
    let mut group = criterion.benchmark_group("force pass, per spring");
    group.throughput(Throughput::Elements(built.model.spring_count() as u64));
    group.bench_function("sheet 100 x 100", |bencher| {
        bencher.iter(|| {
            for batch in &built.model.springs {
                batch.add_forces(black_box(&built.state), &mut forces);
            }
        });
    });
    let pass = built.model.force_pass();
    for threads in [1, 2] {
        group.bench_function(format!("all laws, {threads} thread(s)"), |bencher| {
            on_threads(threads, || {
                let forces = &mut forces[..];
                bencher.iter(|| pass.set_laws(black_box(&built.state), forces, (), |_, _, ()| {}));
            });
        });
    }
    group.finish();
}

/// Runs a measurement in a pool of its own.
fn on_threads(threads: usize, measure: impl FnOnce() + Send) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.unwrap_or_else(|error| panic!("{error}"))
        .install(measure);
}

/// A step of symplectic Euler at 0.9 of the longest one that is stable, on a sheet of 100 × 100
/// particles that hangs at two corners.
fn explicit_step(criterion: &mut Criterion) {
    let changes = [
        "cloth.0.shape.sheet.cells=[99, 99]",
        "cloth.0.material.stretch=1000.0",
        "cloth.0.springs=[\"structural\", \"shear\"]",
        "cloth.0.material.bend=0.0",
        "cloth.0.damping={}",
    ];
    for threads in [1, 2] {
        let name = format!("step of symplectic-euler, {threads} thread(s)");
        criterion.bench_function(&name, |bencher| {
            on_threads(threads, || {
                let built = scene::build(&load("hanging-cloth", &changes));
                let built = built.unwrap_or_else(|error| panic!("{error}"));
                let scheme = Integrator::SymplecticEuler;
                let dt = 0.9 * forecast(&built.model, &built.state).stable_dt(scheme);
                let mut run = Simulation::new(built.model, built.state, scheme, dt);
                bencher.iter(|| run.step().unwrap_or_else(|diverged| panic!("{diverged}")));
            });
        });
    }
}

/// Nanoseconds a hinge: one pass over a crumpled sheet of 140 × 140 cells, some 57,000 hinges, by either law.
fn hinge_pass(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("force pass, per hinge");
    for law in ["edge-spring", "discrete-shell"] {
        let bending = format!("cloth.0.bending={law}");
        let changes = ["cloth.0.shape.sheet.cells=[140, 140]", bending.as_str()];
        let built = scene::build(&load("drape", &changes)).unwrap_or_else(|e| panic!("{e}"));
        let (model, mut state) = (built.model, built.state);
        for x in &mut state.positions {
            *x += DVec3::Y * (0.01 * (300.0 * x.x).sin() * (200.0 * x.z).cos());
        }
        let mut forces = vec![DVec3::ZERO; model.particles()];
        group.throughput(Throughput::Elements(model.hinges().count() as u64));
        group.bench_function(law, |bencher| {
            bencher.iter(|| {
                for batch in model.stiffnesses().skip(model.springs.len()) {
                    batch.add_forces(black_box(&state), &mut forces);
                }
            });
        });
    }
    group.finish();
}

/// Nanoseconds a query: nearest points of all particles of the draped poncho, and one detection pass
/// that knows what the last one found.
fn contact(criterion: &mut Criterion) {
    let (_, simulation) = draped();
    let (obstacles, positions) = (&simulation.model().obstacles, &simulation.state().positions);
    let mut group = criterion.benchmark_group("contact, per particle");
    group.throughput(Throughput::Elements(positions.len() as u64));
    group.bench_function("nearest point", |bencher| {
        bencher.iter(|| {
            for &p in positions {
                black_box(obstacles[0].shape.nearest(p, f64::MAX));
            }
        });
    });
    let Solid::Mesh { surface, .. } = &obstacles[0].shape else {
        panic!("a mannequin is a mesh");
    };
    for (cell, band) in [(0.01, 0.02), (0.005, 0.01)] {
        let grid = DistanceGrid::new(surface, cell, band);
        let grid = grid.unwrap_or_else(|error| panic!("{error}"));
        group.bench_function(format!("grid of {cell} m"), |bencher| {
            bencher.iter(|| {
                for &p in positions {
                    black_box(grid.nearest(p, f64::MAX));
                }
            });
        });
    }
    let bodies = Bodies::new(obstacles, 0.0);
    let mut detection = Detection::new(obstacles, positions.len());
    let mut contacts = Contacts::none(positions.len());
    let mut moved = positions.clone();
    let mut side = 1e-3;
    group.bench_function("detection after 1 mm of motion", |bencher| {
        bencher.iter(|| {
            moved.iter_mut().for_each(|x| x.x += side);
            side = -side;
            detection.find(obstacles, &bodies, &moved, &mut contacts);
        });
    });
    group.finish();
}

/// What a body costs that moves: refitting the mannequin, its pairs of overlapping triangles; and
/// nearest points 5 mm from it, a query.
fn body(criterion: &mut Criterion) {
    let built = scene::build(&load("drape", &[])).unwrap_or_else(|error| panic!("{error}"));
    let Solid::Mesh { surface, .. } = built.model.obstacles[0].shape.clone() else {
        panic!("a mannequin is a mesh");
    };
    let mesh = surface.mesh().clone();
    let mut group = criterion.benchmark_group("mannequin");
    for threads in [1, 2] {
        let mut moved = surface.clone();
        group.bench_function(format!("moved, {threads} thread(s)"), |bencher| {
            on_threads(threads, || {
                bencher.iter(|| moved.move_to(black_box(&mesh.positions)));
            });
        });
    }
    group.bench_function("overlapping triangles", |bencher| {
        bencher.iter(|| {
            let mut pairs = 0;
            let hierarchy = surface.hierarchy();
            for part in 0..hierarchy.parts() {
                hierarchy.self_pairs(part, |_, _| pairs += 1);
            }
            pairs
        });
    });
    let near = mesh.triangles.iter().map(|&triangle| {
        let [a, b, c] = mesh.corners(triangle);
        (a + b + c) / 3.0 + 0.005 * (b - a).cross(c - a).normalize_or_zero()
    });
    let near: Vec<DVec3> = near.collect();
    group.throughput(Throughput::Elements(near.len() as u64));
    group.bench_function("nearest point 5 mm away", |bencher| {
        bencher.iter(|| {
            for &p in &near {
                black_box(surface.nearest(p, f64::MAX));
            }
        });
    });
    group.finish();
}

/// A step of the draped poncho.
fn step(criterion: &mut Criterion) {
    let (_, mut simulation) = draped();
    criterion.bench_function("step of the draped poncho", |bencher| {
        bencher.iter(|| {
            simulation
                .step()
                .unwrap_or_else(|diverged| panic!("{diverged}"))
        });
    });
}

/// Milliseconds a recorded frame, taken and written to a file.
#[cfg(feature = "rerun")]
fn frame(criterion: &mut Criterion) {
    use muslin::frame::Capture;
    use muslin::recorder::{Recorder as _, RerunRecorder, Targets};
    let (loaded, simulation) = draped();
    let (mut capture, header) = Capture::new(&loaded, &simulation);
    criterion.bench_function("frame of the draped poncho, taken", |bencher| {
        bencher.iter(|| black_box(capture.frame(&simulation, Vec::new(), false)));
    });
    let save = std::env::temp_dir().join("muslin-bench.rrd");
    let targets = Targets {
        save: Some(save.clone()),
        ..Targets::default()
    };
    let mut recorder =
        RerunRecorder::new(&header, &targets).unwrap_or_else(|error| panic!("{error}"));
    let mut frame = capture.frame(&simulation, Vec::new(), false);
    criterion.bench_function("frame of the draped poncho, recorded", |bencher| {
        bencher.iter(|| {
            frame.index += 1;
            frame.time += 1.0 / 60.0;
            recorder
                .record(&frame)
                .unwrap_or_else(|error| panic!("{error}"));
        });
    });
    recorder.finish().unwrap_or_else(|error| panic!("{error}"));
    let _ = std::fs::remove_file(save);
}

#[cfg(not(feature = "rerun"))]
fn frame(_: &mut Criterion) {}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = force_pass, explicit_step, hinge_pass, contact, body, step, frame
}
criterion_main!(benches);
