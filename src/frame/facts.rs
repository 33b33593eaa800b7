//! What a recording says about itself.

use crate::scene::{LoadedScene, Material, model_list};
use crate::simulation::Simulation;
use std::num::NonZero;

/// What a recording says about itself, for those who find it a year later.
///
/// The same for every run of a scene on one machine: no clock, and no number of threads, which changes nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts {
    /// The scene's name.
    pub scene: String,
    /// The version of this program.
    pub version: String,
    /// The integration scheme.
    pub scheme: String,
    /// Its time step (s); that of a scheme which chooses its own is the longest.
    pub dt: f64,
    /// System, processor and its cores.
    pub machine: String,
    /// The units of all numbers.
    pub units: String,
    /// Where random numbers come from.
    pub random_numbers: String,
    /// What is modelled, one part an entry.
    pub models: Vec<String>,
    /// The cloths' names.
    pub cloths: Vec<String>,
    /// What each cloth is made of.
    pub materials: Vec<String>,
    /// Particles of all cloths.
    pub particles: u64,
    /// Triangles of all cloths.
    pub triangles: u64,
    /// Springs of all cloths.
    pub springs: u64,
}

impl Facts {
    /// What there is to say of a simulation of a scene.
    pub(super) fn of(loaded: &LoadedScene, simulation: &Simulation) -> Self {
        let model = simulation.model();
        let triangles: usize = model.cloths.iter().map(|cloth| cloth.triangles.len()).sum();
        let models = model_list(&loaded.scene, model);
        let models = models.lines().map(|line| line.trim_start_matches("- "));
        let cloths = &loaded.scene.cloth;
        Self {
            scene: loaded.scene.name.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scheme: simulation.integrator().name().to_owned(),
            dt: simulation.dt(),
            machine: machine(),
            units: "SI (m, kg, s, N, J), y up".to_owned(),
            random_numbers: "none".to_owned(),
            models: models.map(str::to_owned).collect(),
            cloths: cloths.iter().map(|cloth| cloth.name.clone()).collect(),
            materials: cloths.iter().map(|c| material(&c.material)).collect(),
            particles: model.cloth_particles() as u64,
            triangles: triangles as u64,
            springs: model.spring_count() as u64,
        }
    }
}

/// A material in words, with the units of its kind of cloth.
fn material(material: &Material) -> String {
    let Material {
        area_density,
        linear_density,
        density,
        stretch,
        spring_constant,
        bend,
    } = *material;
    let (modulus, rigidity) = match (linear_density, density) {
        (Some(_), _) => ("N", "N·m²"),
        (_, Some(_)) => ("Pa", "N·m"),
        _ => ("N/m", "N·m"),
    };
    let parts = [
        ("area density", area_density, "kg/m²"),
        ("linear density", linear_density, "kg/m"),
        ("density", density, "kg/m³"),
        ("stretch", stretch, modulus),
        ("spring constant", spring_constant, "N/m"),
        ("bend", bend, rigidity),
    ];
    let parts = parts.into_iter();
    let parts = parts.filter_map(|(name, value, unit)| Some(format!("{name} {} {unit}", value?)));
    parts.collect::<Vec<_>>().join(", ")
}

/// System, processor and cores of this machine.
fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, NonZero::get);
    let system = format!(
        "{} {}, {cores} cores",
        std::env::consts::OS,
        std::env::consts::ARCH
    );
    match processor() {
        Some(processor) => format!("{system}, {processor}"),
        None => system,
    }
}

/// What Linux calls the processor; the other systems have no such file.
fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_have_the_units_of_their_kind() {
        let none = Material {
            area_density: None,
            linear_density: None,
            density: None,
            stretch: Some(1000.0),
            spring_constant: None,
            bend: Some(1e-5),
        };
        let sheet = Material {
            area_density: Some(0.2),
            ..none.clone()
        };
        let chain = Material {
            linear_density: Some(0.01),
            ..none.clone()
        };
        let block = Material {
            density: Some(30.0),
            ..none
        };
        let words = [sheet, chain, block].map(|m| material(&m));
        assert_eq!(
            words,
            [
                "area density 0.2 kg/m², stretch 1000 N/m, bend 0.00001 N·m",
                "linear density 0.01 kg/m, stretch 1000 N, bend 0.00001 N·m²",
                "density 30 kg/m³, stretch 1000 Pa, bend 0.00001 N·m",
            ]
        );
    }
}
