//! What varies from row to row of a map: a property of the model.

use crate::model::Model;
use crate::scene::{self, Built, LoadedScene, SceneError};
use crate::state::State;
use crate::study::StudyError;
use glam::DVec3;

/// What varies from row to row of a map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axis {
    /// `material.stretch`, or `material.spring_constant`, of every cloth.
    #[default]
    Stiffness,
    /// The mass of every second particle that is never pinned: neighbours of unlike mass.
    MassRatio,
    /// `damping.stiffness` of every cloth.
    Damping,
}

/// Velocity (m/s) that free particles start with besides their own, at most in each direction: what an
/// instability grows from. A sheet that falls freely is stretched nowhere but by rounding, and one that is
/// hidden there takes three times as long to show. In half a second it moves a particle by 0.05 mm.
const STIR: f64 = 1e-4;

impl Axis {
    /// Every axis.
    pub const ALL: [Self; 3] = [Self::Stiffness, Self::MassRatio, Self::Damping];

    /// Its name in tables and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::MassRatio => "mass-ratio",
            Self::Damping => "damping",
        }
    }

    /// What is multiplied, in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::MassRatio => "mass of every second particle",
            Self::Damping => "damping by stiffness",
        }
    }

    /// The usual factors.
    pub fn factors(self) -> &'static [f64] {
        match self {
            Self::Stiffness => &[1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4],
            Self::MassRatio => &[1e-6, 1e-4, 1e-3, 1e-2, 1e-1, 1.0],
            Self::Damping => &[0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0],
        }
    }

    /// Do factors make sense, and is there something to multiply?
    pub(super) fn check(self, loaded: &LoadedScene, factors: &[f64]) -> Result<(), StudyError> {
        let fits = |f: &f64| f.is_finite() && (*f > 0.0 || *f == 0.0 && self == Self::Damping);
        if let Some(factor) = factors.iter().find(|f| !fits(f)) {
            return Err(StudyError::Ask(format!(
                "factor {factor} of the {}: a factor is a positive number",
                self.words()
            )));
        }
        let mut cloths = loaded.scene.cloth.iter();
        if self == Self::Damping && cloths.all(|cloth| cloth.damping.stiffness == 0.0) {
            return Err(StudyError::Ask(format!(
                "{}: no cloth has damping.stiffness, so that there is nothing to multiply; set it, or map the stiffness",
                loaded.file
            )));
        }
        Ok(())
    }

    /// The scene with its property multiplied, and stirred.
    pub(super) fn build(self, loaded: &LoadedScene, factor: f64) -> Result<Built, SceneError> {
        let mut loaded = loaded.clone();
        for cloth in &mut loaded.scene.cloth {
            let material = &mut cloth.material;
            match self {
                Self::Stiffness => {
                    material.stretch = material.stretch.map(|k| k * factor);
                    material.spring_constant = material.spring_constant.map(|k| k * factor);
                }
                Self::Damping => cloth.damping.stiffness *= factor,
                Self::MassRatio => {}
            }
        }
        let mut built = scene::build(&loaded)?;
        if self == Self::MassRatio {
            lighten(&mut built.model, factor);
        }
        stir(&built.model, &mut built.state);
        Ok(built)
    }
}

/// Multiplies the mass of every second particle that is free from the start; drag stays in proportion.
fn lighten(model: &mut Model, factor: f64) {
    for i in (0..model.cloth_particles()).step_by(2) {
        if !model.is_pinned(i) {
            model.masses[i] *= factor;
            model.inverse_masses[i] = 1.0 / model.masses[i];
            if let Some(weighs) = model.gravity.masses.get_mut(i) {
                *weighs = model.masses[i];
            }
            if let Some(damping) = &mut model.mass_damping {
                damping.drag[i] *= factor;
            }
        }
    }
}

/// Gives free particles velocities that differ in sign and size between neighbours.
fn stir(model: &Model, state: &mut State) {
    for i in 0..model.cloth_particles() {
        if !model.is_pinned(i) {
            #[expect(clippy::cast_precision_loss, reason = "any number will do")]
            let t = i as f64;
            let wave = DVec3::new(2.1 * t, 2.9 * t + 1.0, 2.5 * t + 2.0);
            state.velocities[i] += STIR * wave.map(f64::sin);
        }
    }
}

impl std::str::FromStr for Axis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|axis| axis.name() == text);
        found.ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            format!("\"{text}\" is no axis of a map: use {known}")
        })
    }
}
