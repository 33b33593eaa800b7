//! Springs: with a rest length, or without.
//!
//! A spring without a rest length (ℓ₀ = 0) is the ideal one: E = ½ k |d|², f = k d and the Jacobian
//! k·1 are linear and regular everywhere. With a rest length, force and direction are no longer
//! linear, and at zero length the direction is undefined.

use super::packed::SpringLists;
use super::pass::Tiled;
use super::{Cut, Force, Jacobian, Stiffness, Tiles, Window};
use crate::linear::{Assembly, LineBlock, Pattern};
use crate::state::State;
use glam::DVec3;
use std::ops::Range;

/// Energy of a spring (J): E = ½ k (|d| − ℓ₀)² with d = xⱼ − xᵢ.
pub fn energy(d: DVec3, stiffness: f64, rest_length: f64) -> f64 {
    let stretch = d.length() - rest_length;
    0.5 * stiffness * stretch * stretch
}

/// Force of a spring on its first particle (N): fᵢ = k (|d| − ℓ₀) d/|d| with d = xⱼ − xᵢ.
///
/// Zero when |d| = 0, where the direction is undefined.
///
/// Source: Provot 1995.
#[inline]
pub fn force(d: DVec3, stiffness: f64, rest_length: f64) -> DVec3 {
    let length = d.length();
    if length > 0.0 {
        d * (stiffness * (1.0 - rest_length / length))
    } else {
        DVec3::ZERO
    }
}

/// −∂fᵢ/∂xᵢ of a spring (N/m): k [d̂ d̂ᵀ + (1 − ℓ₀/|d|)(1 − d̂ d̂ᵀ)].
///
/// Negative across a compressed spring: the definite one has max(0, 1 − ℓ₀/|d|) there. At |d| = 0,
/// where the force has no derivative, k·1: the spring resists every direction in which its ends may
/// part.
///
/// Source: Choi and Ko 2002.
#[inline]
pub fn jacobian(d: DVec3, stiffness: f64, rest_length: f64, kind: Jacobian) -> LineBlock {
    let across_least = match kind {
        Jacobian::Exact => f64::NEG_INFINITY,
        Jacobian::Definite => 0.0,
    };
    let length_squared = d.length_squared();
    if length_squared == 0.0 {
        return LineBlock {
            a: stiffness,
            e: 0.0,
            d,
        };
    }
    let across = (1.0 - rest_length / length_squared.sqrt()).max(across_least);
    LineBlock {
        a: stiffness * across,
        e: stiffness * (1.0 - across) / length_squared,
        d,
    }
}

/// One spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Its particles.
    pub ends: [u32; 2],
    /// Rest length ℓ₀ (m).
    pub rest_length: f64,
    /// Stiffness k (N/m).
    pub stiffness: f64,
}

impl Spring {
    /// From its first to its second particle (m).
    #[inline]
    pub fn span(&self, positions: &[DVec3]) -> DVec3 {
        positions[self.ends[1] as usize] - positions[self.ends[0] as usize]
    }

    /// Strain ε = ℓ/ℓ₀ − 1; 0 for a zero-length spring, which has none.
    #[inline]
    pub fn strain(&self, positions: &[DVec3]) -> f64 {
        if self.rest_length > 0.0 {
            self.span(positions).length() / self.rest_length - 1.0
        } else {
            0.0
        }
    }

    /// λ² = (ℓ/ℓ₀)², which needs no square root.
    #[inline]
    pub fn stretch_squared(&self, positions: &[DVec3]) -> f64 {
        self.span(positions).length_squared() / (self.rest_length * self.rest_length)
    }
}

/// Largest λ² of some springs; NaN is passed over, and without springs it is −∞.
pub fn largest_stretch_squared(springs: &[Spring], positions: &[DVec3]) -> f64 {
    let mut largest = Largest::default();
    largest.look_at(springs, |spring| spring.stretch_squared(positions));
    largest.of_all()
}

/// The largest of what is found at elements; NaN is passed over, and of none it is −∞.
///
/// Four springs at once take 1.2 ns each, one after the other 2.5.
#[derive(Debug)]
pub(super) struct Largest([f64; 4]);

impl Default for Largest {
    fn default() -> Self {
        Self([f64::NEG_INFINITY; 4])
    }
}

impl Largest {
    /// Looks at some more elements.
    #[inline(always)]
    pub(super) fn look_at<E>(&mut self, elements: &[E], find: impl Fn(&E) -> f64) {
        let Self(most) = self;
        let (fours, rest) = elements.as_chunks::<4>();
        for four in fours {
            for k in 0..4 {
                let found = find(&four[k]);
                most[k] = if found > most[k] { found } else { most[k] };
            }
        }
        most[0] = rest.iter().map(find).fold(most[0], f64::max);
    }

