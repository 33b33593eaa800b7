//! Replays to viewers that keep what they get, by a clock that only waiting moves.

use super::super::{Messages, Replay};
use super::*;
use crate::frame::{ClothFrame, ClothHeader, Event, Frame, Header, Level, Series};
use crate::recorder::{Recorder, RerunRecorder, Targets, entity};
use rerun::log::Chunk;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

const FRAMES: u16 = 200;
const LAST: f64 = 199.0 / 60.0;

/// A cloth of three particles that rises for 200 frames, with a word in frames 10, 110 and 120.
fn recording(name: &str) -> PathBuf {
    let file = format!("muslin-replay-{}-{name}.rrd", std::process::id());
    let path = std::env::temp_dir().join(file);
    let series = |path: &str, label: &str| Series {
        path: path.to_owned(),
        label: label.to_owned(),
    };
    let header = Header {
        scene: "rise".to_owned(),
        cloths: vec![ClothHeader {
            name: "sheet".to_owned(),
            particles: 3,
            triangles: vec![[0, 1, 2]],
            ..ClothHeader::default()
        }],
        series: vec![
            series("energy/kinetic", "kinetic (J)"),
            series("solver/iterations", "iterations"),
        ],
        ..Header::default()
    };
    let targets = Targets {
        save: Some(path.clone()),
        ..Targets::default()
    };
    let mut recorder = RerunRecorder::new(&header, &targets).unwrap();
    for index in 0..FRAMES {
        let y = f32::from(index);
        let said = [10, 110, 120].contains(&index).then(|| Event {
            level: Level::Info,
            text: index.to_string(),
        });
        let frame = Frame {
            index: index.into(),
            time: f64::from(index) / 60.0,
            cloths: vec![ClothFrame {
                positions: vec![[0.0, y, 0.0], [1.0, y, 0.0], [0.0, y, 1.0]],
                strain: vec![0.0; 3],
                ..ClothFrame::default()
            }],
            values: vec![y.into(), 1.0],
            events: said.into_iter().collect(),
            ..Frame::default()
        };
        recorder.record(&frame).unwrap();
    }
    recorder.finish().unwrap();
    path
}

/// Keeps what it gets, and when.
#[derive(Default)]
struct Audience {
    wall: Rc<Cell<Duration>>,
    got: Vec<(f64, LogMsg)>,
    /// Takes nothing: whoever waits for it waits in vain.
    stopped: bool,
    greeted: Rc<Cell<u64>>,
}

impl Viewers for Audience {
    fn send(&mut self, message: LogMsg) {
        self.got.push((self.wall.get().as_secs_f64(), message));
    }

    fn wait_for_room(&mut self, patience: Duration) -> bool {
        if self.stopped {
            self.wall.set(self.wall.get() + patience);
        }
        !self.stopped
    }

    fn greeted(&self) -> u64 {
        self.greeted.get()
    }

    fn dropped(&self) -> u64 {
        0
    }
}

/// Asks for something at some wall times (s).
struct Script {
    wall: Rc<Cell<Duration>>,
    asked: RefCell<Vec<(f64, Command)>>,
    shown: Vec<ReplayProgress>,
    /// Somebody comes at this wall time (s).
    late: Option<(f64, Rc<Cell<u64>>)>,
}

impl Console for Script {
    fn now(&self) -> Duration {
        self.wall.get()
    }

    fn wait(&mut self, at_most: Duration) -> Option<Command> {
        self.wall.set(self.wall.get() + at_most);
        let now = self.wall.get().as_secs_f64();
        if let Some((_, greeted)) = self.late.take_if(|(at, _)| *at <= now) {
            greeted.set(greeted.get() + 1);
        }
        let mut asked = self.asked.borrow_mut();
        let due = asked.first().is_some_and(|(at, _)| *at <= now);
        due.then(|| asked.remove(0).1)
    }

    fn show(&mut self, progress: ReplayProgress) {
        self.shown.push(progress);
    }
}

const PLAN: ReplayPlan = ReplayPlan {
    speed: 1.0,
    from: 0.0,
    to: LAST,
    looped: false,
};

