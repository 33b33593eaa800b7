//! Damping: mass-proportional on all motion, stiffness-proportional on change of length only.

use super::pass::{Lists, Tiled};
use super::{Cut, Spring, SpringBatch, Stiffness, Tiles, Window};
use crate::linear::{Ahead, Assembly, LineBlock, Pattern};
use crate::state::State;
use glam::DVec3;
use std::fmt::Debug;
use std::ops::Range;

/// The names of dampings in reports.
pub const DAMPINGS: [&str; 2] = ["mass_damping", "stiffness_damping"];

/// Positions, and two velocities there, of all particles.
#[derive(Clone, Copy, Debug)]
pub struct DampedMotion<'a> {
    /// Where the damping is taken (m).
    pub positions: &'a [DVec3],
    /// The velocities that it answers (m/s).
    pub damped: &'a [DVec3],
    /// The velocities along which its force does work (m/s).
    pub moved: &'a [DVec3],
}

/// A batch of damping elements.
pub trait Damping: Debug + Send + Sync {
    /// The name in reports: one of [`DAMPINGS`].
    fn name(&self) -> &'static str;

    /// Number of elements.
    fn elements(&self) -> usize;

    /// Power (W) that the forces of some of its elements take from a motion: −f(x, v) · w with v
    /// `damped` and w `moved`, the same for v and w exchanged.
    fn power_of(&self, elements: Range<usize>, motion: DampedMotion<'_>) -> f64;

    /// Power taken from the motion (W), never negative.
    fn power(&self, state: &State) -> f64 {
        let motion = DampedMotion {
            positions: &state.positions,
            damped: &state.velocities,
            moved: &state.velocities,
        };
        self.power_of(0..self.elements(), motion)
    }

    /// Adds the damping forces (N).
    fn add_forces(&self, state: &State, forces: &mut [DVec3]);

    /// The damping cut by tiles of the particles, for [`super::ForcePass`].
    fn cut(&self, tiles: Tiles) -> Box<dyn Cut>;

    /// Particles between which the law has blocks.
    fn pattern(&self) -> Pattern;

    /// Adds −`scale` · ∂f/∂v to the matrix.
    fn add_jacobian(&self, state: &State, scale: f64, assembly: &mut Assembly<'_>);
}

/// Viscous drag on all motion: f = −c m v (N), P = Σ c m v² (W).
#[derive(Clone, Debug)]
pub struct MassDamping {
    /// c m of each particle (kg/s).
    pub drag: Vec<f64>,
}

impl Damping for MassDamping {
    fn name(&self) -> &'static str {
        DAMPINGS[0]
    }

    fn elements(&self) -> usize {
        self.drag.len()
    }

    fn power_of(&self, elements: Range<usize>, motion: DampedMotion<'_>) -> f64 {
        let velocities = motion.damped[elements.clone()]
            .iter()
            .zip(&motion.moved[elements.clone()]);
        let each = self.drag[elements].iter().zip(velocities);
        each.map(|(c, (v, w))| c * v.dot(*w)).sum()
    }

    fn add_forces(&self, state: &State, forces: &mut [DVec3]) {
        Cut::add_forces(self, 0, state, &mut Window::whole(forces));
    }

    fn cut(&self, _: Tiles) -> Box<dyn Cut> {
        Box::new(self.clone())
    }

    fn pattern(&self) -> Pattern {
        Pattern::Lines(Vec::new())
    }

    fn add_jacobian(&self, _: &State, scale: f64, assembly: &mut Assembly<'_>) {
        for (mass, c) in assembly.matrix.masses.iter_mut().zip(&self.drag) {
            *mass += scale * c;
        }
    }
}

impl Cut for MassDamping {
    fn add_to(&self, ahead: &mut Ahead, _: usize, particles: Range<usize>) {
        ahead.add(&self.drag, particles);
    }

    fn add_forces(&self, _: usize, state: &State, window: &mut Window<'_>) {
        let (range, forces) = window.tile();
        let moving = self.drag[range.clone()]
            .iter()
            .zip(&state.velocities[range]);
        for (force, (&c, &v)) in forces.iter_mut().zip(moving) {
            *force -= v * c;
        }
    }
}

/// Force of a damper on its first particle (N): fᵢ = c d̂ (d̂ · Δv), with Δv = vⱼ − vᵢ.
///
/// Zero when |d| = 0.
#[inline]
pub fn damper_force(d: DVec3, relative_velocity: DVec3, damping: f64) -> DVec3 {
    let length_squared = d.length_squared();
    if length_squared > 0.0 {
        d * (damping * d.dot(relative_velocity) / length_squared)
    } else {
        DVec3::ZERO
    }
}

/// Damping of change of length with c = τ k, so that its share of the critical damping doesn't
/// depend on the mesh; turning and moving as a whole stay free. P = Σ c (d̂ · Δv)² (W).
#[derive(Clone, Debug)]
pub struct SpringDamping {
    /// The springs that are damped.
    pub springs: SpringBatch,
    /// τ of each spring (s).
    pub times: Vec<f64>,
}

impl SpringDamping {
    fn dampers(&self) -> impl Iterator<Item = Damper> + '_ {
        let each = self.springs.springs.iter().zip(&self.times);
        each.map(|(spring, time)| (*spring, *time))
    }
}

