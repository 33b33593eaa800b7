//! The recording as a whole: what is in it, and that no viewer can hold it up.

use std::collections::BTreeMap;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rerun::external::re_log_encoding::DecoderApp;
use rerun::log::{Chunk, LogMsg};

use super::queue::{Link, Queue};
use super::rerun::{RerunRecorder, builder};
use super::{RecordError, Recorder, Targets};
use crate::frame::{
    Checkpoint, ClothCheckpoint, ClothFrame, ClothHeader, ContactMark, Event, Frame, Header,
    Histogram, Level, ObstacleHeader, Series, SpringDetail, SpringFamily,
};

/// A strip of triangles with `particles` particles, and an obstacle.
fn header(particles: u32) -> Header {
    let cloth = ClothHeader {
        name: "my sheet".to_owned(),
        particles: particles as usize,
        triangles: (2..particles).map(|i| [i - 2, i - 1, i]).collect(),
        springs: vec![SpringFamily {
            name: "structural",
            pairs: (1..particles).map(|i| [i - 1, i]).collect(),
        }],
        pins: vec![0],
    };
    let obstacle = ObstacleHeader {
        name: "ground".to_owned(),
        moves: false,
        positions: vec![[0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
        triangles: vec![[0, 1, 2]],
    };
    Header {
        scene: "strip".to_owned(),
        scene_toml: "name = \"strip\"".to_owned(),
        strain_range: 0.1,
        spring_detail: SpringDetail::All,
        cloths: vec![cloth],
        obstacles: vec![obstacle],
        series: vec![Series {
            path: "energy/kinetic".to_owned(),
            label: "kinetic (J)".to_owned(),
        }],
        ..Header::default()
    }
}

/// Frame `index` of that strip.
fn frame(particles: u32, index: u64) -> Frame {
    let time = index as f64 / 60.0;
    let wave = |i: u32| (i as f32 * 0.1 + index as f32 / 60.0).sin();
    let cloth = ClothFrame {
        positions: (0..particles)
            .map(|i| [i as f32, wave(i), (i % 2) as f32])
            .collect(),
        strain: (0..particles).map(|i| 0.1 * wave(i)).collect(),
        spring_strain: vec![(1..particles).map(|i| 0.1 * wave(i)).collect()],
        ..ClothFrame::default()
    };
    Frame {
        index,
        step: 4 * index,
        time,
        cloths: vec![cloth],
        values: vec![1.0 / (1.0 + time)],
        histogram: Histogram {
            first: -0.1,
            width: 0.1,
            counts: vec![1, 2, 3],
        },
        ..Frame::default()
    }
}

/// Rows by entity: static ones, and those of frames.
type Rows = BTreeMap<String, (usize, usize)>;

fn rows(messages: impl IntoIterator<Item = LogMsg>) -> Rows {
    let mut rows = Rows::new();
    for message in messages {
        if let LogMsg::ArrowMsg(store, message) = message
            && store.is_recording()
        {
            let chunk = Chunk::from_arrow_msg(&message).unwrap();
            let count = rows.entry(chunk.entity_path().to_string()).or_default();
            if chunk.is_static() {
                count.0 += chunk.num_rows();
            } else {
                count.1 += chunk.num_rows();
            }
        }
    }
    rows
}

fn rows_of_file(path: &Path) -> Rows {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let messages = DecoderApp::decode_eager(file).unwrap();
    rows(messages.map(Result::unwrap))
}

/// A path in the system's temporary folder that no other test uses.
fn temporary(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("muslin-{}-{name}", std::process::id()))
}

#[test]
fn a_recording_has_the_expected_entities_and_rows() {
    let header = header(5);
    let (stream, memory) = builder(&header).memory().unwrap();
    let mut recorder = RerunRecorder::with_stream(&header, stream).unwrap();
    for index in 0..3 {
        let mut frame = frame(5, index);
        if index == 1 {
            frame.contacts.push(ContactMark {
                position: [0.0; 3],
                depth: 0.001,
            });
            frame.events.push(Event {
                level: Level::Warning,
                text: "touched".to_owned(),
            });
            frame.values[0] = f64::NAN;
        }
        frame.checkpoint = (index == 2).then(|| Checkpoint {
            cloths: vec![ClothCheckpoint {
                name: "my sheet".to_owned(),
                particles: vec![[0.1; 6]; 5],
            }],
            ..Checkpoint::default()
        });
        recorder.record(&frame).unwrap();
    }
    assert_eq!(recorder.finish().unwrap().frames, 3);

    let mut rows = rows(memory.take());
    rows.retain(|path, _| !path.starts_with("/__"));
    let expected = [
        ("/checkpoint", (0, 1)),
        ("/checkpoint/my\\ sheet", (0, 1)),
        ("/energy/kinetic", (1, 2)),
        ("/legend", (1, 0)),
        ("/legend/numbers", (1, 0)), // the NaN leaves a gap
        ("/log", (0, 1)),
        ("/scene", (3, 0)), // its text, what is read back, and the end
        ("/solver/state_hash", (0, 3)),
        ("/strain/histogram", (0, 3)),
        ("/world", (1, 0)),
        ("/world/contacts", (1, 2)), // one to show it, one to take it away
        ("/world/ground", (1, 0)),
        ("/world/my\\ sheet", (1, 3)),
        ("/world/my\\ sheet/pins", (1, 3)),
        ("/world/my\\ sheet/springs/structural", (1, 3)),
    ];
    let expected: Rows = expected.map(|(path, n)| (path.to_owned(), n)).into();
    assert_eq!(rows, expected);
    assert!(recorder.record(&frame(5, 3)).is_err(), "after the end");
}

#[test]
fn an_absent_viewer_costs_the_file_nothing() {
    // A port that was free a moment ago, so that nobody listens on it.
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr();
    let url = format!("rerun+http://{}/proxy", port.unwrap());
    let path = temporary("absent.rrd");
    let targets = Targets {
        save: Some(path.clone()),
        connect: Some(url),
        ..Targets::default()
    };
    let mut recorder = RerunRecorder::new(&header(2000), &targets).unwrap();
    for index in 0..500 {
        recorder.record(&frame(2000, index)).unwrap();
    }
    let start = Instant::now();
    let recorded = recorder.finish().unwrap();
    let took = start.elapsed();
    assert!(took < Duration::from_secs(3), "finish took {took:?}");
    assert_eq!((recorded.frames, recorded.dropped_live_frames), (500, 500));
    let rows = rows_of_file(&path);
    std::fs::remove_file(&path).unwrap();
    for entity in ["/world/my\\ sheet", "/energy/kinetic"] {
        assert_eq!(rows[entity].1, 500, "{entity}");
    }
}

#[test]
fn paths_that_cannot_be_written_are_refused() {
    let save = |path: &Path| Targets {
        save: Some(path.to_owned()),
        ..Targets::default()
    };
    let missing = temporary("no-such-folder").join("run.rrd");
    let error = RerunRecorder::new(&header(3), &save(&missing)).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("run.rrd") && text.contains("create its folder"),
        "{text}"
    );

    let error = RerunRecorder::new(&header(3), &save(&std::env::temp_dir())).unwrap_err();
    assert!(matches!(error, RecordError::CannotWrite { .. }), "{error}");
}