/// Replays files; returns what viewers got and what was shown.
fn replay(
    paths: &[&Path],
    plan: &ReplayPlan,
    mut audience: Audience,
    asked: &[(f64, Command)],
) -> (Audience, Vec<ReplayProgress>) {
    let paths: Vec<PathBuf> = paths.iter().map(|path| (*path).to_owned()).collect();
    let replay = Replay::open(&paths).unwrap();
    let mut script = Script {
        wall: Rc::clone(&audience.wall),
        asked: RefCell::new(asked.to_vec()),
        shown: Vec::new(),
        late: plan.looped.then(|| (20.0, Rc::clone(&audience.greeted))),
    };
    let stage = Stage::set(replay.recordings(), plan, &mut audience, &mut script).unwrap();
    stage.run().unwrap();
    (audience, script.shown)
}

/// A row: its entity, its time (s), how many components it has, and when it came (s).
type Row = (String, f64, usize, f64);

fn rows(got: &[(f64, LogMsg)]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (wall, message) in got {
        if let LogMsg::ArrowMsg(store, message) = message
            && store.is_recording()
        {
            let chunk = Chunk::from_arrow_msg(message).unwrap();
            let Some(times) = chunk.timelines().get(&entity::SIM_TIME.into()) else {
                continue;
            };
            let entity = chunk.entity_path().to_string();
            let row = |time: &i64| {
                (
                    entity.clone(),
                    seconds(*time),
                    chunk.num_components(),
                    *wall,
                )
            };
            rows.extend(times.times_raw().iter().map(row));
        }
    }
    rows
}

/// Entity and time (ns) of every row, in an order of their own.
#[expect(clippy::cast_possible_truncation, reason = "some seconds")]
fn sorted<'a>(rows: impl IntoIterator<Item = &'a Row>) -> Vec<(String, i64)> {
    let row = |(entity, time, ..): &Row| (entity.clone(), (time * 1e9).round() as i64);
    let mut rows: Vec<_> = rows.into_iter().map(row).collect();
    rows.sort();
    rows
}

fn recorded(path: &Path) -> Vec<Row> {
    let mut messages = Messages::open(path).unwrap();
    let mut all = Vec::new();
    while let Some(message) = messages.next().unwrap() {
        all.push((0.0, message));
    }
    rows(&all)
}

#[test]
fn every_row_comes_at_its_time_after_what_is_static() {
    let path = recording("paced");
    for (speed, tick) in [(1.0, 0.009), (0.25, 0.009), (4.0, 0.009)] {
        let plan = ReplayPlan { speed, ..PLAN };
        let (audience, _) = replay(&[&path], &plan, Audience::default(), &[]);
        let rows = rows(&audience.got);
        assert_eq!(rows.len(), 4 * usize::from(FRAMES) + 3, "speed {speed}");
        assert_eq!(sorted(&rows), sorted(&recorded(&path)), "speed {speed}");
        assert!(rows.iter().all(|(_, time, _, wall)| {
            let late = wall - time / speed;
            (-1e-9..tick).contains(&late)
        }));
        let mut greatest = [0.0_f64; 2];
        for (entity, time, ..) in &rows {
            // Within one delivery the rows of an entity stay together.
            assert!(*time >= greatest[0] - speed * tick, "{entity} at {time}");
            greatest[0] = greatest[0].max(*time);
        }
        let temporal = |message: &LogMsg| matches!(message, LogMsg::ArrowMsg(_, rows) if rows.batch.column_by_name(entity::SIM_TIME).is_some());
        let first = audience
            .got
            .iter()
            .position(|(_, message)| temporal(message));
        let greeting = &audience.got[..first.unwrap()];
        let rest = &audience.got[greeting.len()..];
        assert!(rest.iter().all(|(_, message)| temporal(message)), "later");
        assert!(matches!(greeting[0].1, LogMsg::SetStoreInfo(_)));
        let activations = |(_, message): &&(f64, LogMsg)| {
            matches!(message, LogMsg::BlueprintActivationCommand(_))
        };
        assert_eq!(greeting.iter().filter(activations).count(), 1);
    }
    std::fs::remove_file(&path).unwrap();
}

