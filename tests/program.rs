//! The program as a user meets it: exit codes, messages, and the files that it writes or spares.

use crate::support;
use crate::support::program::{
    contents, muslin, muslin_succeeds, read, refused, report, says, write,
};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// A scene of 81 particles; the tests of bad input change one place of it each.
const SMALL: &str = r#"name = "small"
duration = 0.05

[[cloth]]
name = "sheet"
shape = { sheet = { size = [0.5, 0.5], cells = [8, 8] } }
translate = [0.0, 1.0, 0.0]

[cloth.material]
area_density = 0.2
stretch = 100.0

[cloth.damping]
mass = 0.5
stiffness = 0.001

[[pin]]
cloth = "sheet"
select = { edge = "left" }

[solver]
dt = 0.004
"#;

/// Appended to [`SMALL`]: an obstacle whose path stands in line 26.
const BODY: &str = r#"
[[obstacle]]
name = "body"
shape = { obj = { path = "body.obj" } }
"#;

/// A closed cube of four-sided polygons in two objects, with indices from both ends.
const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    o ends\nf 4 3 2 1\nf -4 -3 -2 -1\n\
    o sides\nf 1 2 6 5\nf 2/1 3/2 7/3 6/4\nf 3 4 8 7\nf 4 1 5 8\n";

/// An empty folder for the test of that name.
fn folder(test: &str) -> PathBuf {
    support::folder(&format!("program/{test}"))
}

/// `text` with one place of it changed.
fn changed(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "{from:?} must occur once");
    text.replace(from, to)
}

/// Runs a scene that must be refused although there are older results, which it must spare.
fn scene_refused(folder: &Path, scene: &str, options: &str, words: &[&str]) {
    write(folder, "old.rrd", "an older recording");
    write(folder, "old.json", "an older report");
    let args = format!("{scene} {options} --save old.rrd --report old.json");
    refused(folder, &args, words);
}

/// What is written in [`SMALL`] => instead of what => line | words that are said.
const BAD_SCENES: &str = r#"
duration = 0.05 => duration = 0.05\ngravitation = 9.81 => 3 | unknown field `gravitation` | `gravity`
stretch = 100.0 => strech = 100.0 => 11 | unknown field `strech` | `stretch`
duration = 0.05 => duration = "0.05 s" => 2 | invalid type: string "0.05 s" | expected f64
duration = 0.05 => duration = = 4 => 2 | scene.toml
area_density = 0.2 => area_density = -0.2 => 10 | cloth.0.material.area_density | is -0.2 | above 0
area_density = 0.2 => area_density = 0.0 => 10 | cloth.0.material.area_density | is 0; | above 0
area_density = 0.2 => area_density = nan => 10 | cloth.0.material.area_density | is NaN | finite
area_density = 0.2\n => \n => 9 | cloth.0.material: | area_density is missing
dt = 0.004 => dt = 0.0 => 22 | solver.dt | is 0; | above 0
dt = 0.004 => dt = -1 => 22 | solver.dt | is -1; | above 0
dt = 0.004 => dt = "fast" => 22 | string "fast" | a number of seconds or "auto"
dt = 0.004 => integrator = "rk9" => 22 | `rk9` | `symplectic-euler` | `implicit-euler`
cells = [8, 8] => cells = [0, 8] => 6 | cloth.0.shape.sheet.cells | at least 1
cells = [8, 8] => cells = [90000, 90000] => 6 | asks for 8100000000 cells | at most
cells = [8, 8] => cells = [8, 8], opening = { center = [0.0, 0.0], radius = 0.3 } => 6 | opening of radius 0.3 m | make it smaller
cloth = "sheet" => cloth = "skirt" => 18 | pin.0.cloth | no cloth "skirt" | name of a [[cloth]]
edge = "left" => box = [[5, 5, 5], [6, 6, 6]] => 19 | pin.0.select | selects no particle | make the box larger
edge = "left" => vertices = [81] => 19 | pin.0.select | no vertex 81 | has 81, counted from 0
[cloth.material] => springs = ["structural", "bend"]\n[cloth.material] => 10 | cloth.0.material: | bend is missing | such as 1.0e-5
stretch = 100.0 => stretch = -100.0 => 11 | cloth.0.material.stretch | is -100 | above 0
stretch = 100.0 => stretch = inf => 11 | cloth.0.material.stretch | is inf | finite
stretch = 100.0\n => \n => 9 | cloth.0.material: | stretch is missing
stretch = 100.0 => stretch = 100.0\nspring_constant = 5.0 => 12 | cloth.0.material.spring_constant | remove one
stretch = 100.0 => stretch = 100.0\nbend = -1.0e-5 => 12 | cloth.0.material.bend | is -0.00001 | 0 or more
stretch = 100.0 => stretch = 100.0\nbend = nan => 12 | cloth.0.material.bend | is NaN | finite
area_density = 0.2 => density = 0.2 => 10 | cloth.0.material.density | mass is given by area_density
[cloth.material] => bending = "edge-spring"\n[cloth.material] => 10 | cloth.0.material: | bend is missing: bending needs | such as 1.0e-5
[cloth.material] => bending = "stiff"\n[cloth.material] => 9 | `stiff` | `edge-spring` | `discrete-shell`
[cloth.material] => springs = ["shear"]\n[cloth.material] => 9 | cloth.0.springs | "structural"
[cloth.material] => springs = ["structural", "zero-length"]\n[cloth.material] => 9 | cloth.0.springs | remove one
[cloth.material] => springs = ["zero-length"]\n[cloth.material] => 9 | cloth.0.springs | give material.spring_constant
[cloth.material] => start = { stretch = [0.0, 1.0, 1.0] }\n[cloth.material] => 9 | cloth.0.start.stretch | above 0
[cloth.material] => start = { velocity = [nan, 0.0, 0.0] }\n[cloth.material] => 9 | cloth.0.start.velocity | finite
edge = "left" }\n => edge = "left" }\nclamp = true\n => 20 | pin.0.clamp | give it bending
name = "sheet" => name = "sheet"\nshape = { chain = { length = 1.0, links = 2 } }\nmaterial = { linear_density = 0.1, stretch = 9.0 }\n[[cloth]]\nname = "sheet" => 9 | cloth.1.name | "sheet" is taken | must differ
"#;

