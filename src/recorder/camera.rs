//! From where the scene is looked at when a recording is opened.

use crate::frame::{Frame, Header};

/// Direction from the scene to the eye: a little from the right and above, so that folds and
/// depth show.
const TOWARDS_EYE: [f32; 3] = [0.42, 0.30, 0.86];
/// Distance of the eye in radii of the scene's bounding sphere: a whole sphere needs 2.2 with the
/// viewer's field of view of 55°, but cloth never fills it.
const RADII: f32 = 1.75;
/// A hanging cloth swings below where it starts, by most of its width.
const SWING: f32 = 0.8;

/// Where the pinned particles are (m).
fn pins<'a>(header: &'a Header, first: &'a Frame) -> impl Iterator<Item = &'a [f32; 3]> {
    let cloths = header.cloths.iter().zip(&first.cloths);
    cloths.flat_map(|(cloth, state)| {
        let pins = cloth.pins.iter();
        pins.filter_map(|&pin| state.positions.get(pin as usize))
    })
}

/// An eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Camera {
    /// Where it is (m).
    pub(super) eye: [f32; 3],
    /// Where it looks (m).
    pub(super) target: [f32; 3],
}

impl Camera {
    /// The eye that sees what the scene asks for, or else the cloths of the first frame and the
    /// obstacles near them.
    ///
    /// Of an obstacle that is much larger than the cloth, such as the ground, only the part near
    /// the cloth counts. Without any point it looks at the origin from some metres.
    pub(super) fn framing(header: &Header, first: &Frame) -> Self {
        if let Some(view) = header.view.as_ref().and_then(Bounds::around) {
            return Self::looking_at(view.middle(), (view.diagonal() / 2.0).max(1e-3));
        }
        let cloths = first.cloths.iter().flat_map(|cloth| &cloth.positions);
        let Some(mut view) = Bounds::around(cloths) else {
            return Self::looking_at([0.0, 0.5, 0.0], 1.0);
        };
        let near = view.grown(view.diagonal());
        let obstacles = header.obstacles.iter();
        let obstacles = obstacles.filter_map(|obstacle| Bounds::around(&obstacle.positions));
        let obstacles: Vec<Bounds> = obstacles.filter_map(|b| b.common(near)).collect();
        if obstacles.is_empty() {
            let width = view.width();
            if let Some(pins) = Bounds::around(pins(header, first)) {
                view = view.joined(view.mirrored(pins.middle()));
            }
            view.min[1] -= SWING * width;
        }
        for obstacle in obstacles {
            view = view.joined(obstacle);
        }
        Self::looking_at(view.middle(), (view.diagonal() / 2.0).max(1e-3))
    }

    fn looking_at(target: [f32; 3], radius: f32) -> Self {
        let eye = |axis: usize| target[axis] + RADII * radius * TOWARDS_EYE[axis];
        Self {
            eye: [eye(0), eye(1), eye(2)],
            target,
        }
    }
}

/// A box with its sides along the axes (m).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bounds {
    min: [f32; 3],
    max: [f32; 3],
}

impl Bounds {
    fn around<'a>(points: impl IntoIterator<Item = &'a [f32; 3]>) -> Option<Self> {
        let boxes = points.into_iter().map(|&min| Self { min, max: min });
        boxes.reduce(Self::joined)
    }

    fn joined(self, other: Self) -> Self {
        Self {
            min: [0, 1, 2].map(|axis| self.min[axis].min(other.min[axis])),
            max: [0, 1, 2].map(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    fn common(self, other: Self) -> Option<Self> {
        let common = Self {
            min: [0, 1, 2].map(|axis| self.min[axis].max(other.min[axis])),
            max: [0, 1, 2].map(|axis| self.max[axis].min(other.max[axis])),
        };
        let exists = (0..3).all(|axis| common.min[axis] <= common.max[axis]);
        exists.then_some(common)
    }

    fn grown(self, by: f32) -> Self {
        Self {
            min: self.min.map(|x| x - by),
            max: self.max.map(|x| x + by),
        }
    }

    /// The box on the other side of `centre`, at the same height: what hangs swings through.
    fn mirrored(self, centre: [f32; 3]) -> Self {
        let mut mirrored = self;
        for axis in [0, 2] {
            mirrored.min[axis] = 2.0 * centre[axis] - self.max[axis];
            mirrored.max[axis] = 2.0 * centre[axis] - self.min[axis];
        }
        mirrored
    }

    fn middle(self) -> [f32; 3] {
        [0, 1, 2].map(|axis| (self.min[axis] + self.max[axis]) / 2.0)
    }

    fn side(self, axis: usize) -> f32 {
        self.max[axis] - self.min[axis]
    }

    fn width(self) -> f32 {
        self.side(0).max(self.side(2))
    }

    fn diagonal(self) -> f32 {
        let squares = [0, 1, 2].map(|axis| self.side(axis).powi(2));
        squares.iter().sum::<f32>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{ClothFrame, ClothHeader, ObstacleHeader};

    fn first(positions: &[[f32; 3]]) -> Frame {
        Frame {
            cloths: vec![ClothFrame {
                positions: positions.to_vec(),
                ..ClothFrame::default()
            }],
            ..Frame::default()
        }
    }

    #[test]
    fn a_huge_ground_does_not_push_the_eye_away() {
        let header = Header {
            obstacles: vec![ObstacleHeader {
                positions: vec![[-500.0, 0.0, -500.0], [500.0, 0.0, 500.0]],
                ..ObstacleHeader::default()
            }],
            ..Header::default()
        };
        let frame = first(&[[-0.5, 1.0, -0.5], [0.5, 1.0, 0.5]]);
        let camera = Camera::framing(&header, &frame);
        assert!(camera.eye[2] < 10.0, "{camera:?}");
        assert!(
            camera.target[1] > 0.0 && camera.target[1] < 1.0,
            "{camera:?}"
        );
    }

    #[test]
    fn a_pendulum_is_framed_on_both_sides() {
        let header = Header {
            cloths: vec![ClothHeader {
                pins: vec![0],
                ..ClothHeader::default()
            }],
            ..Header::default()
        };
        let camera = Camera::framing(&header, &first(&[[0.0; 3], [1.0, 0.0, 0.0]]));
        assert_eq!(camera.target, [0.0, -0.4, 0.0]);
    }

    #[test]
    fn a_scene_says_what_to_look_at() {
        let header = Header {
            view: Some([[1.0, 2.0, -1.0], [-1.0, 1.0, 1.0]]),
            ..Header::default()
        };
        let camera = Camera::framing(&header, &first(&[[9.0; 3]]));
        assert_eq!(camera.target, [0.0, 1.5, 0.0]);
        let away = [0, 1, 2].map(|axis| camera.eye[axis] - camera.target[axis]);
        let distance = away.iter().map(|x| x * x).sum::<f32>().sqrt();
        assert!((distance / 1.5 / RADII - 1.0).abs() < 0.01, "{camera:?}");
    }

    #[test]
    fn nothing_to_see_is_no_trouble() {
        let camera = Camera::framing(&Header::default(), &Frame::default());
        assert!(camera.eye.iter().all(|x| x.is_finite()));
    }
}
