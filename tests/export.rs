//! Recordings in other formats, as a user asks for them; the oracle is the exact state in the table.

use crate::support;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A sheet and a chain that fall, a floor, and a ball that moves.
const SCENE: &str = r#"name = "small"
duration = 0.2

[[cloth]]
name = "my sheet"
shape = { sheet = { size = [0.5, 0.5], cells = [4, 4] } }
translate = [0.0, 1.0, 0.0]
material = { area_density = 0.2, stretch = 100.0 }

[[cloth]]
name = "chain"
shape = { chain = { length = 0.5, links = 5 } }
translate = [0.0, 2.0, 1.0]
material = { linear_density = 0.1, stretch = 50.0 }

[[pin]]
cloth = "my sheet"
select = { edge = "left" }

[[pin]]
cloth = "chain"
select = { vertices = [0] }

[[obstacle]]
name = "floor"
shape = { plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 1.0, 0.0] } }

[[obstacle]]
name = "ball"
shape = { sphere = { center = [0.0, 0.5, 0.0], radius = 0.1 } }
motion = { keyframes = [{ t = 0.0, translate = [0.0, 0.0, 0.0] }, { t = 1.0, translate = [0.0, 0.0, 1.0] }] }

[solver]
dt = 0.004
"#;

/// Particles of the sheet and of the chain.
const PARTICLES: [usize; 2] = [25, 6];

/// How a command ended.
#[derive(Debug)]
struct Ended {
    code: Option<i32>,
    out: String,
    err: String,
}

fn muslin(folder: &Path, args: &str) -> Ended {
    let output = assert_cmd::cargo::cargo_bin_cmd!("muslin")
        .args(args.split_whitespace())
        .current_dir(folder)
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Ended {
        code: output.status.code(),
        out: text(&output.stdout),
        err: text(&output.stderr),
    }
}

fn succeeds(folder: &Path, args: &str) -> String {
    let ended = muslin(folder, args);
    assert_eq!(ended.code, Some(0), "muslin {args}: {ended:#?}");
    ended.out
}

fn fails(folder: &Path, args: &str, code: i32, words: &[&str]) {
    let ended = muslin(folder, args);
    assert_eq!(ended.code, Some(code), "muslin {args}: {ended:#?}");
    for word in words {
        assert!(ended.err.contains(word), "no {word:?} in {}", ended.err);
    }
}

/// A folder with a recording `x.rrd`.
fn recorded(name: &str) -> std::path::PathBuf {
    let folder = support::fresh_folder(name);
    fs::write(folder.join("scene.toml"), SCENE).unwrap();
    succeeds(&folder, "scene.toml --save x.rrd --quiet");
    folder
}

/// Names of the files in a folder.
fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

/// The exact positions at the end, rounded to what is drawn.
fn exact(folder: &Path) -> Vec<[f32; 3]> {
    succeeds(folder, "export x.rrd --csv exact.csv --force");
    let table = fs::read_to_string(folder.join("exact.csv")).unwrap();
    let rows = table.lines().skip(1).map(|row| {
        let numbers = row.split(',').skip(2).take(3);
        let numbers = numbers.map(|n| n.parse::<f64>().unwrap() as f32);
        numbers.collect::<Vec<f32>>().try_into().unwrap()
    });
    rows.collect()
}

#[test]
fn the_last_obj_has_the_exact_state() {
    let folder = recorded("export-obj");
    let said = succeeds(&folder, "export x.rrd --obj frames");
    assert!(said.contains("13 frames from t = 0 s to 0.2 s"), "{said}");
    let names: Vec<String> = (0..13).map(|k| format!("frame-{k:06}.obj")).collect();
    assert_eq!(files(&folder.join("frames")), names);
    let text = fs::read_to_string(folder.join("frames/frame-000012.obj")).unwrap();
    let objects = text.lines().filter_map(|line| line.strip_prefix("o "));
    let objects: Vec<&str> = objects.collect();
    assert_eq!(objects, ["my sheet", "chain", "floor", "ball"]);
    let vertices = text.lines().filter_map(|line| line.strip_prefix("v "));
    let positions: Vec<[f32; 3]> = vertices
        .take(PARTICLES.iter().sum())
        .map(|line| {
            let numbers: Vec<f32> = line.split(' ').map(|n| n.parse().unwrap()).collect();
            numbers.try_into().unwrap()
        })
        .collect();
    assert_eq!(positions, exact(&folder));
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with("l ")).collect();
    assert_eq!(
        lines,
        ["l 26 27", "l 27 28", "l 28 29", "l 29 30", "l 30 31"]
    );
    fails(
        &folder,
        "export x.rrd --obj frames",
        2,
        &["holds 13 frames already", "--force"],
    );
    succeeds(&folder, "export x.rrd --obj frames --every 4 --force");
    let some = [0, 4, 8, 12].map(|k| format!("frame-{k:06}.obj"));
    assert_eq!(files(&folder.join("frames")), some, "older frames stay");
}