/// What is wrong inside a scene's file is said with the file, the line, the key and a remedy.
#[test]
fn a_bad_scene_file_is_refused_at_its_line() {
    let folder = folder("bad-scene-file");
    for case in BAD_SCENES.lines().filter(|line| !line.is_empty()) {
        let case = case.replace("\\n", "\n");
        let parts: Vec<&str> = case.split(" => ").collect();
        let &[from, to, said] = parts.as_slice() else {
            panic!("{case} has not three parts");
        };
        write(&folder, "in/scene.toml", &changed(SMALL, from, to));
        let (line, words) = said.split_once(" | ").expect("a line and words");
        let place = format!("in/scene.toml:{line}: ");
        let mut words: Vec<&str> = words.split(" | ").collect();
        words.push(&place);
        scene_refused(&folder, "in/scene.toml", "", &words);
    }
}

/// Scenes that aren't there, or have nothing to simulate.
#[test]
fn an_absent_or_empty_scene_is_refused() {
    let folder = folder("absent-scene");
    write(&folder, "empty.toml", "name = \"empty\"\nduration = 1.0\n");
    let builtin = ["nosuch: ", "drape", "hanging-cloth", "chain", ".toml"];
    scene_refused(&folder, "nosuch", "", &builtin);
    refused(&folder, "scenes nosuch", &["\"nosuch\"", "drape", "chain"]);
    refused(&folder, "check nosuch", &builtin);
    let missing = ["nosuch.toml: can't be read", "`muslin scenes`"];
    scene_refused(&folder, "nosuch.toml", "", &missing);
    scene_refused(&folder, "empty.toml", "", &["empty.toml", "no [[cloth]]"]);
}

/// Options => words that are said.
const BAD_OPTIONS: &str = r#"
--dt 0 => scene.toml | solver.dt | is 0; | above 0
--set solver.iterations=0 => scene.toml | solver.iterations | at least 1
--dt -1 => scene.toml | solver.dt | is -1; | above 0
--dt nan => scene.toml | solver.dt
--dt fast => --dt | "fast" | a number of seconds or "auto"
--dt auto --integrator euler --set cloth.0.damping={} => scene.toml | solver.dt | euler | give every cloth damping
--duration 0 => scene.toml | duration | above 0
--fps -60 => scene.toml | record.fps | is -60;
--set record.error=0.7 => scene.toml | record.error | is 0.7; | at most 0.5
--set record.error=-0.1 => scene.toml | record.error | 0 for none
--set record.error=nan => scene.toml | record.error
--integrator rk9 => scene.toml | rk9 | symplectic-euler | implicit-euler
--set solver.iterations=0 => scene.toml | solver.iterations | at least 1
--set solver.residual=0 => scene.toml | solver.residual | above 0
--set solver.residual=1 => scene.toml | solver.residual | below 1
--threads 0 => --threads 0 | at least one thread
--no-such-flag => --no-such-flag | --help
--set nonsense => scene.toml | "nonsense" | --set KEY=VALUE
--set cloth.skirt.name=x => scene.toml | no entry "skirt" | its name
--set solver.dt.x=1 => scene.toml | "x" | plain value
--set cloth.sheet.material.area_density=0 => scene.toml | area_density | is 0;
--set solvr.dt=1 => scene.toml | `solvr` | `solver`
"#;

/// Options that make no sense are named, with what would.
#[test]
fn bad_options_are_refused() {
    let folder = folder("bad-options");
    write(&folder, "scene.toml", SMALL);
    for case in BAD_OPTIONS.lines().filter(|line| !line.is_empty()) {
        let (options, words) = case.split_once(" => ").expect("two parts");
        let words: Vec<&str> = words.split(" | ").collect();
        scene_refused(&folder, "scene.toml", options, &words);
    }
}

/// What is written in [`CUBE`] => instead of what => line, if one is named | words that are said.
const BAD_OBSTACLES: &str = r#"
v 1 1 0 => v 1 NaN 0 => :3 | "NaN" is not a finite number | export the mesh again
v 1 1 0 => v 1 1 => :3 | three coordinates
f 3 4 8 7 => f 3 4 8 9 => :15 | index 9 is out of range | has 8 vertices, counted from 1
f 3 4 8 7 => f 3 4 8 0 => :15 | index 0 is out of range | has 8 vertices, counted from 1
f -4 -3 -2 -1 => f -9 -3 -2 -1 => :11 | index -9 is out of range
f 3 4 8 7 => f 3 4 8 seven => :15 | "seven" is not a vertex index
f 4 1 5 8\n => \n =>  | isn't closed | (0.0000, 1.0000, 0.0000) to (0.0000, 0.0000, 0.0000) | one side only (4 such edges) | fill its holes
"#;

/// What can't be used of an OBJ file is said with its name, line, cause and remedy.
#[test]
fn a_bad_obstacle_is_refused_at_its_line() {
    let folder = folder("bad-obstacle");
    write(&folder, "in/scene.toml", &format!("{SMALL}{BODY}"));
    for case in BAD_OBSTACLES.lines().filter(|line| !line.is_empty()) {
        let case = case.replace("\\n", "\n");
        let parts: Vec<&str> = case.split(" => ").collect();
        let &[from, to, said] = parts.as_slice() else {
            panic!("{case} has not three parts");
        };
        write(&folder, "in/body.obj", &changed(CUBE, from, to));
        let (line, words) = said.split_once(" | ").expect("a line and words");
        let place = format!("in/body.obj{line}: ");
        let mut words: Vec<&str> = words.split(" | ").collect();
        words.push(&place);
        scene_refused(&folder, "in/scene.toml", "", &words);
    }
}

