//! Parts of a scene that provably do nothing, and parts without which it is provably another.

use crate::support::{folder, load, written};
use muslin::integrator::Integrator;
use muslin::scene::{LoadedScene, Step};
use muslin::study::ablate::{Ablation, Finding, Threshold, ablate, table};
use muslin::study::{Distance, Setting, Subject};
use std::sync::atomic::AtomicBool;

const GRAVITY: f64 = 9.81;

static GO_ON: AtomicBool = AtomicBool::new(false);

/// A study of a scene up to its end, at four times.
fn subject(loaded: LoadedScene) -> (Subject<'static>, Setting) {
    let solver = &loaded.scene.solver;
    let Step::Seconds(dt) = solver.dt else {
        panic!("a test's scene gives its step");
    };
    let setting = Setting {
        integrator: Integrator::of(solver),
        dt,
    };
    let duration = loaded.scene.duration;
    let subject = Subject::new(loaded, duration, 4, 1, &GO_ON).unwrap();
    (subject, setting)
}

fn study(loaded: LoadedScene, tolerance: Option<f64>) -> Ablation {
    let (subject, setting) = subject(loaded);
    ablate(&subject, setting, tolerance, 1, &mut |_| {}).unwrap()
}

fn part<'a>(ablation: &'a Ablation, name: &str) -> &'a Finding {
    let found = ablation.parts.iter().find(|found| found.part.name == name);
    found.unwrap_or_else(|| panic!("{name} is not among {:?}", ablation.parts))
}

fn close(value: f64, exact: f64, share: f64, what: &str) {
    let error = (value / exact - 1.0).abs();
    assert!(error < share, "{what}: {value} against {exact}");
}

/// A strip that hangs straight down beside a floor that it never touches: 2.45 % is what its weight
/// could stretch it by, less than its limit.
const HANGING: &str = r#"
name = "hanging"
duration = 1.0

[[cloth]]
name = "strip"
shape = { sheet = { size = [0.1, 1.0], cells = [2, 20] } }
translate = [0.0, 1.5, 0.0]
rotate = [90.0, 0.0, 0.0]
bending = "edge-spring"
material = { area_density = 0.5, stretch = 100.0, bend = 1.0e-4 }
damping = { mass = 2.0, stiffness = 0.01 }

[[pin]]
cloth = "strip"
select = { edge = "near" }

[[obstacle]]
name = "floor"
shape = { obj = { path = "slab.obj" } }

[strain_limit]
max = 0.1

[solver]
dt = 0.01
linear_tolerance = 1e-12 # what a part that does nothing changes is what the solves leave
"#;

/// What is never touched or reached changes nothing, to the last bit, and what only holds angles that
/// are at rest changes what rounding does.
#[test]
fn parts_that_do_nothing_can_go() {
    let ablation = study(written("hanging", HANGING), Some(1e-9));
    for name in ["friction on floor", "contact with floor", "strain limit"] {
        let found = part(&ablation, name);
        assert_eq!(found.change, Distance::default(), "{name}");
        assert!(found.can_go(Threshold::Asked(0.0)), "{name}");
    }
    let bending = part(&ablation, "bending by hinges");
    assert!(bending.can_go(ablation.threshold), "{bending:?}");
    // It swings down to its weight's stretch, σ g ℓ²/2E = 24.5 mm at rest, by these two.
    for name in ["drag on all motion", "damping of deformation"] {
        let found = part(&ablation, name);
        assert!(found.change.rms > 1e-4, "{found:?}");
        assert!(!found.can_go(ablation.threshold), "{found:?}");
    }
    let all = ablation.together.as_ref().expect("four can go");
    assert!(all.change.rms < 1e-9, "{all:?}");
    // Friction goes with the floor.
    assert_eq!(
        table::flags(&all.part),
        "--set cloth.strip.bending=none --set strain_limit= --set obstacle.floor.friction=0 --set obstacle.floor="
    );
}

/// A mass on a spring comes to rest at ℓ (1 + m g/EA), or at its strain limit.
#[test]
fn a_strain_limit_that_is_reached_is_needed() {
    let text = r#"
name = "weight"
duration = 4.0

[[cloth]]
name = "spring"
shape = { chain = { length = 0.5, links = 1 } }
rotate = [0.0, 0.0, -90.0]
material = { linear_density = 0.4, stretch = 7.896 }
damping = { mass = 10.0 }

[[pin]]
cloth = "spring"
select = { corner = ["left"] }

[strain_limit]
max = 0.01

[solver]
dt = 0.005
"#;
    let ablation = study(written("weight", text), Some(0.001));
    let limit = part(&ablation, "strain limit");
    let exact = 0.5 * (0.1 * GRAVITY / 7.896 - 0.01);
    close(limit.end.largest, exact, 1e-3, "the mass sinks");
    let of_both = limit.end.largest / 2.0_f64.sqrt();
    close(limit.end.rms, of_both, 1e-12, "the pin stays");
    assert!(!limit.can_go(ablation.threshold));
    // At rest at its limit under drag or not: only how it got there differs.
    assert!(part(&ablation, "drag on all motion").end.rms < 1e-6);
}

