//! Both runs in one recording, coloured by their distance.

use super::pair::Pair;
use super::{CompareError, Comparison, flat, for_each_common};
use crate::frame::SpringDetail;
use crate::frame::{
    ClothFrame, ClothHeader, Colors, Event, Frame, Header, Level, ObstacleHeader, Series,
};
use crate::replay::RecordedFrame;
use crate::study::{Distance, digits};
use glam::DVec3;
use std::ops::ControlFlow;
use std::path::Path;

/// Two recordings to be laid over each other.
#[derive(Debug)]
pub struct Overlaid {
    /// What stays the same.
    pub header: Header,
    pair: Pair,
    range: f64,
}

impl Overlaid {
    /// Lays two recordings over each other that are compared already.
    ///
    /// # Errors
    ///
    /// As [`compare`](super::compare()).
    pub fn new(a: &Path, b: &Path, comparison: &Comparison) -> Result<Self, CompareError> {
        let pair = Pair::read([a, b])?;
        // Half of the largest distance is red: one particle alone shouldn't decide what is seen of the others.
        let range = (0.5 * comparison.whole().largest).max(1e-6);
        Ok(Self {
            header: header(&pair, range),
            pair,
            range,
        })
    }

    /// The distance that is drawn red (m).
    pub fn range(&self) -> f64 {
        self.range
    }

    /// Calls `visit` for each frame.
    ///
    /// # Errors
    ///
    /// When a recording can't be read.
    pub fn for_each_frame(
        &self,
        mut visit: impl FnMut(&Frame) -> ControlFlow<()>,
    ) -> Result<(), CompareError> {
        let mut index = 0;
        for_each_common(&self.pair, |first, second| {
            let frame = self.frame(index, &first, second);
            index += 1;
            visit(&frame)
        })?;
        Ok(())
    }

    fn frame(&self, index: u64, first: &RecordedFrame, second: &[DVec3]) -> Frame {
        let a = flat(&first.cloths);
        let [compared, with] = self.pair.places([&a, second]);
        let distance = Distance::between(&compared, &with);
        let apart: Vec<f32> = (compared.iter().zip(&with))
            .map(|(a, b)| single(a.distance(*b)))
            .collect();
        let counts = first.cloths.iter().map(Vec::len);
        let mut cloths = cloth_frames(&a, counts, &apart);
        let counts = self.pair.counts_of_second.iter().copied();
        cloths.extend(cloth_frames(second, counts, &apart));
        let start = (index == 0).then(|| Event {
            level: Level::Info,
            text: format!("red is {} mm apart", digits(1000.0 * self.range)),
        });
        Frame {
            index,
            time: first.time,
            cloths,
            obstacles: first.obstacles.clone(),
            values: vec![1000.0 * distance.rms, 1000.0 * distance.largest],
            events: start.into_iter().collect(),
            ..Frame::default()
        }
    }
}

fn header(pair: &Pair, range: f64) -> Header {
    let [first, second] = &pair.layouts;
    let names = [0, 1].map(|k| pair.paths[k].display().to_string());
    let cloths = [('A', first), ('B', second)]
        .into_iter()
        .flat_map(|(letter, layout)| {
            layout.cloths.iter().map(move |cloth| ClothHeader {
                name: format!("{letter} {}", cloth.name),
                triangles: cloth.triangles.clone(),
                ..ClothHeader::default()
            })
        });
    let obstacles = first.obstacles.iter().map(|obstacle| ObstacleHeader {
        name: obstacle.name.clone(),
        moves: obstacle.positions.is_none(),
        positions: obstacle.positions.clone().unwrap_or_default(),
        triangles: obstacle.triangles.clone(),
    });
    let curve = |path: &str, label: &str| Series {
        path: path.to_owned(),
        label: label.to_owned(),
    };
    Header {
        scene: "compare".to_owned(),
        model_list: format!(
            "A is {}, B is {}. Colour: how far apart they are, red at {} mm.",
            names[0],
            names[1],
            digits(1000.0 * range)
        ),
        scene_toml: first.toml.clone(),
        colors: Colors::Distance,
        strain_range: single(range),
        spring_detail: SpringDetail::Off,
        cloths: cloths.collect(),
        obstacles: obstacles.collect(),
        series: vec![
            curve("error/rms", "RMS distance (mm)"),
            curve("error/largest", "largest distance (mm)"),
        ],
        ..Header::default()
    }
}

/// The cloths of one run, whose particles are given in a row (m), coloured by how far apart each is (m): of the finer of
/// two meshes that isn't known.
fn cloth_frames(
    all: &[DVec3],
    counts: impl Iterator<Item = usize>,
    apart: &[f32],
) -> Vec<ClothFrame> {
    let known = all.len() == apart.len();
    let mut from = 0;
    let each = counts.map(|count| {
        let range = from..from + count;
        from = range.end;
        let points = all[range.clone()].iter();
        ClothFrame {
            positions: points.map(|p| p.as_vec3().to_array()).collect(),
            strain: if known {
                apart[range].to_vec()
            } else {
                vec![0.0; count]
            },
            ..ClothFrame::default()
        }
    });
    each.collect()
}

#[expect(clippy::cast_possible_truncation, reason = "drawn in f32")]
fn single(x: f64) -> f32 {
    x as f32
}
