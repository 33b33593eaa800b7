//! What a run looks like at evenly spread times that its steps need not meet.

use crate::simulation::Simulation;
use crate::state::State;
use glam::DVec3;

/// The cloths' particles at k/fps.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// Positions at each time (m), from 0 on.
    pub frames: Vec<Vec<DVec3>>,
    fps: f64,
    before: State,
}

impl Track {
    /// An empty track of `fps` frames in a simulated second.
    pub fn new(fps: f64) -> Self {
        Self {
            fps,
            ..Self::default()
        }
    }

    /// Leaves out the frames after `end` (s).
    pub fn cut(&mut self, end: f64) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a number of frames"
        )]
        self.frames.truncate((end * self.fps + 1e-6) as usize + 1);
    }

    /// Takes the frames that lie between the state that was seen last and this one.
    ///
    /// Between two steps the way is the cubic with the places and velocities of both (Hermite), whose error
    /// of fourth order in the step is far below that of any scheme here but rk4's.
    pub fn see(&mut self, simulation: &Simulation) {
        let (state, cloth) = (simulation.state(), simulation.model().cloth_particles());
        loop {
            #[expect(clippy::cast_precision_loss, reason = "frames stay far below 2⁵³")]
            let due = self.frames.len() as f64 / self.fps;
            if due > state.time + 1e-9 {
                break;
            }
            let span = state.time - self.before.time;
            let s = if self.frames.is_empty() || span <= 0.0 {
                1.0
            } else {
                ((due - self.before.time) / span).min(1.0)
            };
            let at = |i: usize| {
                if s >= 1.0 {
                    return state.positions[i];
                }
                let ends = [&self.before, state].map(|end| (end.positions[i], end.velocities[i]));
                hermite(ends, span, s)
            };
            self.frames.push((0..cloth).map(at).collect());
        }
        if self.before.positions.len() == state.positions.len() {
            self.before.copy_from(state);
        } else {
            self.before = state.clone();
        }
    }
}

/// The cubic from x₀ with velocity v₀ to x₁ with v₁ in a time `span` (s), at the share `s` of it.
pub(super) fn hermite([(x0, v0), (x1, v1)]: [(DVec3, DVec3); 2], span: f64, s: f64) -> DVec3 {
    let r = 1.0 - s;
    x0 * (r * r * (1.0 + 2.0 * s))
        + x1 * (s * s * (3.0 - 2.0 * s))
        + (v0 * r - v1 * s) * (span * s * r)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_met() {
        let x = |t: f64| DVec3::new(t * t * t - t, 2.0 * t * t, 1.0);
        let v = |t: f64| DVec3::new(3.0 * t * t - 1.0, 4.0 * t, 0.0);
        let (a, b) = (0.3, 0.8);
        for s in [0.0, 0.2, 0.25, 0.5, 0.8, 1.0] {
            let found = hermite([(x(a), v(a)), (x(b), v(b))], b - a, s);
            assert!(found.distance(x(a + s * (b - a))) < 1e-15, "{s}: {found}");
        }
    }
}
