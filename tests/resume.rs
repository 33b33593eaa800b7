//! A run that goes on from a checkpoint ends as if it had never been stopped, bit for bit.

use crate::support::{SCHEMES, load, written};
use muslin::frame::{Capture, Checkpoint};
use muslin::integrator::Integrator;
use muslin::scene::{self, LoadedScene, Step};
use muslin::simulation::{Simulation, forecast, step_length};
use muslin::state::State;

fn start(loaded: &LoadedScene) -> (Simulation, Capture) {
    let built = scene::build(loaded).unwrap();
    let integrator = Integrator::of(&loaded.scene.solver);
    let forecast = forecast(&built.model, &built.state);
    let dt = step_length(loaded.scene.solver.dt, integrator, &forecast).unwrap();
    let simulation = Simulation::new(built.model, built.state, integrator, dt);
    let (capture, _) = Capture::new(loaded, &simulation);
    (simulation, capture)
}

/// Checkpoints at some steps, the last state and ledger.
struct Whole {
    checkpoints: Vec<Checkpoint>,
    last: State,
    report: String,
}

fn report(simulation: &Simulation) -> String {
    let mut stats = *simulation.stats();
    (stats.times, stats.timed) = Default::default();
    format!(
        "{:?} {:?} {:?}",
        stats,
        simulation.balance(),
        simulation.tangled()
    )
}

fn whole(loaded: &LoadedScene, stops: &[u64], steps: u64) -> Whole {
    let (mut simulation, mut capture) = start(loaded);
    let mut checkpoints = Vec::new();
    for step in 0..steps {
        if stops.contains(&step) {
            let frame = capture.checkpoint_frame(&mut simulation, Vec::new());
            checkpoints.push(frame.checkpoint.unwrap());
        }
        simulation.step().unwrap();
    }
    Whole {
        checkpoints,
        last: simulation.state().clone(),
        report: report(&simulation),
    }
}

/// Stops a scene before some steps, and goes on from there in new simulations.
fn resumes(loaded: &LoadedScene, stops: &[u64], steps: u64) {
    let what = format!(
        "{} with {:?}",
        loaded.scene.name, loaded.scene.solver.integrator
    );
    let whole = whole(loaded, stops, steps);
    assert_eq!(whole.checkpoints.len(), stops.len());
    for checkpoint in &whole.checkpoints {
        let (mut simulation, mut capture) = start(loaded);
        capture.go_on(&mut simulation, checkpoint).unwrap();
        assert_eq!(simulation.stats().steps, checkpoint.step);
        while simulation.stats().steps < steps {
            simulation.step().unwrap();
        }
        let (a, b) = (simulation.state(), &whole.last);
        let differ = (0..b.positions.len())
            .filter(|&i| a.positions[i] != b.positions[i] || a.velocities[i] != b.velocities[i]);
        let apart = (a.positions.iter().zip(&b.positions)).map(|(a, b)| a.distance(*b));
        let apart = apart.fold(0.0, f64::max);
        assert!(
            a.hash() == b.hash(),
            "{what}: resumed after step {}, {} of {} particles differ at step {steps}, by {apart:e} m at most",
            checkpoint.step,
            differ.count(),
            b.positions.len()
        );
        assert_eq!(report(&simulation), whole.report, "{what}");
    }
}

/// Each scheme on a scene with contact, friction and a strain limit.
#[test]
fn every_scheme_goes_on_as_if_never_stopped() {
    for scheme in SCHEMES {
        let name = format!("solver.integrator={scheme:?}");
        let dt = match scheme {
            "euler" | "symplectic-euler" | "verlet" | "rk4" => "solver.dt=\"auto\"",
            _ => "solver.dt=0.004",
        };
        let cells = "cloth.0.shape.sheet.cells=[16, 16]";
        // At 0.35 s the cloth lies on the body.
        let loaded = load(
            "drape",
            &[cells, &name, dt, "cloth.0.translate=[0.0, 1.5, 0.0]"],
        );
        let (simulation, _) = start(&loaded);
        let steps = |time: f64| (time / simulation.dt()) as u64;
        resumes(&loaded, &[0, 1, steps(0.3), steps(0.35)], steps(0.4));
        let loaded = load(
            "hanging-cloth",
            &[&name, dt, "cloth.0.shape.sheet.cells=[12, 12]"],
        );
        let (simulation, _) = start(&loaded);
        let steps = |time: f64| (time / simulation.dt()) as u64;
        resumes(&loaded, &[1, steps(0.1), steps(0.2)], steps(0.25));
    }
}

