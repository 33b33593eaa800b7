//! A scene pays only for what it models: parts that it doesn't ask for have no lists and take no time.

use crate::support::{IMPLICIT, fresh_folder, run_to, written};
use muslin::integrator::Integrator;
use muslin::scene::{self, LoadedScene};
use muslin::simulation::{Simulation, Stage};
use std::collections::BTreeMap;
use std::time::Duration;

/// A sheet held at a corner: springs, and what is added behind and before it.
fn sheet(head: &str, cloth: &str, tail: &str) -> LoadedScene {
    let text = format!(
        "name = \"bare\"\nduration = 1.0\n{head}\n\
         [[cloth]]\nname = \"sheet\"\nshape = {{ sheet = {{ size = [0.5, 0.5], cells = [8, 8] }} }}\n\
         material = {{ area_density = 0.2, stretch = 100.0, bend = 1.0e-4 }}\n{cloth}\n\
         [[pin]]\ncloth = \"sheet\"\nselect = {{ corner = [\"left-near\"] }}\n{tail}\n"
    );
    written("required", &text)
}

fn simulation(loaded: &LoadedScene, scheme: Integrator, dt: f64) -> Simulation {
    let built = scene::build(loaded).unwrap();
    Simulation::new(built.model, built.state, scheme, dt)
}

/// The parts after a few steps: nothing is built late either.
fn parts(loaded: &LoadedScene) -> BTreeMap<&'static str, usize> {
    let mut run = simulation(loaded, IMPLICIT, 0.004);
    run_to(&mut run, 0.02);
    run.memory().parts
}

const WEIGHTLESS: &str = "gravity = [0.0, 0.0, 0.0]";

/// A closed box below the sheet.
fn obstacle() -> String {
    let path = fresh_folder("required-box").join("box.obj");
    let text = "v -1 -1 -1\nv 1 -1 -1\nv 1 0 -1\nv -1 0 -1\nv -1 -1 1\nv 1 -1 1\nv 1 0 1\nv -1 0 1\n\
        f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    std::fs::write(&path, text).unwrap();
    format!(
        "[[obstacle]]\nname = \"box\"\ntranslate = [0.0, -0.1, 0.0]\nshape = {{ obj = {{ path = \"{}\" }} }}",
        path.display()
    )
}

#[test]
fn a_bare_scene_has_nothing_else_and_each_part_adds_its_own() {
    let bare = parts(&sheet(WEIGHTLESS, "", ""));
    let names: Vec<_> = bare.keys().copied().collect();
    assert_eq!(names, ["particles", "shear", "structural", "triangles"]);
    let bend = "springs = [\"structural\", \"shear\", \"bend\"]";
    let motion = "motion = { keyframes = [{ t = 0.0 }, { t = 1.0, translate = [0.1, 0.0, 0.0] }] }";
    for (part, head, cloth, tail) in [
        ("gravity", "", "", ""),
        ("bend", WEIGHTLESS, bend, ""),
        ("edge_spring", WEIGHTLESS, "bending = \"edge-spring\"", ""),
        (
            "discrete_shell",
            WEIGHTLESS,
            "bending = \"discrete-shell\"",
            "",
        ),
        ("mass_damping", WEIGHTLESS, "damping = { mass = 1.0 }", ""),
        (
            "stiffness_damping",
            WEIGHTLESS,
            "damping = { stiffness = 0.001 }",
            "",
        ),
        ("strain_limit", WEIGHTLESS, "", "[strain_limit]\nmax = 0.1"),
        ("contact", WEIGHTLESS, "", &obstacle()),
        ("pins", WEIGHTLESS, "", motion),
        ("pins", WEIGHTLESS, "", "release = 0.5"),
    ] {
        let mut with = parts(&sheet(head, cloth, tail));
        assert!(
            with.remove(part).is_some_and(|bytes| bytes > 0),
            "no {part}"
        );
        assert_eq!(with, bare, "{part} brings more than itself");
    }
}

/// Wall time of strain limiting, of finding contacts, and of answering them.
fn corrections(loaded: &LoadedScene) -> [Duration; 3] {
    let mut run = simulation(loaded, IMPLICIT, 0.004);
    run_to(&mut run, 0.02);
    [Stage::LimitStrain, Stage::DetectContacts, Stage::Respond].map(|s| run.stats().times.of(s))
}

#[test]
fn stages_that_a_scene_has_no_use_for_take_no_time() {
    let limit = "[strain_limit]\nmax = 0.1\n";
    let both = format!("{limit}{}", obstacle());
    for (tail, runs) in [
        ("", [false; 3]),
        (limit, [true, false, false]),
        // Nothing touches the box: there is nothing to answer.
        (&obstacle(), [false, true, false]),
        (&both, [true, true, false]),
    ] {
        let spent = corrections(&sheet("", "", tail));
        assert_eq!(
            spent.map(|time| time > Duration::ZERO),
            runs,
            "{tail}: {spent:?}"
        );
    }
}
