//! The frames of a recording, one after another.

use super::layout::{colors, positions};
use super::{Layout, ReadError, for_each_chunk};
use crate::recorder::entity;
use rerun::EntityPath;
use rerun::log::Chunk;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

/// Where everything was at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedFrame {
    /// Number of the frame, from 0.
    pub index: u64,
    /// Simulated time (s).
    pub time: f64,
    /// Particle positions (m) of each cloth of the [`Layout`].
    pub cloths: Vec<Vec<[f32; 3]>>,
    /// Colour of each particle of each cloth by its strain (sRGB); none where none are recorded.
    pub colors: Vec<Vec<[u8; 3]>>,
    /// Vertex positions (m) of each obstacle that moves.
    pub obstacles: Vec<Option<Vec<[f32; 3]>>>,
}

/// A frame of which some entities are read.
#[derive(Debug)]
struct Partial {
    time: f64,
    /// One entry an entity of [`Frames::entities`].
    positions: Vec<Option<Vec<[f32; 3]>>>,
    /// The same.
    colors: Vec<Vec<[u8; 3]>>,
    missing: usize,
}

/// Calls `visit` for each complete frame in order, until it breaks.
///
/// What is in memory at once are the frames of one batch of the file, about half a second.
///
/// # Errors
///
/// When the file can't be read or is no recording.
pub fn for_each_frame(
    path: &Path,
    layout: &Layout,
    mut visit: impl FnMut(RecordedFrame) -> ControlFlow<()>,
) -> Result<(), ReadError> {
    let mut frames = Frames::new(layout);
    let mut going = ControlFlow::Continue(());
    for_each_chunk(path, |chunk| {
        if going.is_continue() {
            frames.take(&chunk);
            going = frames.hand_out(&mut visit);
        }
    })?;
    // Of a frame that the end of a killed run cut off, later ones may be whole.
    frames.waiting.retain(|_, frame| frame.missing == 0);
    if going.is_continue() {
        let _ = frames.hand_out(&mut visit);
    }
    Ok(())
}

/// The frames that are being read.
#[derive(Debug)]
struct Frames {
    /// The cloths, then the obstacles that move.
    entities: Vec<EntityPath>,
    cloths: usize,
    /// Does each obstacle move?
    moves: Vec<bool>,
    waiting: BTreeMap<i64, Partial>,
}

impl Frames {
    fn new(layout: &Layout) -> Self {
        let moves: Vec<bool> = (layout.obstacles.iter().map(|o| o.positions.is_none())).collect();
        let cloths = layout.cloths.iter().map(|cloth| &cloth.name);
        let moving = layout
            .obstacles
            .iter()
            .zip(&moves)
            .filter(|(_, moves)| **moves);
        Self {
            entities: cloths
                .chain(moving.map(|(obstacle, _)| &obstacle.name))
                .map(|name| entity::body(name))
                .collect(),
            cloths: layout.cloths.len(),
            moves,
            waiting: BTreeMap::new(),
        }
    }

    fn take(&mut self, chunk: &Chunk) {
        let found = self
            .entities
            .iter()
            .position(|path| path == chunk.entity_path());
        let Some(entity) = found.filter(|_| !chunk.is_static()) else {
            return;
        };
        let timelines = chunk.timelines();
        let column =
            |name: &'static str| timelines.get(&name.into()).map(|column| column.times_raw());
        let (Some(frames), Some(times)) = (column(entity::FRAME), column(entity::SIM_TIME)) else {
            return;
        };
        let count = self.entities.len();
        let rows = frames.iter().zip(times).zip(positions(chunk));
        let mut colors = colors(chunk);
        for ((&frame, &nanoseconds), positions) in rows {
            let partial = self.waiting.entry(frame).or_insert_with(|| Partial {
                time: seconds(nanoseconds),
                positions: vec![None; count],
                colors: vec![Vec::new(); count],
                missing: count,
            });
            partial.colors[entity] = colors.next().unwrap_or_default();
            if partial.positions[entity].replace(positions).is_none() {
                partial.missing -= 1;
            }
        }
    }

    /// Hands out the frames in front that are complete.
    fn hand_out(
        &mut self,
        visit: &mut impl FnMut(RecordedFrame) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        while let Some(first) = self.waiting.first_entry() {
            if first.get().missing > 0 {
                break;
            }
            let (index, mut frame) = first.remove_entry();
            frame.colors.truncate(self.cloths);
            let mut positions = frame.positions.into_iter().flatten();
            let cloths = positions.by_ref().take(self.cloths).collect();
            let moves = self.moves.iter();
            visit(RecordedFrame {
                index: index.cast_unsigned(),
                time: frame.time,
                cloths,
                colors: frame.colors,
                obstacles: moves
                    .map(|moves| moves.then(|| positions.next()).flatten())
                    .collect(),
            })?;
        }
        ControlFlow::Continue(())
    }
}

