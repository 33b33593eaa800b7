//! Single springs against the closed forms of their motion.

use crate::support::written;
use glam::DVec3;
use muslin::energy::kinetic;
use muslin::integrator::{Integrator, Linear};
use muslin::scene;
use muslin::simulation::Simulation;
use std::f64::consts::TAU;

const EXACT_SOLVES: Integrator = Integrator::ImplicitEuler(Linear::to(1e-14));

/// A pair of masses of 0.05 kg, 0.5 m apart at rest; the first one pinned or not.
fn pair(keys: &str, pinned: bool, scheme: Integrator, dt: f64) -> Simulation {
    let mut text = format!(
        "name = \"pair\"\nduration = 1.0\ngravity = [0.0, 0.0, 0.0]\n[[cloth]]\nname = \"pair\"\nshape = {{ chain = {{ length = 0.5, links = 1 }} }}\n{keys}\n"
    );
    if pinned {
        text += "[[pin]]\ncloth = \"pair\"\nselect = { corner = [\"left\"] }\n";
    }
    let built = scene::build(&written("pair", &text)).unwrap();
    assert!((built.model.masses[1] - 0.05).abs() < 1e-15);
    Simulation::new(built.model, built.state, scheme, dt)
}

fn steps(run: &mut Simulation, steps: u32) {
    for _ in 0..steps {
        run.step().unwrap();
    }
}

/// A mass on an ideal spring goes round an ellipse about the other end in T = 2π √(m/k), whatever its
/// start.
#[test]
fn an_ideal_spring_has_elliptic_orbits_of_one_period() {
    for velocity in [[0.0, 3.0, 0.0], [1.0, -0.5, 2.0]] {
        let (k, m, count) = (5.0, 0.05, 20_000);
        let period = TAU * f64::sqrt(m / k);
        let keys = format!(
            "springs = [\"zero-length\"]\nmaterial = {{ linear_density = 0.2, spring_constant = {k:.1} }}\nstart = {{ velocity = {velocity:?} }}"
        );
        let dt = period / f64::from(count);
        let mut run = pair(&keys, true, Integrator::SymplecticEuler, dt);
        let at = |run: &Simulation| run.state().positions[1] - run.state().positions[0];
        let (start, pull) = (at(&run), run.state().velocities[1]);
        // x(t) = x₀ cos ωt + v₀/ω sin ωt: a quarter of a period later at v₀/ω, then opposite.
        let swing = pull * (period / TAU);
        for (quarter, expected) in [(1, swing), (2, -start), (3, -swing), (4, start)] {
            steps(&mut run, count / 4);
            let error = (at(&run) - expected).length();
            // On the way the scheme is off by its first order, ω dt/2; the closed orbit is not.
            let size = start.length() + swing.length();
            let bound = if quarter == 4 {
                1e-6
            } else {
                TAU / f64::from(count)
            } * size;
            assert!(
                error < bound,
                "quarter {quarter}: {} against {expected}",
                at(&run)
            );
        }
        let late = (at(&run) - start).dot(pull) / pull.length_squared();
        assert!(
            (late / period).abs() < 1e-6,
            "the period is off by {:.1e}",
            late / period
        );
    }
}

/// Displacement of a damped oscillator that starts at rest at 1: x″ + c x′ + ω² x = 0.
fn oscillator(omega: f64, c: f64, t: f64) -> f64 {
    let (half, gap) = (0.5 * c, omega * omega - 0.25 * c * c);
    let (cos, sinc) = if gap.abs() < 1e-9 {
        (1.0, t)
    } else if gap > 0.0 {
        let w = gap.sqrt();
        ((w * t).cos(), (w * t).sin() / w)
    } else {
        let w = (-gap).sqrt();
        ((w * t).cosh(), (w * t).sinh() / w)
    };
    (-half * t).exp() * (cos + half * sinc)
}