/// An OBJ file that isn't there, or holds nothing.
#[test]
fn an_absent_or_empty_obstacle_is_refused() {
    let folder = folder("absent-obstacle");
    write(&folder, "in/scene.toml", &format!("{SMALL}{BODY}"));
    let missing = [
        "in/scene.toml:26: obstacle.0.shape.obj.path: ",
        "in/body.obj can't be read",
        "relative to the scene's file",
    ];
    scene_refused(&folder, "in/scene.toml", "", &missing);
    for text in ["", "# a comment\n", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"] {
        write(&folder, "in/body.obj", text);
        let empty = ["in/body.obj: holds no triangles", "\"f a b c\" lines"];
        scene_refused(&folder, "in/scene.toml", "", &empty);
    }
}

/// Polygons, indices from the end, two objects, repeated and flat triangles, and a mesh that is
/// inside out: all used, and what was repaired is counted.
#[test]
fn an_untidy_obstacle_is_repaired_and_counted() {
    let folder = folder("untidy-obstacle");
    write(&folder, "in/scene.toml", &format!("{SMALL}{BODY}"));
    let untidy = format!("{CUBE}f 1 2 6\nf 1 1 2\nf 1 2 2\n");
    write(&folder, "in/body.obj", &untidy);
    let notes = [
        "in/body.obj: ",
        "2 triangles without area dropped",
        "1 repeated triangles dropped",
    ];
    let ended = muslin_succeeds(&folder, "in/scene.toml --no-save");
    says(&ended, &notes);
    assert!(!ended.err.contains("inside out"), "{}", ended.err);
    let quiet = muslin_succeeds(&folder, "in/scene.toml --no-save --quiet");
    assert_eq!((quiet.out.as_str(), quiet.err.as_str()), ("", ""));
    let check = muslin_succeeds(&folder, "check in/scene.toml");
    assert!(check.out.contains(notes[1]), "{}", check.out);
    let listed = "obstacle body: 12 triangles";
    assert!(check.out.contains(listed), "{}", check.out);

    let mirrored = CUBE.replace("v 1", "v -1");
    write(&folder, "in/body.obj", &mirrored);
    let ended = muslin_succeeds(&folder, "in/scene.toml --no-save");
    says(&ended, &["in/body.obj: ", "inside out"]);
}

/// Bend springs that can't stand for the rigidity that was asked say so.
#[test]
fn bend_springs_that_fall_short_say_so() {
    let folder = folder("short-bend");
    let scene = |bend: &str| {
        let bends = format!(
            "springs = [\"structural\", \"shear\", \"bend\"]\n[cloth.material]\nbend = {bend}"
        );
        write(
            &folder,
            "scene.toml",
            &changed(SMALL, "[cloth.material]", &bends),
        );
        muslin_succeeds(&folder, "check scene.toml").out
    };
    // 0.375 · 100 N/m · (0.5 m / 8)² / 64.
    assert!(scene("1.0").contains("stand for D = 2.29e-3 N·m at most"));
    assert!(!scene("2.0e-3").contains("stand for D"));
}

/// A scene whose cloth is an OBJ mesh that hangs from its highest vertex.
const GARMENT: &str = r#"name = "garment"
duration = 0.05
[[cloth]]
name = "skirt"
shape = { obj = { path = "skirt.obj" } }
bending = "discrete-shell"
material = { area_density = 0.2, stretch = 100.0, bend = 1.0e-5 }
[[pin]]
cloth = "skirt"
select = { vertices = [0, 1] }
clamp = true
"#;

/// Two triangles on the edge 1–2, and room for more.
const SKIRT: &str = "v 0 1 0\nv 0 0 0\nv 1 0 0\nv -1 0 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\n";

/// Meshes that can't be cloth are refused with their place; faults that can be mended are counted.
#[test]
fn a_mesh_becomes_cloth_or_says_why_not() {
    let folder = folder("garment");
    let scene = |text: &str| write(&folder, "in/scene.toml", text);
    let mesh = |text: &str| write(&folder, "in/skirt.obj", text);
    scene(&GARMENT.replace("clamp = true", ""));
    mesh(&format!("{SKIRT}f 1 2 5\n"));
    let edge = [
        "in/skirt.obj: can't be cloth",
        "(0.0000, 1.0000, 0.0000)",
        "3 triangles",
    ];
    scene_refused(&folder, "in/scene.toml", "", &edge);
    mesh(
        &format!("{SKIRT}v 0 0 0\nf 2 1 1\nf 1 3 2\nf 1 6 4\nf 1 2 3\nf 1 4 4\n")
            .replace("f 2 1 4\n", ""),
    );
    let repaired = [
        "in/skirt.obj: ",
        "1 repeated vertices merged",
        "2 triangles without area dropped",
        "1 repeated triangles dropped",
        "triangles turned",
    ];
    let folded = muslin(&folder, "in/scene.toml --no-save");
    assert_eq!(
        folded.code,
        Some(2),
        "two triangles on each other: {folded:#?}"
    );
    mesh(&format!("{SKIRT}v 0 0 0\nf 2 1 1\nf 1 6 4\nf 1 2 3\nf 1 4 4\n").replace("f 2 1 4\n", ""));
    says(
        &muslin_succeeds(&folder, "in/scene.toml --no-save"),
        &repaired,
    );
    mesh(SKIRT);
    muslin_succeeds(&folder, "in/scene.toml --no-save");
    scene(GARMENT);
    muslin_succeeds(&folder, "in/scene.toml --no-save");
    scene(&GARMENT.replace("[0, 1]", "[2]"));
    let alone = [
        "in/scene.toml:10: pin.0.select",
        "clamps no tangent",
        "two neighbouring vertices",
    ];
    scene_refused(&folder, "in/scene.toml", "", &alone);
    scene(&GARMENT.replace(
        "bending =",
        "springs = [\"structural\", \"bend\"]\nbending =",
    ));
    let neighbours = [
        "in/scene.toml:6: cloth.0.springs",
        "no second neighbours",
        "bending =",
    ];
    scene_refused(&folder, "in/scene.toml", "", &neighbours);
}

