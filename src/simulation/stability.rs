//! How long a step may be for an explicit scheme, and how stiff a step is for an iterative one, from the
//! model as it stands.

use super::element::{Element, elements};
use crate::force::{Jacobian, Spring, Stiffness};
use crate::integrator::Integrator;
use crate::linear::{Assembly, LineBlock, PairMatrix, Pattern, largest_eigenvalues};
use crate::model::Model;
use crate::state::State;
use glam::DVec3;
use std::ops::Range;

/// What limits the steps of explicit schemes: the fastest mode of each cloth as it stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Forecast {
    /// One entry a cloth.
    pub modes: Vec<Mode>,
}

/// The fastest mode of a cloth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mode {
    /// Largest ω of M⁻¹K (rad/s).
    pub omega: f64,
    /// Damping of that mode (1/s), x″ + c x′ + ω² x = 0: drag/m + τ ω².
    pub damping: f64,
    /// Damping of motion as a whole (1/s): drag/m.
    pub drag: f64,
    /// Largest ω of motion across springs (rad/s), by their tension: drag is all that damps it.
    pub across: f64,
    /// The spring or hinge that would swing fastest if it were alone.
    pub element: Option<Element>,
}

/// How far a scheme's steps are stable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// The largest stable step (s): infinite for schemes that are stable at any and where nothing
    /// moves by itself, 0 where no step is.
    pub dt: f64,
    /// The element behind it.
    pub element: Option<Element>,
}

/// Finds what limits the steps of explicit schemes at a state.
///
/// The cloths are asked one by one: explicit Euler is unstable where one of them has no damping,
/// however much the others have.
pub fn forecast(model: &Model, state: &State) -> Forecast {
    let mut modes = vec![Mode::default(); model.cloths.len()];
    let ranges: Vec<Range<usize>> = model.cloths.iter().map(|c| c.particles.clone()).collect();
    let mut owner = vec![None; model.particles()];
    for (cloth, range) in ranges.iter().enumerate() {
        owner[range.clone()].fill(Some(cloth));
    }
    // A clamp's hinge has corners of no cloth.
    let of = |particles: &[u32]| particles.iter().find_map(|&i| owner[i as usize]);
    let inverse = loosest(model);
    for element in elements(model, &inverse, &state.positions) {
        if let Some(cloth) = of(element.particles()) {
            let stiffest = &mut modes[cloth].element;
            if stiffest.is_none_or(|known| element.omega_squared > known.omega_squared) {
                *stiffest = Some(element);
            }
        }
    }
    let squares = largest_omega_squared(model, state, &ranges, &modes);
    let across = largest_across(model, state, &ranges);
    let mut times = vec![0.0_f64; modes.len()];
    let springs = model.spring_damping.iter().flat_map(|damping| {
        let ends = damping.springs.springs.iter().map(|s| &s.ends[..]);
        ends.zip(&damping.times)
    });
    let hinges = model.hinge_damping.iter().flat_map(|damping| {
        let corners = damping.hinges.iter().map(|hinge| &hinge.corners[..]);
        corners.zip(&damping.times)
    });
    for (particles, time) in springs.chain(hinges) {
        if let Some(cloth) = of(particles) {
            times[cloth] = times[cloth].max(*time);
        }
    }
    for (cloth, mode) in modes.iter_mut().enumerate() {
        mode.drag = model.mass_damping.as_ref().map_or(0.0, |damping| {
            let free = ranges[cloth].clone().filter(|&i| inverse[i] > 0.0);
            let rates = free.map(|i| damping.drag[i] / model.masses[i]);
            rates.fold(0.0, f64::max)
        });
        mode.omega = squares[cloth].sqrt();
        mode.across = across[cloth].sqrt();
        mode.damping = mode.drag + times[cloth] * squares[cloth];
    }
    Forecast { modes }
}

/// Strain below which tension counts as none: rounding leaves 1e-15 at rest.
const SLACK: f64 = 1e-6;

/// Growth a step that counts as none: it takes a million steps to show.
const STEADY: f64 = 1e-9;

impl Forecast {
    /// The largest stable step of a scheme (s): infinite for implicit ones and without springs or
    /// drag, 0 where no step is stable.
    pub fn stable_dt(&self, scheme: Integrator) -> f64 {
        self.limit(scheme).dt
    }

    /// The largest stable step of a scheme, and what sets it.
    pub fn limit(&self, scheme: Integrator) -> Limit {
        let each = self.modes.iter().map(|mode| mode.limit(scheme));
        let none = Limit {
            dt: f64::INFINITY,
            element: None,
        };
        each.fold(
            none,
            |least, limit| {
                if limit.dt < least.dt { limit } else { least }
            },
        )
    }

    /// Largest factor by which a step of `dt` (s) of an explicit scheme multiplies an amplitude; 0 for the
    /// others.
    pub fn growth(&self, scheme: Integrator, dt: f64) -> f64 {
        let modes = self.modes.iter();
        let each = modes.map(|mode| {
            let fastest = amplification(scheme, mode.omega, mode.damping, dt);
            let across = amplification(scheme, mode.across, mode.drag, dt);
            fastest.max(across)
        });
        each.fold(0.0, f64::max)
    }