#[test]
fn a_replay_is_a_recording_of_its_own() {
    let path = recording("own");
    let stores = || {
        let (audience, _) = replay(&[&path], &PLAN, Audience::default(), &[]);
        let stores = audience.got.iter().map(|(_, message)| message.store_id());
        let mut stores: Vec<_> = stores
            .filter(|store| store.is_recording())
            .cloned()
            .collect();
        stores.dedup();
        assert_eq!(stores.len(), 1, "{stores:?}");
        stores.remove(0)
    };
    let (one, two) = (stores(), stores());
    assert_ne!(one, two);
    assert_eq!(one.application_id().as_str(), entity::APPLICATION);
    std::fs::remove_file(&path).unwrap();
}

#[test]
fn a_part_begins_with_what_was_last_seen() {
    let path = recording("part");
    let plan = ReplayPlan {
        from: 100.5 / 60.0,
        to: 115.0 / 60.0,
        ..PLAN
    };
    let (audience, _) = replay(&[&path], &plan, Audience::default(), &[]);
    let got = rows(&audience.got);
    let (before, inside): (Vec<&Row>, Vec<&Row>) =
        got.iter().partition(|(_, time, ..)| *time < plan.from);
    let all = recorded(&path);
    let expected = all
        .iter()
        .filter(|(_, time, ..)| *time >= plan.from && *time <= plan.to + 1e-8);
    assert_eq!(sorted(inside.into_iter()), sorted(expected));
    let mut seen: BTreeMap<&str, (f64, usize)> = BTreeMap::new();
    for (entity, time, components, wall) in before {
        assert_eq!((*components, *wall), (1, 0.0), "{entity}");
        let entry = seen.entry(entity).or_insert((*time, 0));
        assert_eq!(entry.0, *time, "{entity}");
        entry.1 += 1;
    }
    // The mesh has positions, normals and colours; a word its text and level.
    let frame = |index: i64| seconds((index * 1_000_000_000 + 30) / 60);
    let expected = [
        ("/energy/kinetic", (frame(100), 1)),
        ("/log", (frame(10), 2)),
        ("/solver/iterations", (frame(100), 1)),
        ("/solver/state_hash", (frame(100), 1)),
        ("/world/sheet", (frame(100), 3)),
    ];
    assert_eq!(seen, BTreeMap::from(expected));
    std::fs::remove_file(&path).unwrap();
}

#[test]
fn what_is_left_of_a_killed_run_is_replayed() {
    let path = recording("cut");
    let whole = std::fs::read(&path).unwrap();
    let mut replayed = Vec::new();
    for length in (whole.len() / 4..whole.len()).step_by(4999) {
        std::fs::write(&path, &whole[..length]).unwrap();
        if Replay::open(std::slice::from_ref(&path)).is_ok() {
            let plan = ReplayPlan { speed: 1e9, ..PLAN };
            let (audience, _) = replay(&[&path], &plan, Audience::default(), &[]);
            let got = rows(&audience.got);
            assert_eq!(sorted(&got), sorted(&recorded(&path)), "cut at {length}");
            replayed.push(got.len());
        }
    }
    replayed.dedup();
    assert!(replayed.len() > 2, "{replayed:?}");
    std::fs::remove_file(&path).unwrap();
}

#[test]
fn a_stopped_viewer_is_waited_for_once() {
    let path = recording("stopped");
    let audience = Audience {
        stopped: true,
        ..Audience::default()
    };
    let (audience, _) = replay(&[&path], &PLAN, audience, &[]);
    let wall = audience.wall.get().as_secs_f64();
    assert!(
        (LAST..LAST + 0.1).contains(&wall),
        "{wall} s: the wait is made up for"
    );
    let plan = ReplayPlan { speed: 1e9, ..PLAN };
    let audience = Audience {
        stopped: true,
        ..Audience::default()
    };
    let (audience, _) = replay(&[&path], &plan, audience, &[]);
    let wall = audience.wall.get();
    assert!((PATIENCE..2 * PATIENCE).contains(&wall), "{wall:?}");
    assert_eq!(sorted(&rows(&audience.got)), sorted(&recorded(&path)));
    std::fs::remove_file(&path).unwrap();
}