/// Under-, critically and over-damped by either damping and by both: the closed form, approached
/// with the first order of the schemes.
#[test]
fn damped_springs_follow_the_closed_form() {
    let omega = 10.0; // EA = k ℓ₀ with k = m ω²
    let stretch = 0.05 * omega * omega * 0.5;
    for share in [0.2, 1.0, 3.0] {
        let c = 2.0 * share * omega;
        for (mass, stiffness) in [
            (c, 0.0),
            (0.0, c / (omega * omega)),
            (0.5 * c, 0.5 * c / (omega * omega)),
        ] {
            let keys = format!(
                "material = {{ linear_density = 0.2, stretch = {stretch:?} }}\ndamping = {{ mass = {mass:?}, stiffness = {stiffness:?} }}\nstart = {{ stretch = [1.2, 1.0, 1.0] }}"
            );
            for scheme in [Integrator::SymplecticEuler, EXACT_SOLVES] {
                let worst = |dt: f64| {
                    let mut run = pair(&keys, true, scheme, dt);
                    // The chain lies about the origin: stretched by 1.2, it ends 0.1 m from rest.
                    let end = |run: &Simulation| {
                        run.state().positions[1].x - run.state().positions[0].x - 0.5
                    };
                    let mut worst = 0.0_f64;
                    for _ in 0..20 {
                        steps(&mut run, (0.05 / dt).round() as u32);
                        let exact = 0.1 * oscillator(omega, c, run.state().time);
                        worst = worst.max((end(&run) - exact).abs());
                    }
                    worst
                };
                let [coarse, fine] = [2e-4, 1e-4].map(worst);
                let what = format!("{} {share}, {mass} 1/s, {stiffness} s", scheme.name());
                assert!(fine < 0.1 * 2e-3, "{what}: off by {fine} m");
                assert!((coarse / fine).log2() > 0.95, "{what}: {coarse}, {fine} m");
            }
        }
    }
}

/// A pair that flies and spins as a rigid body does: at the length where its spring holds it together.
fn flying(damping: &str, scheme: Integrator, dt: f64) -> Simulation {
    // k (ℓ − ℓ₀) = m ω² ℓ/2 with ω = 2 rad/s, k = 20 N/m, m = 0.05 kg.
    let (omega, k, m) = (2.0, 20.0, 0.05);
    let stretch = 1.0 / (1.0 - m * omega * omega / (2.0 * k));
    let keys = format!(
        "material = {{ linear_density = 0.2, stretch = 10.0 }}\ndamping = {{ {damping} }}\nstart = {{ stretch = [{stretch:?}, 1.0, 1.0], velocity = [1.0, 2.0, 3.0], spin = [0.0, {omega:.1}, 0.0] }}"
    );
    let run = pair(&keys, false, scheme, dt);
    let (_, spin, _) = momenta(&run);
    let exact = 2.0 * m * f64::powi(0.25 * stretch, 2) * omega;
    assert!(
        (spin - DVec3::Y * exact).length() < 1e-12,
        "starts with {spin}"
    );
    run
}

/// Linear and angular momentum about the centre, and the energy of the spin.
fn momenta(run: &Simulation) -> (DVec3, DVec3, f64) {
    let (x, v) = (&run.state().positions, &run.state().velocities);
    let (m, center, common) = (0.05, (x[0] + x[1]) * 0.5, (v[0] + v[1]) * 0.5);
    let spin = (0..2)
        .map(|i| (x[i] - center).cross(v[i] - common) * m)
        .sum();
    let energy = kinetic(run.model(), run.state()) - m * common.length_squared();
    (common * (2.0 * m), spin, energy)
}

#[test]
fn stiffness_damping_leaves_flight_and_spin_alone() {
    // Steps so short that the schemes' own errors, of order (ω dt)² a step for implicit Euler, stay
    // below what is asked; the damping would stop a motion that it resists in τ⁻¹ m/k = 2.5 µs.
    for (scheme, dt) in [(Integrator::SymplecticEuler, 1e-6), (EXACT_SOLVES, 1e-7)] {
        let mut run = flying("stiffness = 1000.0", scheme, dt);
        let before = momenta(&run);
        steps(&mut run, 1000);
        let after = momenta(&run);
        let name = scheme.name();
        let drift = (after.0 - before.0).length() / before.0.length();
        assert!(drift < 1e-10, "{name}: momentum drifted by {drift:.1e}");
        let drift = (after.1 - before.1).length() / before.1.length();
        assert!(
            drift < 1e-10,
            "{name}: angular momentum drifted by {drift:.1e}"
        );
        let drift = (after.2 / before.2 - 1.0).abs();
        assert!(
            drift < 1e-8,
            "{name}: energy of the spin drifted by {drift:.1e}"
        );
    }
}

/// Mass damping slows the flight and the spin alike, as exp(−c t).
#[test]
fn mass_damping_slows_flight_and_spin() {
    let mut run = flying("mass = 2.0", Integrator::SymplecticEuler, 1e-5);
    let before = momenta(&run);
    steps(&mut run, 20_000);
    let after = momenta(&run);
    let expected = (-2.0_f64 * 0.2).exp();
    for (what, ratio) in [
        ("momentum", after.0.length() / before.0.length()),
        ("angular momentum", after.1.length() / before.1.length()),
    ] {
        assert!(
            (ratio / expected - 1.0).abs() < 1e-5,
            "{what}: {ratio} against {expected}"
        );
    }
}
