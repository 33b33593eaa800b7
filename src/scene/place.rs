//! Placing shapes in the world.

use glam::{DQuat, DVec3};

/// Where a shape is put: turned by degrees about x, then y, then z, and then moved (m).
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// `None` leaves every bit as it is.
    turn: Option<DQuat>,
    translate: DVec3,
}

impl Place {
    pub(super) fn new(rotate: [f64; 3], translate: [f64; 3]) -> Self {
        let [x, y, z] = rotate.map(f64::to_radians);
        let turn =
            || DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y) * DQuat::from_rotation_x(x);
        Self {
            turn: (rotate != [0.0; 3]).then(turn),
            translate: DVec3::from_array(translate),
        }
    }

    /// A point of the shape in the world.
    pub(super) fn of(&self, point: DVec3) -> DVec3 {
        self.turn.map_or(point, |turn| turn * point) + self.translate
    }

    /// A point in the world as one of the shape.
    pub(super) fn undo(&self, point: DVec3) -> DVec3 {
        let moved = point - self.translate;
        self.turn.map_or(moved, |turn| turn.inverse() * moved)
    }
}

/// Puts all points of a shape where it is placed.
pub(super) fn place(points: &mut [DVec3], rotate: [f64; 3], translate: [f64; 3]) {
    let place = Place::new(rotate, translate);
    points
        .iter_mut()
        .for_each(|point| *point = place.of(*point));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn x_before_y_before_z_before_moving() {
        let mut points = [DVec3::Z];
        place(&mut points, [90.0, 0.0, 90.0], [1.0, 2.0, 3.0]);
        // z → −y about x, −y → x about z.
        assert!(
            (points[0] - DVec3::new(2.0, 2.0, 3.0)).length() < 1e-15,
            "{}",
            points[0]
        );
        let back = Place::new([90.0, 0.0, 90.0], [1.0, 2.0, 3.0]).undo(points[0]);
        assert!((back - DVec3::Z).length() < 1e-15, "{back}");
    }
}