/// The material of [`SMALL`] on its own, with hinges.
const MATERIAL: &str = r#"bending = "edge-spring"
diagonals = "both"
cell = 0.004

[material]
area_density = 0.2
stretch = 100.0
bend = 1.0e-5
"#;

/// Swatch tests of a scene, of a material, and of what has no swatch.
#[test]
fn the_lab_tests_cloths_and_names_what_it_does_not() {
    let folder = folder("lab");
    let chain = "[[cloth]]\nname = \"rope\"\nshape = { chain = { length = 1.0, links = 5 } }\n\
        material = { linear_density = 0.1, stretch = 9.0 }\n[[pin]]\n";
    write(&folder, "scene.toml", &changed(SMALL, "[[pin]]\n", chain));
    let ended = muslin_succeeds(&folder, "lab scene.toml");
    for words in [
        "resists no bending",
        "rope",
        "is a chain",
        "| 45° | 100 | 0.3333 | 37.5 | 0 |",
    ] {
        assert!(ended.out.contains(words), "no {words:?} in {}", ended.out);
    }
    assert!(ended.out.contains(&read(&folder, "small-lab/lab.md")));
    write(&folder, "wool.toml", MATERIAL);
    muslin_succeeds(&folder, "lab --material wool.toml --out of/wool");
    let files = contents(&folder.join("of/wool"));
    let names: Vec<_> = files.keys().map(|path| path.file_name().unwrap()).collect();
    let expected = [
        "cantilever-wool.png",
        "lab.csv",
        "lab.md",
        "stiffness-wool.png",
    ];
    assert_eq!(names, expected);
    let table = read(&folder, "of/wool/lab.csv");
    let columns = "cloth,test,angle_deg,cells,quantity,value,unit,reference,error\n";
    assert!(table.starts_with(columns), "{table}");
    assert!(
        table.lines().all(|line| line.split(',').count() == 9),
        "{table}"
    );
    for row in ["wool,membrane,,12,C11,112.5", "wool,cantilever,90.0,36,D,"] {
        assert!(table.contains(row), "no {row} in {table}");
    }
}

/// Scenes without cloth, faults in a material's file, and a folder that can't be written.
#[test]
fn the_lab_refuses_what_it_cannot_test() {
    let folder = folder("bad-lab");
    refused(
        &folder,
        "lab chain",
        &["nothing to test", "is a chain", "a sheet"],
    );
    refused(&folder, "lab nosuch", &["nosuch: ", "drape"]);
    refused(&folder, "lab drape --material x.toml", &["--material"]);
    refused(
        &folder,
        "lab --material no.toml",
        &["no.toml: can't be read"],
    );
    write(&folder, "file", "");
    refused(
        &folder,
        "lab --out file/x",
        &["file/x can't be written", "--out"],
    );
    let cases = [
        ("stretch", "strech", ":7: ", "`stretch`"),
        ("cell = 0.004", "cell = -1", ":3: ", "cell: is -1;"),
        (
            "area_density = 0.2",
            "density = 0.2",
            ":6: ",
            "area_density",
        ),
        ("bend = 1.0e-5", "", ":5: ", "bend is missing"),
    ];
    for (from, to, line, words) in cases {
        write(&folder, "m.toml", &changed(MATERIAL, from, to));
        refused(&folder, "lab --material m.toml", &["m.toml", line, words]);
    }
    write(&folder, "m.toml", MATERIAL);
    let set = "lab --material m.toml --set material.stretch=-5";
    refused(&folder, set, &["m.toml", "material.stretch: is -5;"]);
}

/// A report that can't be written is refused before the run; so the recording is spared.
#[test]
fn an_unwritable_report_is_refused_before_the_run() {
    let folder = folder("unwritable-report");
    write(&folder, "old.rrd", "an older recording");
    let words = [
        "missing/r.json can't be written",
        "No such file",
        "--report",
    ];
    let args = "hanging-cloth --duration 1e6 --save old.rrd --report missing/r.json";
    refused(&folder, args, &words);
    refused(&folder, "mannequin missing/m.obj", &["missing/m.obj"]);
}

/// An output that would overwrite the scene, or another output, is refused; also when flags change
/// the scene, and when the recording has its default name.
#[test]
fn an_output_that_would_destroy_a_file_in_use_is_refused() {
    let folder = folder("outputs-in-use");
    write(&folder, "s.toml", SMALL);
    let cases = [
        "s.toml --save s.toml",
        "s.toml --dt 0.001 --save s.toml",
        "s.toml --dt 0.001 --no-save --report ./s.toml",
        "s.toml --save same --report same",
        "hanging-cloth --report hanging-cloth.rrd",
    ];
    for args in cases {
        refused(&folder, args, &["used already", "choose another"]);
    }
}

/// A run that blows up ends with code 1 and says where, by how much, which limit and what helps.
#[test]
fn a_failing_run_says_why_and_its_remedy_helps() {
    let folder = folder("failing-run");
    let unstable = "hanging-cloth --integrator symplectic-euler --no-save --report r.json";
    let ended = muslin(&folder, &format!("{unstable} --dt 0.05"));
    assert_eq!(ended.code, Some(1), "{ended:#?}");
    let words = [
        "error: diverged in step 2 at t = 0.1",
        "particle ",
        "of \"sheet\"",
        "the structural spring between particles",
        "has strain ",
        "the step is 5.000e-2 s",
        "the stable step of symplectic-euler 1.3",
        "use --dt ",
        "or --integrator implicit-euler",
    ];
    says(&ended, &words);
    let report = report(&folder, "r.json");
    assert_eq!(report["outcome"], "diverged");
    assert_eq!(report["steps"], 1, "steps that succeeded");
    let reason = report["reason"].as_str().unwrap();
    assert!(ended.err.contains(reason), "{reason}\nbut: {}", ended.err);
    let told = &report["divergence"];
    assert_eq!(told["last_good_s"], report["simulated_s"]);
    assert_eq!(told["step"], 2);
    assert_eq!(told["stage"], "integrate");
    assert_eq!(told["cause"]["name"], "step");
    assert_eq!(told["scheme"], "symplectic-euler");
    assert_eq!(told["particle"]["cloth"], "sheet");
    for path in [
        "/time_s",
        "/element/strain",
        "/limit/dt_s",
        "/suggestion/dt_s",
        "/cause/times_limit",
    ] {
        let number = told.pointer(path).and_then(Value::as_f64);
        assert!(number.is_some(), "{path} is no number: {told:#}");
    }

    let (_, advice) = ended.err.split_once("use --dt ").unwrap();
    let dt = advice.split_whitespace().next().unwrap();
    muslin_succeeds(&folder, &format!("{unstable} --dt {dt} --duration 0.3"));
    let implicit = "hanging-cloth --integrator implicit-euler --dt 0.05 --no-save --duration 0.3";
    muslin_succeeds(&folder, implicit);
}

