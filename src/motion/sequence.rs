//! A mesh that moves through given frames.

use super::Deformation;
use glam::DVec3;

/// Positions of a mesh's vertices at equal times, and straight lines between them.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// The vertices of each frame (m).
    frames: Vec<Vec<DVec3>>,
    /// Frames a second.
    fps: f64,
    /// When the first frame is (s).
    start: f64,
}

/// What is wrong with a sequence.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SequenceError {
    /// Not even one frame.
    #[error("there is no frame")]
    Empty,
    /// Another number of vertices than in the first frame.
    #[error("frame {frame} has {vertices} vertices, the first has {first}")]
    Vertices {
        /// Number of the frame, from 0.
        frame: usize,
        /// Its vertices.
        vertices: usize,
        /// Those of the first frame.
        first: usize,
    },
    /// A vertex that is suddenly somewhere else.
    #[error(
        "vertex {vertex} jumps by {way:.3} m from frame {} to frame {frame}, {times:.0} times as far as the fastest vertices go in other frames",
        frame - 1
    )]
    Jump {
        /// Number of the frame that it jumps to, from 0.
        frame: usize,
        /// The vertex.
        vertex: usize,
        /// How far it goes (m).
        way: f64,
        /// The same over the median of the frames' longest ways.
        times: f64,
    },
}

/// A way this many times as long as the fastest vertices' in half of the frames is a jump, if it is also
/// longer than [`SMALL`] of the mesh: a step's foot, which rests for half of the time, goes three times as
/// far in its fastest frame as in the median one.
const JUMP: f64 = 10.0;

/// Share of the size of the mesh.
const SMALL: f64 = 0.05;

impl Sequence {
    /// The motion through frames (m) at `fps` a second, from `start` (s) on.
    ///
    /// # Errors
    ///
    /// Without frames, with frames of different numbers of vertices, and where a vertex jumps.
    pub fn new(frames: Vec<Vec<DVec3>>, fps: f64, start: f64) -> Result<Self, SequenceError> {
        let first = frames.first().ok_or(SequenceError::Empty)?;
        let other = frames.iter().position(|frame| frame.len() != first.len());
        if let Some(frame) = other {
            return Err(SequenceError::Vertices {
                frame,
                vertices: frames[frame].len(),
                first: first.len(),
            });
        }
        if let Some(jump) = find_jump(&frames) {
            return Err(jump);
        }
        Ok(Self { frames, fps, start })
    }

    /// Velocities of all vertices at a time (m/s): the slopes of the lines, and none before and after.
    pub fn velocities(&self, time: f64, velocities: &mut [DVec3]) {
        let (before, share) = self.place(time);
        let next = (before + 1).min(self.frames.len() - 1);
        let moving = time >= self.start && share < 1.0;
        let rate = if moving { self.fps } else { 0.0 };
        let ends = self.frames[before].iter().zip(&self.frames[next]);
        for (v, (a, b)) in velocities.iter_mut().zip(ends) {
            *v = (*b - *a) * rate;
        }
    }

    /// The frame before a time, and how far the way to the next is gone; the last but one and all of it
    /// after the end.
    fn place(&self, time: f64) -> (usize, f64) {
        let at = ((time - self.start) * self.fps).max(0.0);
        let last = self.frames.len().saturating_sub(2);
        let mut before = 0;
        // A loop in place of a cast: frames are few.
        while before < last && number(before + 1) <= at {
            before += 1;
        }
        (before, (at - number(before)).min(1.0))
    }
}

impl Deformation for Sequence {
    fn positions(&self, time: f64, positions: &mut [DVec3]) {
        let (before, share) = self.place(time);
        let next = (before + 1).min(self.frames.len() - 1);
        let ends = self.frames[before].iter().zip(&self.frames[next]);
        for (x, (a, b)) in positions.iter_mut().zip(ends) {
            *x = a.lerp(*b, share);
        }
    }
}