#[test]
fn bad_targets_are_refused() {
    let refuse = |targets: &Targets| RerunRecorder::new(&header(3), targets).unwrap_err();
    assert!(matches!(refuse(&Targets::default()), RecordError::NoTarget));

    let connect = |url: &str| Targets {
        connect: Some(url.to_owned()),
        ..Targets::default()
    };
    for url in ["", "localhost:9876", "rerun+http://127.0.0.1:9876/catalog"] {
        let error = refuse(&connect(url));
        assert!(
            matches!(error, RecordError::BadUrl { .. }),
            "{url}: {error}"
        );
    }

    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let serve = Targets {
        serve: Some(taken.local_addr().unwrap()),
        ..Targets::default()
    };
    assert!(matches!(refuse(&serve), RecordError::CannotServe { .. }));
}

#[test]
fn names_that_collide_are_refused() {
    let mut header = header(3);
    header.obstacles[0].name = header.cloths[0].name.clone();
    let (stream, _memory) = builder(&header).memory().unwrap();
    drop(stream);
    let targets = Targets {
        save: Some(temporary("never.rrd")),
        ..Targets::default()
    };
    let error = RerunRecorder::new(&header, &targets).unwrap_err();
    assert!(matches!(error, RecordError::NameTaken { .. }), "{error}");
    assert!(!temporary("never.rrd").exists());
}

/// Some messages of a recording of three frames.
fn messages() -> Vec<LogMsg> {
    let header = header(5);
    let (stream, memory) = builder(&header).memory().unwrap();
    let mut recorder = RerunRecorder::with_stream(&header, stream).unwrap();
    for index in 0..3 {
        recorder.record(&frame(5, index)).unwrap();
    }
    memory.take()
}

#[test]
fn every_viewer_gets_the_static_data_and_a_lost_one_counts() {
    let queue = Queue::new();
    let messages = messages();
    let all = messages.len();
    for message in messages {
        queue.push(message);
    }
    queue.set_link(Link::Up);
    let first = queue.take(Duration::ZERO).len();
    assert_eq!(first, all.min(64));
    queue.settle(false);
    assert_eq!(queue.dropped(), 3, "all three frames were on their way");

    queue.set_link(Link::Down);
    queue.set_link(Link::Up);
    let again = queue.take(Duration::ZERO);
    assert!(!again.is_empty() && again.len() < first, "{}", again.len());
    let (_, temporal) = rows(again)
        .values()
        .fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    assert_eq!(temporal, 0, "only what is static comes again");
}

#[test]
fn a_full_line_drops_the_oldest() {
    let queue = Queue::new();
    let messages = messages();
    // The 4096 places of the line, several times over.
    for _ in 0..2000 {
        for message in &messages {
            if matches!(message, LogMsg::ArrowMsg(store, _) if store.is_recording()) {
                queue.push(message.clone());
            }
        }
    }
    assert_eq!(queue.dropped(), 3);
}

#[test]
fn a_viewer_that_takes_nothing_is_not_waited_for() {
    let queue = Queue::new();
    for message in messages() {
        queue.push(message);
    }
    queue.set_link(Link::Up);
    let never = Instant::now() + Duration::from_secs(86_400);
    assert!(!queue.drain(never, Duration::from_millis(20), never));
    assert_eq!(queue.dropped(), 0, "it may still come to its senses");
}
