//! `--tolerance` and `--budget`: the error that comes out against the one that was asked for. Which
//! setting is chosen depends on the machine's mood; what is promised of it doesn't.

use crate::support::{folder, written};
use muslin::integrator::{Integrator, Linear};
use muslin::scene::LoadedScene;
use muslin::study::pick::{Goal, Picked, candidates, pick};
use muslin::study::{Distance, Outcome, Setting, Subject, Trial};
use serde_json::Value;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// A sheet whose pinned edge is swung up and aside.
const SWUNG: &str = r#"name = "swung"
duration = 0.4

[[cloth]]
name = "sheet"
shape = { sheet = { size = [0.4, 0.3], cells = [8, 6] } }
translate = [0.0, 1.0, 0.0]
material = { area_density = 0.2, stretch = 60.0 }
damping = { mass = 0.5, stiffness = 0.001 }

[[pin]]
cloth = "sheet"
select = { edge = "left" }
motion = { keyframes = [{ t = 0.0, translate = [0, 0, 0] }, { t = 0.3, translate = [0.1, 0.05, 0.1] }] }
"#;

/// A chain between pins that lets go of one of them.
const CHAIN: &str = r#"name = "chain"
duration = 0.6

[[cloth]]
name = "chain"
shape = { chain = { length = 0.5, links = 12 } }
translate = [0.0, 1.0, 0.0]
material = { linear_density = 0.05, stretch = 20.0 }
damping = { mass = 1.0, stiffness = 0.002 }

[[pin]]
cloth = "chain"
select = { corner = ["left"] }

[[pin]]
cloth = "chain"
select = { corner = ["right"] }
release = 0.1
"#;

/// A cloth that falls onto a slab with friction. It lies askew: where particles meet edges of the slab,
/// the last bit decides what happens.
const TABLE: &str = r#"name = "table"
duration = 0.3

[[cloth]]
name = "cloth"
shape = { sheet = { size = [0.4, 0.4], cells = [8, 8] } }
translate = [0.013, 0.23, 0.007]
rotate = [0.0, 9.0, 0.0]
material = { area_density = 0.3, stretch = 40.0 }
damping = { mass = 1.0, stiffness = 0.002 }

[[obstacle]]
name = "table"
shape = { obj = { path = "table.obj" } }
friction = 0.5
"#;

/// A slab with its top at y = 0.2.
const SLAB: &str = "v -0.1 0 -0.1\nv 0.1 0 -0.1\nv 0.1 0.2 -0.1\nv -0.1 0.2 -0.1\n\
    v -0.1 0 0.1\nv 0.1 0 0.1\nv 0.1 0.2 0.1\nv -0.1 0.2 0.1\n\
    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// A scene with the slab beside it.
fn scene(name: &str, text: &str) -> LoadedScene {
    let slab = folder(&format!("pick/{name}")).join("slab.obj");
    std::fs::write(&slab, SLAB).unwrap();
    let place = format!("{:?}", slab.display().to_string());
    written(name, &text.replace("\"table.obj\"", &place))
}

/// What is picked, and its error (m RMS) when that is largest, by a run in tiny steps and its check by
/// another scheme.
fn picked(loaded: LoadedScene, goal: f64, schemes: &[Integrator]) -> (Picked, f64) {
    let stop = AtomicBool::new(false);
    let duration = loaded.scene.duration;
    let name = loaded.scene.name.clone();
    let mut subject = Subject::new(loaded, duration, 1, 2, &stop).unwrap();
    let picked = pick(&mut subject, Goal::Tolerance(goal), schemes, &mut |_| {})
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    subject.patience = 60.0;
    let run = |integrator: Integrator, share: f64| {
        let dt = subject.fitting(share * subject.forecast.stable_dt(integrator));
        ran(&subject, Setting { integrator, dt })
    };
    let fine = run(Integrator::Rk4, 0.01);
    let check = run(Integrator::Verlet, 0.01);
    let apart = Distance::worst(&fine.states, &check.states).rms;
    assert!(
        apart < 0.2 * goal,
        "{name}: fine runs are {apart:.1e} m apart"
    );
    let chosen = ran(&subject, picked.chosen.setting);
    let error = Distance::worst(&chosen.states, &fine.states).rms;
    assert!(
        (error - picked.chosen.error).abs() <= picked.resolution + apart + 1e-6,
        "{name}, {goal} m: expected {:.2e} ± {:.1e} m, and {error:.2e} m came out",
        picked.chosen.error,
        picked.resolution
    );
    (picked, error)
}

fn ran(subject: &Subject<'_>, setting: Setting) -> Trial {
    let trial = subject.run(setting, &mut |_| {}).unwrap();
    assert_eq!(trial.outcome, Outcome::Completed, "{setting:?}");
    trial
}

