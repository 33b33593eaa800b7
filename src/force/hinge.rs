//! Hinges: bending between two triangles on one edge.
//!
//! What an angle costs is a [`BendingLaw`]; how it depends on the corners is [`Dihedral`]'s. How stiff
//! a hinge of a given cloth must be is the scene's: a plate rigidity, calibrated on the mesh.

use super::dihedral::{Hessian, PAIRS};
use super::pass::{Lists, Tiled};
use super::{Cut, Dihedral, Fold, Force, Jacobian, Stiffness, Tiles, Window};
use crate::linear::{Assembly, Pattern};
use crate::state::State;
use glam::DVec3;
use std::fmt::Debug;
use std::marker::PhantomData;
use std::ops::Range;

/// Energy of a dihedral angle θ against its rest angle θ₀ (rad), for a hinge of stiffness 1. A law
/// that asks for the angle itself pays for its arctangent.
///
/// All laws agree for small angles: E = ½ (θ − θ₀)².
pub trait BendingLaw: Debug + Default + Copy + Send + Sync {
    /// The law's name in reports.
    const NAME: &'static str;

    /// E/k.
    fn energy(fold: Fold, rest: f64) -> f64;

    /// E′/k.
    fn moment(fold: Fold, rest: f64) -> f64;

    /// E″/k, never negative.
    fn slope(fold: Fold, rest: f64) -> f64;

    /// C with E/k = ½ C², of the sign of θ − θ₀, and C′, so that C C′ = E′/k: what makes a hinge a
    /// compliant constraint.
    fn constraint(fold: Fold, rest: f64) -> [f64; 2];
}

/// Two triangles on one edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hinge {
    /// Particles a, b on the edge, c and d opposite: triangles a → b → c and b → a → d.
    pub corners: [u32; 4],
    /// Rest angle θ₀ (rad).
    pub rest_angle: f64,
    /// Stiffness k (N·m).
    pub stiffness: f64,
}

impl Hinge {
    /// The corners' entries in a list of positions or velocities.
    #[inline]
    pub fn of(&self, list: &[DVec3]) -> [DVec3; 4] {
        self.corners.map(|corner| list[corner as usize])
    }
}

/// All hinges of one law: E = Σ k L(θ, θ₀) (J).
#[derive(Clone, Debug, Default)]
pub struct HingeBatch<L> {
    /// The hinges.
    pub hinges: Vec<Hinge>,
    law: PhantomData<L>,
}

impl<L: BendingLaw> HingeBatch<L> {
    /// The batch of some hinges.
    pub fn new(hinges: Vec<Hinge>) -> Self {
        let law = PhantomData;
        Self { hinges, law }
    }
}

impl<L: BendingLaw> Force for HingeBatch<L> {
    fn name(&self) -> &'static str {
        L::NAME
    }

    fn elements(&self) -> usize {
        self.hinges.len()
    }

    fn energy_of(&self, elements: Range<usize>, positions: &[DVec3]) -> f64 {
        let each = self.hinges[elements].iter().map(|hinge| {
            let fold = Dihedral::of(hinge.of(positions)).fold;
            hinge.stiffness * L::energy(fold, hinge.rest_angle)
        });
        each.sum()
    }

    fn add_forces(&self, state: &State, forces: &mut [DVec3]) {
        add_forces::<L>(&self.hinges, state, &mut Window::whole(forces));
    }

    fn cut(&self, tiles: Tiles) -> Box<dyn Cut> {
        let tiled = Tiled::new(tiles, &self.hinges, |hinge| hinge.corners);
        let add = add_forces::<L>;
        Box::new(Lists { tiled, add })
    }
}

fn add_forces<L: BendingLaw>(hinges: &[Hinge], state: &State, window: &mut Window<'_>) {
    for hinge in hinges {
        let dihedral = Dihedral::of(hinge.of(&state.positions));
        let moment = hinge.stiffness * L::moment(dihedral.fold, hinge.rest_angle);
        for (corner, gradient) in hinge.corners.into_iter().zip(dihedral.gradient) {
            window.add(corner, gradient * -moment);
        }
    }
}

impl<L: BendingLaw> Stiffness for HingeBatch<L> {
    fn pattern(&self) -> Pattern {
        hinge_pattern(&self.hinges)
    }

