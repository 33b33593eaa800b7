//! How long a step may be for an explicit scheme, from the model as it stands.

use crate::force::{
    BendingLaw as _, Dihedral, DiscreteShell, EdgeSpring, Hinge, Jacobian, Spring, Stiffness,
};
use crate::linear::{Assembly, PairMatrix};
use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// The largest stable step of symplectic Euler, and the element that sets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StableStep {
    /// Largest stable step (s); infinite without springs or drag.
    pub dt: f64,
    /// Largest ω of M⁻¹K (rad/s).
    pub omega: f64,
    /// The spring or hinge that would swing fastest if it were alone: its family or law, and its ends
    /// or those of its edge.
    pub element: Option<(&'static str, [u32; 2])>,
}

/// Iterations of the power method: the largest eigenvalue of a 60 × 60 sheet is then within 1 %.
const ITERATIONS: u32 = 200;

/// Forecasts the largest stable step of symplectic Euler at a state.
///
/// With ω² the largest eigenvalue of M⁻¹K and c = drag/m + τ ω² the damping of that mode, the scheme
/// is stable while 4 − 2 c dt − ω² dt² ≥ 0: dt = (√(c² + 4 ω²) − c) / ω²; undamped, dt = 2/ω.
pub fn stable_step(model: &Model, state: &State) -> StableStep {
    let omega_squared = largest_eigenvalue(model, state);
    let drag = model.mass_damping.as_ref().map_or(0.0, |damping| {
        damping
            .drag
            .iter()
            .zip(&model.masses)
            .map(|(c, m)| c / m)
            .fold(0.0, f64::max)
    });
    let springs = model.spring_damping.iter().flat_map(|d| &d.times);
    let hinges = model.hinge_damping.iter().flat_map(|d| &d.times);
    let time = springs.chain(hinges).copied().fold(0.0, f64::max);
    let c = drag + time * omega_squared;
    let dt = if omega_squared > 0.0 {
        (c.hypot(2.0 * omega_squared.sqrt()) - c) / omega_squared
    } else if drag > 0.0 {
        2.0 / drag
    } else {
        f64::INFINITY
    };
    StableStep {
        dt,
        omega: omega_squared.sqrt(),
        element: stiffest(model, state),
    }
}

/// Largest eigenvalue of M⁻¹K (1/s²) by power iteration on M^-½ K M^-½.
fn largest_eigenvalue(model: &Model, state: &State) -> f64 {
    let particles = model.particles();
    let patterns: Vec<_> = model.stiffnesses().map(Stiffness::pattern).collect();
    let mut matrix = PairMatrix::with_patterns(particles, &patterns);
    for (law, pattern) in model.stiffnesses().zip(&patterns) {
        let slots = &matrix.slots(pattern);
        let matrix = &mut matrix;
        law.add_jacobian(
            state,
            1.0,
            Jacobian::Definite,
            &mut Assembly { matrix, slots },
        );
    }
    let root: Vec<f64> = model.inverse_masses.iter().map(|w| w.sqrt()).collect();
    let mut x: Vec<DVec3> = (0..particles).map(seed).collect();
    let mut y = vec![DVec3::ZERO; particles];
    let mut value = 0.0;
    for _ in 0..ITERATIONS {
        let length = x.iter().map(|x| x.length_squared()).sum::<f64>().sqrt();
        if length == 0.0 {
            return 0.0;
        }
        let scaled: Vec<DVec3> = x
            .iter()
            .zip(&root)
            .map(|(x, r)| *x * (r / length))
            .collect();
        matrix.multiply(&scaled, &mut y);
        value = scaled.iter().zip(&y).map(|(x, y)| x.dot(*y)).sum();
        for i in 0..particles {
            x[i] = y[i] * root[i];
        }
    }
    value
}

/// A start with a share of every mode: neighbours differ in sign and size.
fn seed(i: usize) -> DVec3 {
    #[expect(clippy::cast_precision_loss, reason = "any number will do")]
    let t = i as f64;
    DVec3::new(
        (2.1 * t).sin(),
        (2.9 * t + 1.0).sin(),
        (2.5 * t + 2.0).sin(),
    )
}

/// The element with the largest ω² of its own: k (1/mᵢ + 1/mⱼ) of a spring, k Σ |∇θ|²/m of a hinge.
fn stiffest(model: &Model, state: &State) -> Option<(&'static str, [u32; 2])> {
    let w = |particle: u32| model.inverse_masses[particle as usize];
    let springs = model.springs.iter().flat_map(|batch| {
        let own = |s: &Spring| s.stiffness * (w(s.ends[0]) + w(s.ends[1]));
        batch
            .springs
            .iter()
            .map(move |s| (own(s), batch.family, s.ends))
    });
    let hinge = |name: &'static str, hinge: &Hinge| {
        let gradient = Dihedral::of(hinge.of(&state.positions)).gradient;
        let corners = hinge.corners.into_iter().zip(gradient);
        let own: f64 = corners.map(|(i, g)| w(i) * g.length_squared()).sum();
        (
            hinge.stiffness * own,
            name,
            [hinge.corners[0], hinge.corners[1]],
        )
    };
    let edge_springs = model.edge_springs.iter().flat_map(|batch| &batch.hinges);
    let shells = model.discrete_shells.iter().flat_map(|batch| &batch.hinges);
    let edge_springs = edge_springs.map(|h| hinge(EdgeSpring::NAME, h));
    let shells = shells.map(|h| hinge(DiscreteShell::NAME, h));
    springs
        .chain(edge_springs)
        .chain(shells)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name, ends)| (name, ends))
}
