//! Whole runs: same bits, slow and failing recorders, divergence, contact that holds.

use crate::support::{IMPLICIT, load, simulation};
use muslin::frame::{Capture, Frame};
use muslin::integrator::{Integrator, Linear};
use muslin::pipeline::{self, Finished, PipelineError, Plan};
use muslin::recorder::{MemoryRecorder, RecordError, Recorded, Recorder};
use muslin::scene;
use muslin::simulation::Simulation;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Runs a scene through the pipeline.
fn run(
    changes: &[&str],
    threads: usize,
    duration: f64,
    recorder: &mut (dyn Recorder + Send),
) -> Result<Finished, PipelineError> {
    let loaded = load("drape", changes);
    let built = scene::build(&loaded).unwrap();
    let scheme = Integrator::ImplicitEuler(Linear::to(loaded.scene.solver.linear_tolerance));
    let simulation = Simulation::new(built.model, built.state, scheme, 0.004);
    let (capture, _) = Capture::new(&loaded, &simulation);
    let stop = AtomicBool::new(false);
    let plan = Plan {
        duration,
        fps: 60.0,
        checkpoint: 0.1,
        error: 0.0,
        threads,
        notes: Vec::new(),
        stop: &stop,
    };
    pipeline::run(simulation, capture, recorder, &plan, &mut |_| {})
}

#[test]
fn one_and_two_threads_give_the_same_bits() {
    // 61 × 61 particles are four chunks of the solver; half a second in, the cloth lies on the body.
    let states = [1, 2, 3].map(|threads| {
        let finished = run(&[], threads, 0.5, &mut MemoryRecorder::default()).unwrap();
        assert!(finished.simulation.contacts().list.len() > 100);
        finished.simulation.state().clone()
    });
    assert!(
        states[0] == states[1] && states[0] == states[2],
        "the state depends on the number of threads"
    );
}

/// A recorder that is slower than the simulation.
struct Slow(MemoryRecorder);

impl Recorder for Slow {
    fn record(&mut self, frame: &Frame) -> Result<(), RecordError> {
        std::thread::sleep(Duration::from_millis(60));
        self.0.record(frame)
    }

    fn finish(&mut self) -> Result<Recorded, RecordError> {
        self.0.finish()
    }
}

const SMALL: [&str; 1] = ["cloth.0.shape.sheet.cells=[24, 24]"];

#[test]
fn a_slow_recorder_changes_nothing() {
    let mut fast = MemoryRecorder::default();
    let mut slow = Slow(MemoryRecorder::default());
    let first = run(&SMALL, 2, 0.5, &mut fast).unwrap();
    let second = run(&SMALL, 2, 0.5, &mut slow).unwrap();
    assert!(first.simulation.state() == second.simulation.state());
    assert_eq!(fast.frames.len(), 31);
    assert_eq!(slow.0.frames.len(), 31);
    let positions = |frames: &[Frame]| {
        frames
            .iter()
            .map(|f| f.cloths[0].positions.clone())
            .collect::<Vec<_>>()
    };
    assert!(positions(&fast.frames) == positions(&slow.0.frames));
}

#[test]
fn frames_are_taken_at_their_times_and_checkpoints_when_due() {
    let mut recorder = MemoryRecorder::default();
    run(&SMALL, 1, 0.5, &mut recorder).unwrap();
    for (k, frame) in recorder.frames.iter().enumerate() {
        let due = k as f64 / 60.0;
        assert_eq!(frame.index, k as u64);
        assert!(
            frame.time >= due - 1e-9 && frame.time < due + 0.004,
            "frame {k} at {} s",
            frame.time
        );
    }
    let checkpoints: Vec<f64> = recorder
        .frames
        .iter()
        .filter_map(|f| f.checkpoint.as_ref())
        .map(|c| c.time)
        .collect();
    assert_eq!(checkpoints.len(), 6, "{checkpoints:?}");
    assert!(
        (checkpoints[5] - 0.5).abs() < 1e-12,
        "the last state has one: {checkpoints:?}"
    );
}

/// A recorder whose disk fills up.
struct Full(u64);

impl Recorder for Full {
    fn record(&mut self, frame: &Frame) -> Result<(), RecordError> {
        if frame.index < self.0 {
            Ok(())
        } else {
            Err(RecordError::Sink {
                message: "disk full".to_owned(),
            })
        }
    }

    fn finish(&mut self) -> Result<Recorded, RecordError> {
        Ok(Recorded::default())
    }
}

#[test]
fn a_failing_recorder_ends_the_run_with_its_error() {
    // An hour of simulated time: the test ends only because the run does.
    let error = run(&SMALL, 2, 3600.0, &mut Full(5)).unwrap_err();
    assert!(error.to_string().contains("disk full"), "{error}");
}

