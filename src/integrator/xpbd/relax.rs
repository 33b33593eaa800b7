//! One constraint at a time: moves particles until it is met as far as its compliance asks.
//!
//! Source: Macklin, Müller and Chentanez 2016. With a constraint C of compliance α and damping time
//! τ, α̃ = α/dt², γ = τ/dt, the multiplier λ gains
//!
//! Δλ = (−C − α̃ λ − γ ∇C·(x − x₀)) / ((1 + γ) Σ w |∇C|² + α̃),   Δxᵢ = wᵢ ∇ᵢC Δλ.
//!
//! Their β̃ = dt² β with the damping β = τ/α gives γ = α̃ β̃/dt = τ/dt.

use super::cluster::{CHUNK, Cluster, Constraints, Crease, Link};
use crate::force::{BendingLaw, Dihedral, DiscreteShell, EdgeSpring};
use glam::DVec3;

/// A particle in the middle of a step. Two of them fill a cache line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(32))]
pub(super) struct Particle {
    /// Position (m).
    pub(super) x: DVec3,
    /// Inverse mass (1/kg), 0 when pinned.
    pub(super) w: f64,
}

/// A chunk of particles as its cluster sees it.
pub(super) struct Part<'a> {
    pub(super) now: &'a mut [Particle; CHUNK],
    /// Positions at the start of the step (m).
    pub(super) start: &'a [DVec3],
}

/// The step's length in the two forms that constraints need.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    /// 1/dt (1/s).
    pub(super) per_dt: f64,
    /// 1/dt² (1/s²).
    pub(super) per_dt_squared: f64,
    /// Whether this is the step's first sweep.
    pub(super) first: bool,
}

/// The chunks of a cluster.
pub(super) struct Patch<'a, const N: usize>(pub(super) [Part<'a>; N]);

impl<const N: usize> Patch<'_, N> {
    #[inline(always)]
    fn at(&self, place: u32) -> &Particle {
        &self.0[place as usize / CHUNK].now[place as usize % CHUNK]
    }

    #[inline(always)]
    fn shift(&mut self, place: u32, by: DVec3) {
        self.0[place as usize / CHUNK].now[place as usize % CHUNK].x += by;
    }

    /// The way that a particle has gone since the start of the step (m).
    #[inline(always)]
    fn gone(&self, place: u32) -> DVec3 {
        let part = &self.0[place as usize / CHUNK];
        part.now[place as usize % CHUNK].x - part.start[place as usize % CHUNK]
    }
}

/// Relaxes each constraint of a cluster once.
pub(super) fn relax<const N: usize>(cluster: &mut Cluster, patch: &mut Patch<'_, N>, pace: Pace) {
    let Cluster {
        springs,
        edge_springs,
        discrete_shells,
        ..
    } = cluster;
    if springs.times.is_empty() && springs.multipliers.is_empty() {
        relax_plain_springs(springs, patch, pace);
    } else {
        relax_springs(springs, patch, pace);
    }
    relax_hinges::<EdgeSpring, N>(edge_springs, patch, pace);
    relax_hinges::<DiscreteShell, N>(discrete_shells, patch, pace);
}

/// Springs that are relaxed together: their square roots and divisions share instructions.
const LANES: usize = 4;

/// Springs without damping, in a step of one sweep: λ = 0.
fn relax_plain_springs<const N: usize>(
    springs: &Constraints<Link>,
    patch: &mut Patch<'_, N>,
    pace: Pace,
) {
    let mut start = 0;
    for &end in &springs.ends {
        let (lanes, rest) = springs.elements[start..end].as_chunks::<LANES>();
        for links in lanes {
            relax_lanes(links, patch, pace);
        }
        for &link in rest {
            relax_lanes(&[link], patch, pace);
        }
        start = end;
    }
}

/// Stands for a denominator of zero (m/kg): at zero length the step is then 0 times something finite.
const TINY: f64 = 1e-150;

