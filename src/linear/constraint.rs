//! What of an unknown is given.

use super::outer;
use glam::{DMat3, DVec3};

/// The directions in which a row's unknown is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constraint {
    /// None.
    Free,
    /// Along a unit normal.
    Plane(DVec3),
    /// All.
    Fixed,
}

impl Constraint {
    /// P v, P the projection on the free directions.
    #[inline]
    pub fn project(self, v: DVec3) -> DVec3 {
        match self {
            Self::Free => v,
            Self::Plane(n) => v - n * n.dot(v),
            Self::Fixed => DVec3::ZERO,
        }
    }

    /// P.
    pub fn projection(self) -> DMat3 {
        match self {
            Self::Free => DMat3::IDENTITY,
            Self::Plane(n) => DMat3::IDENTITY - outer(n, n),
            Self::Fixed => DMat3::ZERO,
        }
    }

    /// P B P + s (1 − P), s the size of B: invertible, and B on the free directions.
    pub fn restrict(self, block: DMat3) -> DMat3 {
        match self {
            Self::Free => block,
            Self::Plane(n) => {
                let (p, size) = (self.projection(), block.x_axis.x.max(block.y_axis.y));
                p * block * p + outer(n, n) * size
            }
            Self::Fixed => DMat3::IDENTITY,
        }
    }

    /// The inverse of a symmetric diagonal block on the free directions, zero on the given ones.
    pub fn inverse(self, block: DMat3) -> DMat3 {
        match self {
            Self::Free => block.inverse(),
            Self::Fixed => DMat3::ZERO,
            Self::Plane(n) => plane_inverse(block, n),
        }
    }
}

/// T (Tᵀ B T)⁻¹ Tᵀ with T two unit vectors across the normal.
fn plane_inverse(block: DMat3, n: DVec3) -> DMat3 {
    let (s, t) = n.any_orthonormal_pair();
    let (bs, bt) = (block * s, block * t);
    let (ss, st, tt) = (s.dot(bs), s.dot(bt), t.dot(bt));
    let determinant = ss * tt - st * st;
    let (across_s, across_t) = (
        (s * tt - t * st) / determinant,
        (t * ss - s * st) / determinant,
    );
    DMat3::from_cols(
        across_s * s.x + across_t * t.x,
        across_s * s.y + across_t * t.y,
        across_s * s.z + across_t * t.z,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::LineBlock;

    #[test]
    fn plane_inverse_inverts_across_the_normal_and_ignores_it() {
        let along = |a, e, d| LineBlock { a, e, d }.to_matrix();
        let block = along(3.0, 2.0, DVec3::new(0.5, -1.0, 0.2))
            + along(0.0, 1.0, DVec3::new(1.0, 2.0, 3.0));
        let n = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let inverse = Constraint::Plane(n).inverse(block);
        assert!((inverse * n).length() < 1e-14);
        let across = n.any_orthonormal_vector();
        let back = inverse * (block * across);
        assert!((back - across).length() < 1e-13, "{back} against {across}");
        assert_eq!(Constraint::Fixed.inverse(block), DMat3::ZERO);
    }
}
