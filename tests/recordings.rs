//! Recordings that nothing destroys, and what can be done with them: going on, branching, running again.

use crate::support;
use crate::support::background::{Running, wait_for};
use crate::support::program::{Ended, muslin, muslin_succeeds, read, refused, report, says, write};
use muslin::frame::Capture;
use muslin::integrator::Integrator;
use muslin::pipeline::Plan;
use muslin::replay::{Layout, Verdict, state_hashes, verify};
use muslin::scene;
use muslin::simulation::Simulation;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

fn folder(test: &str) -> PathBuf {
    support::folder(&format!("recordings/{test}"))
}

/// A scene that makes a frame of 4 kB every millisecond of wall time or so, for ever.
const ENDLESS: &str = r#"name = "endless"
duration = 100000.0

[[cloth]]
name = "sheet"
shape = { sheet = { size = [0.5, 0.5], cells = [12, 12] } }
material = { area_density = 0.2, stretch = 100.0 }
damping = { mass = 0.5, stiffness = 0.001 }

[[pin]]
cloth = "sheet"
select = { edge = "left" }

[solver]
integrator = "bdf2"
dt = 0.004

[record]
checkpoint = 0.1
"#;

fn starts(folder: &Path, args: &str) -> Running {
    let child = Command::new(assert_cmd::cargo::cargo_bin!("muslin"))
        .args(args.split_whitespace())
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    Running(child.expect("muslin starts"))
}

fn last_csv(folder: &Path, recording: &str) -> String {
    let csv = format!("{recording}.csv");
    muslin_succeeds(folder, &format!("export {recording} --csv {csv}"));
    read(folder, &csv)
}

/// Resumed at three times, a run ends with the same table, for a scheme with memory and one without; so does a run
/// that was resumed twice.
#[test]
fn a_resumed_run_ends_as_if_never_stopped() {
    for (scene, settings) in [
        ("hanging-cloth", "--integrator bdf2"),
        ("hanging-cloth", "--integrator symplectic-euler --dt auto"),
        (
            "drape",
            "--integrator bdf2 --set cloth.0.shape.sheet.cells=[24,24]",
        ),
        ("drape", "--set cloth.0.shape.sheet.cells=[24,24]"),
    ] {
        let folder = folder("resumed");
        let args =
            format!("{scene} {settings} --duration 0.8 --set record.checkpoint=0.1 --save a.rrd");
        muslin_succeeds(&folder, &args);
        let whole = last_csv(&folder, "a.rrd");
        for at in ["0.05", "0.31", "0.7"] {
            let name = format!("b{at}.rrd");
            muslin_succeeds(&folder, &format!("resume a.rrd --at {at} --save {name}"));
            assert!(
                last_csv(&folder, &name) == whole,
                "{scene} {settings}: resumed at {at} s, it ends otherwise"
            );
        }
        muslin_succeeds(
            &folder,
            "resume b0.31.rrd --at 0.55 --save c.rrd --threads 1",
        );
        assert!(
            last_csv(&folder, "c.rrd") == whole,
            "{scene} {settings}: resumed twice"
        );
        let said = muslin_succeeds(&folder, "verify c.rrd").out;
        assert!(said.contains("bit for bit"), "{said}");
    }
}