/// Springs that share no particle.
#[inline(always)]
fn relax_lanes<const L: usize, const N: usize>(
    links: &[Link; L],
    patch: &mut Patch<'_, N>,
    pace: Pace,
) {
    // Loops over plain arrays: `map` on arrays of particles copies them about, and takes twice as long.
    let (mut spans, mut weights) = ([DVec3::ZERO; L], [[0.0; 2]; L]);
    let (mut squares, mut shares) = ([0.0; L], [0.0; L]);
    for k in 0..L {
        let [a, b] = links[k].ends;
        let (a, b) = (patch.at(a), patch.at(b));
        spans[k] = b.x - a.x;
        squares[k] = spans[k].length_squared();
        weights[k] = [a.w, b.w];
    }
    for k in 0..L {
        let length = squares[k].sqrt();
        let softness = weights[k][0] + weights[k][1] + links[k].compliance * pace.per_dt_squared;
        shares[k] = (length - links[k].rest_length) / at_least(length * softness, TINY);
    }
    for k in 0..L {
        let [a, b] = links[k].ends;
        patch.shift(a, spans[k] * (shares[k] * weights[k][0]));
        patch.shift(b, spans[k] * (-shares[k] * weights[k][1]));
    }
}

/// The larger of two numbers, without `f64::max`'s care for NaN.
#[inline(always)]
fn at_least(x: f64, least: f64) -> f64 {
    if x > least { x } else { least }
}

/// Springs with damping, or in a step of several sweeps.
fn relax_springs<const N: usize>(
    springs: &mut Constraints<Link>,
    patch: &mut Patch<'_, N>,
    pace: Pace,
) {
    let Constraints {
        elements,
        times,
        multipliers,
        ..
    } = springs;
    if pace.first {
        multipliers.fill(0.0);
    }
    for (k, link) in elements.iter().enumerate() {
        let [i, j] = link.ends;
        let (a, b) = (*patch.at(i), *patch.at(j));
        let span = b.x - a.x;
        let length = span.length();
        if length == 0.0 {
            continue;
        }
        let direction = span / length;
        let mut off = length - link.rest_length;
        let compliance = link.compliance * pace.per_dt_squared;
        let mut weight = a.w + b.w;
        if let Some(time) = times.get(k) {
            let damping = time * pace.per_dt;
            off += damping * direction.dot(patch.gone(j) - patch.gone(i));
            weight *= 1.0 + damping;
        }
        if let Some(multiplier) = multipliers.get(k) {
            off += compliance * multiplier;
        }
        let gain = -off / (weight + compliance);
        if let Some(multiplier) = multipliers.get_mut(k) {
            *multiplier += gain;
        }
        patch.shift(i, direction * (-gain * a.w));
        patch.shift(j, direction * (gain * b.w));
    }
}

/// Hinges of one law. C(θ) has E = ½ k C²; the multiplier is that of θ itself, μ = C′ λ, since damping
/// is of θ too:
///
/// Δμ = (−C C′ − α̃ μ − γ ∇θ·(x − x₀)) / ((C′² + γ) Σ w |∇θ|² + α̃),   Δxᵢ = wᵢ ∇ᵢθ Δμ.
fn relax_hinges<L: BendingLaw, const N: usize>(
    hinges: &mut Constraints<Crease>,
    patch: &mut Patch<'_, N>,
    pace: Pace,
) {
    let Constraints {
        elements,
        times,
        multipliers,
        ..
    } = hinges;
    if pace.first {
        multipliers.fill(0.0);
    }
    for (k, crease) in elements.iter().enumerate() {
        let corners = crease.corners.map(|corner| *patch.at(corner));
        let Dihedral { fold, gradient } = Dihedral::of(corners.map(|corner| corner.x));
        let [c, slope] = L::constraint(fold, crease.rest_angle);
        let compliance = crease.compliance * pace.per_dt_squared;
        let (mut off, mut square) = (c * slope, slope * slope);
        if let Some(time) = times.get(k) {
            let damping = time * pace.per_dt;
            let gone = crease.corners.map(|corner| patch.gone(corner));
            let turned: f64 = gradient.iter().zip(gone).map(|(g, x)| g.dot(x)).sum();
            off += damping * turned;
            square += damping;
        }
        if let Some(multiplier) = multipliers.get(k) {
            off += compliance * multiplier;
        }
        let weights = gradient.iter().zip(&corners);
        let weight: f64 = weights.map(|(g, p)| p.w * g.length_squared()).sum();
        let gain = -off / (square * weight + compliance);
        if let Some(multiplier) = multipliers.get_mut(k) {
            *multiplier += gain;
        }
        for ((corner, g), particle) in crease.corners.into_iter().zip(gradient).zip(corners) {
            patch.shift(corner, g * (gain * particle.w));
        }
    }
}
