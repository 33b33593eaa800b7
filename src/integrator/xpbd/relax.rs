//! One constraint at a time: moves particles until it is met as far as its compliance asks.
//!
//! Source: Macklin, Müller and Chentanez 2016. With a constraint C of compliance α and damping time
//! τ, α̃ = α/dt², γ = τ/dt, the multiplier λ gains
//!
//! Δλ = (−C − α̃ λ − γ ∇C·(x − x₀)) / ((1 + γ) Σ w |∇C|² + α̃),   Δxᵢ = wᵢ ∇ᵢC Δλ.
//!
//! Their β̃ = dt² β with the damping β = τ/α gives γ = α̃ β̃/dt = τ/dt.

use super::cluster::{Cluster, place};
use super::course::Course;
use super::element::{Crease, Link};
use super::packed::Links;
use crate::force::{BendingLaw, Dihedral, DiscreteShell, EdgeSpring};
use crate::linear::{Ahead, BATCH};
use glam::DVec3;

/// A chunk of particles as its cluster sees it.
pub(super) struct Part<'a> {
    /// Positions (m).
    pub(super) x: &'a mut [DVec3],
    /// Inverse masses (1/kg), 0 when pinned.
    pub(super) w: &'a [f64],
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
    /// The chunk in which a particle is, and its number there.
    #[inline(always)]
    fn place(at: u32) -> (usize, usize) {
        if N == 1 { (0, at as usize) } else { place(at) }
    }

    /// Position (m) and inverse mass (1/kg) of a particle.
    #[inline(always)]
    fn at(&self, at: u32) -> (DVec3, f64) {
        let (slot, number) = Self::place(at);
        let part = &self.0[slot];
        (part.x[number], part.w[number])
    }

    #[inline(always)]
    fn shift(&mut self, at: u32, by: DVec3) {
        let (slot, number) = Self::place(at);
        self.0[slot].x[number] += by;
    }

    /// The way that a particle has gone since the start of the step (m).
    #[inline(always)]
    fn gone(&self, at: u32) -> DVec3 {
        let (slot, number) = Self::place(at);
        let part = &self.0[slot];
        part.x[number] - part.start[number]
    }
}

/// Relaxes each constraint of one stage of a cluster once.
pub(super) fn relax<const N: usize>(
    cluster: &mut Cluster,
    stage: usize,
    patch: &mut Patch<'_, N>,
    pace: Pace,
    ahead: &mut Ahead,
) {
    match &mut cluster.springs {
        Links::Packed(packed) => {
            let link = packed.links.at(stage);
            relax_springs(&mut packed.course, stage, link, patch, pace, ahead);
        }
        Links::Whole(course) => relax_springs(course, stage, |link| link, patch, pace, ahead),
    }
    relax_hinges::<EdgeSpring, N>(&mut cluster.edge_springs, stage, patch, pace);
    relax_hinges::<DiscreteShell, N>(&mut cluster.discrete_shells, stage, patch, pace);
}

/// Springs that are relaxed together: their square roots and divisions share instructions.
const LANES: usize = 4;

/// The springs of a stage; `link` unpacks one.
fn relax_springs<P: Copy, const N: usize>(
    springs: &mut Course<P>,
    stage: usize,
    link: impl Fn(P) -> Link,
    patch: &mut Patch<'_, N>,
    pace: Pace,
    ahead: &mut Ahead,
) {
    if springs.times.is_empty() && springs.multipliers.is_empty() {
        for run in springs.runs(stage) {
            for batch in springs.elements[run].chunks(BATCH) {
                ahead.ask();
                let (lanes, rest) = batch.as_chunks::<LANES>();
                for links in lanes {
                    relax_lanes(links, &link, patch, pace);
                }
                for &one in rest {
                    relax_lanes(&[one], &link, patch, pace);
                }
            }
        }
    } else {
        relax_in_turn(springs, stage, link, patch, pace);
    }
}