/// A change branches: the new recording starts where the old one was, says so, and can itself be resumed and verified.
#[test]
fn a_change_branches() {
    let folder = folder("branch");
    let args = "hanging-cloth --duration 0.4 --set record.checkpoint=0.1 --save a.rrd";
    muslin_succeeds(&folder, args);
    let stiffer = "resume a.rrd --at 0.2 --set cloth.0.material.stretch=2000 --save b.rrd";
    let ended = muslin_succeeds(&folder, stiffer);
    let origin = "goes on from a.rrd at 0.2 s, with cloth.0.material.stretch=2000";
    says(&ended, &[origin]);
    let state = |recording: &str, at: &str| {
        let csv = "export --csv t.csv --force";
        muslin_succeeds(&folder, &format!("{csv} {recording} --at {at}"));
        read(&folder, "t.csv")
    };
    assert!(
        state("a.rrd", "0.2") == state("b.rrd", "0.2"),
        "another start"
    );
    assert!(state("a.rrd", "0.4") != state("b.rrd", "0.4"), "no change");
    muslin_succeeds(&folder, "resume b.rrd --at 0.3 --save c.rrd");
    assert!(
        state("b.rrd", "last") == state("c.rrd", "last"),
        "a resumed branch"
    );
    for recording in ["b.rrd", "c.rrd"] {
        let said = muslin_succeeds(&folder, &format!("verify {recording}")).out;
        assert!(said.contains("bit for bit"), "{said}");
    }
    // Going on for longer changes nothing before.
    muslin_succeeds(&folder, "resume a.rrd --duration 0.5 --save d.rrd");
    muslin_succeeds(&folder, "hanging-cloth --duration 0.5 --save e.rrd");
    assert!(
        state("d.rrd", "last") == state("e.rrd", "last"),
        "a longer run"
    );
}

#[test]
fn what_cannot_go_on_is_refused() {
    let folder = folder("refused");
    muslin_succeeds(&folder, "hanging-cloth --duration 0.05 --save a.rrd");
    let other = "resume a.rrd --at 0 --set cloth.0.shape.sheet.cells=[5,5]";
    refused(&folder, other, &["a.rrd", "other particles"]);
    refused(&folder, "resume a.rrd", &["a.rrd", "0.05", "--duration"]);
    refused(
        &folder,
        "resume a.rrd --at -1",
        &["a.rrd", "first is at 0 s"],
    );
    refused(
        &folder,
        "resume a.rrd --at 0 --save a.rrd --force",
        &["a.rrd", "used already"],
    );
    refused(
        &folder,
        "resume missing.rrd",
        &["missing.rrd", "No such file"],
    );
    refused(
        &folder,
        "verify missing.rrd",
        &["missing.rrd", "No such file"],
    );
}

/// Meshes that a scene names go with the recording: it can be resumed and verified where they aren't.
#[test]
fn a_recording_brings_its_meshes() {
    let folder = folder("meshes");
    let corner = |i: u32| {
        let [x, y, z] = [i & 1, i >> 1 & 1, i >> 2 & 1].map(|bit| f64::from(bit) - 0.5);
        format!("v {x} {y} {z}\n")
    };
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    write(
        &folder,
        "in/body.obj",
        &((0..8).map(corner).collect::<String>() + faces),
    );
    let scene = "name = \"on a box\"\nduration = 0.3\n[[cloth]]\nname = \"sheet\"\ntranslate = [0.0, 0.51, 0.0]\n\
        shape = { sheet = { size = [0.8, 0.8], cells = [12, 12] } }\n\
        material = { area_density = 0.2, stretch = 100.0 }\n\
        [[obstacle]]\nname = \"box\"\nshape = { obj = { path = \"body.obj\" } }\n\
        [solver]\ndt = 0.004\n[record]\ncheckpoint = 0.1\n";
    write(&folder, "in/scene.toml", scene);
    muslin_succeeds(&folder, "in/scene.toml --save a.rrd");
    fs::remove_dir_all(folder.join("in")).unwrap();
    muslin_succeeds(&folder, "resume a.rrd --at 0.15 --save b.rrd");
    assert!(last_csv(&folder, "a.rrd") == last_csv(&folder, "b.rrd"));
    muslin_succeeds(&folder, "verify a.rrd");
}