#[test]
fn the_last_ply_has_the_exact_state() {
    let folder = recorded("export-ply");
    succeeds(&folder, "export x.rrd --ply frames --at last");
    assert_eq!(files(&folder.join("frames")), ["frame-000012.ply"]);
    let file = fs::read(folder.join("frames/frame-000012.ply")).unwrap();
    let end = b"end_header\n";
    let start = file.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let head = String::from_utf8_lossy(&file[..start]);
    assert!(head.contains("comment body 1 is chain\n"), "{head}");
    // Three floats, three bytes of colour, two of the body's number.
    let vertices = file[start..].chunks(17).take(PARTICLES.iter().sum());
    let float = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().unwrap());
    let positions: Vec<[f32; 3]> = vertices
        .map(|v| [float(&v[..4]), float(&v[4..8]), float(&v[8..12])])
        .collect();
    assert_eq!(positions, exact(&folder));
}

/// First the positions of a body, then their differences in the last frame.
fn first_and_last(document: &Value, binary: &[u8], name: &str) -> [Vec<[f32; 3]>; 2] {
    let nodes = document["nodes"].as_array().unwrap();
    let node = nodes.iter().find(|node| node["name"] == name).unwrap();
    let number = |value: &Value| value.as_u64().unwrap() as usize;
    let primitive = &document["meshes"][number(&node["mesh"])]["primitives"][0];
    let targets = primitive["targets"].as_array().unwrap();
    assert_eq!(targets.len(), 12);
    [&primitive["attributes"], &targets[11]].map(|attributes| {
        let accessor = &document["accessors"][number(&attributes["POSITION"])];
        let view = &document["bufferViews"][number(&accessor["bufferView"])];
        let at = number(&view["byteOffset"]) + number(&accessor["byteOffset"]);
        let bytes = &binary[at..at + 12 * number(&accessor["count"])];
        let float = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().unwrap());
        bytes
            .chunks(12)
            .map(|v| [float(&v[..4]), float(&v[4..8]), float(&v[8..])])
            .collect()
    })
}

#[test]
fn the_last_target_of_a_glb_leads_to_the_exact_state() {
    let folder = recorded("export-glb");
    let said = succeeds(&folder, "export x.rrd --glb x.glb");
    assert!(
        said.contains("x.glb: 13 frames from t = 0 s to 0.2 s"),
        "{said}"
    );
    let file = fs::read(folder.join("x.glb")).unwrap();
    let length = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
    let document: Value = serde_json::from_slice(&file[20..20 + length]).unwrap();
    let binary = &file[28 + length..];
    let exact = exact(&folder);
    let (sheet, chain) = exact.split_at(PARTICLES[0]);
    for (name, exact) in [("my sheet", sheet), ("chain", chain)] {
        let [base, moved] = first_and_last(&document, binary, name);
        assert_eq!(base.len(), exact.len());
        assert!(moved.iter().any(|d| d[1] < -0.05), "{name} fell");
        for ((base, moved), exact) in base.iter().zip(&moved).zip(exact) {
            for axis in 0..3 {
                let off = (base[axis] + moved[axis] - exact[axis]).abs();
                assert!(off <= 2.0 * f32::EPSILON, "{name} is {off} m off");
            }
        }
    }
    // Keyframes ease in and out: 3 t² − 2 t³ of the way.
    let [_, ball] = first_and_last(&document, binary, "ball");
    let off = |d: &[f32; 3]| (d[2] - 0.104).abs();
    assert!(ball.iter().all(|d| off(d) < 1e-6), "{:?}", ball[0]);
}

