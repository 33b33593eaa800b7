//! Placing shapes in the world.

use glam::{DQuat, DVec3};

/// Turns points by degrees about x, then y, then z, and then moves them (m).
pub(super) fn place(points: &mut [DVec3], rotate: [f64; 3], translate: [f64; 3]) {
    let [x, y, z] = rotate.map(f64::to_radians);
    let turn = DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y) * DQuat::from_rotation_x(x);
    let unturned = rotate == [0.0; 3];
    for point in points {
        let turned = if unturned { *point } else { turn * *point };
        *point = turned + DVec3::from_array(translate);
    }
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
    }
}
