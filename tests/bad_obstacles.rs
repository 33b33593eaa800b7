//! Obstacles that can't be right: each is refused with file or key, cause and remedy, or repaired and said.

use crate::support::fresh_folder;
use muslin::scene;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const CLOTH: &str = "name = \"bad\"\nduration = 0.02\n[[cloth]]\nname = \"sheet\"\ntranslate = [0.5, 1.1, 0.5]\n\
    shape = { sheet = { size = [0.5, 0.5], cells = [10, 10] } }\n\
    material = { area_density = 0.2, stretch = 100.0 }\ndamping = { stiffness = 0.001 }\n\
    [[obstacle]]\nname = \"body\"\n";

const CUBE: &str = "shape = { obj = { path = \"cube.obj\" } }\n";

const FACES: [[u32; 4]; 6] = [
    [4, 3, 2, 1],
    [5, 6, 7, 8],
    [1, 2, 6, 5],
    [2, 3, 7, 6],
    [3, 4, 8, 7],
    [4, 1, 5, 8],
];

/// OBJ text of a cube of some side (m), shifted along x, with some of its faces.
fn cube(side: f64, shift: f64, faces: &[[u32; 4]]) -> String {
    let mut text = String::new();
    let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]];
    for z in [0, 1] {
        for [x, y, _] in corners {
            let [x, y, z] = [x, y, z].map(|k| side * f64::from(k));
            writeln!(text, "v {} {y} {z}", x + shift).unwrap();
        }
    }
    for [a, b, c, d] in faces {
        writeln!(text, "f {a} {b} {c} {d}").unwrap();
    }
    text
}

/// A folder with a scene, a good cube, and frames of it that go 1 cm each.
fn folder(obstacle: &str) -> PathBuf {
    let folder = fresh_folder("bad-obstacles");
    fs::write(folder.join("scene.toml"), format!("{CLOTH}{obstacle}")).unwrap();
    fs::write(folder.join("cube.obj"), cube(1.0, 0.0, &FACES)).unwrap();
    fs::create_dir(folder.join("frames")).unwrap();
    for k in 0..8 {
        let shift = 0.01 * f64::from(k);
        fs::write(frame(&folder, k), cube(1.0, shift, &FACES)).unwrap();
    }
    folder
}

fn frame(folder: &Path, k: u32) -> PathBuf {
    folder.join(format!("frames/cube-{k:04}.obj"))
}

/// What building a folder's scene says: its notes, or why it can't be.
fn built(folder: &Path) -> Result<Vec<String>, String> {
    let path = folder.join("scene.toml").display().to_string();
    let built = scene::load(&path, &[]).and_then(|loaded| scene::build(&loaded));
    built
        .map(|built| built.notes)
        .map_err(|error| error.to_string())
}

fn says(what: &str, said: &str, words: &[&str]) {
    for word in words {
        assert!(said.contains(word), "{what}: \"{word}\" isn't in: {said}");
    }
}

fn refused(what: &str, folder: &Path, words: &[&str]) {
    says(what, &built(folder).expect_err(what), words);
}

const SEQUENCE: &str = "motion = { sequence = { dir = \"frames\", fps = 30.0 } }\n";

/// A cube that moves through ten frames.
fn whole() -> PathBuf {
    folder(&format!("{CUBE}{SEQUENCE}"))
}

#[test]
fn a_sequence_with_a_hole_or_a_jump_is_refused() {
    let good = built(&whole());
    assert!(good.is_ok(), "{good:?}");

    let one = whole();
    fs::remove_file(frame(&one, 3)).unwrap();
    let words = [
        "scene.toml:",
        "obstacle.0.motion.sequence.dir",
        "frame 3 is missing",
        "cube-0002.obj",
        "give one file for every number",
    ];
    refused("missing frame", &one, &words);
    exits_with_2(&one, &words);

    let one = whole();
    fs::write(frame(&one, 5), cube(1.0, 0.8, &FACES)).unwrap();
    refused(
        "jump",
        &one,
        &[
            "obstacle.0.motion.sequence.dir",
            "cube-0005.obj",
            "jumps by",
            "write the frames again",
        ],
    );

    let one = whole();
    fs::write(one.join("frames/notes.obj"), "").unwrap();
    refused(
        "no number",
        &one,
        &["notes.obj has no number", "name the frames like"],
    );
}