#[test]
fn several_formats_at_a_time() {
    let folder = recorded("export-all");
    let args = "export x.rrd --csv a.csv --obj obj --ply ply --glb a.glb --at 0.105";
    let said = succeeds(&folder, args);
    // Frames are the first steps at or after each 1/60 s.
    assert_eq!(said.matches("1 frame at t = 0.1 s").count(), 3, "{said}");
    assert_eq!(files(&folder.join("obj")), ["frame-000006.obj"]);
    assert_eq!(files(&folder.join("ply")), ["frame-000006.ply"]);
}

#[test]
fn nothing_is_overwritten_or_left_half_written() {
    let folder = recorded("export-refused");
    let recording = fs::read(folder.join("x.rrd")).unwrap();
    fs::write(folder.join("old"), "older").unwrap();
    let before = files(&folder);
    let cases: &[(&str, &[&str])] = &[
        ("", &["--csv", "--obj", "--ply", "--glb", "required"]),
        ("--glb old", &["--glb old exists already", "--force"]),
        ("--csv old", &["--csv old exists already", "--force"]),
        (
            "--obj old --force",
            &["--obj old can't be written", "ot a dir"],
        ),
        ("--obj new/frames", &["new/frames", "create its folder"]),
        ("--glb new/x.glb", &["new/x.glb", "create its folder"]),
        ("--glb x.rrd --force", &["that is the recording"]),
        ("--glb a --csv ./a", &["another output"]),
        ("--glb a --every 0", &["--every"]),
        ("--glb a --every 2 --at 1", &["--every", "--at"]),
        ("--csv a --every 2", &["one state", "--at"]),
        ("--glb a --at soon", &["--at soon", "`last` or seconds"]),
        (
            "--obj a --at -1",
            &["no frame at or before -1 s", "first is at 0 s"],
        ),
        (
            "--glb . --force",
            &["--glb . can't be written", "directory"],
        ),
    ];
    for (args, words) in cases {
        fails(&folder, &format!("export x.rrd {args}"), 2, words);
        assert_eq!(files(&folder), before, "{args}");
    }
    fails(
        &folder,
        "export missing.rrd --obj a",
        2,
        &["missing.rrd", "No such file"],
    );
    for format in ["glb", "csv"] {
        let args = format!("export x.rrd --{format} /dev/full");
        fails(
            &folder,
            &args,
            1,
            &["/dev/full", "No space left", "make room"],
        );
    }
    assert_eq!(files(&folder), before);
    assert_eq!(fs::read(folder.join("old")).unwrap(), b"older");
    assert!(fs::read(folder.join("x.rrd")).unwrap() == recording);
    succeeds(&folder, "export x.rrd --glb old --force");
    assert_eq!(&fs::read(folder.join("old")).unwrap()[..4], b"glTF");
}

/// The recording of a run that was killed gives the frames that are whole; one without any is refused.
#[test]
fn a_cut_recording_gives_whole_frames() {
    let folder = recorded("export-cut");
    let whole = fs::read(folder.join("x.rrd")).unwrap();
    succeeds(&folder, "export x.rrd --obj whole");
    let mut most = 0;
    for tenth in 1..10 {
        fs::write(folder.join("cut.rrd"), &whole[..whole.len() * tenth / 10]).unwrap();
        let ended = muslin(&folder, "export cut.rrd --obj cut --glb cut.glb --force");
        if ended.code == Some(2) {
            assert!(ended.err.contains("cut.rrd"), "{ended:#?}");
            continue;
        }
        assert_eq!(ended.code, Some(0), "{ended:#?}");
        for name in files(&folder.join("cut")) {
            let read = |of: &str| fs::read(folder.join(of).join(&name)).unwrap();
            assert!(read("cut") == read("whole"), "{name} of {tenth}/10");
        }
        most = most.max(files(&folder.join("cut")).len());
    }
    assert!(most > 0, "no cut left a frame");
}
