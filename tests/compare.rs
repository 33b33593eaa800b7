//! Two recordings on one timeline: the distances are those of the states themselves.

use crate::support;
use crate::support::program::{muslin_succeeds, refused};
use glam::DVec3;
use muslin::integrator::Integrator;
use muslin::replay::{Layout, for_each_frame};
use muslin::scene;
use muslin::simulation::Simulation;
use muslin::study::Distance;
use muslin::study::compare::compare;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

fn folder(test: &str) -> PathBuf {
    support::folder(&format!("compare/{test}"))
}

/// States of a scene after each step, with their times.
fn states(scene: &str, changes: &[&str], dt: f64, duration: f64) -> Vec<(f64, Vec<DVec3>)> {
    let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
    let loaded = scene::load(scene, &changes).unwrap();
    let built = scene::build(&loaded).unwrap();
    let scheme = Integrator::of(&loaded.scene.solver);
    let mut simulation = Simulation::new(built.model, built.state, scheme, dt);
    let mut states = Vec::new();
    loop {
        let state = simulation.state();
        states.push((state.time, state.positions.clone()));
        if state.time > duration - 0.5 * dt {
            return states;
        }
        simulation.step().unwrap();
    }
}

/// The state at a time that a step ends at.
fn at(states: &[(f64, Vec<DVec3>)], time: f64) -> &[DVec3] {
    let found = states.iter().find(|(t, _)| (t - time).abs() < 1e-8);
    &found.unwrap_or_else(|| panic!("no step ends at {time}")).1
}

#[test]
fn a_run_is_as_far_from_itself_as_nothing() {
    let folder = folder("self");
    muslin_succeeds(&folder, "hanging-cloth --duration 0.3 --save a.rrd");
    let said = muslin_succeeds(&folder, "compare a.rrd a.rrd --save both.rrd").out;
    assert!(said.contains("RMS 0 mm, largest 0 mm"), "{said}");
    assert!(said.contains("never apart"), "{said}");
    let layout = Layout::read(&folder.join("both.rrd")).unwrap();
    let names: Vec<_> = layout
        .cloths
        .iter()
        .map(|cloth| cloth.name.as_str())
        .collect();
    assert_eq!(names, ["A sheet", "B sheet"]);
}

/// Of steps dt and dt/2 the distances are those of the states, at every frame: exactly where both have a frame at the
/// time, and where the second one's is found between its frames as well as is said.
#[test]
fn the_distances_are_those_of_the_states() {
    let folder = folder("steps");
    let scene = "hanging-cloth";
    let coarse = states(scene, &[], 0.004, 0.5);
    let fine = states(scene, &[], 0.002, 0.5);
    for fps in [50, 60] {
        for (dt, name) in [("0.004", "a"), ("0.002", "b")] {
            let args =
                format!("{scene} --dt {dt} --fps {fps} --duration 0.5 --save {name}{fps}.rrd");
            muslin_succeeds(&folder, &args);
        }
        let [a, b] = ["a", "b"].map(|name| folder.join(format!("{name}{fps}.rrd")));
        let comparison = compare(&a, &b).unwrap();
        assert!(comparison.times.len() > usize::try_from(fps / 2 - 2).unwrap());
        assert!(comparison.one_mesh);
        let said = comparison.unseen;
        assert_eq!(said.largest > 0.0, fps == 60, "{said:?}");
        let [mut largest, mut worst] = [0.0_f64; 2];
        for (time, found) in comparison.times.iter().zip(&comparison.each) {
            let exact = Distance::between(at(&coarse, *time), at(&fine, *time));
            for (found, exact, said) in [
                (found.rms, exact.rms, said.rms),
                (found.largest, exact.largest, said.largest),
            ] {
                let off = (found - exact).abs();
                worst = worst.max(off);
                // Recorded positions are rounded to 1e-7 m.
                assert!(
                    off <= said + 3e-7,
                    "{fps} frames a second, t = {time}: {found} against {exact}"
                );
                largest = largest.max(exact);
            }
        }
        assert!(largest > 1e-3, "hardly apart: {largest}");
        eprintln!("{fps} frames a second: off by {worst:e} m at most, {said:?} said");
        assert!(said.largest < 100.0 * worst.max(1e-7), "that says nothing");
    }
}

/// Sheets of 10 and 20 cells are compared at the particles that they share.
#[test]
fn resolutions_compare_by_their_material() {
    let folder = folder("cells");
    let cells = |n: u32| format!("cloth.0.shape.sheet.cells=[{n},{n}]");
    for n in [10, 20] {
        let args = format!(
            "hanging-cloth --set {} --fps 50 --duration 0.3 --save {n}.rrd",
            cells(n)
        );
        muslin_succeeds(&folder, &args);
    }
    let [coarse, fine] = [10, 20].map(|n| states("hanging-cloth", &[&cells(n)], 0.004, 0.3));
    for (a, b) in [("10.rrd", "20.rrd"), ("20.rrd", "10.rrd")] {
        let comparison = compare(&folder.join(a), &folder.join(b)).unwrap();
        assert_eq!((comparison.particles, comparison.one_mesh), (121, false));
        for (time, found) in comparison.times.iter().zip(&comparison.each) {
            let all = at(&fine, *time);
            let shared = (0..121).map(|i| all[2 * (i / 11) * 21 + 2 * (i % 11)]);
            let shared: Vec<DVec3> = shared.collect();
            let exact = Distance::between(at(&coarse, *time), &shared);
            let off = (found.rms - exact.rms)
                .abs()
                .max((found.largest - exact.largest).abs());
            assert!(
                off < 3e-7,
                "{a} and {b} at {time}: {found:?} against {exact:?}"
            );
        }
    }
    let ended = muslin_succeeds(
        &folder,
        "compare 10.rrd 20.rrd --save both.rrd --visible 1mm",
    );
    assert!(
        ended.out.contains("121 particles of the coarser mesh"),
        "{}",
        ended.out
    );
    assert!(ended.out.contains("visibly apart"), "{}", ended.out);
    assert_eq!(frames(&folder.join("both.rrd")), 16);
}

fn frames(path: &Path) -> usize {
    let layout = Layout::read(path).unwrap();
    let mut count = 0;
    for_each_frame(path, &layout, |_| {
        count += 1;
        ControlFlow::Continue(())
    })
    .unwrap();
    count
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let folder = folder("refused");
    muslin_succeeds(&folder, "hanging-cloth --duration 0.05 --save a.rrd");
    muslin_succeeds(&folder, "sheets --duration 0.05 --save b.rrd");
    refused(
        &folder,
        "compare a.rrd b.rrd",
        &["a.rrd", "b.rrd", "1 and 5 cloths"],
    );
    refused(
        &folder,
        "compare a.rrd missing.rrd",
        &["missing.rrd", "No such file"],
    );
    refused(
        &folder,
        "compare a.rrd a.rrd --save a.rrd --force",
        &["a.rrd", "one of the recordings"],
    );
    muslin_succeeds(
        &folder,
        "resume a.rrd --at 0 --duration 0.5 --save c.rrd --set record.fps=10",
    );
    muslin_succeeds(&folder, "resume c.rrd --at 0.5 --duration 0.6 --save d.rrd");
    let said = muslin_succeeds(&folder, "compare c.rrd d.rrd").out;
    assert!(said.contains("RMS 0 mm"), "one run, told twice: {said}");
    refused(
        &folder,
        "compare a.rrd d.rrd",
        &["a.rrd", "d.rrd", "no time in common"],
    );
}
