//! The scenes of contact, audited at every recorded frame.

use crate::support::load;
use muslin::frame::{Audited, Capture};
use muslin::integrator::Integrator;
use muslin::scene;
use muslin::simulation::{Simulation, forecast, step_length};

/// A scene with changes, at its own step.
fn start(name: &str, changes: &[&str]) -> (Simulation, Capture) {
    let loaded = load(name, changes);
    let built = scene::build(&loaded).unwrap_or_else(|error| panic!("{error}"));
    let solver = &loaded.scene.solver;
    let integrator = Integrator::of(solver);
    let forecast = forecast(&built.model, &built.state);
    let dt = step_length(solver.dt, integrator, &forecast).unwrap();
    let run = Simulation::new(built.model, built.state, integrator, dt);
    let (capture, _) = Capture::new(&loaded, &run);
    (run, capture)
}

/// Runs for a time (s) with an audit at every one of `frames` equal times.
fn audited(name: &str, changes: &[&str], end: f64, frames: u32) -> (Simulation, Audited) {
    let (mut run, mut capture) = start(name, changes);
    for frame in 1..=frames {
        while run.state().time < end * f64::from(frame) / f64::from(frames) - 1e-9 {
            run.step()
                .unwrap_or_else(|diverged| panic!("{name}: {diverged}"));
        }
        capture.frame(&run, Vec::new(), false);
    }
    let found = capture.audited().unwrap();
    let stats = run.stats();
    println!(
        "{name} {changes:?}: {found:?}, {:?}, strain ever {:.3}",
        stats.impacts, stats.strain_ever
    );
    (run, found)
}

/// Nothing inside, nothing crossing, nothing missed; the ledger is closed.
fn assert_clean(name: &str, (run, found): &(Simulation, Audited)) {
    assert_eq!(found.bad_frames, 0, "{name}: {found:?}");
    assert_eq!(found.depth, 0.0, "{name}: {found:?}");
    assert_eq!(run.stats().impacts.missed, 0, "{name}");
    let balance = run.balance();
    assert!(balance.unexplained() < 1e-9, "{name}: {balance:?}");
}

#[test]
fn nothing_is_inside_a_body_at_rest() {
    let coarse = "cloth.0.shape.sheet.cells=[30, 30]";
    for (name, end) in [("drape", 1.0), ("drape-sphere", 1.0), ("table-cloth", 1.0)] {
        let run = audited(name, &[coarse], end, 60);
        assert_clean(name, &run);
        // Over a sharp edge contact has the last word.
        let most = if name == "table-cloth" { 0.11 } else { 0.1002 };
        assert!(
            run.0.stats().strain < most,
            "{name}: {}",
            run.0.stats().strain
        );
    }
}

/// The keyframes of `bullet` with its times as many times as long.
fn slower(times: f64) -> String {
    let keys = [0.0, 0.002, 0.004, 0.006].map(|t| t * times);
    let keys: Vec<String> = keys
        .iter()
        .zip([0.0, 0.2, 0.4, 0.6])
        .map(|(t, z)| format!("{{ t = {t:e}, translate = [0.0, 0.0, {z:?}] }}"))
        .collect();
    format!("obstacle.bullet.motion.keyframes=[{}]", keys.join(", "))
}

#[test]
fn a_bullet_leaves_no_hole_at_any_speed() {
    for (speed, times) in [(10.0, 10.0), (100.0, 1.0), (300.0, 1.0 / 3.0)] {
        let dt = format!("solver.dt={:e}", 2e-4 * times);
        let changes = [
            slower(times),
            dt,
            "cloth.0.shape.sheet.cells=[40, 40]".to_owned(),
        ];
        let changes = changes.each_ref().map(String::as_str);
        let run = audited("bullet", &changes, 0.008 * times, 40);
        assert_clean(&format!("bullet at {speed} m/s"), &run);
        // It took the middle of the sheet with it.
        let far = run
            .0
            .state()
            .positions
            .iter()
            .map(|x| x.z)
            .fold(0.0, f64::max);
        assert!(far > 0.2, "{speed} m/s: {far} m");
    }
}

#[test]
fn a_walk_stays_outside_its_garment() {
    let away = ["obstacle.mannequin.motion.walk.on_the_spot=false"];
    let run = audited("walking-mannequin", &away, 2.2, 132);
    assert_clean("walking-mannequin", &run);
    assert!(
        run.0.stats().strain_ever < 0.1002,
        "{:?}",
        run.0.stats().strain_ever
    );
    let (lowest, highest) = run
        .0
        .state()
        .positions
        .iter()
        .fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x.y), b.max(x.y)));
    assert!(
        lowest > 0.3 && highest > 1.4,
        "it hangs from {highest} m to {lowest} m"
    );
}

#[test]
fn layers_stay_apart() {
    let run = audited("stack", &[], 0.6, 36);
    assert_clean("stack", &run);
    for cells in ["[50, 15]", "[100, 30]"] {
        let cells = format!("cloth.0.shape.sheet.cells={cells}");
        let run = audited("twist", &[&cells], 3.0, 60);
        assert_clean("twist", &run);
        // Folds that are in the way of each other don't keep springs long.
        let most = run.0.stats().strain_ever;
        assert!(most < 0.2002, "{cells}: {most}");
    }
}

/// The same bits for one thread and for two.
#[test]
fn contact_has_the_same_bits_for_any_number_of_threads() {
    for (name, steps) in [
        ("drape-sphere", 40),
        ("table-cloth", 60),
        ("bullet", 40),
        ("stack", 40),
        ("twist", 150),
        ("walking-mannequin", 60),
        ("incline", 60),
    ] {
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| {
                let (mut run, _) = start(
                    name,
                    &["obstacle.mannequin.motion.walk.start=0.1"]
                        [..usize::from(name == "walking-mannequin")],
                );
                for _ in 0..steps {
                    run.step()
                        .unwrap_or_else(|diverged| panic!("{name}: {diverged}"));
                }
                let state = run.state();
                let all = state.positions.iter().chain(&state.velocities);
                all.flat_map(|x| x.to_array().map(f64::to_bits))
                    .collect::<Vec<_>>()
            })
        };
        assert!(run(1) == run(2), "{name}: other bits");
    }
}