#[test]
fn an_impossible_step_is_explained_and_the_last_good_state_kept() {
    let mut run = simulation("drape", &[], Integrator::SymplecticEuler, 0.05);
    let diverged = (0..1000)
        .find_map(|_| run.step().err())
        .expect("a step of 0.05 s must diverge");
    assert!(run.state().first_non_finite().is_none());
    assert_eq!(diverged.step, run.stats().steps + 1);
    assert!(
        diverged.dt > diverged.stable_dt && diverged.account.spring.is_some(),
        "{diverged:?}"
    );
    let text = diverged.to_string();
    for word in [
        "step",
        "t = ",
        "particle",
        "spring",
        "strain",
        "stable step",
        "use --dt",
    ] {
        assert!(text.contains(word), "\"{word}\" is missing: {text}");
    }
}

#[test]
fn a_cloth_that_starts_inside_the_body_comes_out_without_an_explosion() {
    // 1 cm lower than the shoulders at their highest: part of the poncho starts inside.
    let changes = [
        "cloth.0.translate=[0, 1.44, 0]",
        "cloth.0.shape.sheet.cells=[40, 40]",
    ];
    let mut run = simulation("drape", &changes, IMPLICIT, 0.004);
    run.step().unwrap();
    assert!(
        run.contacts().list.len() > 20,
        "only {} contacts",
        run.contacts().list.len()
    );
    let mut fastest: f64 = 0.0;
    for _ in 0..250 {
        let step = run.step().unwrap();
        // What starts inside is led out within a quarter of a second.
        assert!(
            step.depth < 1e-3 || run.state().time < 0.26,
            "{} m deep at {} s",
            step.depth,
            run.state().time
        );
        fastest = run
            .state()
            .velocities
            .iter()
            .map(|v| v.length())
            .fold(fastest, f64::max);
    }
    // Falling from 1.44 m gives at most 5.3 m/s.
    assert!(fastest < 5.3, "thrown at {fastest} m/s");
    assert!(run.stats().strain < 0.101, "strain {}", run.stats().strain);
}

/// A sheet on a tilted plate sticks below the angle of friction and slides above it.
#[test]
fn friction_holds_below_its_angle_and_yields_above() {
    for (mu, slides) in [(0.9, false), (0.5, true)] {
        // tan 36° = 0.727. The plate is a large box turned about z.
        let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("incline");
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join(format!("incline-{mu}.toml"));
        std::fs::write(folder.join("box.obj"), BOX).unwrap();
        std::fs::write(&path, incline(mu)).unwrap();
        let mut run = simulation(path.to_str().unwrap(), &[], IMPLICIT, 0.002);
        let center = |run: &Simulation| {
            run.state().positions.iter().sum::<glam::DVec3>() / run.model().particles() as f64
        };
        crate::support::run_to(&mut run, 0.5);
        let (x0, t) = (center(&run), 0.5);
        let v0 =
            run.state().velocities.iter().sum::<glam::DVec3>() / run.model().particles() as f64;
        crate::support::run_to(&mut run, 1.0);
        let slid = (center(&run) - x0).length();
        let (sin, cos) = 36_f64.to_radians().sin_cos();
        if slides {
            let exact = v0.length() * t + 0.5 * 9.81 * (sin - mu * cos) * t * t;
            assert!(
                (slid / exact - 1.0).abs() < 0.02,
                "μ = {mu}: slid {slid} m, closed form {exact} m"
            );
        } else {
            assert!(slid < 1e-4, "μ = {mu}: crept {slid} m in half a second");
        }
    }
}

const BOX: &str = "v -9 -1 -9\nv 9 -1 -9\nv 9 0 -9\nv -9 0 -9\nv -9 -1 9\nv 9 -1 9\nv 9 0 9\nv -9 0 9\n\
    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

fn incline(mu: f64) -> String {
    format!(
        "name = \"incline\"\nduration = 1.0\n\
         [[cloth]]\nname = \"sheet\"\nrotate = [0, 0, 36]\ntranslate = [-0.00176, 0.00243, 0]\n\
         shape = {{ sheet = {{ size = [0.3, 0.3], cells = [10, 10] }} }}\n\
         material = {{ area_density = 0.2, stretch = 200 }}\n\
         damping = {{ stiffness = 0.01 }}\n\
         [[obstacle]]\nname = \"plate\"\nshape = {{ obj = {{ path = \"box.obj\" }} }}\nrotate = [0, 0, 36]\n\
         friction = {mu}\nthickness = 0.003\n"
    )
}
