//! How large a grid will be, before it is made.

use super::{BadGrid, Brick, CELLS, DistanceGrid, GridError, SAMPLES};
use crate::mesh::{Aabb, Surface, triangle_area};
use glam::{DVec3, Vec4};

/// What a brick with samples takes (B).
pub(super) const NEAR_BYTES: f64 = (SAMPLES * size_of::<Vec4>()) as f64;

/// The size of a grid before it is made.
#[derive(Clone, Copy)]
pub(super) struct Plan {
    cell: f64,
    band: f64,
    body: Aabb,
    /// Surface of the body (m²).
    area: f64,
}

impl Plan {
    pub(super) fn new(surface: &Surface, cell: f64, band: f64) -> Self {
        let mesh = surface.mesh();
        let triangles = || {
            mesh.triangles
                .iter()
                .map(|&triangle| mesh.corners(triangle))
        };
        Self {
            cell,
            band,
            body: Aabb::around(triangles().flatten()),
            area: triangles().map(triangle_area).sum(),
        }
    }

    /// Bricks along each axis.
    fn size(&self) -> DVec3 {
        let extent = self.body.max - self.body.min + 2.0 * self.band;
        (extent / (self.cell * CELLS as f64)).floor() + 1.0
    }

    pub(super) fn brick_bytes(&self) -> f64 {
        self.size().element_product() * size_of::<Brick>() as f64
    }

    /// What the grid will take, about: bricks are near within δ of the surface, in a volume of
    /// 2 A δ and a ball's for the body's ends.
    pub(super) fn bytes(&self) -> f64 {
        let length = self.cell * CELLS as f64;
        let near = self.band + 0.5 * 3.0_f64.sqrt() * length;
        let volume = 2.0 * self.area * near + 8.4 * near.powi(3);
        let bricks = (volume / length.powi(3)).min(self.size().element_product());
        self.brick_bytes() + bricks * NEAR_BYTES
    }

    /// The refusal of a grid of that many bytes, with cells that fit: to two digits, and with a
    /// tenth of the memory to spare for what [`Plan::bytes`] doesn't foresee.
    pub(super) fn too_fine(&self, bytes: f64) -> BadGrid {
        let mut coarser = *self;
        while coarser.bytes() > 0.9 * DistanceGrid::LIMIT as f64 || coarser.cell <= self.cell {
            coarser.cell *= 1.05;
        }
        BadGrid::TooFine {
            cell: self.cell,
            megabytes: (bytes / 1e6).min(1e9),
            enough: round_up(coarser.cell),
        }
    }

    pub(super) fn empty(&self) -> DistanceGrid {
        let far = Brick {
            first: Brick::FAR,
            distance: 0.0,
        };
        let size = self.size().to_array().map(whole);
        DistanceGrid {
            cell: self.cell,
            band: self.band,
            per_metre: 1.0 / self.cell,
            origin: self.body.min - self.band,
            body: self.body,
            size,
            end: size.map(|bricks| (bricks * CELLS) as f64 - 1e-9),
            bricks: vec![far; size.iter().product()],
            samples: Vec::new(),
            error: GridError::default(),
        }
    }
}

/// The next number of two digits.
fn round_up(x: f64) -> f64 {
    let digits = 10.0_f64.powf(1.0 - x.log10().floor());
    (x * digits).ceil() / digits
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a small whole number"
)]
fn whole(x: f64) -> usize {
    x as usize
}