    fn add_jacobian(
        &self,
        state: &State,
        scale: f64,
        jacobian: Jacobian,
        assembly: &mut Assembly<'_>,
    ) {
        for (element, hinge) in self.hinges.iter().enumerate() {
            let corners = hinge.of(&state.positions);
            let Dihedral { fold, gradient } = Dihedral::of(corners);
            let k = scale * hinge.stiffness;
            let moment = k * L::moment(fold, hinge.rest_angle);
            let mut hessian =
                Hessian::gauss_newton(&gradient, k * L::slope(fold, hinge.rest_angle));
            match jacobian {
                Jacobian::Exact => hessian.add_curvature(corners, moment),
                Jacobian::Definite => hessian.add_positive_curvature(corners, moment),
            }
            add_hessian(element, &hessian, assembly);
        }
    }
}

/// Six whole blocks a hinge.
pub(super) fn hinge_pattern(hinges: &[Hinge]) -> Pattern {
    let pairs = |hinge: &Hinge| PAIRS.map(|pair| pair.map(|corner| hinge.corners[corner]));
    Pattern::Whole(hinges.iter().flat_map(pairs).collect())
}

/// Adds an element's second derivatives to its six blocks.
#[inline]
pub(super) fn add_hessian(element: usize, hessian: &Hessian, assembly: &mut Assembly<'_>) {
    for (pair, block) in hessian.0.iter().enumerate() {
        assembly.add_whole(PAIRS.len() * element + pair, -*block);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::{DiscreteShell, EdgeSpring, HingeDamping};
    use crate::linear::PairMatrix;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    const EDGE: f64 = 0.02;

    /// A hinge of any shape, folded by any angle: feet along the edge and altitudes as shares of the
    /// edge, from slivers to tall triangles.
    fn corners(angle: f64, feet: [f64; 2], altitudes: [f64; 2]) -> [DVec3; 4] {
        let c = DVec3::new(-altitudes[0], feet[0], 0.0);
        let d = DVec3::new(
            altitudes[1] * angle.cos(),
            feet[1],
            -altitudes[1] * angle.sin(),
        );
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -0.8, 2.0);
        [DVec3::ZERO, DVec3::Y, c, d].map(|x| turn * x * EDGE + DVec3::new(0.2, 1.4, -0.3))
    }

    fn one<L: BendingLaw>(rest_angle: f64) -> HingeBatch<L> {
        HingeBatch::new(vec![Hinge {
            corners: [0, 1, 2, 3],
            rest_angle,
            stiffness: 2e-5,
        }])
    }

    fn matrix_of(pattern: &Pattern, fill: impl FnOnce(&mut Assembly<'_>)) -> PairMatrix {
        let mut matrix = PairMatrix::with_patterns(4, std::slice::from_ref(pattern));
        let slots = &matrix.slots(pattern);
        fill(&mut Assembly {
            matrix: &mut matrix,
            slots,
        });
        matrix
    }

    fn times(matrix: &PairMatrix, x: &[DVec3]) -> Vec<DVec3> {
        let mut y = vec![DVec3::ZERO; x.len()];
        matrix.multiply(x, &mut y);
        y
    }

    /// Fourth-order central difference.
    fn slope<T>(at: impl Fn(f64) -> T, h: f64) -> T
    where
        T: std::ops::Sub<Output = T> + std::ops::Mul<f64, Output = T>,
    {
        ((at(h) - at(-h)) * 8.0 - (at(2.0 * h) - at(-2.0 * h))) * (1.0 / (12.0 * h))
    }

    fn check_derivatives<L: BendingLaw>(x: [DVec3; 4], rest: f64) -> Result<(), TestCaseError> {
        let batch = one::<L>(rest);
        let moved = |corner: usize, by: DVec3| {
            let mut positions = x.to_vec();
            positions[corner] += by;
            State::at_rest(positions)
        };
        let forces = |state: &State| {
            let mut forces = vec![DVec3::ZERO; 4];
            batch.add_forces(state, &mut forces);
            forces
        };
        let state = State::at_rest(x.to_vec());
        let at_x = forces(&state);
        let jacobian = matrix_of(&batch.pattern(), |assembly| {
            batch.add_jacobian(&state, 1.0, Jacobian::Exact, assembly);
        });
        // Derivatives grow with the inverse of the smallest altitude.
        let [a, b, c, d] = x;
        let e = b - a;
        let altitude = |tip: DVec3| e.cross(tip - a).length() / e.length();
        let least = altitude(c).min(altitude(d)).min(e.length());
        let (h, k) = (1e-3 * least, batch.hinges[0].stiffness);
        for corner in 0..4 {
            for axis in DVec3::AXES {
                let dual = slope(|t| batch.energy(&moved(corner, axis * t)), h);
                prop_assert!(
                    (dual + at_x[corner].dot(axis)).abs() < 1e-6 * k / least,
                    "corner {corner}: dE = {dual}, f = {}",
                    at_x[corner]
                );
                let mut direction = [DVec3::ZERO; 4];
                direction[corner] = axis;
                let product = times(&jacobian, &direction);
                for other in 0..4 {
                    let change = slope(|t| forces(&moved(corner, axis * t))[other], h);
                    prop_assert!(
                        (change + product[other]).length() < 1e-5 * k / (least * least),
                        "∂f{other}/∂x{corner}: {change} against {}",
                        -product[other]
                    );
                }
            }
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn derivatives_agree_with_differences(
            angle in -3.0..3.0_f64, rest in -1.5..1.5_f64,
            foot1 in -0.5..1.5_f64, foot2 in -0.5..1.5_f64,
            log1 in -3.0..0.3_f64, log2 in -3.0..0.3_f64,
        ) {
            let x = corners(angle, [foot1, foot2], [10_f64.powf(log1), 10_f64.powf(log2)]);
            // The short way round jumps half a turn away from rest.
            prop_assume!((angle - rest).abs() < 3.1);
            check_derivatives::<DiscreteShell>(x, rest)?;
            check_derivatives::<EdgeSpring>(x, rest)?;
        }

        /// The definite Jacobian is positive semi-definite and not below the exact one, and they
        /// are the same where nothing has to be dropped.
        #[test]
        fn the_definite_jacobian_bounds_the_exact_one(
            angle in -3.0..3.0_f64, foot1 in -0.5..1.5_f64, foot2 in -0.5..1.5_f64,
            log1 in -2.0..0.3_f64, log2 in -2.0..0.3_f64, seed in 0..1000_u32,
        ) {
            let x = corners(angle, [foot1, foot2], [10_f64.powf(log1), 10_f64.powf(log2)]);
            let batch = one::<DiscreteShell>(0.0);
            let state = State::at_rest(x.to_vec());
            let [exact, definite] = [Jacobian::Exact, Jacobian::Definite].map(|kind| {
                matrix_of(&batch.pattern(), |assembly| {
                    batch.add_jacobian(&state, 1.0, kind, assembly);
                })
            });
            let number = |i: u32| f64::from((seed + 1) * 7919 % 1013 * (i + 3) % 997) / 498.5 - 1.0;
            for round in 0..20 {
                let v: Vec<DVec3> = (0..4)
                    .map(|i| DVec3::new(number(12 * round + i), number(12 * round + 4 + i), number(12 * round + 8 + i)))
                    .collect();
                let [low, high] = [&exact, &definite].map(|matrix| {
                    let product = times(matrix, &v);
                    (0..4).map(|i| product[i].dot(v[i])).sum::<f64>()
                });
                let size = times(&definite, &v).iter().map(|p| p.length()).sum::<f64>();
                prop_assert!(high >= -1e-12 * size && high >= low - 1e-12 * size, "{high} against {low}");
            }
        }
    }

    #[test]
    fn the_definite_jacobian_of_a_flat_hinge_is_the_exact_one() {
        let x = corners(0.0, [0.4, 0.7], [0.8, 0.6]);
        let state = State::at_rest(x.to_vec());
        let batch = one::<EdgeSpring>(0.0);
        let [exact, definite] = [Jacobian::Exact, Jacobian::Definite].map(|kind| {
            let pattern = batch.pattern();
            let matrix = matrix_of(&pattern, |a| batch.add_jacobian(&state, 1.0, kind, a));
            matrix.off_diagonal().collect::<Vec<_>>()
        });
        let size = exact[0]
            .to_cols_array()
            .iter()
            .map(|v| v.abs())
            .sum::<f64>();
        for (exact, definite) in exact.iter().zip(definite) {
            assert!(exact.abs_diff_eq(definite, 1e-12 * size));
        }
    }

    /// Collapsed triangles, coinciding corners, and hinges folded flat onto themselves.
    #[test]
    fn degenerate_hinges_are_finite() {
        let flat = corners(PI, [0.5, 0.5], [1.0, 1.0]);
        let on_line = corners(1.0, [0.5, 0.5], [0.0, 1.0]);
        let sliver = corners(1.0, [0.5, 0.5], [1e-12, 1.0]);
        let point = [DVec3::ONE; 4];
        let same_tips = corners(PI, [0.5, 0.5], [0.7, 0.7]);
        for x in [flat, on_line, sliver, point, same_tips] {
            let state = State::at_rest(x.to_vec());
            for law in [
                &one::<EdgeSpring>(0.3) as &dyn Stiffness,
                &one::<DiscreteShell>(0.3),
            ] {
                let mut forces = vec![DVec3::ZERO; 4];
                law.add_forces(&state, &mut forces);
                assert!(
                    forces.iter().all(|f| f.is_finite()),
                    "{}: {forces:?}",
                    law.name()
                );
                assert!(law.energy(&state).is_finite());
                for kind in [Jacobian::Exact, Jacobian::Definite] {
                    let matrix =
                        matrix_of(&law.pattern(), |a| law.add_jacobian(&state, 1.0, kind, a));
                    assert!(
                        matrix.off_diagonal().all(|block| block.is_finite()),
                        "{}",
                        law.name()
                    );
                }
            }
        }
    }

    #[test]
    fn laws_agree_for_small_angles_and_vanish_at_rest() {
        for rest in [0.0, 0.7, -2.0] {
            let fold = Fold::from(rest);
            let edge = EdgeSpring::energy(fold, rest).abs() + EdgeSpring::moment(fold, rest).abs();
            let shell = DiscreteShell::energy(fold, rest) + DiscreteShell::moment(fold, rest).abs();
            assert!(edge < 1e-15 && shell < 1e-15, "{rest}: {edge}, {shell}");
        }
        let fold = Fold::from(1e-3);
        let ratio = EdgeSpring::energy(fold, 0.0) / DiscreteShell::energy(fold, 0.0);
        assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
        // Discrete shells turn the short way round.
        let turn = DiscreteShell::moment(Fold::from(-3.0), 3.0);
        assert!((turn - (std::f64::consts::TAU - 6.0)).abs() < 1e-15);
    }

    /// ½ C² = E/k and C C′ = E′/k, for angles from rounding to folded flat.
    #[test]
    fn constraints_are_roots_of_the_energy() {
        fn check<L: BendingLaw>(rest: f64, turn: f64) {
            let fold = Fold::from(rest + turn);
            let [c, slope] = L::constraint(fold, rest);
            let (energy, moment) = (L::energy(fold, rest), L::moment(fold, rest));
            // The energy rounds at 1e-16, the turn itself too.
            let off = (0.5 * c * c - energy).abs() + (c * slope - moment).abs();
            assert!(off < 1e-14, "{}, {rest}, {turn}: {off}", L::NAME);
            assert!(c * turn >= 0.0 && slope.is_finite());
            // C from E itself, where that has digits enough: a relative check.
            if turn.abs() > 1e-3 {
                assert!((0.5 * c * c / energy - 1.0).abs() < 1e-7);
            }
        }
        for rest in [0.0, 1e-9, 0.7, -2.0, 3.0] {
            for size in [1e-12, 1e-9, 0.9e-7, 1.1e-7, 1e-5, 1e-3, 0.1, 1.0, 3.0] {
                for turn in [size, -size] {
                    if f64::abs(rest + turn) < PI {
                        check::<EdgeSpring>(rest, turn);
                        check::<DiscreteShell>(rest, turn);
                    }
                }
            }
        }
        let [c, slope] = EdgeSpring::constraint(Fold::from(1.2), 0.0);
        assert!((c - 4.0 * f64::sin(0.3)).abs() < 1e-15 && (slope - f64::cos(0.3)).abs() < 1e-15);
        assert_eq!(EdgeSpring::constraint(Fold::default(), 0.0), [0.0, 1.0]);
    }

    #[test]
    fn half_sines_are_those_of_the_angle() {
        for angle in [
            -3.1, -2.0, -1e-3, -1e-9, 0.0, 1e-12, 0.5, 1.57, 1.58, 3.1, PI,
        ] {
            let fold = Fold::from(angle);
            assert!((fold.angle() - angle).abs() < 1e-15);
            let error = fold.half_sine() - f64::sin(0.5 * angle);
            assert!(
                error.abs() <= 2e-16 * (1.0 + angle.abs()),
                "{angle}: {error}"
            );
        }
        assert!(Fold::default().half_sine() == 0.0);
    }

    #[test]
    fn hinge_damping_has_the_derivative_of_its_force() {
        use crate::force::Damping;
        let hinges = one::<EdgeSpring>(0.0).hinges;
        let damping = HingeDamping {
            hinges,
            times: vec![0.01],
        };
        let mut state = State::at_rest(corners(0.8, [0.4, 0.7], [0.8, 0.6]).to_vec());
        state.velocities = vec![DVec3::X, DVec3::Y, DVec3::new(0.3, -0.2, 0.9), DVec3::NEG_Z];
        let matrix = matrix_of(&damping.pattern(), |a| damping.add_jacobian(&state, 1.0, a));
        let mut forces = vec![DVec3::ZERO; 4];
        damping.add_forces(&state, &mut forces);
        // The force is linear in the velocities.
        for (force, product) in forces.iter().zip(times(&matrix, &state.velocities)) {
            assert!(
                (*force + product).length() < 1e-11 * force.length(),
                "{force} against {product}"
            );
        }
    }
}
