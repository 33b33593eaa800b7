//! What several topics need.

use muslin::integrator::Integrator;
use muslin::scene::{self, LoadedScene};
use muslin::simulation::Simulation;

/// A tight implicit Euler: its linear solves are far more exact than its steps.
pub(crate) const IMPLICIT: Integrator = Integrator::ImplicitEuler {
    linear_tolerance: 1e-9,
};

/// A scene with changes.
pub(crate) fn load(name: &str, changes: &[&str]) -> LoadedScene {
    let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
    scene::load(name, &changes).unwrap_or_else(|error| panic!("{error}"))
}

/// A simulation of a scene with changes.
pub(crate) fn simulation(
    name: &str,
    changes: &[&str],
    integrator: Integrator,
    dt: f64,
) -> Simulation {
    let built = scene::build(&load(name, changes)).unwrap_or_else(|error| panic!("{error}"));
    Simulation::new(built.model, built.state, integrator, dt)
}

/// Steps until `time` (s).
pub(crate) fn run_to(simulation: &mut Simulation, time: f64) {
    let steps = (time / simulation.dt()).round() as u64;
    while simulation.stats().steps < steps {
        simulation
            .step()
            .unwrap_or_else(|diverged| panic!("{diverged}"));
    }
}

/// A sequence of numbers in −1 … 1 that looks random and is the same every time.
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn next(&mut self) -> f64 {
        // Knuth's MMIX generator; its upper bits.
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    }

    pub(crate) fn vector(&mut self) -> glam::DVec3 {
        glam::DVec3::new(self.next(), self.next(), self.next())
    }
}