/// Stands for a denominator of zero (m/kg): at zero length the step is then 0 times something finite.
const TINY: f64 = 1e-150;

/// Springs that share no particle, without damping, in a step of one sweep: λ = 0.
#[inline(always)]
fn relax_lanes<P: Copy, const L: usize, const N: usize>(
    links: &[P; L],
    link: impl Fn(P) -> Link,
    patch: &mut Patch<'_, N>,
    pace: Pace,
) {
    // Loops over plain arrays: `map` on arrays of particles copies them about, and takes twice as long.
    let (mut spans, mut weights) = ([DVec3::ZERO; L], [[0.0; 2]; L]);
    let (mut squares, mut shares) = ([0.0; L], [0.0; L]);
    for k in 0..L {
        let [a, b] = link(links[k]).ends;
        let ((a, v), (b, w)) = (patch.at(a), patch.at(b));
        spans[k] = b - a;
        squares[k] = spans[k].length_squared();
        weights[k] = [v, w];
    }
    for k in 0..L {
        let length = squares[k].sqrt();
        let link = link(links[k]);
        let softness = weights[k][0] + weights[k][1] + link.compliance * pace.per_dt_squared;
        shares[k] = (length - link.rest_length) / at_least(length * softness, TINY);
    }
    for k in 0..L {
        let [a, b] = link(links[k]).ends;
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
fn relax_in_turn<P: Copy, const N: usize>(
    springs: &mut Course<P>,
    stage: usize,
    link: impl Fn(P) -> Link,
    patch: &mut Patch<'_, N>,
    pace: Pace,
) {
    let stage = springs.of_stage(stage);
    if pace.first && !springs.multipliers.is_empty() {
        springs.multipliers[stage.clone()].fill(0.0);
    }
    let Course {
        elements,
        times,
        multipliers,
        ..
    } = springs;
    for k in stage {
        let link = link(elements[k]);
        let [i, j] = link.ends;
        let ((a, v), (b, w)) = (patch.at(i), patch.at(j));
        let span = b - a;
        let length = span.length();
        if length == 0.0 {
            continue;
        }
        let direction = span / length;
        let mut off = length - link.rest_length;
        let compliance = link.compliance * pace.per_dt_squared;
        let mut weight = v + w;
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
        patch.shift(i, direction * (-gain * v));
        patch.shift(j, direction * (gain * w));
    }
}

/// Hinges of one law. C(θ) has E = ½ k C²; the multiplier is that of θ itself, μ = C′ λ, since damping
/// is of θ too:
///
/// Δμ = (−C C′ − α̃ μ − γ ∇θ·(x − x₀)) / ((C′² + γ) Σ w |∇θ|² + α̃),   Δxᵢ = wᵢ ∇ᵢθ Δμ.
fn relax_hinges<L: BendingLaw, const N: usize>(
    hinges: &mut Course<Crease>,
    stage: usize,
    patch: &mut Patch<'_, N>,
    pace: Pace,
) {
    let stage = hinges.of_stage(stage);
    if pace.first && !hinges.multipliers.is_empty() {
        hinges.multipliers[stage.clone()].fill(0.0);
    }
    let Course {
        elements,
        times,
        multipliers,
        ..
    } = hinges;
    for k in stage {
        let crease = &elements[k];
        let corners = crease.corners.map(|corner| patch.at(corner));
        let Dihedral { fold, gradient } = Dihedral::of(corners.map(|(x, _)| x));
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
        let weight: f64 = weights.map(|(g, (_, w))| w * g.length_squared()).sum();
        let gain = -off / (square * weight + compliance);
        if let Some(multiplier) = multipliers.get_mut(k) {
            *multiplier += gain;
        }
        for ((corner, g), (_, w)) in crease.corners.into_iter().zip(gradient).zip(corners) {
            patch.shift(corner, g * (gain * w));
        }
    }
}