#[test]
fn the_error_is_within_what_was_asked_for() {
    for (name, text) in [("swung", SWUNG), ("chain", CHAIN), ("table", TABLE)] {
        for goal in [1e-2, 1e-3] {
            let loaded = scene(&format!("pick-{name}-{goal}"), text);
            let schemes = candidates(&loaded.scene.solver);
            let (picked, error) = picked(loaded, goal, &schemes);
            let setting = picked.chosen.setting;
            assert!(
                error <= goal,
                "{name}, {goal} m: {error:.2e} m with {setting:?}"
            );
        }
    }
}

/// Where the step is all that there is to choose, the tolerance is used.
#[test]
fn a_given_scheme_is_turned_to_the_tolerance() {
    for scheme in [
        Integrator::ImplicitEuler(Linear::to(1e-6)),
        Integrator::Xpbd { iterations: 1 },
    ] {
        for goal in [1e-2, 2e-3] {
            let loaded = scene(&format!("pick-{}-{goal}", scheme.name()), SWUNG);
            let (picked, error) = picked(loaded, goal, &[scheme]);
            assert_eq!(picked.chosen.setting.integrator, scheme);
            assert!(
                (goal / 3.0..=goal).contains(&error),
                "{}, {goal} m: {error:.2e} m",
                scheme.name()
            );
        }
    }
}

/// Runs `muslin run swung.toml --no-save` in a folder, and gives exit code, messages and report.
fn muslin(folder: &Path, args: &str) -> (Option<i32>, String, Value) {
    std::fs::write(folder.join("swung.toml"), SWUNG).unwrap();
    let output = assert_cmd::cargo::cargo_bin_cmd!("muslin")
        .args("run swung.toml --no-save --report report.json".split(' '))
        .args(args.split_whitespace())
        .current_dir(folder)
        .timeout(Duration::from_secs(120))
        .output()
        .expect("muslin starts");
    let report = std::fs::read(folder.join("report.json")).unwrap_or_default();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let report = serde_json::from_slice(&report).unwrap_or(Value::Null);
    (output.status.code(), said, report)
}

#[test]
fn what_was_chosen_is_said_recorded_and_run_again() {
    let folder = folder("pick/again");
    let (code, said, first) = muslin(&folder, "--integrator bdf2 --tolerance 0.2cm");
    assert_eq!(code, Some(0), "{said}");
    let chosen = &first["chosen"];
    assert_eq!(chosen["asked"]["tolerance_m"], 0.002);
    assert_eq!(chosen["integrator"], "bdf2");
    assert_eq!(
        (&chosen["dt"], &chosen["integrator"]),
        (&first["dt"], &first["integrator"])
    );
    assert!(
        chosen["expected_error_m"].as_f64().unwrap() <= 0.002,
        "{chosen}"
    );
    assert!(chosen["expected_ms_per_frame"].as_f64().unwrap() > 0.0);
    assert!(chosen["calibration_s"].as_f64().unwrap() > 0.0);
    let (_, again) = said
        .split_once("the same again: ")
        .expect("flags to repeat it");
    let (code, said, second) = muslin(&folder, again.lines().next().unwrap());
    assert_eq!(code, Some(0), "{said}");
    assert!(second.get("chosen").is_none());
    for field in ["integrator", "dt", "steps", "energy", "strain"] {
        assert_eq!(first[field], second[field], "{field}");
    }
}

#[test]
fn a_budget_is_kept_in_mind() {
    let (code, said, report) = muslin(&folder("pick/budget"), "--budget 5ms");
    assert_eq!(code, Some(0), "{said}");
    let chosen = &report["chosen"];
    assert_eq!(chosen["asked"]["budget_ms"], 5.0);
    assert_eq!(chosen["dt"], report["dt"]);
    assert!(
        chosen["expected_error_m"].as_f64().unwrap() < 1e-3,
        "{chosen}"
    );
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = folder("pick/refused");
    for (args, words) in [
        ("--tolerance 1furlong", "1mm"),
        ("--tolerance -1mm", "1mm"),
        ("--budget 16fps", "16ms"),
        ("--tolerance 1mm --budget 16ms", "cannot be used with"),
        ("--tolerance 1mm --dt 0.001", "cannot be used with"),
        (
            "--tolerance 1mm --set solver.dt=0.001",
            "leave one of them out",
        ),
        (
            "--integrator euler --set cloth.0.damping.mass=0 --set cloth.0.damping.stiffness=0 --tolerance 1mm",
            "stable at no step",
        ),
        ("--budget 0.1us", "larger cells"),
    ] {
        let (code, said, report) = muslin(&folder, args);
        assert_eq!(code, Some(2), "{args}: {said}");
        assert!(said.contains(words), "{args}: no {words:?} in {said}");
        assert_eq!(report, Value::Null, "{args}");
    }
}
