//! A recording for tests: a sheet, a chain, an obstacle that rests and one that moves.

use crate::frame::{ClothFrame, ClothHeader, Frame, Header, ObstacleHeader};
use crate::recorder::{Recorder, RerunRecorder, Targets};
use crate::replay::{Layout, RecordedFrame, for_each_frame};
use std::ops::ControlFlow;
use std::path::PathBuf;

/// The bodies in their order.
pub(super) const NAMES: [&str; 4] = ["my sheet/1", "chain", "floor", "ball"];

/// A recording that is removed at the end of its test.
#[derive(Debug)]
pub(super) struct Recording {
    pub(super) path: PathBuf,
}

impl Drop for Recording {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

impl Recording {
    /// All of it.
    pub(super) fn read(&self) -> (Layout, Vec<RecordedFrame>) {
        let layout = Layout::read(&self.path).unwrap();
        let mut frames = Vec::new();
        for_each_frame(&self.path, &layout, |frame| {
            frames.push(frame);
            ControlFlow::Continue(())
        })
        .unwrap();
        (layout, frames)
    }
}

/// An empty folder for a test.
pub(super) fn folder(name: &str) -> PathBuf {
    let name = format!("muslin-export-{}-{name}", std::process::id());
    let folder = std::env::temp_dir().join(name);
    std::fs::create_dir(&folder).unwrap();
    folder
}

/// Records so many frames, one each 0.1 s, of things that move, turn and bend.
pub(super) fn recording(name: &str, frames: u16) -> Recording {
    let file = format!("muslin-export-{}-{name}.rrd", std::process::id());
    let path = std::env::temp_dir().join(file);
    let targets = Targets {
        save: Some(path.clone()),
        ..Targets::default()
    };
    let mut recorder = RerunRecorder::new(&header(), &targets).unwrap();
    for index in 0..frames {
        let (turn, rise) = (f32::from(index) * 0.3, f32::from(index) / 3.0);
        let cloth = |positions: Vec<[f32; 3]>| ClothFrame {
            strain: vec![0.0, 0.2, -0.2, 0.0][..positions.len()].to_vec(),
            positions,
            ..ClothFrame::default()
        };
        let (sin, cos) = turn.sin_cos();
        let sheet = vec![
            [0.0, rise, 0.0],
            [0.0, rise, 1.0],
            [cos, rise + sin, 1.0],
            [cos, rise + sin, 1e-7],
        ];
        let chain = vec![[-1.0, 1.0, 0.0], [-1.0, 0.5, sin], [cos, 0.1, sin]];
        let frame = Frame {
            index: index.into(),
            time: f64::from(index) * 0.1,
            cloths: vec![cloth(sheet), cloth(chain)],
            obstacles: vec![None, Some(triangle(-rise))],
            ..Frame::default()
        };
        recorder.record(&frame).unwrap();
    }
    recorder.finish().unwrap();
    Recording { path }
}

fn header() -> Header {
    let cloth = |name: &str, triangles: Vec<[u32; 3]>| ClothHeader {
        name: name.to_owned(),
        triangles,
        ..ClothHeader::default()
    };
    let obstacle = |name: &str, moves| ObstacleHeader {
        name: name.to_owned(),
        moves,
        positions: triangle(-0.25),
        triangles: vec![[0, 2, 1]],
    };
    Header {
        scene_toml: "name = \"a\"".to_owned(),
        strain_range: 0.1,
        cloths: vec![
            cloth(NAMES[0], vec![[0, 1, 2], [0, 2, 3]]),
            cloth(NAMES[1], vec![]),
        ],
        obstacles: vec![obstacle(NAMES[2], false), obstacle(NAMES[3], true)],
        ..Header::default()
    }
}

fn triangle(y: f32) -> Vec<[f32; 3]> {
    vec![[0.0, y, 0.0], [0.1, y, 0.0], [0.0, y, 0.1 + 0.2]]
}
