//! The dial of contact: what its settings let through, and what the program says of them.

use crate::support::{fresh_folder, load, written};
use glam::DVec3;
use muslin::integrator::Integrator;
use muslin::mesh;
use muslin::scene::LoadedScene;
use muslin::study::contact::{CELLS, Contact, Dial, Measured, contact, table};
use muslin::study::{Setting, Subject};
use std::sync::atomic::AtomicBool;

static GO_ON: AtomicBool = AtomicBool::new(false);

fn study(loaded: LoadedScene, dt: f64) -> (Subject<'static>, Contact) {
    let setting = Setting {
        integrator: Integrator::of(&loaded.scene.solver),
        dt,
    };
    let duration = loaded.scene.duration;
    let subject = Subject::new(loaded, duration, 4, 1, &GO_ON).unwrap();
    let study = contact(&subject, setting, 2, &mut |_| {}).unwrap();
    (subject, study)
}

fn measured(study: &Contact, cell: Option<f64>, ccd: bool) -> &Measured {
    let dial = Dial { cell, ccd };
    let row = study.rows.iter().find(|row| row.dial == dial);
    let row = row.unwrap_or_else(|| panic!("{dial:?} is not among {:?}", study.rows));
    row.came
        .as_ref()
        .unwrap_or_else(|failed| panic!("{dial:?}: {failed:?}"))
}

/// A sheet of wide cells falls over the edges of a box, 2.5 mm cells around which take 600 MB; a ball
/// beside it, that it doesn't touch.
const EDGES: &str = r#"
name = "edges"
duration = 0.4

[[cloth]]
name = "sheet"
shape = { sheet = { size = [0.8, 0.8], cells = [8, 8] } }
translate = [0.93, 0.01, 0.93]
rotate = [0.0, 20.0, 0.0]
material = { area_density = 0.25, stretch = 500.0 }
damping = { stiffness = 0.004 }

[[obstacle]]
name = "box"
shape = { obj = { path = "slab.obj" } }
thickness = 0.001

[[obstacle]]
name = "ball"
shape = { sphere = { center = [5.0, 0.0, 0.0], radius = 0.1 } }
"#;

/// Particles alone don't hold edges back from a box's; continuous detection does, by any distances.
#[test]
fn continuous_detection_and_nothing_else_keeps_edges_out() {
    let (subject, study) = study(written("edges", EDGES), 0.004);
    for row in &study.rows {
        let Ok(came) = &row.came else {
            assert_eq!(row.dial.cell, Some(0.0025), "{row:?}");
            continue;
        };
        let found = &came.audited;
        assert!(found.frames > 20, "{found:?}");
        if row.dial.ccd {
            assert_eq!(
                (found.depth, found.crossings, came.missed),
                (0.0, 0, 0),
                "{row:?}"
            );
        } else {
            assert!(found.crossings > 0, "{row:?}");
        }
        assert_eq!(
            came.grids.len(),
            usize::from(row.dial.cell.is_some()),
            "the box alone"
        );
    }
    let exact = measured(&study, None, true);
    assert_eq!(exact.distance.rms, 0.0, "from itself");
    assert!(measured(&study, None, false).distance.rms > study.halved.rms);
    // What can't be made is explained, and costs no other row.
    assert_eq!(study.rows.len(), 8);
    let refused = study.rows.iter().filter_map(|row| row.came.as_ref().err());
    for failed in refused.clone() {
        assert_eq!(failed.name, "refused");
        assert!(
            failed.why.contains("MB") && failed.why.contains("cells of"),
            "{failed:?}"
        );
    }
    assert_eq!(refused.count(), 2);
    let text = table::markdown(&subject, &study);
    for words in [
        "the grid of box, not of ball",
        "| exact | on | 0 | 0 | 0 | 0 | 0 | 0 |",
        "refused: ",
        "- the grid of 10 mm of box is off by",
    ] {
        assert!(text.contains(words), "{words} is missing:\n{text}");
    }
}

/// A particle that falls farther in a step than its thickness is stopped where its grid says that the
/// surface is: so it is no deeper than the grid is off, and by exact distances not inside at all.
#[test]
fn depth_on_a_grid_is_bounded_by_the_error_of_the_grid() {
    let folder = fresh_folder("contact-ball");
    let ball = mesh::write_obj(&mesh::ball(DVec3::ZERO, 0.2), "a ball");
    std::fs::write(folder.join("ball.obj"), ball).unwrap();
    let scene = r#"
name = "ball"
duration = 0.2

[[cloth]]
name = "sheet"
shape = { sheet = { size = [0.6, 0.6], cells = [24, 24] } }
translate = [0.0, 0.3, 0.0]
material = { area_density = 0.2, stretch = 500.0 }
damping = { stiffness = 0.004 }

[[obstacle]]
name = "ball"
shape = { obj = { path = "ball.obj" } }
thickness = 0.001
"#;
    let file = folder.join("scene.toml");
    std::fs::write(&file, scene).unwrap();
    let (_, study) = study(load(&file.display().to_string(), &[]), 0.004);
    let exact = measured(&study, None, false).audited;
    assert_eq!((exact.depth, exact.inside), (0.0, 0), "{exact:?}");
    for cell in CELLS {
        let came = measured(&study, Some(cell), false);
        let error = came.grids[0].1.largest;
        let depth = came.audited.depth;
        assert!(depth > 0.0, "{cell}: nothing was at stake");
        assert!(depth <= error, "{cell}: {depth} against {error}");
    }
}