/// Recorded times are whole nanoseconds; the quotient is the number nearest to theirs.
#[expect(clippy::cast_precision_loss, reason = "2⁵³ ns are 104 days")]
pub(super) fn seconds(nanoseconds: i64) -> f64 {
    nanoseconds as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{ClothFrame, ClothHeader, Frame, Header, ObstacleHeader};
    use crate::recorder::{Recorder, RerunRecorder, Targets};
    use std::path::PathBuf;

    const TRIANGLES: [[u32; 3]; 1] = [[0, 1, 2]];

    /// A cloth, a chain, a body that rests and one that moves; in frame k all is k higher.
    fn recording(name: &str) -> PathBuf {
        let file = format!("muslin-frames-{}-{name}.rrd", std::process::id());
        let path = std::env::temp_dir().join(file);
        let obstacle = |name: &str, moves| ObstacleHeader {
            name: name.to_owned(),
            moves,
            positions: corners(0.5),
            triangles: TRIANGLES.to_vec(),
        };
        let header = Header {
            scene_toml: "name = \"a\"".to_owned(),
            strain_range: 0.1,
            cloths: vec![
                ClothHeader {
                    name: "my skirt/2".to_owned(),
                    triangles: TRIANGLES.to_vec(),
                    ..ClothHeader::default()
                },
                ClothHeader {
                    name: "chain".to_owned(),
                    ..ClothHeader::default()
                },
            ],
            obstacles: vec![obstacle("floor", false), obstacle("ball", true)],
            ..Header::default()
        };
        let targets = Targets {
            save: Some(path.clone()),
            ..Targets::default()
        };
        let mut recorder = RerunRecorder::new(&header, &targets).unwrap();
        for index in 0..70_u16 {
            let cloth = |y: f32| ClothFrame {
                positions: corners(y),
                strain: vec![0.0, y, -y],
                ..ClothFrame::default()
            };
            let y = f32::from(index);
            let frame = Frame {
                index: index.into(),
                time: f64::from(index) / 60.0,
                cloths: vec![cloth(y), cloth(y + 0.25)],
                obstacles: vec![None, Some(corners(-y))],
                ..Frame::default()
            };
            recorder.record(&frame).unwrap();
        }
        recorder.finish().unwrap();
        path
    }

    fn corners(y: f32) -> Vec<[f32; 3]> {
        vec![[0.0, y, 0.0], [1.0, y, 0.0], [0.0, y, 1.0]]
    }

    fn read(path: &Path) -> Vec<RecordedFrame> {
        let layout = Layout::read(path).unwrap();
        let mut frames = Vec::new();
        for_each_frame(path, &layout, |frame| {
            frames.push(frame);
            ControlFlow::Continue(())
        })
        .unwrap();
        frames
    }

    #[test]
    fn every_frame_comes_back_in_order() {
        let path = recording("order");
        let layout = Layout::read(&path).unwrap();
        assert_eq!(layout.toml, "name = \"a\"");
        let names: Vec<_> = layout
            .cloths
            .iter()
            .map(|cloth| cloth.name.as_str())
            .collect();
        assert_eq!(names, ["my skirt/2", "chain"]);
        assert_eq!(layout.cloths[0].triangles, TRIANGLES);
        assert!(layout.cloths[1].triangles.is_empty());
        assert_eq!(layout.obstacles[0].positions, Some(corners(0.5)));
        assert_eq!(layout.obstacles[1].positions, None);
        let frames = read(&path);
        assert_eq!(frames.len(), 70);
        for (k, frame) in (0_u16..).zip(&frames) {
            let y = f32::from(k);
            assert_eq!(frame.index, u64::from(k));
            assert!(
                (frame.time - f64::from(k) / 60.0).abs() < 1e-9,
                "{}",
                frame.time
            );
            assert_eq!(frame.cloths, [corners(y), corners(y + 0.25)]);
            assert_eq!(frame.obstacles, [None, Some(corners(-y))]);
            let (linen, blue, red) = ([232, 227, 217], [33, 102, 172], [178, 24, 43]);
            let strained = [linen, red, blue].map(|color| if k == 0 { linen } else { color });
            assert_eq!(frame.colors[0], strained);
            assert_eq!(frame.colors.len(), 2);
        }
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn a_cut_recording_gives_whole_frames_only() {
        let path = recording("cut");
        let whole = std::fs::read(&path).unwrap();
        let all = read(&path);
        let mut most = 0;
        for length in (whole.len() / 2..whole.len()).step_by(997) {
            std::fs::write(&path, &whole[..length]).unwrap();
            if Layout::read(&path).is_ok() {
                let frames = read(&path);
                assert!(
                    frames
                        .iter()
                        .all(|frame| *frame == all[frame.index as usize])
                );
                most = most.max(frames.len());
            }
        }
        assert!(most > 0, "no cut left a frame");
        std::fs::remove_file(&path).unwrap();
    }
}
