//! Springs in six bytes each.
//!
//! As for the passes of forces: springs of a regular sheet differ in their places alone, and a few
//! hundred pairs of rest length and compliance stand for all of them, bit for bit.

use super::course::Course;
use super::element::Link;
use crate::linear::{Ahead, BATCH};
use std::collections::BTreeMap;

/// A spring, by its places from the stage's lowest on and its kind.
#[derive(Clone, Copy, Debug)]
pub(super) struct Packed {
    ends: [u16; 2],
    kind: u16,
}

/// Kinds at most: 64 KiB, which leave room in the second-level cache.
const KINDS: usize = 4096;

/// Springs of few kinds, their ends near to each other.
#[derive(Debug)]
pub(super) struct PackedLinks {
    pub(super) course: Course<Packed>,
    pub(super) links: Unpacked,
}

/// What packed springs stand for.
#[derive(Debug)]
pub(super) struct Unpacked {
    /// The place from which those of each stage count.
    first: Vec<u32>,
    /// Rest length (m) and compliance (m/N) of each kind.
    kinds: Vec<[f64; 2]>,
}

impl Unpacked {
    /// Springs of one stage, unpacked.
    #[inline(always)]
    pub(super) fn at(&self, stage: usize) -> impl Fn(Packed) -> Link {
        let first = self.first[stage];
        move |packed| {
            let [rest_length, compliance] = self.kinds[usize::from(packed.kind)];
            Link {
                ends: packed.ends.map(|end| first + u32::from(end)),
                rest_length,
                compliance,
            }
        }
    }
}

/// The springs of a cluster.
#[derive(Debug)]
pub(super) enum Links {
    /// Springs in six bytes.
    Packed(PackedLinks),
    /// Any springs.
    Whole(Course<Link>),
}

impl Links {
    /// Packs springs where that is possible.
    pub(super) fn of(course: Course<Link>) -> Self {
        let first: Vec<u32> = course
            .lowest()
            .map(|place| u32::try_from(place).unwrap_or_default())
            .collect();
        let mut kinds = Kinds::default();
        let stages = first.iter().enumerate();
        let links = stages.flat_map(|(stage, &first)| {
            let links = &course.elements[course.of_stage(stage)];
            links.iter().map(move |link| (first, link))
        });
        let packed = links.map(|(first, link)| {
            let place = |end: u32| u16::try_from(end - first).ok();
            Some(Packed {
                ends: [place(link.ends[0])?, place(link.ends[1])?],
                kind: kinds.number([link.rest_length, link.compliance])?,
            })
        });
        match packed.collect() {
            Some(packed) => Self::Packed(PackedLinks {
                course: course.with(packed),
                links: Unpacked {
                    first,
                    kinds: kinds.list,
                },
            }),
            None => Self::Whole(course),
        }
    }

    /// Adds a stage's springs, where there is such a stage, to what is asked for ahead of its use.
    pub(super) fn add_to(&self, ahead: &mut Ahead, stage: usize) {
        match self {
            Self::Packed(packed) => packed.course.add_to(ahead, stage),
            Self::Whole(course) => course.add_to(ahead, stage),
        }
    }

    /// Number of a stage's batches.
    pub(super) fn batches(&self, stage: usize) -> usize {
        let springs = match self {
            Self::Packed(packed) => packed.course.of_stage(stage),
            Self::Whole(course) => course.of_stage(stage),
        };
        springs.len().div_ceil(BATCH)
    }
}

/// Different pairs, numbered in the order of their first appearance.
#[derive(Default)]
struct Kinds {
    list: Vec<[f64; 2]>,
    numbers: BTreeMap<[u64; 2], u16>,
}

impl Kinds {
    /// The number of a pair, while there is room.
    fn number(&mut self, kind: [f64; 2]) -> Option<u16> {
        let bits = kind.map(f64::to_bits);
        if let Some(&number) = self.numbers.get(&bits) {
            return Some(number);
        }
        let next = u16::try_from(self.list.len()).ok();
        let next = next.filter(|&next| usize::from(next) < KINDS)?;
        self.list.push(kind);
        self.numbers.insert(bits, next);
        Some(next)
    }
}

#[cfg(test)]
mod tests {
    use super::super::course::Stages;
    use super::super::course::tests::{colors_of, sheet};
    use super::*;

    #[test]
    fn packed_springs_are_the_same_springs() {
        let course = |links: &[(Link, f64)]| {
            Course::of(links, &colors_of(links), &mut Stages::of(10_000), false)
        };
        let mut links = sheet();
        let whole = course(&links);
        let Links::Packed(packed) = Links::of(course(&links)) else {
            panic!("six kinds");
        };
        assert_eq!(packed.links.kinds.len(), 6);
        for stage in 0..10 {
            let link = packed.links.at(stage);
            for k in packed.course.of_stage(stage) {
                assert_eq!(link(packed.course.elements[k]), whole.elements[k]);
            }
        }
        for (k, (link, _)) in (0..).zip(&mut links) {
            link.rest_length = f64::from(k);
        }
        assert!(matches!(Links::of(course(&links)), Links::Whole(_)));
    }
}