/// Every row is in the table with as many fields as the head, and numbers come back as they were.
#[test]
fn the_table_has_every_row_and_digit() {
    let changes = ["cloth.0.shape.sheet.cells=[8, 8]", "duration=0.1"];
    let (subject, study) = study(load("drape-sphere", &changes), 0.004);
    let csv = table::csv(&subject, &study);
    let mut lines = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let head = lines.next().unwrap();
    let lines: Vec<_> = lines.collect();
    // A sphere takes no grid.
    assert_eq!((lines.len(), study.rows.len()), (2, 2), "{csv}");
    for (line, row) in lines.iter().zip(&study.rows) {
        assert_eq!(line.len(), head.len(), "{csv}");
        let at = |name: &str| line[head.iter().position(|known| *known == name).unwrap()];
        let came = row.came.as_ref().unwrap();
        assert_eq!(
            (at("distance"), at("cell_m"), at("outcome")),
            ("exact", "", "completed")
        );
        assert_eq!(at("ccd"), row.dial.ccd.to_string());
        for (name, value) in [
            ("depth_m", came.audited.depth),
            ("rms_m", came.distance.rms),
            ("largest_m", came.distance.largest),
            ("detect_s", came.time.stages[0]),
            ("respond_s", came.time.stages[1]),
            ("impacts_s", came.time.stages[2]),
            ("contact_share", came.time.share(study.setting.dt)),
            ("seconds_per_second", came.time.seconds_per_second),
            ("halved_rms_m", study.halved.rms),
        ] {
            assert_eq!(at(name).parse(), Ok(value), "{name}");
        }
    }
    let text = table::markdown(&subject, &study);
    assert!(
        text.contains("No obstacle is an OBJ that keeps its shape"),
        "{text}"
    );
}

/// A setting is dominated by one that is clearly faster and in nothing worse; distances below what halving
/// the step does don't tell settings apart, faults of contact do.
#[test]
fn slower_and_not_better_is_dominated() {
    let changes = ["cloth.0.shape.sheet.cells=[4, 4]", "duration=0.02"];
    let (_, mut study) = study(load("drape-sphere", &changes), 0.004);
    let verdicts = |study: &Contact| {
        let verdicts = study.rows.iter().map(|row| study.is_dominated(row));
        verdicts.collect::<Vec<_>>()
    };
    study.halved.rms = 0.01;
    for (row, seconds) in study.rows.iter_mut().zip([2.0, 1.0]) {
        row.came.as_mut().unwrap().time.seconds_per_second = seconds;
    }
    let other = |study: &mut Contact, change: &dyn Fn(&mut Measured)| {
        change(study.rows[1].came.as_mut().unwrap());
    };
    other(&mut study, &|came| came.distance.rms = 0.009);
    assert_eq!(verdicts(&study), [true, false]);
    other(&mut study, &|came| came.distance.rms = 0.011);
    assert_eq!(verdicts(&study), [false, false]);
    other(&mut study, &|came| came.distance.rms = 0.009);
    other(&mut study, &|came| came.audited.crossings = 1);
    assert_eq!(verdicts(&study), [false, false]);
    other(&mut study, &|came| came.audited.crossings = 0);
    other(&mut study, &|came| came.time.seconds_per_second = 1.9); // the machine's mood
    assert_eq!(verdicts(&study), [false, false]);
}

#[test]
fn the_program_writes_the_table_and_refuses_a_scene_without_contact() {
    let folder = fresh_folder("contact-program");
    let study = |args: &[&str]| {
        assert_cmd::cargo::cargo_bin_cmd!("muslin")
            .arg("study")
            .args(args)
            .current_dir(&folder)
            .assert()
    };
    let small = [
        "--set",
        "cloth.0.shape.sheet.cells=[8, 8]",
        "--duration",
        "0.1",
    ];
    for _ in 0..2 {
        let said = study(&[&["drape-sphere", "--contact"], &small[..]].concat()).success();
        let said = String::from_utf8_lossy(&said.get_output().stdout).into_owned();
        assert!(said.contains("| exact | off |"), "{said}");
        let csv = std::fs::read_to_string(folder.join("drape-sphere-study/contact.csv")).unwrap();
        assert_eq!(csv.lines().count(), 3, "{csv}");
        assert!(csv.starts_with(table::HEADER), "{csv}");
    }
    for (args, words) in [
        (&["hanging-cloth", "--contact"][..], "has no obstacles"),
        (&["drape", "--contact", "--ablate"], "cannot be used with"),
        (
            &["drape", "--contact", "--cells", "10,20"],
            "cannot be used with",
        ),
        (
            &["drape", "--contact", "--stability"],
            "cannot be used with",
        ),
    ] {
        let failed = study(args).code(2);
        let text = String::from_utf8_lossy(&failed.get_output().stderr).into_owned();
        assert!(text.contains(words), "{args:?}: {text}");
    }
    assert!(!folder.join("hanging-cloth-study").exists());
}