#[test]
fn a_sequence_of_other_meshes_is_refused() {
    let one = whole();
    fs::write(
        frame(&one, 4),
        cube(1.0, 0.04, &FACES).replace(
            "f 5 6 7 8",
            "v 0.5 0.5 1.5\nf 5 6 9\nf 6 7 9\nf 7 8 9\nf 8 5 9",
        ),
    )
    .unwrap();
    refused(
        "more vertices",
        &one,
        &[
            "cube-0004.obj",
            "is no frame of obstacle body",
            "write all frames from one mesh",
        ],
    );

    let one = whole();
    let other = cube(1.0, 0.04, &FACES).replace("f 5 6 7 8", "f 6 7 8 5");
    fs::write(frame(&one, 4), other).unwrap();
    refused(
        "other triangles",
        &one,
        &[
            "cube-0004.obj",
            "is no frame of obstacle body",
            "write all frames from one mesh",
        ],
    );
}

#[test]
fn keyframes_out_of_order_are_refused() {
    let keys = "motion = { keyframes = [{ t = 0.5 }, { t = 0.2, translate = [0.1, 0.0, 0.0] }] }\n";
    let words = [
        "scene.toml:",
        "obstacle.0.motion.keyframes.1.t",
        "order of time",
    ];
    refused("keyframes", &folder(&format!("{CUBE}{keys}")), &words);
}

#[test]
fn an_obstacle_inside_out_is_turned_and_an_open_one_refused() {
    let one = folder(CUBE);
    assert_eq!(built(&one), Ok(Vec::new()));
    let inward = FACES.map(|[a, b, c, d]| [d, c, b, a]);
    fs::write(one.join("cube.obj"), cube(1.0, 0.0, &inward)).unwrap();
    let notes = built(&one).unwrap();
    says(
        "inside out",
        &notes.join("\n"),
        &["cube.obj", "was inside out and was turned"],
    );
    fs::write(one.join("cube.obj"), cube(1.0, 0.0, &FACES[1..])).unwrap();
    let words = ["cube.obj", "isn't closed", "fill its holes"];
    refused("open", &one, &words);
    exits_with_2(&one, &words);
}

#[test]
fn millimetres_are_noticed_and_a_scale_proposed() {
    let one = folder(CUBE);
    fs::write(one.join("cube.obj"), cube(1700.0, 0.0, &FACES)).unwrap();
    let notes = built(&one).unwrap();
    says(
        "millimetres",
        &notes.join("\n"),
        &["obstacle body", "millimetres", "scale = 0.001", "1.7000 m"],
    );
}

#[test]
fn thicknesses_beyond_the_cells_are_said_or_refused() {
    let one = folder(&format!("{CUBE}thickness = 0.2\n"));
    let notes = built(&one).unwrap();
    says(
        "thick",
        &notes.join("\n"),
        &[
            "obstacle body",
            "thickness of 0.2 m",
            "of cloth",
            "closer fit",
        ],
    );
    let one = folder(&format!("{CUBE}[self_collision]\nthickness = 0.2\n"));
    refused(
        "layers",
        &one,
        &[
            "scene.toml:",
            "self_collision.thickness",
            "is 0.2 m, more than",
            "use ",
        ],
    );
}

#[test]
fn a_walk_that_cant_be_walked_is_refused() {
    let walk = |speed: f64| format!("motion = {{ walk = {{ speed = {speed:?} }} }}\n");
    let one = folder(&format!("{CUBE}{}", walk(1.2)));
    refused(
        "no mannequin",
        &one,
        &["obstacle.0.motion.walk", "mannequin"],
    );
    let body = "shape = { obj = { path = \"mannequin.obj\" } }\n";
    let one = folder(&format!("{body}{}", walk(9.0)));
    refused(
        "9 m/s",
        &one,
        &["scene.toml:", "obstacle.0.motion.walk", "9", "m/s"],
    );
    let one = folder(&format!(
        "shape = {{ sphere = {{ radius = 0.3 }} }}\n{}",
        walk(1.2)
    ));
    refused("sphere", &one, &["obstacle.0.motion.walk", "mannequin.obj"]);
}

#[test]
fn a_grid_on_what_deforms_is_refused() {
    let grid = "distance = { grid = 0.02 }\n";
    assert!(built(&folder(&format!("{CUBE}{grid}"))).is_ok());
    let one = folder(&format!("{CUBE}{grid}{SEQUENCE}"));
    refused(
        "grid",
        &one,
        &[
            "scene.toml:",
            "obstacle.0.distance",
            "keeps its shape",
            "use distance = \"exact\"",
        ],
    );
}

/// The program says the same and ends with 2.
fn exits_with_2(folder: &Path, words: &[&str]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_muslin"));
    let ended = command
        .args(["run", "scene.toml", "--no-save"])
        .current_dir(folder)
        .output();
    let ended = ended.unwrap();
    assert_eq!(ended.status.code(), Some(2), "{ended:?}");
    says(
        "the program",
        &String::from_utf8_lossy(&ended.stderr),
        words,
    );
}
