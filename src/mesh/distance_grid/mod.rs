//! Signed distances sampled on a grid: the fast and approximate alternative to
//! [`Surface`](super::Surface) for bodies at rest.
//!
//! Samples stand in bricks, and only where the surface is near. Each holds the distance and its
//! gradient, so that interpolation is exact for quadratic fields: the error falls with the third
//! power of the cell near a smooth surface, with the first near an edge. It is measured when the
//! grid is made.

mod build;
mod plan;
#[cfg(test)]
mod tests;

use super::Aabb;
use glam::{DVec3, Vec4, Vec4Swizzles as _};

/// Distances from a closed surface at rest, on a grid around it.
#[derive(Clone)]
pub struct DistanceGrid {
    /// Length of a cell (m).
    cell: f64,
    /// Distance (m) up to which there are answers.
    band: f64,
    /// Cells along a metre.
    per_metre: f64,
    /// Place of the first sample (m).
    origin: DVec3,
    /// Box around the body (m).
    body: Aabb,
    /// Bricks along x, y and z.
    size: [usize; 3],
    /// Last place in them (cells).
    end: [f64; 3],
    /// All bricks, x fastest.
    bricks: Vec<Brick>,
    /// Normal and distance at each sample; [`SAMPLES`] of each brick that is near, x fastest.
    samples: Vec<Vec4>,
    error: GridError,
}

/// What a grid answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridNearest {
    /// Unit normal of the surface, pointing out of the body.
    pub normal: DVec3,
    /// Distance from the surface (m), negative inside.
    pub distance: f64,
}

/// How far a grid's answers are from the exact distance.
///
/// Measured at up to 4096 triangles, evenly chosen: at the middle and at one corner of each, on the
/// surface and a cell from it to both sides. It can't be larger than 1.3 cells anywhere: no distance
/// differs from that at a sample by more than the way to it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GridError {
    /// The largest (m).
    pub largest: f64,
    /// Root of the mean square (m).
    pub root_mean_square: f64,
}

/// Why a grid can't be made.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BadGrid {
    /// A length that is none.
    #[error("the {name} of a distance grid is {value} m; write a positive length, as 0.005")]
    Length {
        /// Which.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// More memory than [`DistanceGrid::LIMIT`].
    #[error(
        "a distance grid with cells of {cell} m takes {megabytes:.0} MB, more than the {} MB that \
         it may; write cells of {enough} m or more, or use exact distances",
        DistanceGrid::LIMIT / 1_000_000
    )]
    TooFine {
        /// Length of a cell (m).
        cell: f64,
        /// What it would take (MB).
        megabytes: f64,
        /// Length of a cell that fits (m).
        enough: f64,
    },
}

/// Cells along a brick. Larger bricks share fewer samples, but have more of them far from the
/// surface.
const CELLS: usize = 4;

/// Samples along a brick: its last are also its neighbour's first.
const ROW: usize = CELLS + 1;

/// Samples of a brick.
const SAMPLES: usize = ROW * ROW * ROW;

/// A cube of cells.
#[derive(Clone, Copy, Debug)]
struct Brick {
    /// Number of the first of its samples, or [`Brick::FAR`].
    first: u32,
    /// Distance of its middle from the surface (m).
    distance: f32,
}

impl Brick {
    /// The surface is too far for samples.
    const FAR: u32 = u32::MAX;
}

impl DistanceGrid {
    /// Memory that a grid may take (B). A body of 1.75 m takes 23 MB with cells of 5 mm and a band of
    /// 1 cm, 128 MB with cells of 2.5 mm.
    pub const LIMIT: usize = 256_000_000;

    /// The distance of a point; `None` when the surface is not closer than `reach` (m), or farther
    /// than the band.
    pub fn nearest(&self, p: DVec3, reach: f64) -> Option<GridNearest> {
        let (brick, cell, t) = self.brick(p)?;
        if brick.first == Brick::FAR {
            return None;
        }
        let [i, j, k] = cell.map(|i| i & (CELLS - 1));
        let samples = &self.samples[brick.first as usize + i + ROW * (j + ROW * k)..];
        let (field, bend) = interpolate(samples, t)?;
        let distance = f64::from(field.w) + self.cell * f64::from(bend);
        let normal = field.xyz().as_dvec3();
        (distance.abs() < reach.min(self.band)).then(|| GridNearest {
            // Zero only where the surface is as close on opposite sides.
            normal: normal.try_normalize().unwrap_or(DVec3::Y),
            distance,
        })
    }

