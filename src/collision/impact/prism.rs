//! What an element sweeps in a step, in single precision and ready to be told apart from what others sweep.

use super::element::Element;
use glam::{Mat4, Vec3, Vec4};

/// An element's corners at the start and at the end of their ways, and the slab along its normal that holds them.
///
/// An element of a rope of folds has drifted against ten others, and most are told apart by a slab: what both need is
/// worked out once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prism {
    /// x, y and z of the corners, at the start and at the end (m); the last corner twice.
    corners: [[Vec4; 3]; 2],
    /// Least and largest corner of its box, at the start and at the end (m).
    boxes: [[Vec4; 2]; 2],
    /// Unit normal at the start; 0 without area.
    normal: Vec3,
    /// Least and largest height along it (m).
    slab: [f32; 2],
}

impl Prism {
    pub(super) const NONE: Self = Self {
        corners: [[Vec4::ZERO; 3]; 2],
        boxes: [[Vec4::ZERO; 2]; 2],
        normal: Vec3::ZERO,
        slab: [0.0; 2],
    };

    /// What an element sweeps, from the starts and ends of all vertices' ways (m).
    pub(super) fn of(element: &Element, ways: &[[Vec4; 2]]) -> Self {
        let [a, b, c] = element.corners.map(|i| &ways[i as usize]);
        let corners = [0, 1].map(|time| {
            let all = Mat4::from_cols(a[time], b[time], c[time], c[time]).transpose();
            [all.x_axis, all.y_axis, all.z_axis]
        });
        let boxes = [0, 1].map(|time| {
            let [a, b, c] = [a[time], b[time], c[time]];
            [a.min(b).min(c), a.max(b).max(c)]
        });
        let [a, b, c] = [a, b, c].map(|way| way[0].truncate());
        let mut prism = Self {
            corners,
            boxes,
            normal: (b - a).cross(c - a).normalize_or_zero(),
            slab: [0.0; 2],
        };
        prism.slab = prism.range(prism.normal);
        prism
    }

    /// Whether two elements keep a gap (m) along an axis, the normal of one of them or the line between them, on the
    /// same side at the start and at the end.
    #[inline]
    pub(super) fn are_apart(&self, other: &Self, gap: f32) -> bool {
        if boxes_are_apart(self.boxes, other.boxes, gap) {
            return true;
        }
        let slabs = |one: &Self, other: &Self| {
            let ([low, high], [other_low, other_high]) = (one.slab, other.range(one.normal));
            low - other_high > gap || other_low - high > gap
        };
        if slabs(self, other) || slabs(other, self) {
            return true;
        }
        let middle =
            |[[low, high], [end_low, end_high]]: [[Vec4; 2]; 2]| low + high + end_low + end_high;
        let between = middle(self.boxes) - middle(other.boxes);
        let between = between.truncate().normalize_or_zero();
        self.range(between)[0] - other.range(between)[1] > gap
    }

    /// Least and largest height of the corners along a direction (m).
    #[inline]
    fn range(&self, direction: Vec3) -> [f32; 2] {
        let [start, end] = [&self.corners[0], &self.corners[1]]
            .map(|[x, y, z]| *x * direction.x + *y * direction.y + *z * direction.z);
        [start.min(end).min_element(), start.max(end).max_element()]
    }
}

/// Whether two boxes keep a gap (m) along an axis, on the same side at both ends of their ways: of each the least and the
/// largest corner at the start, then at the end.
#[inline]
pub(super) fn boxes_are_apart(
    [a0, a1]: [[Vec4; 2]; 2],
    [b0, b1]: [[Vec4; 2]; 2],
    gap: f32,
) -> bool {
    let above = (a0[0] - b0[1]).min(a1[0] - b1[1]);
    let below = (b0[0] - a0[1]).min(b1[0] - a1[1]);
    above.max(below).max_element() > gap
}

#[cfg(test)]
mod tests {
    use super::super::element::elements;
    use super::*;
    use proptest::prelude::*;

    fn point(far: f32) -> impl Strategy<Value = Vec4> {
        [-far..far, -far..far, -far..far].prop_map(|[x, y, z]| Vec4::new(x, y, z, 0.0))
    }

    /// Points of a triangle.
    fn points([a, b, c]: [Vec4; 3]) -> impl Iterator<Item = Vec4> {
        let share = |k: u8| f32::from(k) / 8.0;
        let both = (0..=8).flat_map(|j| (0..=8 - j).map(move |k| [j, k]));
        both.map(move |[j, k]| a + (b - a) * share(j) + (c - a) * share(k))
    }

    proptest! {
        /// What is told apart never comes closer than the gap, and what goes along with each other at twice the gap
        /// and its size is told apart.
        #[test]
        fn what_is_apart_stays_apart(
            shape in prop::array::uniform6(point(1.0)),
            moves in prop::array::uniform6(point(1.5)),
            away in point(1.5),
        ) {
            let gap = 0.1;
            let mut ways: Vec<[Vec4; 2]> = shape.iter().zip(&moves).map(|(x, v)| [*x, *x + *v]).collect();
            ways[3..].iter_mut().flatten().for_each(|x| *x += away);
            let list = elements(0, 6, &[[0, 1, 2], [3, 4, 5]], &[], 0);
            let prisms = |ways: &[[Vec4; 2]]| [0, 1].map(|k| Prism::of(&list[k], ways));
            let [one, other] = prisms(&ways);
            prop_assert_eq!(one.are_apart(&other, gap), other.are_apart(&one, gap));
            if one.are_apart(&other, gap) {
                for time in (0..=8_u8).map(|k| f32::from(k) / 8.0) {
                    let at = |i: usize| ways[i][0].lerp(ways[i][1], time);
                    let nearest = points([at(0), at(1), at(2)])
                        .flat_map(|x| points([at(3), at(4), at(5)]).map(move |y| x.distance(y)))
                        .fold(f32::INFINITY, f32::min);
                    prop_assert!(nearest > gap - 1e-5, "{nearest} m at {time}");
                }
            }
            let far = 3.6 + 2.0 * gap; // longer than two diagonals of what the points are in
            for (k, way) in ways.iter_mut().enumerate() {
                let start = shape[k] + if k < 3 { Vec4::ZERO } else { Vec4::X * far };
                *way = [start, start + away];
            }
            let [one, other] = prisms(&ways);
            prop_assert!(one.are_apart(&other, gap));
        }
    }
}
