//! Boxes along the axes.

use glam::DVec3;

/// An axis-aligned bounding box; its faces belong to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates (m).
    pub min: DVec3,
    /// Largest coordinates (m).
    pub max: DVec3,
}

impl Aabb {
    /// The box of nothing: it overlaps nothing, and is neutral in [`Aabb::union`].
    pub const EMPTY: Self = Self {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };

    /// The smallest box around some points.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |whole, p| Self {
            min: whole.min.min(p),
            max: whole.max.max(p),
        })
    }

    /// The smallest box around two.
    pub fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// Whether two boxes have a point in common; to touch is enough.
    pub fn overlaps(self, other: Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// The box grown by `margin` (m) on every side.
    pub fn grown(self, margin: f64) -> Self {
        Self {
            min: self.min - DVec3::splat(margin),
            max: self.max + DVec3::splat(margin),
        }
    }

    /// Its middle (m).
    pub fn center(self) -> DVec3 {
        0.5 * self.min + 0.5 * self.max
    }

    /// Half its surface (m²), 0 of nothing: dx dy + dy dz + dz dx.
    pub fn half_area(self) -> f64 {
        let d = (self.max - self.min).max(DVec3::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// Square of the distance of a point (m²), 0 inside.
    pub fn distance_squared(self, p: DVec3) -> f64 {
        let outside = (self.min - p).max(p - self.max).max(DVec3::ZERO);
        outside.length_squared()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn boxes_that_touch_overlap_and_nothing_overlaps_nothing() {
        let unit = Aabb::around([DVec3::ZERO, DVec3::ONE]);
        let beside = Aabb::around([dvec3(1.0, 0.5, 0.5), dvec3(2.0, 0.6, 0.6)]);
        assert!(unit.overlaps(beside) && beside.overlaps(unit) && unit.overlaps(unit));
        let away = Aabb::around([dvec3(1.0 + 1e-15, 0.5, 0.5)]);
        assert!(!unit.overlaps(away) && unit.grown(1e-14).overlaps(away));
        assert!(!unit.overlaps(Aabb::EMPTY) && !Aabb::EMPTY.overlaps(Aabb::EMPTY));
        assert_eq!(unit.union(Aabb::EMPTY), unit);
        assert_eq!(unit.union(beside).max, dvec3(2.0, 1.0, 1.0));
    }

    #[test]
    fn area_and_distance() {
        let flat = Aabb::around([DVec3::ZERO, dvec3(1.0, 2.0, 3.0)]);
        assert_eq!(flat.half_area(), 11.0);
        assert_eq!(Aabb::EMPTY.half_area(), 0.0);
        assert_eq!(flat.center(), dvec3(0.5, 1.0, 1.5));
        assert_eq!(flat.distance_squared(dvec3(0.5, 2.0, 2.9)), 0.0);
        assert_eq!(flat.distance_squared(dvec3(-3.0, 1.0, 7.0)), 25.0);
    }
}