/// Verifying sees a state that isn't what the scene gives.
#[test]
fn verify_sees_another_state() {
    let folder = folder("verify");
    muslin_succeeds(&folder, "hanging-cloth --duration 0.2 --save a.rrd");
    let said = muslin_succeeds(&folder, "verify a.rrd --threads 1").out;
    assert!(said.contains("all 13 frames"), "{said}");
    let path = folder.join("a.rrd");
    let layout = Layout::read(&path).unwrap();
    let again = |hashes| {
        let loaded = layout.scene("a.rrd").unwrap();
        let built = scene::build(&loaded).unwrap();
        let scheme = Integrator::of(&loaded.scene.solver);
        let simulation = Simulation::new(built.model, built.state, scheme, 0.004);
        let (capture, _) = Capture::new(&loaded, &simulation);
        let stop = AtomicBool::new(false);
        let plan = Plan {
            duration: loaded.scene.duration,
            fps: loaded.scene.record.fps,
            checkpoint: loaded.scene.record.checkpoint,
            error: 0.0,
            threads: 1,
            notes: Vec::new(),
            stop: &stop,
        };
        verify(simulation, capture, hashes, &plan, &mut |_| {}).unwrap()
    };
    let hashes = state_hashes(&path).unwrap();
    assert_eq!(again(hashes.clone()), Verdict::Same { frames: 13 });
    let mut other = hashes;
    other.get_mut(&5).unwrap().hash ^= 1;
    let verdict = again(other);
    let Verdict::Parts {
        frame: 5, same: 5, ..
    } = verdict
    else {
        panic!("{verdict:?}");
    };
}

/// Killed at any moment, a run leaves a recording with all but the last quarter second, which can be exported and
/// resumed.
#[cfg(unix)]
#[test]
fn a_killed_run_leaves_what_it_had() {
    let folder = folder("killed");
    write(&folder, "endless.toml", ENDLESS);
    for kill in 0..10_u64 {
        let name = format!("{kill}.rrd");
        let mut run = starts(&folder, &format!("endless.toml --save {name}"));
        // What comes before the first frame takes as long as the machine is slow.
        let first = format!("export {name} --csv first.csv --force");
        wait_for("a frame", || {
            (muslin(&folder, &first).code == Some(0)).then_some(())
        });
        let length = || fs::metadata(folder.join(&name)).map_or(0, |file| file.len());
        wait_for("frames", || (length() > kill * 150_000).then_some(()));
        std::thread::sleep(Duration::from_millis(7 * kill));
        run.0.kill().expect("it runs");
        run.0.wait().expect("it ends");
        let csv = last_csv(&folder, &name);
        assert_eq!(csv.lines().count(), 1 + 169);
        let said = muslin_succeeds(&folder, &format!("export {name} --csv at.csv --force")).out;
        let time: f64 = said
            .split("t = ")
            .nth(1)
            .and_then(|t| t.split(' ').next())
            .unwrap()
            .parse()
            .unwrap();
        let until = time + 0.2;
        let resume = format!("resume {name} --duration {until} --save r{name}");
        muslin_succeeds(&folder, &resume);
        muslin_succeeds(&folder, &format!("verify r{name}"));
    }
}

/// SIGTERM, as from a batch system, ends a run as Ctrl-C does.
#[cfg(unix)]
#[test]
fn a_terminated_run_completes_its_recording() {
    let folder = folder("terminated");
    write(&folder, "endless.toml", ENDLESS);
    let mut run = starts(&folder, "endless.toml --save a.rrd --report r.json");
    let length = || fs::metadata(folder.join("a.rrd")).map_or(0, |file| file.len());
    wait_for("frames", || (length() > 200_000).then_some(()));
    let id = run.0.id().to_string();
    let killed = Command::new("kill").args(["-TERM", &id]).status();
    assert!(killed.expect("kill is there").success());
    let status = wait_for("the end", || run.0.try_wait().expect("a child"));
    assert_eq!(status.code(), Some(0));
    assert_eq!(report(&folder, "r.json")["outcome"], "stopped");
    let bytes = fs::read(folder.join("a.rrd")).unwrap();
    assert!(
        bytes[bytes.len() - 32..]
            .windows(8)
            .any(|w| w == b"RRF2FOOT")
    );
    muslin_succeeds(&folder, "verify a.rrd");
}