/// The step that the program chooses is said, and how far it is from the limit.
#[test]
fn a_chosen_step_is_said_and_holds() {
    let folder = folder("chosen-step");
    let args = "hanging-cloth --integrator verlet --dt auto --duration 0.1 --no-save";
    let ended = muslin_succeeds(&folder, &format!("{args} --report r.json"));
    for words in [
        "verlet with dt = ",
        "(auto)",
        "dt is 0.90 of the stable step",
    ] {
        assert!(ended.err.contains(words), "no {words:?} in {}", ended.err);
    }
    let dt = report(&folder, "r.json")["dt"].as_f64().unwrap();
    assert!(dt > 1e-3 && dt < 2e-3, "{dt}");
    let quiet = muslin_succeeds(&folder, &format!("{args} --quiet"));
    assert_eq!(quiet.err, "");
}

/// The fields of a report keep their names and types.
#[test]
fn a_report_has_every_field() {
    let folder = folder("report-fields");
    write(&folder, "scene.toml", SMALL);
    let args = "scene.toml --no-save --duration 0.1 --fps 60 --dt 0.004 --report r.json";
    muslin_succeeds(&folder, args);
    let report = report(&folder, "r.json");
    let check = |paths: &str, kind: &str, is: fn(&Value) -> bool| {
        for path in paths.split_whitespace() {
            let value = report.pointer(path);
            assert!(value.is_some_and(is), "{path} is {value:?}, no {kind}");
        }
    };
    check(
        "/scene /integrator /outcome /error/sees",
        "text",
        Value::is_string,
    );
    check(
        "/threads /particles /springs /hinges /triangles /steps /recorded_frames \
         /dropped_live_frames /contact/count /error/samples",
        "count",
        Value::is_u64,
    );
    check(
        "/dt /simulated_s /wall_s /ms_per_frame /energy/kinetic /energy/gravitational \
         /energy/residual /energy/exchanged /energy/unexplained /energy/dissipated/scheme \
         /energy/elastic/structural /energy/elastic/shear /strain/max \
         /strain/max_ever /strain/mean /contact/max_depth_m /contact/max_depth_ever_m \
         /error/estimate_m /error/per_step_m /error/share_of_time",
        "number",
        Value::is_f64,
    );
    let numbers: fn(&Value) -> bool = |value| {
        let entries = value.as_object();
        entries.is_some_and(|entries| entries.values().all(Value::is_f64))
    };
    let parts = report["memory_bytes"].as_object();
    assert!(parts.is_some_and(|parts| parts.values().all(Value::is_u64)));
    let named = "/stage_ms /energy/elastic /energy/dissipated /energy/work";
    check(named, "table of numbers", numbers);
    assert!(report.get("reason").is_none(), "{report:#}");
}

/// What a report counts, for a scene that can be counted by hand.
#[test]
fn a_report_counts_right() {
    let folder = folder("report-counts");
    write(&folder, "scene.toml", SMALL);
    let args =
        "scene.toml --no-save --duration 0.1 --fps 60 --dt 0.004 --threads 1 --report r.json";
    muslin_succeeds(&folder, args);
    let report = report(&folder, "r.json");
    for (field, expected) in [
        ("scene", Value::from("small")),
        ("integrator", "implicit-euler".into()),
        ("outcome", "completed".into()),
        ("dt", 0.004.into()),
        ("threads", 1.into()),
        ("particles", 81.into()),
        ("triangles", 128.into()),
        ("springs", (2 * 8 * 9 + 64).into()),
        ("steps", 25.into()),
        ("recorded_frames", 0.into()),
        ("dropped_live_frames", 0.into()),
    ] {
        assert_eq!(report[field], expected, "{field}");
    }
    let simulated = report["simulated_s"].as_f64().unwrap();
    assert!((simulated - 0.1).abs() < 1e-12, "{simulated}");
}

/// `--help` and `--version` succeed and name what there is.
#[test]
fn help_names_every_command_and_flag() {
    let folder = folder("help");
    let help = muslin_succeeds(&folder, "--help").out;
    let mut words = vec!["run", "scenes", "check", "mannequin", "[SCENE]", "drape"];
    if cfg!(feature = "rerun") {
        words.push("export");
    }
    let flags = "--save --no-save --connect --serve --spawn --integrator --dt --duration --fps \
        --threads --set --report --quiet --version";
    words.extend(flags.split_whitespace());
    for word in words {
        assert!(help.contains(word), "no {word:?} in {help}");
    }
    let run = muslin_succeeds(&folder, "run --help").out;
    assert!(run.contains("--integrator"), "{run}");
    let version = muslin_succeeds(&folder, "--version").out;
    assert_eq!(
        version.trim(),
        concat!("muslin ", env!("CARGO_PKG_VERSION"))
    );
}