/// Cloth that lies on a slope of 20°, less than the 21.8° at which friction gives way: without friction
/// it slides by g sin α t²/2, without the slope it falls by g t²/2, of implicit Euler g t (t + dt)/2.
#[test]
fn friction_and_contact_that_hold_cloth_are_needed() {
    let text = r#"
name = "slope"
duration = 0.4

[[cloth]]
name = "patch"
shape = { sheet = { size = [0.1, 0.1], cells = [4, 4] } }
translate = [0.001026060, 0.002819078, 0.0]
rotate = [0.0, 0.0, -20.0]
material = { area_density = 0.3, stretch = 500.0 }
damping = { stiffness = 0.002 }

[[obstacle]]
name = "slope"
shape = { obj = { path = "slab.obj" } }
rotate = [0.0, 0.0, -20.0]
friction = 0.4

[solver]
dt = 0.002
"#;
    let ablation = study(written("slope", text), Some(0.001));
    let falls = 0.5 * GRAVITY * 0.4 * 0.402;
    let contact = part(&ablation, "contact with slope");
    close(contact.end.rms, falls, 0.002, "falls");
    let friction = part(&ablation, "friction on slope");
    let slides = falls * 20.0_f64.to_radians().sin();
    close(friction.end.rms, slides, 0.01, "slides");
    for needed in [contact, friction] {
        assert!(!needed.can_go(ablation.threshold), "{needed:?}");
        assert_eq!(needed.change, needed.end);
    }
}

/// In free fall implicit Euler is ahead by g t dt/2, and by half of that at half the step.
#[test]
fn the_threshold_is_what_halving_the_step_does() {
    let changes = [
        "pin=[]",
        "cloth.0.start.stretch=[1, 1, 1]",
        "cloth.0.damping.mass=0",
        "duration=0.4",
        "solver.dt=0.01",
    ];
    let ablation = study(load("chain", &changes), None);
    let Threshold::TimeStep(length) = ablation.threshold else {
        panic!("{:?}", ablation.threshold);
    };
    close(length, GRAVITY * 0.4 * 0.01 / 4.0, 1e-6, "threshold");
    // It falls as it is: nothing deforms.
    let damping = part(&ablation, "damping of deformation");
    assert!(damping.change.rms < 1e-9 && damping.can_go(ablation.threshold));
}

/// Both kinds of springs go at once by one list, and whoever runs what the flags say finds the figures.
#[test]
fn what_it_says_is_found_again() {
    let changes = [
        "cloth.0.shape.sheet.cells=[8, 8]",
        "duration=0.4",
        "solver.dt=0.01",
    ];
    let loaded = load("hanging-cloth", &changes);
    let ablation = study(loaded.clone(), Some(10.0));
    let all = ablation.together.as_ref().expect("all can go up to 10 m");
    assert_eq!(
        table::flags(&all.part),
        "--set 'cloth.sheet.springs=[\"structural\"]' --set cloth.sheet.damping.mass=0 --set cloth.sheet.damping.stiffness=0"
    );
    let (full, setting) = subject(loaded.clone());
    let whole = full.run(setting, &mut |_| {}).unwrap();
    assert_eq!(ablation.parts.len(), 4);
    for found in ablation.parts.iter().chain([all]) {
        let (less, _) = subject(loaded.with(&found.part.changes).unwrap());
        let states = less.run(setting, &mut |_| {}).unwrap().states;
        assert_eq!(Distance::worst(&states, &whole.states), found.change);
        assert!(found.change.rms > 0.0, "{found:?}");
        for (a, b) in states.iter().zip(&whole.states) {
            assert!(Distance::between(a, b).rms <= found.change.rms);
        }
    }
}

/// `muslin check` cites the table that lies in its place, of its own scene only.
#[test]
fn check_cites_what_was_measured() {
    let folder = folder("ablate-check");
    let check = |args: &[&str]| {
        let output = assert_cmd::cargo::cargo_bin_cmd!("muslin")
            .args(["check", "scene.toml"])
            .args(args)
            .current_dir(&folder)
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let scene = folder.join("scene.toml");
    std::fs::write(&scene, HANGING).unwrap();
    let none = check(&[]);
    assert!(
        none.contains("needs: not measured; `muslin study scene.toml --ablate`"),
        "{none}"
    );
    let ablation = study(load(&scene.display().to_string(), &[]), Some(1e-9));
    std::fs::create_dir(folder.join("hanging-study")).unwrap();
    let file = folder.join("hanging-study/ablate.csv");
    std::fs::write(&file, table::csv(&ablation, "2026-11-22")).unwrap();
    let cited = check(&[]);
    for words in [
        "measured on 2026-11-22 over 1 s by implicit-euler at 10 ms",
        "can go: strain limit (moves the cloth by 0 mm RMS",
        "needed: drag on all motion (moves the cloth by ",
        "can go: all at once: bending by hinges, strain limit, ",
        "; --set strain_limit=)",
    ] {
        assert!(cited.contains(words), "{words} is missing:\n{cited}");
    }
    // What is recorded is no part of the scene; a comment neither.
    std::fs::write(&scene, format!("# a strip\n{HANGING}")).unwrap();
    assert!(check(&["--fps", "30"]).contains("can go: strain limit"));
    let other = check(&["--set", "strain_limit.max=0.2"]);
    assert!(
        other.contains("is of another version of this scene"),
        "{other}"
    );
    std::fs::write(&file, "nonsense").unwrap();
    assert!(check(&[]).contains("is no whole table"));
}
