//! The real viewer's server on this machine: whatever it does, the file is complete and the run goes on.
//!
//! The viewer is the one of `rerun-sdk` (`.ci/viewer` installs it); where it can't be had these tests only say so, but for
//! the continuous checks, which set `CI`.

use crate::support;
use crate::support::background::{Running, wait_for};
use crate::support::program::{muslin_succeeds, read, report, write};
use muslin::replay::{Layout, for_each_frame};
use std::fs;
use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

fn folder(test: &str) -> PathBuf {
    support::folder(&format!("live/{test}"))
}

/// The viewer's program, if it can be had.
fn viewer() -> Option<&'static Path> {
    static VIEWER: OnceLock<Option<PathBuf>> = OnceLock::new();
    let found = VIEWER.get_or_init(|| {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join(".ci/viewer");
        let output = Command::new(script).output().ok()?;
        let path = PathBuf::from(String::from_utf8(output.stdout).ok()?.trim());
        (output.status.success() && path.is_file()).then_some(path)
    });
    assert!(
        found.is_some() || std::env::var_os("CI").is_none(),
        ".ci/viewer can't install the viewer"
    );
    if found.is_none() {
        eprintln!("the viewer of PyPI can't be had: nothing is tested with it");
    }
    found.as_deref()
}

/// A free port.
fn port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().port()
}

/// The viewer's server, which writes what it receives to a file.
fn serve(port: u16, received: &Path) -> Running {
    let child = Command::new(viewer().unwrap())
        .args(["--port", &port.to_string(), "--bind", "127.0.0.1", "--save"])
        .arg(received)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the viewer starts");
    wait_for("the viewer", || {
        TcpStream::connect(("127.0.0.1", port)).ok()
    });
    Running(child)
}

/// A sheet with some 200 kB a frame, whose run takes some seconds; `seconds` simulated.
fn scene(seconds: f64) -> String {
    format!(
        "name = \"live\"\nduration = {seconds:?}\n[[cloth]]\nname = \"sheet\"\n\
         shape = {{ sheet = {{ size = [1.0, 1.0], cells = [80, 80] }} }}\n\
         material = {{ area_density = 0.2, stretch = 100.0 }}\ndamping = {{ mass = 0.5, stiffness = 0.001 }}\n\
         [[pin]]\ncloth = \"sheet\"\nselect = {{ edge = \"left\" }}\n[solver]\ndt = 0.008\n[record]\nerror = 0.0\n"
    )
}

fn starts(folder: &Path, port: u16) -> Running {
    let args = format!(
        "scene.toml --save a.rrd --report r.json --connect rerun+http://127.0.0.1:{port}/proxy"
    );
    let child: Child = Command::new(assert_cmd::cargo::cargo_bin!("muslin"))
        .args(args.split_whitespace())
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(fs::File::create(folder.join("said.txt")).unwrap())
        .spawn()
        .expect("muslin starts");
    Running(child)
}

/// Waits until the recording has so many bytes.
fn grown(folder: &Path, bytes: u64) {
    let length = || fs::metadata(folder.join("a.rrd")).map_or(0, |file| file.len());
    wait_for("frames", || (length() > bytes).then_some(()));
}

/// Waits for the run's end. Everything is in the file; returns the number of frames and of those that the viewer missed.
fn ends(folder: &Path, mut run: Running) -> (u64, u64) {
    let start = Instant::now();
    let status = loop {
        if let Some(status) = run.0.try_wait().expect("a child") {
            break status;
        }
        assert!(start.elapsed() < Duration::from_secs(120), "the run hangs");
        thread::sleep(Duration::from_millis(20));
    };
    assert!(status.success(), "{}", read(folder, "said.txt"));
    let report = report(folder, "r.json");
    let frames = report["recorded_frames"].as_u64().unwrap();
    let recorded = frames_of(&folder.join("a.rrd"));
    assert_eq!(
        recorded,
        (0..frames).collect::<Vec<_>>(),
        "frames in the file"
    );
    assert_eq!(
        Layout::read(&folder.join("a.rrd")).unwrap().frames,
        Some(frames)
    );
    (frames, report["dropped_live_frames"].as_u64().unwrap())
}

/// Numbers of the frames that have the cloth's mesh; the triangles must be there, too.
fn frames_of(path: &Path) -> Vec<u64> {
    let layout = Layout::read(path).unwrap();
    assert_eq!(layout.cloths[0].triangles.len(), 2 * 80 * 80);
    let mut numbers = Vec::new();
    for_each_frame(path, &layout, |frame| {
        numbers.push(frame.index);
        ControlFlow::Continue(())
    })
    .unwrap();
    numbers
}

fn signal(process: &Running, name: &str) {
    let id = process.0.id().to_string();
    assert!(
        Command::new("kill")
            .args([name, &id])
            .status()
            .unwrap()
            .success()
    );
}