/// The gallery lists each scene; a printed one runs from elsewhere, with its built-in mesh.
#[test]
fn the_gallery_lists_scenes_that_run_from_anywhere() {
    let folder = folder("gallery");
    let list = muslin_succeeds(&folder, "scenes").out;
    for (name, _) in muslin::scene::BUILTIN {
        let line = list.lines().find(|line| line.starts_with(name));
        assert!(line.is_some_and(|line| line.len() > 40), "{name} in {list}");
    }
    let drape = muslin_succeeds(&folder, "scenes drape").out;
    write(&folder, "elsewhere/mine.toml", &drape);
    let args = "elsewhere/mine.toml --no-save --duration 0.01 --report r.json \
        --set cloth.poncho.shape.sheet.cells=[20,20]";
    muslin_succeeds(&folder, args);
    assert_eq!(report(&folder, "r.json")["scene"], "drape");
}

/// `check` says the stable step and warns of a longer one.
#[test]
fn check_knows_the_stable_step() {
    let folder = folder("check");
    let out = muslin_succeeds(&folder, "check hanging-cloth").out;
    for words in [
        "441 particles",
        "structural springs: 840",
        "symplectic-euler: stable up to dt = 1.3",
        "chosen: implicit-euler with dt = 0.004 s",
        "for 4 s simulated",
        "dopri5: chooses stable steps itself",
        "implicit-euler, newton, bdf2, xpbd, projective: stable at any dt",
        "implicit-midpoint: stable at any dt, with steps of implicit Euler where it would make energy",
        "stiffness ratio dt² k (1/mᵢ + 1/mⱼ): at most ",
        "xpbd with 1 sweep(s)",
        "its own damping: ",
    ] {
        assert!(out.contains(words), "no {words:?} in {out}");
    }
    assert!(!out.contains("WARNING"), "{out}");
    let args = "check hanging-cloth --integrator symplectic-euler";
    let out = muslin_succeeds(&folder, args).out;
    assert!(
        out.contains("WARNING: this diverges; use --dt 1.2e-3"),
        "{out}"
    );
    assert_eq!(contents(&folder).len(), 0, "check writes nothing");
}

/// `solver.iterations` is said to be XPBD's sweeps only where they are.
#[test]
fn check_counts_the_sweeps_of_xpbd_alone() {
    let folder = folder("sweeps");
    write(&folder, "scene.toml", SMALL);
    for (scheme, sweeps) in [("newton", 1), ("xpbd", 7)] {
        let args = format!("check scene.toml --integrator {scheme} --set solver.iterations=7");
        let out = muslin_succeeds(&folder, &args).out;
        let words = format!("xpbd with {sweeps} sweep(s)");
        assert!(out.contains(&words), "{scheme}: no {words:?} in {out}");
    }
}

/// The head of a run says of each scheme what there is to say of its steps.
#[test]
fn a_run_begins_with_what_matters_to_its_scheme() {
    let folder = folder("heads");
    write(&folder, "scene.toml", SMALL);
    for (scheme, words) in [
        ("verlet", "head-room: dt is "),
        ("dopri5", "its steps are chosen by solver.tolerance"),
        ("bdf2", "conjugate gradients at this dt: some "),
        ("xpbd", "xpbd with 1 sweep(s) at this dt: "),
        (
            "projective",
            "stiffness ratio dt² k (1/mᵢ + 1/mⱼ): at most ",
        ),
    ] {
        let args = format!("scene.toml --no-save --dt 0.001 --integrator {scheme}");
        let err = muslin_succeeds(&folder, &args).err;
        assert!(err.contains(words), "{scheme}: no {words:?} in {err}");
    }
    let held = changed(SMALL, "edge = \"left\"", "box = [[-9, -9, -9], [9, 9, 9]]");
    write(&folder, "held.toml", &held);
    let args = "held.toml --no-save --integrator verlet";
    let err = muslin_succeeds(&folder, args).err;
    assert!(err.contains("nothing swings, any step is stable"), "{err}");
}

/// Steps that end before they are solved are counted, with the key that says when they are.
#[test]
fn unsolved_steps_are_warned_of_with_their_own_key() {
    let folder = folder("unsolved");
    write(&folder, "scene.toml", SMALL);
    let few = "use a smaller --dt, more solver.iterations, or a larger solver.residual";
    let strict = "--set solver.residual=1e-12 --set solver.iterations=1";
    for (scheme, settings, words) in [
        ("newton", strict, few),
        ("implicit-midpoint", strict, few),
        ("bdf2", strict, few),
        ("projective", strict, few),
    ] {
        let args = format!("scene.toml --no-save --dt 0.01 --integrator {scheme} {settings}");
        let out = muslin_succeeds(&folder, &args).out;
        let words = format!("WARNING: 5 of 5 steps were not solved to their tolerance; {words}");
        assert!(out.contains(&words), "{scheme}: no {words:?} in {out}");
    }
    let out = muslin_succeeds(&folder, "scene.toml --no-save").out;
    assert!(!out.contains("WARNING"), "{out}");
    // A scheme that chooses its own steps and finds none ends the run.
    let args = "scene.toml --no-save --integrator dopri5 --set solver.tolerance=1e-300";
    let ended = muslin(&folder, args);
    assert_eq!(ended.code, Some(1), "{ended:#?}");
    says(
        &ended,
        &["no step is short enough", "another solver.tolerance"],
    );
}

/// The mannequin and its poncho in the repository are those that the program makes.
#[test]
fn the_mannequin_is_written_again_byte_for_byte() {
    let folder = folder("mannequin");
    for (options, file) in [("", "mannequin.obj"), ("--poncho ", "poncho.obj")] {
        let said = muslin_succeeds(&folder, &format!("mannequin {options}out.obj")).out;
        assert!(said.contains("out.obj: "), "{said}");
        let kept = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("meshes")
            .join(file);
        let made = read(&folder, "out.obj");
        let kept = fs::read_to_string(kept).unwrap();
        let lines = made.lines().zip(kept.lines()).enumerate();
        let first = lines.into_iter().find(|(_, (made, kept))| made != kept);
        assert!(
            made == kept,
            "{file}, first different line (from 0): {first:?}"
        );
    }
}

/// A program without Rerun says so when it is asked to record.
#[cfg(not(feature = "rerun"))]
#[test]
fn recording_without_rerun_is_refused() {
    let folder = folder("without-rerun");
    let words = ["without Rerun", "--no-save", "default features"];
    refused(&folder, "hanging-cloth", &words);
    refused(&folder, "hanging-cloth --no-save --connect", &words);
}