/// A spring and its τ (s).
type Damper = (Spring, f64);

/// Span (m), relative velocity (m/s) and damping c (N·s/m) of a damper.
#[inline]
fn motion((spring, time): Damper, state: &State) -> (DVec3, DVec3, f64) {
    let d = spring.span(&state.positions);
    let v = spring.span(&state.velocities);
    (d, v, time * spring.stiffness)
}

fn add_forces(dampers: impl Iterator<Item = Damper>, state: &State, window: &mut Window<'_>) {
    for damper in dampers {
        let (d, v, c) = motion(damper, state);
        let f = damper_force(d, v, c);
        let [i, j] = damper.0.ends;
        window.add(i, f);
        window.add(j, -f);
    }
}

impl Damping for SpringDamping {
    fn name(&self) -> &'static str {
        DAMPINGS[1]
    }

    fn elements(&self) -> usize {
        self.times.len()
    }

    fn power_of(&self, elements: Range<usize>, motion: DampedMotion<'_>) -> f64 {
        let springs = self.springs.springs[elements.clone()].iter();
        let power = |(spring, time): (&Spring, &f64)| {
            let d = spring.span(motion.positions);
            let force = damper_force(d, spring.span(motion.damped), time * spring.stiffness);
            force.dot(spring.span(motion.moved))
        };
        springs.zip(&self.times[elements]).map(power).sum()
    }

    fn add_forces(&self, state: &State, forces: &mut [DVec3]) {
        add_forces(self.dampers(), state, &mut Window::whole(forces));
    }

    fn cut(&self, tiles: Tiles) -> Box<dyn Cut> {
        let dampers: Vec<Damper> = self.dampers().collect();
        let add = |dampers: &[Damper], state: &State, window: &mut Window<'_>| {
            add_forces(dampers.iter().copied(), state, window);
        };
        let tiled = Tiled::new(tiles, &dampers, |(s, _)| s.ends);
        Box::new(Lists { tiled, add })
    }

    fn pattern(&self) -> Pattern {
        self.springs.pattern()
    }

    fn add_jacobian(&self, state: &State, scale: f64, assembly: &mut Assembly<'_>) {
        for (element, damper) in self.dampers().enumerate() {
            let (d, _, c) = motion(damper, state);
            let length_squared = d.length_squared();
            if length_squared > 0.0 {
                assembly.add(
                    element,
                    LineBlock {
                        a: 0.0,
                        e: scale * c / length_squared,
                        d,
                    },
                );
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::Spring;
    use glam::dvec3;

    fn pair() -> (SpringDamping, State) {
        let spring = Spring {
            ends: [0, 1],
            rest_length: 1.0,
            stiffness: 50.0,
        };
        let springs = SpringBatch {
            family: "structural",
            springs: vec![spring],
        };
        let state = State {
            time: 0.0,
            positions: vec![dvec3(0.1, 0.2, 0.3), dvec3(0.9, -0.4, 0.5)],
            velocities: vec![dvec3(1.0, 0.0, -2.0), dvec3(0.5, 0.7, 0.1)],
        };
        (
            SpringDamping {
                springs,
                times: vec![0.01],
            },
            state,
        )
    }

    #[test]
    fn spring_damping_dissipates_keeps_momenta_and_ignores_rotation() {
        let (damping, mut state) = pair();
        let mut forces = vec![DVec3::ZERO; 2];
        damping.add_forces(&state, &mut forces);
        assert!((forces[0] + forces[1]).length() < 1e-15);
        let torque: DVec3 = state
            .positions
            .iter()
            .zip(&forces)
            .map(|(x, f)| x.cross(*f))
            .sum();
        assert!(torque.length() < 1e-15);
        let work: f64 = state
            .velocities
            .iter()
            .zip(&forces)
            .map(|(v, f)| v.dot(*f))
            .sum();
        assert!((damping.power(&state) + work).abs() < 1e-14 && work < 0.0);
        let spin = dvec3(0.3, -0.8, 1.1);
        state.velocities = state
            .positions
            .iter()
            .map(|&x| spin.cross(x) + DVec3::X)
            .collect();
        assert!(damping.power(&state) < 1e-28);
    }

    #[test]
    fn jacobian_is_the_derivative_by_velocity() {
        let (damping, state) = pair();
        let pattern = damping.pattern();
        let mut matrix =
            crate::linear::PairMatrix::with_patterns(2, std::slice::from_ref(&pattern));
        let slots = matrix.slots(&pattern);
        damping.add_jacobian(
            &state,
            1.0,
            &mut Assembly {
                matrix: &mut matrix,
                slots: &slots,
            },
        );
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let mut moved = state.clone();
            moved.velocities[0] += axis;
            let (mut before, mut after) = (vec![DVec3::ZERO; 2], vec![DVec3::ZERO; 2]);
            damping.add_forces(&state, &mut before);
            damping.add_forces(&moved, &mut after);
            let mut product = vec![DVec3::ZERO; 2];
            matrix.multiply(&[axis, DVec3::ZERO], &mut product);
            for i in 0..2 {
                assert!((before[i] - after[i] - product[i]).length() < 1e-12);
            }
        }
    }
}