    pub(super) fn of_all(self) -> f64 {
        self.0.into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Energy of some springs together (J), and their largest λ² as [`largest_stretch_squared`] has it.
pub fn energy_and_stretch_squared(springs: &[Spring], positions: &[DVec3]) -> [f64; 2] {
    look::<true>(springs, positions)
}

/// Four springs at once, so that their roots and divisions share instructions; the largest λ² if it is
/// asked for.
#[inline(always)]
fn look<const STRETCH: bool>(springs: &[Spring], positions: &[DVec3]) -> [f64; 2] {
    let (mut sums, mut largest) = ([0.0; 4], [f64::NEG_INFINITY; 4]);
    let (fours, rest) = springs.as_chunks::<4>();
    for four in fours {
        look_at(four, positions, &mut sums, &mut largest, STRETCH);
    }
    let (mut sum, mut most) = ([0.0], [f64::NEG_INFINITY]);
    for spring in rest {
        look_at(&[*spring], positions, &mut sum, &mut most, STRETCH);
    }
    let sum = sums.iter().chain(&sum).sum::<f64>();
    let most = largest.into_iter().chain(most);
    [0.5 * sum, most.fold(f64::NEG_INFINITY, f64::max)]
}

/// Adds k (ℓ − ℓ₀)² of each to its sum, and keeps its λ² where that is larger.
#[inline(always)]
fn look_at<const L: usize>(
    springs: &[Spring; L],
    positions: &[DVec3],
    sums: &mut [f64; L],
    largest: &mut [f64; L],
    with_stretch: bool,
) {
    let squares = springs
        .each_ref()
        .map(|spring| spring.span(positions).length_squared());
    let rests = springs.each_ref().map(|spring| spring.rest_length);
    for k in 0..L {
        let stretch = squares[k].sqrt() - rests[k];
        sums[k] += springs[k].stiffness * (stretch * stretch);
    }
    if with_stretch {
        for k in 0..L {
            let square = squares[k] / (rests[k] * rests[k]);
            largest[k] = if square > largest[k] {
                square
            } else {
                largest[k]
            };
        }
    }
}

/// All springs of one family.
#[derive(Clone, Debug)]
pub struct SpringBatch {
    /// `structural`, `shear`, `bend` or `zero-length`.
    pub family: &'static str,
    /// The springs.
    pub springs: Vec<Spring>,
}

impl SpringBatch {
    /// Whether the springs stand for lengths of the weave, whose strain counts.
    pub fn is_weave(&self) -> bool {
        matches!(self.family, "structural" | "shear")
    }
}

impl Force for SpringBatch {
    fn name(&self) -> &'static str {
        self.family
    }

    fn elements(&self) -> usize {
        self.springs.len()
    }

    fn energy_of(&self, elements: Range<usize>, positions: &[DVec3]) -> f64 {
        look::<false>(&self.springs[elements], positions)[0]
    }

    fn add_forces(&self, state: &State, forces: &mut [DVec3]) {
        add_forces(&self.springs, state, &mut Window::whole(forces));
    }

    fn cut(&self, tiles: Tiles) -> Box<dyn Cut> {
        let tiled = Tiled::new(tiles, &self.springs, |spring| spring.ends);
        Box::new(SpringLists::of(tiled))
    }
}

pub(super) fn add_forces(springs: &[Spring], state: &State, window: &mut Window<'_>) {
    for spring in springs {
        let d = spring.span(&state.positions);
        let f = force(d, spring.stiffness, spring.rest_length);
        window.add(spring.ends[0], f);
        window.add(spring.ends[1], -f);
    }
}

impl Stiffness for SpringBatch {
    fn pattern(&self) -> Pattern {
        Pattern::Lines(self.springs.iter().map(|spring| spring.ends).collect())
    }

    fn add_jacobian(&self, state: &State, scale: f64, kind: Jacobian, assembly: &mut Assembly<'_>) {
        for (element, spring) in self.springs.iter().enumerate() {
            let d = spring.span(&state.positions);
            let k = scale * spring.stiffness;
            assembly.add(element, jacobian(d, k, spring.rest_length, kind));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const AXES: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];

    proptest! {
        /// Force against differences of the energy, Jacobian against differences of the force, from
        /// a tenth to three times the rest length. The step balances truncation (h²) with rounding
        /// (ε/h).
        #[test]
        fn derivatives_agree_with_differences(
            angle in 0.0..6.3_f64, height in -1.0..1.0_f64, stretch in 0.1..3.0_f64, k in 0.1..1e4_f64,
        ) {
            let (rest, h) = (0.3, 1e-6);
            let around = (1.0 - height * height).sqrt();
            let d = DVec3::new(around * angle.cos(), height, around * angle.sin()) * rest * stretch;
            let (f, j) = (force(d, k, rest), jacobian(d, k, rest, Jacobian::Exact).to_matrix());
            for axis in AXES {
                // f acts on the first particle and d points away from it: f = +∂E/∂d.
                let slope = (energy(d + axis * h, k, rest) - energy(d - axis * h, k, rest)) / (2.0 * h);
                prop_assert!((slope - f.dot(axis)).abs() < 1e-6 * k * rest, "{slope} against {f}");
                let column = (force(d + axis * h, k, rest) - force(d - axis * h, k, rest)) / (2.0 * h);
                prop_assert!((column - j * axis).length() < 1e-5 * k, "{column} against {j}");
            }
        }
    }

    #[test]
    fn definite_jacobian_is_the_exact_one_when_stretched_and_definite_when_not() {
        let stretched = DVec3::new(0.2, 0.3, -0.1);
        assert_eq!(
            jacobian(stretched, 5.0, 0.1, Jacobian::Exact),
            jacobian(stretched, 5.0, 0.1, Jacobian::Definite)
        );
        let compressed = jacobian(stretched, 5.0, 1.0, Jacobian::Definite).to_matrix();
        for axis in AXES {
            assert!(axis.dot(compressed * axis) >= 0.0);
        }
        let across = stretched.cross(DVec3::X);
        assert!(
            across.dot(jacobian(stretched, 5.0, 1.0, Jacobian::Exact).to_matrix() * across) < 0.0
        );
    }

    #[test]
    fn a_spring_of_zero_length_is_finite() {
        assert_eq!(force(DVec3::ZERO, 5.0, 1.0), DVec3::ZERO);
        assert!(
            jacobian(DVec3::ZERO, 5.0, 1.0, Jacobian::Exact)
                .to_matrix()
                .is_finite()
        );
        assert!((energy(DVec3::ZERO, 5.0, 1.0) - 2.5).abs() < 1e-15);
    }
}
