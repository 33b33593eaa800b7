//! Round openings in sheets: the grid's square rings around one are bent into circles, so that its
//! border is a smooth polygon of equal sides instead of a staircase.

use super::Sheet;
use glam::DVec2;
use serde::{Deserialize, Serialize};

/// A round hole in a sheet.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Opening {
    /// Its centre on the sheet, along x and along z (m).
    pub center: [f64; 2],
    /// Its radius (m).
    pub radius: f64,
}

/// Why a sheet can't be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "the opening of radius {radius} m around ({x}, {z}) leaves less than two cells of cloth beside it or folds them over; make it smaller, move it, or use more cells, as long as wide"
)]
pub struct OpeningTooLarge {
    radius: f64,
    x: f64,
    z: f64,
}

impl OpeningTooLarge {
    pub(super) fn of(opening: &Opening) -> Self {
        let [x, z] = opening.center;
        Self {
            radius: opening.radius,
            x,
            z,
        }
    }
}

/// Where the grid is bent around an opening.
///
/// Ring k is the square of grid points at index distance k from the centre's nearest point. Ring
/// `inner` becomes the opening's circle; from there to ring `outer` circles blend into squares.
pub(super) struct Hole {
    center: DVec2,
    radius: f64,
    nearest: [i64; 2],
    pub(super) inner: i64,
    outer: i64,
    cell: f64,
}

impl Hole {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "rounded grid indices, at most 2³² in size"
    )]
    pub(super) fn new(sheet: &Sheet, opening: &Opening) -> Result<Self, OpeningTooLarge> {
        let h = sheet.cell_size();
        let [x, z] = opening.center;
        if x.abs().max(z.abs()).max(opening.radius) > sheet.size[0].max(sheet.size[1]) {
            return Err(OpeningTooLarge::of(opening));
        }
        let nearest = [
            ((x + 0.5 * sheet.size[0]) / h.x).round() as i64,
            ((z + 0.5 * sheet.size[1]) / h.y).round() as i64,
        ];
        let cell = (h.x * h.y).sqrt();
        // A circle of radius R takes the ring whose half width is closest to R: its 8 k sides are a
        // quarter shorter than the cells.
        let inner = ((opening.radius / cell).round() as i64).max(1);
        let room = (0..2)
            .map(|axis| nearest[axis].min(i64::from(sheet.cells[axis]) - nearest[axis]))
            .fold(i64::MAX, i64::min);
        if room < inner + 2 {
            return Err(OpeningTooLarge::of(opening));
        }
        let outer = (2 * inner + 4).min(room);
        Ok(Self {
            center: DVec2::new(x, z),
            radius: opening.radius,
            nearest,
            inner,
            outer,
            cell,
        })
    }

    /// Index distance of a grid point from the opening's centre.
    pub(super) fn ring(&self, i: u32, j: u32) -> i64 {
        (i64::from(i) - self.nearest[0])
            .abs()
            .max((i64::from(j) - self.nearest[1]).abs())
    }

    /// Moves a grid point that lies at `point`.
    #[expect(clippy::cast_precision_loss, reason = "grid indices")]
    pub(super) fn bend(&self, i: u32, j: u32, point: DVec2) -> DVec2 {
        let ring = self.ring(i, j);
        if ring >= self.outer || ring < self.inner {
            return point;
        }
        let (u, v) = (
            (i64::from(i) - self.nearest[0]) as f64,
            (j as i64 - self.nearest[1]) as f64,
        );
        let direction = DVec2::from_angle(square_to_circle_angle(u, v));
        let circle =
            self.center + direction * (self.radius + (ring - self.inner) as f64 * self.cell);
        let t = (ring - self.inner) as f64 / (self.outer - self.inner) as f64;
        circle.lerp(point, t * t * (3.0 - 2.0 * t))
    }
}

/// Angle on a circle of a point on a square ring, evenly spaced along each side (rad).
fn square_to_circle_angle(u: f64, v: f64) -> f64 {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    if u.abs() >= v.abs() {
        let side = FRAC_PI_4 * v / u;
        if u > 0.0 { side } else { side + PI }
    } else {
        FRAC_PI_2 * v.signum() - FRAC_PI_4 * u / v
    }
}