/// An existing recording is spared unless it may be replaced; without a name, another one is found.
#[test]
fn nothing_is_overwritten() {
    let folder = folder("overwritten");
    write(&folder, "old.rrd", "an older recording");
    let run = "hanging-cloth --duration 0.02";
    refused(
        &folder,
        &format!("{run} --save old.rrd"),
        &["old.rrd", "exists", "--force"],
    );
    muslin_succeeds(&folder, &format!("{run} --save old.rrd --force"));
    assert!(fs::metadata(folder.join("old.rrd")).unwrap().len() > 1000);
    for name in [
        "hanging-cloth.rrd",
        "hanging-cloth-2.rrd",
        "hanging-cloth-3.rrd",
    ] {
        assert!(!folder.join(name).exists(), "{name}");
        muslin_succeeds(&folder, run);
        assert!(folder.join(name).exists(), "{name}");
    }
    write(&folder, "hanging-cloth.rrd", "an older recording");
    muslin_succeeds(&folder, &format!("{run} --force"));
    assert!(
        fs::metadata(folder.join("hanging-cloth.rrd"))
            .unwrap()
            .len()
            > 1000
    );
    assert!(!folder.join("hanging-cloth-4.rrd").exists());
}

/// RERUN=0 in the environment switches Rerun off; a recording that was asked for is written nevertheless.
#[test]
fn rerun_off_loses_nothing() {
    let folder = folder("off");
    let status = Command::new(assert_cmd::cargo::cargo_bin!("muslin"))
        .args([
            "hanging-cloth",
            "--duration",
            "0.1",
            "--save",
            "a.rrd",
            "--quiet",
        ])
        .env("RERUN", "0")
        .current_dir(&folder)
        .status()
        .expect("muslin starts");
    assert!(status.success());
    muslin_succeeds(&folder, "verify a.rrd");
}

/// A small disk of its own; unmounted in the end.
#[cfg(target_os = "linux")]
struct SmallDisk(PathBuf);

#[cfg(target_os = "linux")]
impl SmallDisk {
    /// `None` where this process may not mount anything.
    fn new(place: PathBuf, bytes: u32) -> Option<Self> {
        fs::create_dir_all(&place).unwrap();
        let size = format!("size={bytes}");
        let options = ["-t", "tmpfs", "-o", &size, "tmpfs"];
        let mounted = Command::new("mount").args(options).arg(&place).status();
        mounted
            .is_ok_and(|status| status.success())
            .then_some(Self(place))
    }
}

#[cfg(target_os = "linux")]
impl Drop for SmallDisk {
    fn drop(&mut self) {
        Command::new("umount").arg(&self.0).status().ok();
    }
}

/// A disk that fills up ends the run with exit code 1 and the reason, and the file opens.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_ends_the_run() {
    let folder = folder("full");
    write(&folder, "endless.toml", ENDLESS);
    // Where nothing may be mounted, a limit on the size of files stands in for a small disk.
    let disk = SmallDisk::new(folder.join("small"), 3 << 20);
    let (reason, ended) = if disk.is_some() {
        (
            "No space left",
            muslin(&folder, "endless.toml --save small/a.rrd"),
        )
    } else {
        fs::create_dir_all(folder.join("small")).unwrap();
        let program = assert_cmd::cargo::cargo_bin!("muslin")
            .display()
            .to_string();
        let limited =
            format!("trap '' XFSZ; ulimit -f 3000; exec {program} endless.toml --save small/a.rrd");
        let output = Command::new("bash")
            .args(["-c", &limited])
            .current_dir(&folder)
            .output()
            .unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let ended = Ended {
            code: output.status.code(),
            out: text(&output.stdout),
            err: text(&output.stderr),
        };
        ("File too large", ended)
    };
    assert_eq!(ended.code, Some(1), "{ended:?}");
    says(&ended, &[reason, "small/a.rrd"]);
    let said = muslin_succeeds(&folder, "export small/a.rrd --csv a.csv").out;
    assert!(said.contains("169 particles"), "{said}");
}
