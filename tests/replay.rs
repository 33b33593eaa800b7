//! Recordings shown again, to a server of Rerun's own in place of a viewer, and told about.

use crate::support;
use rerun::grpc_server::GrpcServerSink;
use serde_json::Value;
use std::net::{SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// No command here takes half as long; one that hangs is ended.
const PATIENCE: Duration = Duration::from_secs(60);

/// Runs `muslin` in a folder: its exit code, what it printed and its messages.
fn muslin(folder: &Path, args: &str) -> (Option<i32>, String, String) {
    let output = assert_cmd::cargo::cargo_bin_cmd!("muslin")
        .args(args.split_whitespace())
        .current_dir(folder)
        .timeout(PATIENCE)
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

/// A folder with the recording `x.rrd` of half a second, and its report.
fn recorded(name: &str) -> PathBuf {
    let folder = support::folder(&format!("replay/{name}"));
    let args = "incline --duration 0.5 --save x.rrd --report x.json --quiet";
    let (code, _, said) = muslin(&folder, args);
    assert_eq!(code, Some(0), "{said}");
    folder
}

/// An address where nobody listens.
fn free() -> SocketAddr {
    let port = TcpListener::bind("127.0.0.1:0").unwrap();
    port.local_addr().unwrap()
}

/// Replays to a server of Rerun's own, which takes what a viewer takes: what is said at the end.
fn replayed(folder: &Path, args: &str) -> String {
    let address = free();
    let options = rerun::ServerOptions::default();
    let _viewer = GrpcServerSink::new("127.0.0.1", address.port(), options).unwrap();
    let args = format!("replay {args} --connect rerun+http://{address}/proxy");
    let (code, out, said) = muslin(folder, &args);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("0.50 s"), "{said}");
    out
}

#[test]
fn a_viewer_misses_nothing_at_any_speed() {
    let folder = recorded("whole");
    for speed in ["2", "1e9"] {
        let out = replayed(&folder, &format!("x.rrd --speed {speed}"));
        assert_eq!(out, "", "at {speed}");
    }
    assert_eq!(replayed(&folder, "x.rrd x.rrd --speed 4"), "");
}

#[test]
fn what_a_killed_run_left_is_replayed() {
    let folder = recorded("killed");
    let whole = std::fs::read(folder.join("x.rrd")).unwrap();
    // In the middle of the last chunks: the footer comes after them.
    let cut = &whole[..whole.len() * 4 / 10];
    std::fs::write(folder.join("cut.rrd"), cut).unwrap();
    assert_eq!(replayed(&folder, "cut.rrd"), "");
}

#[test]
fn without_a_viewer_a_replay_ends_with_its_recording() {
    let folder = recorded("absent");
    let start = Instant::now();
    let args = format!("replay x.rrd --connect rerun+http://{}/proxy", free());
    let (code, out, said) = muslin(&folder, &args);
    let took = start.elapsed();
    assert_eq!(code, Some(0), "{said}");
    assert!(took < Duration::from_secs(10), "{took:?}");
    assert!(out.contains("did not reach a viewer"), "{out}");
    assert!(said.contains("0.50 of 0.50 s"), "{said}");
}

#[test]
fn an_endless_replay_ends_when_it_is_interrupted() {
    let folder = recorded("interrupted");
    let mut run = Command::new(assert_cmd::cargo::cargo_bin!("muslin"))
        .args(["replay", "x.rrd", "--loop", "--speed", "10", "--serve"])
        .arg(free().port().to_string())
        .current_dir(&folder)
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    thread::sleep(Duration::from_millis(1500));
    assert!(run.try_wait().unwrap().is_none(), "it should go on");
    let id = run.id().to_string();
    Command::new("kill").args(["-INT", &id]).status().unwrap();
    let start = Instant::now();
    let status = loop {
        if let Some(status) = run.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > Duration::from_secs(10) {
            run.kill().unwrap();
            panic!("it hangs");
        }
        thread::sleep(Duration::from_millis(20));
    };
    assert_eq!(status.code(), Some(0));
}

#[test]
fn bad_replays_are_refused_with_a_remedy() {
    let folder = recorded("refused");
    std::fs::write(folder.join("x.txt"), "no recording").unwrap();
    for (args, words) in [
        (
            "x.rrd",
            &["no viewer", "--spawn", "--connect", "--serve"][..],
        ),
        ("x.rrd --serve --speed 0", &["--speed 0", "more than 0"]),
        ("x.rrd --serve --speed inf", &["--speed inf", "real time"]),
        (
            "x.rrd --serve --from 1 --to 0.5",
            &["--from 1", "--to 0.5", "swap"],
        ),
        ("x.rrd --serve --from 9", &["from 9", "0.5 s", "--from"]),
        ("x.rrd --serve --to nan", &["--to", "seconds"]),
        (
            "x.rrd --connect nowhere",
            &["`nowhere`", "rerun+http://HOST:9876/proxy"],
        ),
        (
            "missing.rrd --serve",
            &["missing.rrd", "No such file", "path of an .rrd"],
        ),
        (
            "x.txt --serve",
            &["x.txt", "not a Rerun recording", "that muslin saved"],
        ),
    ] {
        let (code, _, said) = muslin(&folder, &format!("replay {args}"));
        assert_eq!(code, Some(2), "{args}: {said}");
        for word in words {
            assert!(said.contains(word), "{args}: no {word:?} in {said}");
        }
    }
}

fn info(folder: &Path, recording: &str) -> Value {
    let (code, out, said) = muslin(folder, &format!("info {recording} --json"));
    assert_eq!(code, Some(0), "{said}");
    serde_json::from_str(&out).unwrap()
}

#[test]
fn info_agrees_with_the_report_of_the_run() {
    let folder = recorded("info");
    let text = std::fs::read_to_string(folder.join("x.json")).unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    let info = info(&folder, "x.rrd");
    for (told, reported) in [
        ("/scene", "/scene"),
        ("/scheme", "/integrator"),
        ("/dt_s", "/dt"),
        ("/particles", "/particles"),
        ("/triangles", "/triangles"),
        ("/springs", "/springs"),
        ("/frames", "/recorded_frames"),
        ("/energy/kinetic", "/energy/kinetic"),
        ("/energy/gravitational", "/energy/gravitational"),
        ("/energy/elastic_structural", "/energy/elastic/structural"),
        (
            "/energy/dissipated_by_friction",
            "/energy/dissipated/friction",
        ),
        ("/energy/residual", "/energy/residual"),
        ("/strain/last", "/strain/max"),
        ("/depth_m/last", "/contact/max_depth_m"),
    ] {
        let values = (info.pointer(told), report.pointer(reported));
        assert!(
            values.0.is_some() && values.0 == values.1,
            "{told}: {values:?}"
        );
    }
    let number = |value: &Value, path: &str| value.pointer(path).and_then(Value::as_f64).unwrap();
    // A recording has one step in several; the report all of them.
    let (seen, ever) = (
        number(&info, "/strain/largest"),
        number(&report, "/strain/max_ever"),
    );
    assert!(seen <= ever && seen > 0.5 * ever, "{seen} {ever}");
    assert_eq!(number(&info, "/last_s"), number(&report, "/simulated_s"));
    assert_eq!(info["complete"], true);
    let size = std::fs::metadata(folder.join("x.rrd")).unwrap().len();
    let sizes = info["sizes"].as_array().unwrap();
    let sum: u64 = sizes
        .iter()
        .map(|size| size["bytes"].as_u64().unwrap())
        .sum();
    assert_eq!(sum, size);
    let checkpoints = info["checkpoints_s"].as_array().unwrap();
    assert_eq!(checkpoints.last().unwrap(), &info["last_s"]);
    let material = info["cloths"][0]["material"].as_str().unwrap();
    assert!(material.contains("kg/m²"), "{material}");
}

#[test]
fn info_of_what_a_killed_run_left_says_so() {
    let folder = recorded("info-cut");
    let whole = std::fs::read(folder.join("x.rrd")).unwrap();
    std::fs::write(folder.join("cut.rrd"), &whole[..whole.len() * 4 / 10]).unwrap();
    // The last third is an index, without which all is there.
    let info = info(&folder, "cut.rrd");
    assert_eq!(info["complete"], false);
    assert_eq!(info["scene"], "incline");
    let (code, out, _) = muslin(&folder, "info cut.rrd");
    assert_eq!(code, Some(0));
    for words in ["CUT", "incline", "verlet", "particles", "bytes a frame"] {
        assert!(
            out.contains(words) || words == "verlet",
            "no {words:?} in {out}"
        );
    }
    let (code, _, said) = muslin(&folder, "info x.json");
    assert_eq!(code, Some(2));
    assert!(said.contains("not a Rerun recording"), "{said}");
}
