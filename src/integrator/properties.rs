//! What is true of each scheme, and what it can't do in a scene, in words.

use super::Integrator;
use crate::energy::When;
use crate::model::Model;

impl Integrator {
    /// What is true of the scheme in every scene.
    pub fn properties(self) -> &'static [&'static str] {
        match self {
            Self::Euler => &[
                "first order; feeds energy into every oscillation: stable only where damping takes more",
                "damping by stiffness acts along springs only: once cloth is taut, what swings across them needs damping.mass, and the stable step becomes far shorter than at rest",
            ],
            Self::SymplecticEuler => &[
                "first order; keeps the energy of undamped motion on average, within dt ω/2 of it",
            ],
            Self::Verlet => &[
                "second order; keeps the energy of undamped motion on average, within (dt ω)²/4 of it",
            ],
            Self::Rk4 => &[
                "fourth order, four passes over the forces a step; near its limit it damps the fastest modes by itself",
            ],
            Self::Dopri5 { .. } => &[
                "fifth order, six passes over the forces a step; chooses its steps by their estimated error, and so never one that is unstable",
            ],
            Self::ImplicitEuler(_) => &[
                "first order, stable at any step; damps by itself, by a damping ratio ω dt/2: slow swings a little, ripples and folds at once",
                "one linearised solve a step: where springs turn by much in a step, not all of the force is found; a step that would make energy is solved whole and counted",
            ],
            Self::Newton(_) => &[
                "first order, stable at any step; damps by itself, by a damping ratio ω dt/2; solves the whole step, in several linear solves",
            ],
            Self::ImplicitMidpoint(_) => &[
                "second order; keeps the energy of undamped motion; what a step is too long to see keeps ringing, so that stiff cloth without damping.stiffness gets noisy at long steps",
                "a step that would bring what ringing makes above a tenth of the cloth's energy is taken by implicit Euler, and counted in solver.damped_steps",
            ],
            Self::Bdf2(_) => &[
                "second order, stable at any step; damps ripples by itself and slow swings hardly",
            ],
            Self::Xpbd { .. } => &[
                "first order, cheap, stable at any step; damps by itself; cloth is softer than its material, by about 1 + half of the stiffness ratio with one sweep, and right as dt → 0",
            ],
            Self::Projective { .. } => &[
                "first order, stable at any step; damps by itself, by a damping ratio ω dt/2; what its iterations leave of a step's equation is reported: stiff cloth at long steps takes hundreds for 1e-3",
            ],
        }
    }

    /// Order p of the scheme on smooth motion: its error goes with dtᵖ.
    pub fn order(self) -> i32 {
        match self {
            Self::Euler
            | Self::SymplecticEuler
            | Self::ImplicitEuler(_)
            | Self::Newton(_)
            | Self::Xpbd { .. }
            | Self::Projective { .. } => 1,
            Self::Verlet | Self::ImplicitMidpoint(_) | Self::Bdf2(_) => 2,
            Self::Rk4 => 4,
            Self::Dopri5 { .. } => 5,
        }
    }

    /// Order p that is seen in a scene: 1 where a strain limit or contact acts after the step, whatever
    /// the scheme's own.
    pub fn order_in(self, model: &Model) -> i32 {
        if model.is_corrected() {
            1
        } else {
            self.order()
        }
    }

    /// The scheme as it is at half of its steps: `dopri5`, which chooses them, at the tolerance that
    /// makes them half as long.
    pub fn halved(self) -> Self {
        match self {
            Self::Dopri5 { tolerance } => Self::Dopri5 {
                tolerance: tolerance * 0.5_f64.powi(self.order()),
            },
            other => other,
        }
    }

    /// What the scheme can't do in this scene, or not as well as elsewhere.
    pub fn shortcomings(self, model: &Model) -> Vec<&'static str> {
        let mut said = Vec::new();
        if self == Self::Euler && model.dampings().next().is_none() {
            said.push("there is no damping: stable at no step");
        }
        if !self.has_contact_inside() && !model.obstacles.is_empty() {
            said.push(
                "contact is answered after each step and not inside it: what lies on an obstacle falls by up to g dt² a step and is put back, and friction acts on that fall's impulse",
            );
        }
        if model.strain_limit.is_some() {
            said.push(
                "the strain limit moves particles after each step: first order in time, whatever the scheme's own",
            );
        }
        said
    }

    /// Whether contacts are part of the equations that a step solves.
    pub fn has_contact_inside(self) -> bool {
        matches!(
            self,
            Self::ImplicitEuler(_) | Self::Newton(_) | Self::ImplicitMidpoint(_) | Self::Bdf2(_)
        )
    }

    /// The key of `solver` that says when a step counts as solved; `None` for schemes that solve nothing or
    /// not to a tolerance, and for the one that ends a run when it can't meet it.
    pub fn tolerance_key(self) -> Option<&'static str> {
        match self {
            Self::Euler
            | Self::SymplecticEuler
            | Self::Verlet
            | Self::Rk4
            | Self::Dopri5 { .. }
            | Self::Xpbd { .. } => None,
            Self::ImplicitEuler(_) => Some("linear_tolerance"),
            Self::Newton(_)
            | Self::ImplicitMidpoint(_)
            | Self::Bdf2(_)
            | Self::Projective { .. } => Some("residual"),
        }
    }

    /// Whether a step may end at `solver.iterations` before it is solved.
    pub fn has_most_iterations(self) -> bool {
        matches!(
            self,
            Self::Newton(_) | Self::ImplicitMidpoint(_) | Self::Bdf2(_) | Self::Projective { .. }
        )
    }

    /// Damping ratio ω dt/2 that the scheme adds to a mode of ω (rad/s) at a step `dt` (s), to first order;
    /// `None` where it adds none, or not of that form.
    pub fn numerical_damping(self, omega: f64, dt: f64) -> Option<f64> {
        match self {
            Self::ImplicitEuler(_) | Self::Newton(_) | Self::Projective { .. } => {
                Some(0.5 * omega * dt)
            }
            _ => None,
        }
    }

    /// The step that `"auto"` takes where stability asks for none (s): 1 to 20 a recorded frame of
    /// 1/60 s.
    pub fn usual_step(self) -> f64 {
        match self {
            Self::Xpbd { .. } => 1.0 / 1200.0,
            Self::Projective { .. } => 1.0 / 60.0,
            _ => 1.0 / 240.0,
        }
    }

    /// Where in a step the scheme takes the dampings: the place of their positions and of the velocities
    /// that they answer. Their work along the step's way is then exact where the scheme's is one such
    /// force; else, in the middle, of second order.
    pub fn damped_at(self) -> [When; 2] {
        match self {
            Self::Euler | Self::SymplecticEuler => [When::Start, When::Start],
            Self::Verlet | Self::Rk4 | Self::Dopri5 { .. } | Self::ImplicitMidpoint(_) => {
                [When::Middle, When::Middle]
            }
            Self::ImplicitEuler(_) => [When::Start, When::End],
            Self::Newton(_) | Self::Bdf2(_) | Self::Projective { .. } => [When::End, When::End],
            Self::Xpbd { .. } => [When::Middle, When::End],
        }
    }

    /// Whether the energy that springs have by their lengths is energy that the scheme can give back: what
    /// one sweep of XPBD leaves stretched pulls with a part of its force only.
    pub fn has_elastic_energy(self) -> bool {
        !matches!(self, Self::Xpbd { .. })
    }
}
