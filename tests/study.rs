//! The study: its reference, its rows, and the program around it.

use crate::support::{distance, fresh_folder, load, run_to, simulation, written};
use muslin::integrator::Integrator;
use muslin::study::{
    Dials, MARGIN, Outcome, Reference, Setting, StudyError, Subject, front, ladder, reference,
    sweep, table,
};
use std::sync::atomic::{AtomicBool, Ordering};

static GO: AtomicBool = AtomicBool::new(false);

/// `hanging-cloth` with few cells: runs of a tenth of a second.
fn small() -> Subject<'static> {
    let loaded = load("hanging-cloth", &["cloth.0.shape.sheet.cells=[8, 8]"]);
    Subject::new(loaded, 0.5, 3, 1, &GO).unwrap()
}

fn found(subject: &mut Subject<'_>) -> Reference {
    reference(subject, 1e-6, 20.0, &mut |_| {}).unwrap_or_else(|error| panic!("{error}"))
}

fn schemes(names: &[&str]) -> Dials {
    Dials {
        schemes: names.iter().map(|name| name.parse().unwrap()).collect(),
        ..Dials::default()
    }
}

/// The error that a study reports is the distance to any sufficiently fine run, by any scheme.
#[test]
fn the_reference_is_as_exact_as_it_says() {
    let mut subject = small();
    let reference = found(&mut subject);
    assert!(
        reference.converged && reference.cut.is_none(),
        "{reference:?}"
    );
    let changes = ["cloth.0.shape.sheet.cells=[8, 8]"];
    let mut fine = simulation(
        "hanging-cloth",
        &changes,
        Integrator::Verlet,
        0.5 / 20_000.0,
    );
    run_to(&mut fine, 0.5);
    let last = reference.states.last().unwrap();
    let apart = distance(last, &fine.state().positions[..last.len()]);
    println!("{:.2e} m, says {:.2e} m", apart, reference.error.rms);
    assert!(
        apart < 2.0 * reference.error.rms + 1e-7,
        "{apart} m from a finer run, but it says {} m",
        reference.error.rms
    );
}

/// Errors fall at the schemes' orders, and what costs more without being better is marked.
#[test]
fn errors_fall_at_the_observed_orders() {
    let mut subject = small();
    let reference = found(&mut subject);
    let dials = schemes(&["symplectic-euler", "implicit-euler", "bdf2", "xpbd"]);
    let settings = ladder::settings(&subject, &dials).unwrap();
    let rows = sweep(&subject, &reference, &settings, &mut |_| {}).unwrap();
    for (name, list) in front::series(&rows) {
        let order = front::observed_order(&list).unwrap_or_else(|| panic!("{name}: no order"));
        println!("{name}: order {order:.2}");
        let expected = if name == "bdf2" { 2.0 } else { 1.0 };
        assert!((order - expected).abs() < 0.25, "{name}: order {order}");
    }
    let beyond = &rows[0];
    assert!(
        matches!(beyond.outcome, Outcome::Diverged(_)) && beyond.rms().is_none(),
        "1.8 times the stable step: {:?}",
        beyond.outcome
    );
    for row in &rows {
        let better = rows.iter().any(|other| {
            other.at_most() <= row.at_most()
                && other.seconds_per_second < (1.0 - front::FASTER) * row.seconds_per_second
        });
        let failed = row.outcome != Outcome::Completed;
        assert_eq!(front::is_dominated(row, &rows), better || failed, "{row:?}");
        // Nothing below what the reference can tell is printed.
        assert!(
            row.rms()
                .is_none_or(|rms| rms >= MARGIN * reference.error.rms)
        );
    }
    let csv = table::csv(&subject, &rows);
    assert!(csv.starts_with(table::HEADER) && csv.lines().count() == rows.len() + 1);
}

/// Times differ from run to run, errors don't, on any number of threads.
#[test]
fn errors_are_the_same_every_time() {
    let setting = Setting {
        integrator: Integrator::SymplecticEuler,
        dt: 0.5 / 2000.0,
    };
    let states = [1, 2].map(|threads| {
        let loaded = load("hanging-cloth", &["cloth.0.shape.sheet.cells=[30, 30]"]);
        let subject = Subject::new(loaded, 0.1, 2, threads, &GO).unwrap();
        let setting = Setting {
            dt: subject.fitting(setting.dt),
            ..setting
        };
        let [a, b] = [(); 2].map(|()| subject.measure(setting).unwrap().states);
        assert!(a == b && a.len() == 2);
        a
    });
    assert!(states[0] == states[1], "1 and 2 threads differ");
}