    /// The element with the largest ω² of its own: what makes a step stiff.
    pub fn stiffest(&self) -> Option<Element> {
        let each = self.modes.iter().filter_map(|mode| mode.element);
        each.max_by(|a, b| a.omega_squared.total_cmp(&b.omega_squared))
    }

    /// dt² k (1/mᵢ + 1/mⱼ) of the stiffest spring, or the same of a hinge: how many times further than
    /// its force asks for a step of `dt` (s) would throw it. Explicit schemes need it below 4;
    /// the more it is above, the more iterations the others take.
    pub fn stiffness_ratio(&self, dt: f64) -> f64 {
        let stiffest = self.stiffest();
        stiffest.map_or(0.0, |element| dt * dt * element.omega_squared)
    }
}

impl Mode {
    /// The largest stable step of a scheme for this mode, for motion across taut springs, and for
    /// motion as a whole, which drag alone may slow faster than the mode. Only in the first case is an
    /// element behind it.
    fn limit(&self, scheme: Integrator) -> Limit {
        let fastest = stable_dt(scheme, self.omega, self.damping);
        let across = stable_dt(scheme, self.across, self.drag);
        let others = across.min(stable_dt(scheme, 0.0, self.drag));
        Limit {
            dt: fastest.min(others),
            element: self.element.filter(|_| fastest <= others),
        }
    }
}

/// The largest stable step of a scheme for x″ + c x′ + ω² x = 0 (s).
///
/// Found by trying: the amplification of the scheme's own step, doubled to where it grows and then
/// bisected. Undamped, dt ω is 2 for symplectic Euler and Verlet, 2√2 for rk4; explicit Euler has
/// dt = c/ω².
fn stable_dt(scheme: Integrator, omega: f64, damping: f64) -> f64 {
    let rate = omega + damping;
    if !scheme.is_explicit() || rate == 0.0 {
        return f64::INFINITY;
    }
    let stable = |dt: f64| amplification(scheme, omega, damping, dt) <= 1.0 + STEADY;
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

/// Largest factor by which a step of a scheme multiplies an amplitude of a mode.
fn amplification(scheme: Integrator, omega: f64, damping: f64, dt: f64) -> f64 {
    let step = |start| scheme.test_step(omega * omega, damping, dt, start);
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

/// Largest ω² of motion across springs of each cloth (1/s²): K has k (1 − ℓ₀/ℓ)(1 − d̂ d̂ᵀ) alone.
fn largest_across(model: &Model, state: &State, cloths: &[Range<usize>]) -> Vec<f64> {
    let springs = || model.springs.iter().flat_map(|batch| &batch.springs);
    let taut = |spring: &Spring| {
        let length = spring.span(&state.positions).length();
        (1.0 - spring.rest_length / length).max(0.0)
    };
    if springs().all(|spring| taut(spring) <= SLACK) {
        return vec![0.0; cloths.len()];
    }
    let pattern = Pattern::Lines(springs().map(|spring| spring.ends).collect());
    let mut matrix = PairMatrix::with_patterns(model.particles(), std::slice::from_ref(&pattern));
    let slots = &matrix.slots(&pattern);
    let matrix = &mut matrix;
    let mut assembly = Assembly { matrix, slots };
    for (element, spring) in springs().enumerate() {
        let d = spring.span(&state.positions);
        let tension = spring.stiffness * taut(spring);
        if tension > SLACK * spring.stiffness {
            let (a, e) = (tension, -tension / d.length_squared());
            assembly.add(element, LineBlock { a, e, d });
        }
    }
    let inverse = loosest(model);
    let root: Vec<f64> = inverse.iter().map(|w| w.sqrt()).collect();
    let mut start = vec![DVec3::ZERO; model.particles()];
    for i in cloths.iter().cloned().flatten() {
        if inverse[i] > 0.0 {
            start[i] = seed(i);
        }
    }
    largest_eigenvalues(assembly.matrix, &root, cloths, start)
}

/// Largest eigenvalue of M⁻¹K of each cloth (1/s²), as that of M^-½ K M^-½.
fn largest_omega_squared(
    model: &Model,
    state: &State,
    cloths: &[Range<usize>],
    modes: &[Mode],
) -> Vec<f64> {
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
    let inverse = loosest(model);
    let root: Vec<f64> = inverse.iter().map(|w| w.sqrt()).collect();
    let mut start = vec![DVec3::ZERO; particles];
    for (rows, mode) in cloths.iter().zip(modes) {
        for i in rows.clone().filter(|&i| inverse[i] > 0.0) {
            start[i] = seed(i);
        }
        // A single stiff spring or light particle must not be missed among thousands of others.
        for &i in mode.element.iter().flat_map(Element::particles) {
            #[expect(clippy::cast_precision_loss, reason = "any number will do")]
            let share = (rows.len() as f64).sqrt();
            start[i as usize] *= share;
        }
    }
    largest_eigenvalues(&matrix, &root, cloths, start)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Limits in closed form: dt ω = 2, 2, 2√2 undamped; explicit Euler c/ω², symplectic Euler
    /// (√(c² + 4 ω²) − c)/ω² damped; −2.785 on the real axis for rk4, −2 for the others' drag alone.
    #[test]
    fn stable_steps_are_those_of_closed_form() {
        let limit = |omega: f64, damping: f64, scheme| stable_dt(scheme, omega, damping);
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