#[test]
fn a_viewer_gets_every_frame_or_they_are_counted() {
    if viewer().is_none() {
        return;
    }
    let folder = folder("present");
    write(&folder, "scene.toml", &scene(2.0));
    let port = port();
    let server = serve(port, &folder.join("received.rrd"));
    let (frames, dropped) = ends(&folder, starts(&folder, port));
    thread::sleep(Duration::from_millis(500)); // for the server to write
    drop(server);
    let received = frames_of(&folder.join("received.rrd")).len() as u64;
    assert!(
        received + dropped >= frames && received <= frames,
        "{received} of {frames} frames received, {dropped} dropped"
    );
    assert_eq!(dropped, 0, "a viewer on the same machine keeps up");
}

#[test]
fn a_killed_viewer_that_comes_again_shows_the_mesh() {
    if viewer().is_none() {
        return;
    }
    let folder = folder("killed");
    write(&folder, "scene.toml", &scene(12.0));
    let port = port();
    let first = serve(port, &folder.join("first.rrd"));
    let run = starts(&folder, port);
    grown(&folder, 10_000_000);
    drop(first);
    grown(&folder, 20_000_000);
    let again = serve(port, &folder.join("again.rrd"));
    let (frames, dropped) = ends(&folder, run);
    thread::sleep(Duration::from_millis(500));
    drop(again);
    let seen = frames_of(&folder.join("again.rrd"));
    assert_eq!(seen.last(), Some(&(frames - 1)), "it follows to the end");
    assert!(dropped < frames, "{dropped} of {frames} dropped");
}

#[test]
fn a_stopped_viewer_holds_nothing_up() {
    if viewer().is_none() {
        return;
    }
    let folder = folder("stopped");
    write(&folder, "scene.toml", &scene(30.0));
    let port = port();
    let server = serve(port, &folder.join("received.rrd"));
    let run = starts(&folder, port);
    grown(&folder, 5_000_000);
    signal(&server, "-STOP");
    // The run ends while the viewer stands still: 400 MB don't fit into any line.
    let (frames, dropped) = ends(&folder, run);
    signal(&server, "-CONT");
    assert!(dropped > 0, "none of {frames} frames counted as dropped");
    let said = read(&folder, "said.txt");
    assert!(said.contains("live frames dropped"), "{said}");
}

/// Passes on at most so many bytes a second.
fn slow_line(to: u16, bytes_per_second: f64) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    in_the_background(move || {
        for near in listener.incoming() {
            let (Ok(near), Ok(far)) = (near, TcpStream::connect(("127.0.0.1", to))) else {
                return;
            };
            let (near2, far2) = (near.try_clone().unwrap(), far.try_clone().unwrap());
            in_the_background(move || pass(near, far, 1.0 / bytes_per_second));
            in_the_background(move || pass(far2, near2, 0.0));
        }
    });
    port
}

/// Passes on what comes, with so many seconds a byte.
fn pass(mut from: TcpStream, mut to: TcpStream, pause: f64) {
    let mut bytes = vec![0; 16 << 10];
    while let Ok(n @ 1..) = from.read(&mut bytes) {
        if to.write_all(&bytes[..n]).is_err() {
            break;
        }
        thread::sleep(Duration::from_secs_f64(pause * n as f64));
    }
    to.shutdown(Shutdown::Both).ok();
}

/// Ends with the tests.
fn in_the_background(work: impl FnOnce() + Send + 'static) {
    let thread = thread::Builder::new().name("line".to_owned());
    thread.spawn(work).expect("a thread");
}

#[test]
fn a_slow_line_holds_nothing_up() {
    if viewer().is_none() {
        return;
    }
    let folder = folder("slow");
    write(&folder, "scene.toml", &scene(20.0));
    let port = port();
    let server = serve(port, &folder.join("received.rrd"));
    let slow = slow_line(port, 2e6);
    let (frames, dropped) = ends(&folder, starts(&folder, slow));
    drop(server);
    assert!(dropped > 0, "none of {frames} frames counted as dropped");
    let received = frames_of(&folder.join("received.rrd"));
    assert!(!received.is_empty(), "it shows nothing");
}

/// Without any viewer, the one that we serve is fetched by one that comes late.
#[test]
fn a_viewer_that_comes_late_is_served() {
    if viewer().is_none() {
        return;
    }
    let folder = folder("served");
    write(&folder, "scene.toml", &scene(12.0));
    let port = port();
    let child = Command::new(assert_cmd::cargo::cargo_bin!("muslin"))
        .args(format!("scene.toml --save a.rrd --quiet --serve {port}").split_whitespace())
        .current_dir(&folder)
        .spawn();
    let mut run = Running(child.expect("muslin starts"));
    grown(&folder, 10_000_000);
    let fetched = folder.join("fetched.rrd");
    let mut late = Running(
        Command::new(viewer().unwrap())
            .args([
                "--connect",
                &format!("rerun+http://127.0.0.1:{port}/proxy"),
                "--save",
            ])
            .arg(&fetched)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the viewer starts"),
    );
    let status = run.0.wait().expect("it ends");
    assert!(status.success());
    wait_for("the viewer", || late.0.try_wait().expect("a child"));
    let seen = frames_of(&fetched);
    assert_eq!(seen.first(), Some(&0), "with all that was before it came");
    muslin_succeeds(&folder, "verify a.rrd --quiet");
}