/// A pencil on its tip: two masses on a rod that stands upright falls to the side that rounding picks.
/// Here: a strip that is pressed together, and buckles.
#[test]
fn what_no_step_determines_is_not_compared() {
    let loaded = written(
        "pressed",
        r#"
name = "pressed"
duration = 0.5
gravity = [0.0, 0.0, 0.0]
[[cloth]]
name = "strip"
shape = { sheet = { size = [1.0, 0.2], cells = [40, 8], diagonals = "alternating" } }
material = { area_density = 0.1, stretch = 200.0 }
[[pin]]
cloth = "strip"
select = { edge = "left" }
motion = { keyframes = [{ t = 0.0, translate = [0, 0, 0] }, { t = 0.3, translate = [0.5, 0.02, 0.03] }] }
[[pin]]
cloth = "strip"
select = { edge = "right" }
"#,
    );
    let mut subject = Subject::new(loaded, 0.5, 5, 2, &GO).unwrap();
    let mut said = Vec::new();
    let reference = reference(&mut subject, 1e-6, 6.0, &mut |line| said.push(line));
    match reference {
        Ok(reference) => {
            let cut = reference
                .cut
                .unwrap_or_else(|| panic!("nothing was cut: {said:?}"));
            assert!(subject.duration < cut.time && cut.error > 1e-3, "{cut:?}");
            assert_eq!(reference.states.len() as u32, subject.times);
            let text = table::markdown(&subject, &reference, &[]);
            assert!(text.contains("Nothing is compared from"), "{text}");
        }
        Err(StudyError::NoReference { reason, .. }) => {
            assert!(reason.contains("depends on every detail"), "{reason}");
        }
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn a_study_without_sense_says_what_to_do() {
    let subject = small();
    let fault = |dials: Dials| ladder::settings(&subject, &dials).unwrap_err().to_string();
    let steps = |steps: Vec<f64>| Dials {
        steps,
        ..Dials::default()
    };
    assert!(fault(steps(vec![0.001, -1.0])).contains("--steps -1"));
    assert!(fault(steps(vec![1.0])).contains("longer --duration"));
    let tolerances = Dials {
        tolerances: vec![f64::NAN],
        ..Dials::default()
    };
    assert!(fault(tolerances).contains("--tolerance NaN"));
    let none = Dials {
        iterations: vec![0],
        ..Dials::default()
    };
    assert!(fault(none).contains("at least one"));
    // Undamped, explicit Euler is stable at no step.
    let still = ["cloth.0.damping={}", "cloth.0.shape.sheet.cells=[4, 4]"];
    let undamped = Subject::new(load("hanging-cloth", &still), 0.5, 3, 1, &GO).unwrap();
    let error = ladder::settings(&undamped, &schemes(&["euler"])).unwrap_err();
    assert!(
        error.to_string().contains("euler is stable at no step"),
        "{error}"
    );
}

/// Ctrl-C keeps what is finished.
#[test]
fn a_stopped_study_keeps_its_rows() {
    static STOP: AtomicBool = AtomicBool::new(false);
    let loaded = load("hanging-cloth", &["cloth.0.shape.sheet.cells=[8, 8]"]);
    let mut subject = Subject::new(loaded, 0.2, 2, 1, &STOP).unwrap();
    let reference = found(&mut subject);
    let settings = ladder::settings(&subject, &schemes(&["implicit-euler"])).unwrap();
    let rows = sweep(&subject, &reference, &settings, &mut |rows| {
        STOP.store(rows.len() == 2, Ordering::Relaxed);
    });
    let rows = rows.unwrap();
    assert_eq!(rows.len(), 2, "of {}", settings.len());
    assert_eq!(rows[1].outcome, Outcome::Completed);
}

#[test]
fn the_program_writes_a_folder() {
    let out = fresh_folder("study").join("results");
    let study = |more: &[&str]| {
        assert_cmd::Command::new(env!("CARGO_BIN_EXE_muslin"))
            .args(["study", "hanging-cloth", "--duration", "0.1"])
            .args(["--set", "cloth.0.shape.sheet.cells=[6, 6]", "--out"])
            .arg(&out)
            .args(more)
            .assert()
    };
    let quick = [
        "--schemes",
        "verlet,implicit-euler",
        "--steps",
        "0.002,0.001",
        "--times",
        "2",
    ];
    study(&quick).success();
    for file in ["study.csv", "study.md", "work-precision.png"] {
        assert!(
            out.join(file).metadata().is_ok_and(|m| m.len() > 100),
            "{file}"
        );
    }
    assert_eq!(out.join("study.rrd").exists(), cfg!(feature = "rerun"));
    let csv = std::fs::read_to_string(out.join("study.csv")).unwrap();
    let errors = |csv: &str| -> Vec<String> {
        let rows = csv
            .lines()
            .skip(1)
            .map(|row| row.split(',').collect::<Vec<_>>());
        rows.map(|row| [&row[..3], &row[7..10]].concat().join(","))
            .collect()
    };
    assert_eq!(csv.lines().count(), 5, "{csv}");
    study(&quick).success();
    let again = std::fs::read_to_string(out.join("study.csv")).unwrap();
    assert_eq!(errors(&csv), errors(&again), "errors of two studies");
    for (wrong, remedy) in [
        (["--schemes", "verlett"], "symplectic-euler"),
        (["--steps", "-0.1"], "positive number"),
        (["--times", "0"], "at one time at least"),
        (["--set", "cloth.0.material.stretch=-1"], "stretch"),
    ] {
        let failed = study(&wrong).code(2);
        let text = String::from_utf8_lossy(&failed.get_output().stderr).into_owned();
        assert!(text.contains(remedy), "{wrong:?}: {text}");
    }
}