/// What needs recordings.
#[cfg(feature = "rerun")]
mod recorded {
    use super::{SMALL, folder};
    use crate::support::background::{Running, wait_for};
    use crate::support::program::{
        contents, muslin, muslin_succeeds, read, refused, report, write,
    };
    use std::fs;
    use std::path::Path;
    use std::process::{Command, ExitStatus, Stdio};

    const HEADER: &str = "cloth,particle,x,y,z,vx,vy,vz";

    /// Exports a recording's state, checks its form, and returns the numbers of each row.
    fn exported(folder: &Path, recording: &str, options: &str) -> Vec<[f64; 6]> {
        muslin_succeeds(
            folder,
            &format!("export {recording} --csv state.csv --force {options}"),
        );
        let table = read(folder, "state.csv");
        let mut lines = table.lines();
        assert_eq!(lines.next(), Some(HEADER));
        let row = |(i, line): (usize, &str)| {
            let numbers = line.strip_prefix(&format!("sheet,{i},"));
            let numbers = numbers.unwrap_or_else(|| panic!("row {i} is {line}"));
            let numbers = numbers.split(',').map(str::parse::<f64>);
            let numbers: Vec<f64> = numbers.collect::<Result<_, _>>().expect("numbers");
            assert!(numbers.iter().all(|x| x.is_finite()), "row {i} is {line}");
            numbers.try_into().expect("six numbers")
        };
        lines.enumerate().map(row).collect()
    }

    /// A recording that can't be written is refused before the run.
    #[test]
    fn an_unwritable_recording_is_refused_before_the_run() {
        let folder = folder("unwritable-recording");
        let run = "hanging-cloth --duration 1e6 --save";
        let missing = [
            "missing/x.rrd",
            "No such file",
            "create its folder",
            "--save",
        ];
        refused(&folder, &format!("{run} missing/x.rrd"), &missing);
        fs::create_dir(folder.join("x.rrd")).unwrap();
        refused(
            &folder,
            &format!("{run} x.rrd"),
            &["x.rrd", "folder", "--save"],
        );
        write(&folder, "old.rrd", "an older recording");
        let args = format!("{run} old.rrd --force --connect nowhere");
        refused(
            &folder,
            &args,
            &["`nowhere`", "rerun+http://HOST:9876/proxy"],
        );
    }

    /// A run is recorded under its scene's name unless told otherwise.
    #[test]
    fn a_recording_is_named_after_its_scene() {
        let folder = folder("default-name");
        write(&folder, "scene.toml", SMALL);
        muslin_succeeds(&folder, "scene.toml");
        assert_eq!(exported(&folder, "small.rrd", "").len(), 81);
        muslin_succeeds(&folder, "scene.toml --no-save");
        assert_eq!(contents(&folder).len(), 3, "scene, recording, table");
    }

    /// The recording of a run that blew up holds everything up to there, all of it finite.
    #[test]
    fn a_failed_run_leaves_a_complete_recording() {
        let folder = folder("failed-recording");
        let args =
            "hanging-cloth --integrator symplectic-euler --dt 0.05 --save x.rrd --report r.json";
        assert_eq!(muslin(&folder, args).code, Some(1));
        let report = report(&folder, "r.json");
        assert_eq!(report["outcome"], "diverged");
        assert_eq!(exported(&folder, "x.rrd", "").len(), 441);
        let said = muslin_succeeds(&folder, "export x.rrd --csv last.csv").out;
        let last = format!("441 particles at t = {} s", report["simulated_s"]);
        assert!(said.contains(&last), "no {last:?} in {said}");
    }

    /// A sheet of 1681 particles, enough for several threads, that falls onto the mannequin's head.
    const FALLING: &str = r#"name = "falling"
duration = 0.3

[[cloth]]
name = "sheet"
shape = { sheet = { size = [0.8, 0.8], cells = [40, 40] } }
translate = [0.0, 1.77, 0.0]
material = { area_density = 0.2, stretch = 300.0 }
damping = { mass = 0.5, stiffness = 0.002 }

[[obstacle]]
name = "mannequin"
shape = { obj = { path = "mannequin.obj" } }

[strain_limit]
max = 0.1

[record]
checkpoint = 0.1
"#;

    /// Two runs, with any number of threads, give the same bits.
    #[test]
    fn the_exported_state_has_the_same_bits_for_any_number_of_threads() {
        let folder = folder("same-bits");
        write(&folder, "falling.toml", FALLING);
        let state = |threads: u32| {
            let args =
                format!("falling.toml --threads {threads} --save x.rrd --force --report r.json");
            muslin_succeeds(&folder, &args);
            muslin_succeeds(&folder, "export x.rrd --csv x.csv --force");
            read(&folder, "x.csv")
        };
        let one = state(1);
        let contacts = report(&folder, "r.json")["contact"]["count"].as_u64();
        assert!(contacts > Some(50), "{contacts:?} contacts");
        assert_eq!(one.lines().count(), 1 + 1681);
        for threads in [1, 2, 2] {
            let other = state(threads);
            let first = one.lines().zip(other.lines()).find(|(a, b)| a != b);
            assert!(one == other, "{threads} thread(s): {first:?}");
        }
        starts_flat_and_at_rest(&folder);
    }

    /// The recording's first checkpoint is the scene as placed; others are found by their time.
    fn starts_flat_and_at_rest(folder: &Path) {
        let start = exported(folder, "x.rrd", "--at 0");
        for (i, &[x, y, z, vx, vy, vz]) in start.iter().enumerate() {
            assert_eq!(
                [y, vx, vy, vz].map(f64::to_bits),
                [1.77, 0.0, 0.0, 0.0].map(f64::to_bits)
            );
            assert!(
                x.abs() < 0.4 + 1e-12 && z.abs() < 0.4 + 1e-12,
                "particle {i}: {x}, {z}"
            );
        }
        let [x, _, z, ..] = start[0];
        assert!(
            (x + 0.4).abs() < 1e-12 && (z + 0.4).abs() < 1e-12,
            "{x}, {z}"
        );
        for (at, time) in [("0.05", 0.0), ("0.15", 0.1), ("99", 0.3), ("last", 0.3)] {
            let args = format!("export x.rrd --csv t.csv --force --at {at}");
            let said = muslin_succeeds(folder, &args).out;
            let found = said.trim().trim_end_matches(" s").rsplit(' ').next();
            let found: f64 = found.expect("a time").parse().expect("a time");
            assert!((found - time).abs() < 0.004, "--at {at}: {said}");
        }
    }