/// Moving bodies, pins that move, layers, edges kept apart.
#[test]
fn contact_goes_on_as_if_never_stopped() {
    for (name, changes, stops, steps) in [
        (
            "twist",
            // A rope of folds at its limit after 1.5 s.
            &[
                "cloth.0.shape.sheet.cells=[30, 30]",
                "strain_limit.max=0.05",
            ][..],
            [90, 120],
            130,
        ),
        (
            "twist",
            &[
                "cloth.0.shape.sheet.cells=[30, 30]",
                "strain_limit.max=0.05",
                "solver.dt=0.004",
            ],
            [40, 375],
            400,
        ),
        // Torn apart, with what is missed and with rigid zones.
        (
            "twist",
            &["cloth.0.shape.sheet.cells=[30, 30]", "strain_limit="],
            [90, 110],
            120,
        ),
        ("stack", &[], [30, 120], 150),
        ("table-cloth", &[], [60, 110], 130),
        ("walking-mannequin", &[], [60, 300], 320),
        ("bullet", &[], [20, 60], 90),
        ("incline", &[], [20, 60], 90),
    ] {
        let loaded = load(name, changes);
        resumes(&loaded, &stops, steps);
    }
}

/// Pins that let go before and after the checkpoint, one of them a clamp.
#[test]
fn releases_go_on_as_if_never_stopped() {
    // Euler's scheme would need steps of 1e-6 s.
    for scheme in SCHEMES.into_iter().filter(|scheme| *scheme != "euler") {
        let loaded = written(
            "resume-releases",
            &format!(
                "name = \"let go\"\nduration = 1.0\n[[cloth]]\nname = \"sheet\"\nbending = \"discrete-shell\"\n\
                 shape = {{ sheet = {{ size = [0.4, 0.4], cells = [8, 8] }} }}\n\
                 material = {{ area_density = 0.2, stretch = 200.0, bend = 1e-4 }}\n\
                 damping = {{ stiffness = 0.002, mass = 0.1 }}\n\
                 [[pin]]\ncloth = \"sheet\"\nselect = {{ edge = \"left\" }}\nclamp = true\nrelease = 0.06\n\
                 [[pin]]\ncloth = \"sheet\"\nselect = {{ edge = \"right\" }}\nclamp = true\nrelease = 0.12\n\
                 motion = {{ keyframes = [{{ t = 0.0 }}, {{ t = 0.2, translate = [0.1, 0.0, 0.0], rotate = [0, 0, 20] }}] }}\n\
                 [solver]\nintegrator = \"{scheme}\"\ndt = 0.0002"
            ),
        );
        resumes(&loaded, &[250, 301, 500, 601], 700);
    }
}

/// Cloth that starts inside a body and is being led out.
#[test]
fn what_started_tangled_goes_on_as_if_never_stopped() {
    let loaded = load(
        "drape",
        &[
            "cloth.0.translate=[0.0, 1.2, 0.0]",
            "cloth.0.shape.sheet.cells=[24, 24]",
        ],
    );
    let (simulation, _) = start(&loaded);
    assert!(simulation.tangled().at_start > 0);
    resumes(&loaded, &[10, 40, 70, 150], 200);
}

#[test]
fn a_checkpoint_of_another_model_is_refused() {
    let loaded = load("hanging-cloth", &["cloth.0.shape.sheet.cells=[12, 12]"]);
    let other = load("hanging-cloth", &["cloth.0.shape.sheet.cells=[10, 10]"]);
    let scheme = loaded
        .with(&["solver.integrator=\"verlet\"".to_owned()])
        .unwrap();
    assert!(matches!(loaded.scene.solver.dt, Step::Seconds(_)));
    let checkpoint = whole(&loaded, &[2], 3).checkpoints.remove(0);
    for other in [&other, &scheme] {
        let (mut simulation, mut capture) = start(other);
        assert!(capture.go_on(&mut simulation, &checkpoint).is_err());
    }
    let mut cut = checkpoint;
    cut.luggage.pop();
    let (mut simulation, mut capture) = start(&loaded);
    assert!(capture.go_on(&mut simulation, &cut).is_err());
}