#[test]
fn keys_are_obeyed() {
    let path = recording("keys");
    let asked = [
        (1.0, Command::Pause),
        (2.0, Command::Step),
        (3.0, Command::Step),
        (4.0, Command::Pause),
        (4.5, Command::Faster),
        (5.0, Command::Slower),
        (5.2, Command::Quit),
    ];
    let (audience, shown) = replay(&[&path], &PLAN, Audience::default(), &asked);
    let rows = rows(&audience.got);
    let came = |from: f64, to: f64| {
        let mesh = rows.iter().filter(|row| row.0 == "/energy/kinetic");
        mesh.filter(|row| row.3 >= from && row.3 < to).count()
    };
    // 61 frames in the first second; a pause with two single frames; half a second each at speeds 1 and 2.
    let counts = [
        came(0.0, 1.0),
        came(1.1, 2.0),
        came(2.0, 3.0),
        came(3.0, 4.0),
    ];
    assert!((59..=61).contains(&counts[0]), "{counts:?}");
    assert_eq!(counts[1..], [0, 1, 1], "{counts:?}");
    let (slow, fast) = (came(4.1, 4.5), came(4.6, 5.0));
    assert!(
        (23..=25).contains(&slow) && (46..=50).contains(&fast),
        "{slow} {fast}"
    );
    let end = audience.wall.get().as_secs_f64();
    assert!((5.2..5.3).contains(&end), "{end}");
    assert!(shown.iter().any(|progress| progress.paused));
    assert!(shown.iter().any(|progress| progress.speed == 2.0));
    std::fs::remove_file(&path).unwrap();
}

#[test]
fn in_a_loop_the_viewer_plays_on_by_itself_and_who_comes_late_gets_all() {
    let path = recording("loop");
    let plan = ReplayPlan {
        looped: true,
        ..PLAN
    };
    let asked = [(30.0, Command::Quit)];
    let (audience, shown) = replay(&[&path], &plan, Audience::default(), &asked);
    let got = rows(&audience.got);
    let once = recorded(&path).len();
    let early = got.iter().filter(|row| row.3 < 20.0).count();
    assert_eq!((early, got.len()), (once, 2 * once));
    assert!(got.iter().all(|row| row.3 < LAST + 0.1 || row.3 < 20.2));
    assert!(shown.last().unwrap().done);
    let after = audience.got.iter().skip_while(|(wall, _)| *wall < LAST);
    let blueprint =
        after.filter(|(wall, message)| *wall < 19.0 && message.store_id().is_blueprint());
    let told: Vec<_> = blueprint.map(|(_, message)| message).collect();
    let panel = |message: &&LogMsg| match message {
        LogMsg::ArrowMsg(_, rows) => {
            let chunk = Chunk::from_arrow_msg(rows).unwrap();
            chunk.entity_path().to_string() == "/time_panel"
        }
        _ => false,
    };
    assert!(
        told.iter().copied().any(|message| panel(&message)),
        "{told:?}"
    );
    assert!(matches!(
        told.last(),
        Some(LogMsg::BlueprintActivationCommand(_))
    ));
    std::fs::remove_file(&path).unwrap();
}

#[test]
fn several_recordings_are_one_with_all_their_entities() {
    let (coarse, fine) = (recording("coarse"), recording("fine"));
    let (audience, _) = replay(&[&coarse, &fine], &PLAN, Audience::default(), &[]);
    let got = rows(&audience.got);
    assert_eq!(got.len(), 2 * recorded(&fine).len());
    let count = |name: &str, part: &str| {
        let own = |row: &&Row| row.0.contains(name) && row.0.contains(part);
        got.iter().filter(own).count()
    };
    for name in ["coarse", "fine"] {
        // Below /solver there are two series: iterations and the hash of the state.
        for (group, rows) in [("/energy/", 1), ("/world/", 1), ("/solver/", 2)] {
            let rows = rows * usize::from(FRAMES);
            assert_eq!(count(name, group), rows, "{group}{name}");
        }
        assert_eq!(count(name, "/log/"), 3);
    }
    let blueprints = audience
        .got
        .iter()
        .filter(|(_, message)| matches!(message, LogMsg::BlueprintActivationCommand(_)));
    assert_eq!(blueprints.count(), 1);
    let mut stores: Vec<_> = audience
        .got
        .iter()
        .map(|(_, m)| m.store_id().clone())
        .collect();
    stores.sort();
    stores.dedup();
    assert_eq!(
        stores.len(),
        2,
        "one recording and its blueprint: {stores:?}"
    );
    for path in [coarse, fine] {
        std::fs::remove_file(path).unwrap();
    }
}