    /// A signed distance (m) that is no larger than the true one, also far from the surface: 0
    /// close to it.
    pub fn at_least(&self, p: DVec3) -> f64 {
        let Some((brick, cell, t)) = self.brick(p) else {
            return self.body.distance_squared(p).sqrt();
        };
        let from_middle = |axis: usize| {
            let cells = (cell[axis] & (CELLS - 1)) as f64 - 0.5 * CELLS as f64;
            cells + f64::from(t[axis])
        };
        let middle = DVec3::from_array([0, 1, 2].map(from_middle));
        let distance = f64::from(brick.distance);
        // Single precision has lost less than a millionth.
        let least = distance.abs() * (1.0 - 1e-6) - middle.length() * self.cell;
        least.max(0.0).copysign(distance)
    }

    /// How wrong it is near the surface.
    pub fn error(&self) -> GridError {
        self.error
    }

    /// Its size (B).
    pub fn bytes(&self) -> usize {
        size_of_val(&self.bricks[..]) + size_of_val(&self.samples[..])
    }

    /// The brick that a point is in, its cell, and where in that it is, in 0..=1.
    #[inline]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "fewer than 2³² cells along an axis; t needs no more"
    )]
    fn brick(&self, p: DVec3) -> Option<(Brick, [usize; 3], [f32; 3])> {
        let at = ((p - self.origin) * self.per_metre).to_array();
        let mut cell = [0; 3];
        let mut t = [0.0; 3];
        for axis in 0..3 {
            if !(at[axis] >= 0.0 && at[axis] <= self.end[axis]) {
                return None;
            }
            let shifted = (at[axis] - 0.5) + UNITS;
            cell[axis] = shifted.to_bits() as u32 as usize;
            t[axis] = (at[axis] - (shifted - UNITS)) as f32;
        }
        let [i, j, k] = cell.map(|cell| cell / CELLS);
        let brick = self.bricks[i + self.size[0] * (j + self.size[1] * k)];
        Some((brick, cell, t))
    }
}

/// 3 · 2⁵¹: a number much smaller is rounded when this is added, and stands in the lowest bits. A
/// conversion, which has to mind numbers out of range, makes a query take 57 ns instead of 23.
const UNITS: f64 = (3_u64 << 51) as f64;

/// Field at a place t in a cell, of which `samples` begin with the first corner, and what its bend
/// adds to the distance (cells).
///
/// With g the gradient and t = (x, y, z) in 0..1:
///
/// d = Σ wᵢ dᵢ + ½ h Σₐ tₐ (1 − tₐ) (gₐ(tₐ = 0) − gₐ(tₐ = 1))
///
/// The sum over corners is trilinear; it is too large by ½ h² t (1 − t) ∂²d/∂a² along each axis a,
/// which the gradients tell.
#[inline]
fn interpolate(samples: &[Vec4], [x, y, z]: [f32; 3]) -> Option<(Vec4, f32)> {
    const FAR_CORNER: usize = 1 + ROW + ROW * ROW;
    let samples = samples.first_chunk::<{ FAR_CORNER + 1 }>()?;
    let along_z = |i: usize| {
        let fall = samples[i] - samples[i + ROW * ROW];
        (samples[i] - fall * z, fall)
    };
    let along_y = |i: usize| {
        let ((here, fall), (there, next_fall)) = (along_z(i), along_z(i + ROW));
        let fall_y = here - there;
        (here - fall_y * y, fall_y, fall.lerp(next_fall, y))
    };
    let ((here, fall_y, fall_z), (there, next_y, next_z)) = (along_y(0), along_y(1));
    let fall_x = here - there;
    let bend = x * (1.0 - x) * fall_x.x
        + y * (1.0 - y) * fall_y.lerp(next_y, x).y
        + z * (1.0 - z) * fall_z.lerp(next_z, x).z;
    Some((here - fall_x * x, 0.5 * bend))
}

impl std::fmt::Debug for DistanceGrid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "DistanceGrid of cells of {} m", self.cell)
    }
}
