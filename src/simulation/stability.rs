//! How long a step may be for an explicit scheme, from the model as it stands.

use crate::force::{
    BendingLaw as _, Dihedral, DiscreteShell, EdgeSpring, Hinge, Jacobian, Spring, Stiffness,
};
use crate::integrator::Integrator;
use crate::linear::{Assembly, PairMatrix};
use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// What limits the steps of explicit schemes: the fastest mode of a model as it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Largest ω of M⁻¹K (rad/s).
    pub omega: f64,
    /// Damping of that mode (1/s), x″ + c x′ + ω² x = 0: drag/m + τ ω².
    pub damping: f64,
    /// The spring or hinge that would swing fastest if it were alone: its family or law, and its ends
    /// or those of its edge.
    pub element: Option<(&'static str, [u32; 2])>,
}

/// Iterations of the power method: the largest eigenvalue of a 60 × 60 sheet is then within 1 %.
const ITERATIONS: u32 = 200;

/// Finds what limits the steps of explicit schemes at a state.
pub fn forecast(model: &Model, state: &State) -> Forecast {
    let omega_squared = largest_eigenvalue(model, state);
    let drag = model.mass_damping.as_ref().map_or(0.0, |damping| {
        let rates = damping.drag.iter().zip(&model.masses).map(|(c, m)| c / m);
        rates.fold(0.0, f64::max)
    });
    let springs = model.spring_damping.iter().flat_map(|d| &d.times);
    let hinges = model.hinge_damping.iter().flat_map(|d| &d.times);
    let time = springs.chain(hinges).copied().fold(0.0, f64::max);
    Forecast {
        omega: omega_squared.sqrt(),
        damping: drag + time * omega_squared,
        element: stiffest(model, state),
    }
}

/// Growth a step that counts as none: it takes a million steps to show.
const STEADY: f64 = 1e-9;

impl Forecast {
    /// The largest stable step of a scheme (s): infinite for implicit ones and without springs or
    /// drag, 0 where no step is stable.
    ///
    /// Found by trying: the amplification of the scheme's own step of the damped oscillator, doubled
    /// to where it grows and then bisected. Undamped, dt ω is 2 for symplectic Euler and Verlet, 2√2
    /// for rk4; explicit Euler has dt = c/ω².
    pub fn stable_dt(&self, scheme: Integrator) -> f64 {
        let rate = self.omega + self.damping;
        if !scheme.is_explicit() || rate == 0.0 {
            return f64::INFINITY;
        }
        let stable = |dt: f64| self.amplification(scheme, dt) <= 1.0 + STEADY;
        let mut low = 1e-4 / rate;
        if !stable(low) {
            return 0.0;
        }
        while stable(1.1 * low) {
            low *= 1.1;
        }
        let mut high = 1.1 * low;
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if stable(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// Largest factor by which a step of a scheme multiplies an amplitude of the mode.
    fn amplification(&self, scheme: Integrator, dt: f64) -> f64 {
        let step = |start| scheme.test_step(self.omega * self.omega, self.damping, dt, start);
        let (Some([a, c]), Some([b, d])) = (step([1.0, 0.0]), step([0.0, 1.0])) else {
            return 0.0;
        };
        let (half_trace, determinant) = (0.5 * (a + d), a * d - b * c);
        let gap = half_trace * half_trace - determinant;
        if gap > 0.0 {
            half_trace.abs() + gap.sqrt()
        } else {
            determinant.sqrt()
        }
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
    let root: Vec<f64> = loosest(model).iter().map(|w| w.sqrt()).collect();
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

/// 1/mass of each particle (1/kg) with all pins released that ever will be: freeing particles only raises
/// the largest eigenvalue, and the step has to do for the whole run.
fn loosest(model: &Model) -> Vec<f64> {
    let mut inverse = model.inverse_masses.clone();
    for &i in model.pins.releases.iter().flat_map(|r| &r.particles) {
        inverse[i as usize] = 1.0 / model.masses[i as usize];
    }
    inverse
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
    let loosest = loosest(model);
    let w = |particle: u32| loosest[particle as usize];
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Limits in closed form: dt ω = 2, 2, 2√2 undamped; explicit Euler c/ω², symplectic Euler
    /// (√(c² + 4 ω²) − c)/ω² damped; −2.785 on the real axis for rk4, −2 for the others' drag alone.
    #[test]
    fn stable_steps_are_those_of_closed_form() {
        let limit = |omega: f64, damping: f64, scheme| {
            let forecast = Forecast {
                omega,
                damping,
                element: None,
            };
            forecast.stable_dt(scheme)
        };
        let (omega, c) = (50.0_f64, 7.0_f64);
        for (scheme, damping, exact) in [
            (Integrator::Euler, 0.0, 0.0),
            (Integrator::Euler, c, c / (omega * omega)),
            (Integrator::SymplecticEuler, 0.0, 2.0 / omega),
            (
                Integrator::SymplecticEuler,
                c,
                (c.hypot(2.0 * omega) - c) / (omega * omega),
            ),
            (Integrator::Verlet, 0.0, 2.0 / omega),
            (Integrator::Rk4, 0.0, 8.0_f64.sqrt() / omega),
        ] {
            let found = limit(omega, damping, scheme);
            // rk4 grows by (dt ω − 2√2)/3 a step beyond, the pair of Verlet by a square root.
            assert!(
                (found - exact).abs() <= 1e-6 * exact,
                "{scheme:?}, {damping}: {found}, {exact}"
            );
        }
        for (scheme, exact) in [(Integrator::Euler, 2.0), (Integrator::Rk4, 2.785_293_563)] {
            let found = limit(0.0, 1.0, scheme);
            assert!(
                (found / exact - 1.0).abs() < 1e-6,
                "{scheme:?}: {found}, {exact}"
            );
        }
    }
}
