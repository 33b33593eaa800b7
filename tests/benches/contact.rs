//! What contact costs: by setting, by size, and of cloth with itself. `cargo bench --bench contact`.
//!
//! A "pass" is a stage's time in a step over how often the stage ran in it at most; shares are of the whole step.

use muslin::integrator::Integrator;
use muslin::scene::{self, Step};
use muslin::simulation::{Simulation, Stage};
use std::time::{Duration, Instant};

/// A built-in scene with changes.
fn start(name: &str, changes: &[String]) -> Simulation {
    let loaded = scene::load(name, changes).unwrap_or_else(|error| panic!("{error}"));
    let built = scene::build(&loaded).unwrap_or_else(|error| panic!("{error}"));
    let scheme = Integrator::of(&loaded.scene.solver);
    let dt = match loaded.scene.solver.dt {
        Step::Seconds(dt) => dt,
        Step::Auto => panic!("{name} has no step of its own"),
    };
    Simulation::new(built.model, built.state, scheme, dt)
}

/// Wall milliseconds between two times (s): in all stages, in those of contact, and in finding contacts.
#[derive(Default)]
struct Cost {
    all: f64,
    contact: f64,
    detection: f64,
    impacts: f64,
    steps: f64,
}

fn run(simulation: &mut Simulation, end: f64) -> Cost {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build();
    let pool = pool.unwrap_or_else(|error| panic!("{error}"));
    let spent = |run: &Simulation, stage: Stage| run.stats().times.of(stage);
    let stages = [Stage::DetectContacts, Stage::Respond, Stage::ResolveImpacts];
    let before = stages.map(|stage| spent(simulation, stage));
    let (start, steps) = (Instant::now(), simulation.stats().steps);
    pool.install(|| {
        while simulation.state().time < end - 1e-9 {
            if let Err(diverged) = simulation.step() {
                println!("{diverged}");
                break;
            }
        }
    });
    let ms = |time: Duration| time.as_secs_f64() * 1000.0;
    let [detection, respond, impacts] =
        [0, 1, 2].map(|k| ms(spent(simulation, stages[k]) - before[k]));
    Cost {
        all: ms(start.elapsed()),
        contact: detection + respond + impacts,
        detection,
        impacts,
        steps: f64::from(u32::try_from(simulation.stats().steps - steps).unwrap_or(u32::MAX)),
    }
}

/// A sheet of 100 × 100 particles falls on the mannequin, with each setting of the contact dial.
fn print_settings() {
    println!("100 x 100 particles on the mannequin, 0.6 s, ms a step");
    println!("| setting | step | contact | share | detection | impacts |");
    let settings: [(&str, &[&str]); 5] = [
        ("exact, continuous", &[]),
        ("exact", &["obstacle.0.ccd=false"]),
        (
            "grid of 5 mm, continuous",
            &["obstacle.0.distance.grid=0.005"],
        ),
        (
            "grid of 10 mm",
            &["obstacle.0.distance.grid=0.01", "obstacle.0.ccd=false"],
        ),
        (
            "grid of 5 mm",
            &["obstacle.0.distance.grid=0.005", "obstacle.0.ccd=false"],
        ),
    ];
    for (name, changes) in settings {
        let mut all = vec!["cloth.0.shape.sheet.cells=[99, 99]".to_owned()];
        all.extend(changes.iter().map(|change| (*change).to_owned()));
        let cost = run(&mut start("drape", &all), 0.6);
        let each = |ms: f64| ms / cost.steps;
        println!(
            "| {name} | {:.1} | {:.2} | {:.0} % | {:.2} | {:.2} |",
            each(cost.all),
            each(cost.contact),
            100.0 * cost.contact / cost.all,
            each(cost.detection),
            each(cost.impacts)
        );
    }
}

/// The same sheet ever finer, by XPBD in steps of a millisecond.
fn print_sizes() {
    println!("a sheet on the mannequin, 0.1 s, ns of contact a particle and step");
    println!("| particles | detection | impacts | over n log n of the first |");
    let mut first = None;
    for side in [50, 100, 200, 500] {
        let changes = [
            format!("cloth.0.shape.sheet.cells=[{0}, {0}]", side - 1),
            "solver.integrator=xpbd".to_owned(),
            "solver.dt=0.001".to_owned(),
            "strain_limit=".to_owned(),
        ];
        let mut simulation = start("drape", &changes);
        let cost = run(&mut simulation, 0.1);
        let n = f64::from(u32::try_from(simulation.model().particles()).unwrap_or(u32::MAX));
        let each = |ms: f64| ms * 1e6 / (cost.steps * n);
        let growth = each(cost.contact) / n.ln();
        let first = *first.get_or_insert(growth);
        println!(
            "| {n} | {:.0} | {:.0} | {:.2} |",
            each(cost.detection),
            each(cost.impacts),
            growth / first
        );
    }
}

/// `twist` with 100 × 100 particles, with and without contact of cloth with cloth, at some step (s).
fn print_twist(dt: f64) {
    println!("twist, 100 x 100 particles, step of {dt:.4} s, ms a simulated 1/60 s");
    println!("| turns | with | of which contact | without |");
    let cells = "cloth.0.shape.sheet.cells=[99, 99]".to_owned();
    let step = format!("solver.dt={dt}");
    let mut with = start("twist", &[cells.clone(), step.clone()]);
    let mut without = start("twist", &[cells, step, "self_collision=".to_owned()]);
    for end in [0.5, 1.0, 1.5, 2.0, 2.5, 3.0] {
        let turns: f64 = end / 3.0;
        let turns = 3.0 * turns * turns * (3.0 - 2.0 * turns);
        let [a, b] = [run(&mut with, end), run(&mut without, end)];
        let frame = |ms: f64| ms / (0.5 * 60.0);
        println!(
            "| {turns:.2} | {:.1} | {:.1} | {:.1} |",
            frame(a.all),
            frame(a.contact),
            frame(b.all)
        );
    }
}

fn main() {
    let asked = |name: &str| std::env::args().any(|word| word == name);
    let all = !["settings", "sizes", "twist"].into_iter().any(asked);
    if all || asked("settings") {
        print_settings();
    }
    if all || asked("sizes") {
        print_sizes();
    }
    if all || asked("twist") {
        // The scene's own step, and the default.
        print_twist(1.0 / 60.0);
        print_twist(0.004);
    }
}