/// The first frame to which a vertex jumps.
fn find_jump(frames: &[Vec<DVec3>]) -> Option<SequenceError> {
    let first = frames.first()?;
    let low = first.iter().copied().reduce(DVec3::min)?;
    let high = first.iter().copied().reduce(DVec3::max)?;
    let longest = |pair: &[Vec<DVec3>]| {
        let ways = pair[0].iter().zip(&pair[1]).map(|(a, b)| a.distance(*b));
        let each = ways.enumerate();
        each.fold(
            (0, 0.0),
            |most, (v, way)| if way > most.1 { (v, way) } else { most },
        )
    };
    let ways: Vec<(usize, f64)> = frames.windows(2).map(longest).collect();
    let mut sorted: Vec<f64> = ways.iter().map(|(_, way)| *way).collect();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied()?;
    let most = (JUMP * median).max(SMALL * low.distance(high));
    let k = ways
        .iter()
        .position(|(_, way)| *way > most && ways.len() > 2)?;
    let (vertex, way) = ways[k];
    Some(SequenceError::Jump {
        frame: k + 1,
        vertex,
        way,
        times: way / median.max(f64::MIN_POSITIVE),
    })
}

#[expect(clippy::cast_precision_loss, reason = "frames are few")]
fn number(i: usize) -> f64 {
    i as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames() -> Vec<Vec<DVec3>> {
        let at = |k: u32| {
            let s = f64::from(k);
            vec![
                DVec3::new(0.1 * s, 0.0, 0.0),
                DVec3::new(1.0, 0.05 * s * s, 0.0),
            ]
        };
        (0..5).map(at).collect()
    }

    #[test]
    fn goes_straight_through_its_frames_and_rests_before_and_after() {
        let sequence = Sequence::new(frames(), 10.0, 0.5).unwrap();
        let at = |time: f64| {
            let (mut x, mut v) = (vec![DVec3::ZERO; 2], vec![DVec3::ZERO; 2]);
            sequence.positions(time, &mut x);
            sequence.velocities(time, &mut v);
            [x[0].x, x[1].y, v[0].x, v[1].y]
        };
        let close = |a: [f64; 4], b: [f64; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(close(at(0.2), [0.0, 0.0, 0.0, 0.0]));
        assert!(close(at(0.65), [0.15, 0.125, 1.0, 1.5]), "{:?}", at(0.65));
        assert!(close(at(0.9), [0.4, 0.8, 0.0, 0.0]), "{:?}", at(0.9));
        assert!(close(at(7.0), [0.4, 0.8, 0.0, 0.0]));
        // One frame is a body at rest.
        let still = Sequence::new(frames()[..1].to_vec(), 10.0, 0.0).unwrap();
        let mut x = vec![DVec3::ZERO; 2];
        still.positions(0.3, &mut x);
        assert_eq!(x, frames()[0]);
    }

    #[test]
    fn what_is_missing_or_jumps_is_named() {
        assert_eq!(
            Sequence::new(Vec::new(), 30.0, 0.0).err(),
            Some(SequenceError::Empty)
        );
        let mut torn = frames();
        torn[3].pop();
        let error = Sequence::new(torn, 30.0, 0.0).err();
        let expected = SequenceError::Vertices {
            frame: 3,
            vertices: 1,
            first: 2,
        };
        assert_eq!(error, Some(expected));
        let mut jumps: Vec<Vec<DVec3>> = (0..9)
            .map(|k| vec![DVec3::X * (0.01 * f64::from(k)), DVec3::Y])
            .collect();
        jumps[5][0].z = 0.7;
        let error = Sequence::new(jumps, 30.0, 0.0).err();
        assert!(
            matches!(
                error,
                Some(SequenceError::Jump {
                    frame: 5,
                    vertex: 0,
                    ..
                })
            ),
            "{error:?}"
        );
    }
}