    /// What can't be exported is refused, and an older table is spared.
    #[test]
    fn a_bad_export_is_refused() {
        let folder = folder("bad-export");
        write(&folder, "scene.toml", SMALL);
        write(&folder, "old.csv", "an older table");
        write(&folder, "empty.rrd", "");
        muslin_succeeds(&folder, "scene.toml --save x.rrd");
        let cases: &[(&str, &[&str])] = &[
            ("x.rrd --at -1", &["x.rrd", "-1 s", "first is at 0 s"]),
            ("x.rrd --at soon", &["--at soon", "`last` or seconds"]),
            ("scene.toml", &["scene.toml", "not a Rerun recording"]),
            ("empty.rrd", &["empty.rrd", "empty", ".rrd"]),
            ("missing.rrd", &["missing.rrd", "No such file", ".rrd"]),
        ];
        for (args, words) in cases {
            refused(
                &folder,
                &format!("export {args} --csv old.csv --force"),
                words,
            );
        }
        refused(
            &folder,
            "export x.rrd --csv ./x.rrd",
            &["that is the recording"],
        );
        let missing = ["missing/x.csv can't be written", "--csv"];
        refused(&folder, "export x.rrd --csv missing/x.csv", &missing);
    }

    /// Frame 0, the first state at or after each k / fps, and the last one.
    #[test]
    fn a_report_counts_the_recorded_frames() {
        let folder = folder("recorded-frames");
        write(&folder, "scene.toml", SMALL);
        let cases = [
            ("--duration 0.1 --fps 60 --dt 0.004", 7),
            ("--duration 0.1 --fps 30 --dt 0.004", 4),
            ("--duration 0.1 --fps 25 --dt 0.004", 4),
            ("--duration 0.1 --fps 1000 --dt 0.004", 26),
            ("--duration 0.001 --fps 60 --dt 0.004", 2),
        ];
        for (options, frames) in cases {
            let args = format!("scene.toml --save x.rrd --force --report r.json {options}");
            let ended = muslin_succeeds(&folder, &args);
            let report = report(&folder, "r.json");
            assert_eq!(report["recorded_frames"], frames, "{options}");
            let warned = ended.err.contains("more frames than there are steps");
            assert_eq!(warned, options.contains("1000"), "{}", ended.err);
        }
    }

    /// A viewer that isn't there costs its live frames, and nothing of the file.
    #[test]
    fn an_absent_viewer_costs_the_file_nothing() {
        let folder = folder("absent-viewer");
        write(&folder, "scene.toml", SMALL);
        let run = "scene.toml --duration 0.1 --report r.json --save";
        muslin_succeeds(&folder, &format!("{run} alone.rrd"));
        let alone = exported(&folder, "alone.rrd", "");
        let nobody = "--connect rerun+http://127.0.0.1:1/proxy";
        let ended = muslin_succeeds(&folder, &format!("{run} x.rrd {nobody}"));
        let dropped = "7 live frames dropped; the file has them all";
        assert!(ended.out.contains(dropped), "{}", ended.out);
        let report = report(&folder, "r.json");
        assert_eq!(report["dropped_live_frames"], 7, "{report:#}");
        assert_eq!(report["recorded_frames"], 7, "{report:#}");
        assert!(exported(&folder, "x.rrd", "") == alone, "another state");
    }

    /// Interrupts a run once frames have reached its recording, and returns how it ended.
    fn interrupt(run: &mut Running, recording: &Path) -> ExitStatus {
        let length = || fs::metadata(recording).ok().map(|file| file.len());
        let many_frames = || length().filter(|&bytes| bytes > 500_000);
        wait_for("the recording to grow", many_frames);
        let running = run.0.try_wait().expect("a child");
        assert_eq!(running, None, "it ended by itself");
        let id = run.0.id().to_string();
        let killed = Command::new("kill").args(["-INT", &id]).status();
        assert!(killed.expect("kill is there").success());
        wait_for("the run to end", || run.0.try_wait().expect("a child"))
    }

    /// Ctrl-C ends a run cleanly: a complete recording, a report, exit code 0.
    #[cfg(unix)]
    #[test]
    fn an_interrupted_run_leaves_a_complete_recording() {
        let folder = folder("interrupted");
        let child = Command::new(assert_cmd::cargo::cargo_bin!("muslin"))
            .args("hanging-cloth --duration 100000 --save x.rrd --report r.json".split(' '))
            .current_dir(&folder)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("muslin starts");
        let status = interrupt(&mut Running(child), &folder.join("x.rrd"));
        assert_eq!(status.code(), Some(0));
        let report = report(&folder, "r.json");
        assert_eq!(report["outcome"], "stopped");
        let simulated = report["simulated_s"].as_f64().unwrap();
        assert!(simulated > 0.0 && simulated < 1e4, "{simulated}");
        assert!(report["recorded_frames"].as_u64() > Some(1), "{report:#}");
        assert_eq!(exported(&folder, "x.rrd", "").len(), 441);
        let said = muslin_succeeds(&folder, "export x.rrd --csv last.csv").out;
        // Read as a number: the JSON reader may be off by its last bit.
        let (_, last) = said.split_once("at t = ").expect("a time");
        let (last, _) = last.split_once(' ').expect("its unit");
        let last: f64 = last.parse().expect("a number");
        assert!(
            (last - simulated).abs() < 1e-9,
            "{last} against {simulated}"
        );
    }
}
