//! What is drawn in a frame: the cloths, then the obstacles.

use super::ExportError;
use crate::recorder::color::OBSTACLE;
use crate::replay::{Layout, RecordedFrame};
use std::path::Path;

/// Colour of cloth whose strain isn't recorded (sRGB): that of no strain.
const LINEN: [u8; 3] = [232, 227, 217];

/// A cloth or obstacle in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body<'a> {
    pub(super) name: &'a str,
    /// Vertex positions (m).
    pub(super) positions: &'a [[f32; 3]],
    /// Empty for a chain.
    pub(super) triangles: &'a [[u32; 3]],
    /// Of each vertex, where recorded (sRGB).
    colors: &'a [[u8; 3]],
    pub(super) is_cloth: bool,
    /// Whether it has the same place in every frame.
    pub(super) rests: bool,
}

impl<'a> Body<'a> {
    /// The links of a chain, whose particles follow one another; none of a mesh.
    pub(super) fn links(self) -> impl Iterator<Item = [u32; 2]> + use<'a> {
        let chain = self.is_cloth && self.triangles.is_empty();
        let count = if chain { self.positions.len() } else { 0 };
        (0..).zip(1..).take(count.saturating_sub(1)).map(Into::into)
    }

    /// Colour of a vertex (sRGB): by strain where recorded.
    pub(super) fn color(self, vertex: usize) -> [u8; 3] {
        let plain = if self.is_cloth { LINEN } else { OBSTACLE };
        self.colors.get(vertex).copied().unwrap_or(plain)
    }
}

/// What is drawn in a frame.
pub(super) fn bodies<'a>(
    layout: &'a Layout,
    frame: &'a RecordedFrame,
) -> impl Iterator<Item = Body<'a>> {
    let colors = frame.colors.iter().map(Vec::as_slice);
    let colors = colors.chain(std::iter::repeat(&[] as &[_]));
    let states = frame.cloths.iter().zip(colors);
    let cloths = layout.cloths.iter().zip(states);
    let cloths = cloths.map(|(cloth, (positions, colors))| Body {
        name: &cloth.name,
        positions,
        triangles: &cloth.triangles,
        colors,
        is_cloth: true,
        rests: false,
    });
    let obstacles = layout.obstacles.iter().zip(&frame.obstacles);
    let obstacles = obstacles.filter_map(|(obstacle, moved)| {
        Some(Body {
            name: &obstacle.name,
            positions: obstacle.positions.as_ref().or(moved.as_ref())?,
            triangles: &obstacle.triangles,
            colors: &[],
            is_cloth: false,
            rests: obstacle.positions.is_some(),
        })
    });
    cloths
        .chain(obstacles)
        .filter(|body| !body.positions.is_empty())
}

/// Refuses a frame whose triangles have vertices that aren't there.
pub(super) fn check(
    path: &Path,
    layout: &Layout,
    frame: &RecordedFrame,
) -> Result<(), ExportError> {
    for body in bodies(layout, frame) {
        let last = body.triangles.iter().flatten().max();
        if let Some(&last) = last.filter(|last| **last as usize >= body.positions.len()) {
            let what = format!(
                "{:?} has {} vertices in frame {}, and a triangle of vertex {last}",
                body.name,
                body.positions.len(),
                frame.index
            );
            let path = path.to_owned();
            return Err(ExportError::Damaged { path, what });
        }
    }
    Ok(())
}
