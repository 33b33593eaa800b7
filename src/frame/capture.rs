//! Taking frames from a simulation.

use super::{
    Checkpoint, ClothCheckpoint, ClothFrame, ClothHeader, ContactMark, Event, Frame, Header,
    Histogram, ObstacleHeader, Series, SpringDetail, SpringFamily,
};
use crate::mesh::TriMesh;
use crate::model::Cloth;
use crate::scene::{LoadedScene, SpringDetailName, model_list};
use crate::simulation::Simulation;
use glam::DVec3;

/// Takes frames; knows which springs belong to which cloth.
#[derive(Clone, Debug)]
pub struct Capture {
    /// Per cloth, per family of its header: the model's batch and the springs in it.
    springs: Vec<Vec<(usize, Vec<usize>)>>,
    /// Strain at the ends of the histogram.
    strain_range: f64,
    frames: u64,
    /// Releases of pins that had happened when the header was made.
    released: usize,
    /// Error of the time step (m): not a number before it is known, `None` where nobody asks.
    error: Option<f64>,
}

/// Classes of the strain histogram; odd, so that one is centred on zero.
const CLASSES: u32 = 41;

impl Capture {
    /// Gets ready for the frames of a simulation, and says what stays the same in all of them.
    pub fn new(loaded: &LoadedScene, simulation: &Simulation) -> (Self, Header) {
        let record = &loaded.scene.record;
        let model = simulation.model();
        let springs = model
            .cloths
            .iter()
            .map(|cloth| springs_of(cloth, simulation))
            .collect();
        let capture = Self {
            springs,
            strain_range: record.strain_range,
            frames: 0,
            released: model.released(),
            error: (record.error > 0.0).then_some(f64::NAN),
        };
        let header = Header {
            scene: loaded.scene.name.clone(),
            scene_toml: loaded.text.clone(),
            model_list: model_list(&loaded.scene, model),
            strain_range: single(record.strain_range),
            view: record
                .view
                .map(|corners| corners.map(|corner| point(corner.into()))),
            spring_detail: match record.springs {
                SpringDetailName::Off => SpringDetail::Off,
                SpringDetailName::All => SpringDetail::All,
                SpringDetailName::Auto => SpringDetail::Auto,
            },
            cloths: model
                .cloths
                .iter()
                .zip(&capture.springs)
                .map(|(c, s)| cloth_header(c, s, simulation))
                .collect(),
            obstacles: model
                .obstacles
                .iter()
                .map(|obstacle| obstacle_header(&obstacle.name, &obstacle.shape.drawing()))
                .collect(),
            series: series(simulation, capture.error)
                .into_iter()
                .map(|(path, label, _)| Series { path, label })
                .collect(),
        };
        (capture, header)
    }

    /// Takes the error of the time step (m) as it is estimated now, for the frames from here on.
    pub fn note_error(&mut self, error: f64) {
        if let Some(known) = &mut self.error {
            *known = error;
        }
    }

    /// The frame of the current state.
    pub fn frame(
        &mut self,
        simulation: &Simulation,
        events: Vec<Event>,
        with_checkpoint: bool,
    ) -> Frame {
        let state = simulation.state();
        let index = self.frames;
        self.frames += 1;
        let cloths = simulation.model().cloths.iter().zip(&self.springs);
        let released = simulation.model().released() > self.released;
        let contacts = simulation
            .contacts()
            .list
            .iter()
            .map(|contact| ContactMark {
                position: point(state.positions[contact.particle]),
                depth: single((-contact.distance).max(0.0)),
            });
        Frame {
            index,
            step: simulation.stats().steps,
            time: state.time,
            cloths: cloths
                .map(|(cloth, springs)| ClothFrame {
                    pins: released.then(|| pins(cloth, simulation)),
                    ..cloth_frame(cloth, springs, simulation)
                })
                .collect(),
            contacts: contacts.collect(),
            values: series(simulation, self.error)
                .into_iter()
                .map(|(_, _, value)| value)
                .collect(),
            histogram: histogram(simulation, self.strain_range),
            events,
            checkpoint: with_checkpoint.then(|| checkpoint(simulation)),
        }
    }
}

/// The springs of a cloth by family: each belongs to the cloth of its first particle.
fn springs_of(cloth: &Cloth, simulation: &Simulation) -> Vec<(usize, Vec<usize>)> {
    let batches = simulation.model().springs.iter().enumerate();
    let own = batches.map(|(batch, family)| {
        let springs = family.springs.iter().enumerate();
        let inside =
            springs.filter(|(_, spring)| cloth.particles.contains(&(spring.ends[0] as usize)));
        (batch, inside.map(|(spring, _)| spring).collect::<Vec<_>>())
    });
    own.filter(|(_, springs)| !springs.is_empty()).collect()
}

fn cloth_header(
    cloth: &Cloth,
    springs: &[(usize, Vec<usize>)],
    simulation: &Simulation,
) -> ClothHeader {
    let model = simulation.model();
    let first = cloth.particles.start;
    let local = |particle: u32| index(particle as usize - first);
    let families = springs.iter().map(|(batch, springs)| SpringFamily {
        name: model.springs[*batch].family,
        pairs: springs
            .iter()
            .map(|&spring| model.springs[*batch].springs[spring].ends.map(local))
            .collect(),
    });
    ClothHeader {
        name: cloth.name.clone(),
        particles: cloth.particles.len(),
        triangles: cloth
            .triangles
            .iter()
            .map(|triangle| triangle.map(local))
            .collect(),
        springs: families.collect(),
        pins: pins(cloth, simulation),
    }
}

/// The pinned particles of a cloth.
fn pins(cloth: &Cloth, simulation: &Simulation) -> Vec<u32> {
    let pinned = (cloth.particles.clone()).filter(|&i| simulation.model().is_pinned(i));
    pinned.map(|i| index(i - cloth.particles.start)).collect()
}

fn obstacle_header(name: &str, mesh: &TriMesh) -> ObstacleHeader {
    ObstacleHeader {
        name: name.to_owned(),
        positions: mesh.positions.iter().map(|&p| point(p)).collect(),
        triangles: mesh.triangles.clone(),
    }
}

fn cloth_frame(
    cloth: &Cloth,
    springs: &[(usize, Vec<usize>)],
    simulation: &Simulation,
) -> ClothFrame {
    let positions = &simulation.state().positions;
    let mut sums = vec![(0.0_f64, 0.0_f64); cloth.particles.len()];
    let spring_strain = springs.iter().map(|(batch, springs)| {
        let batch = &simulation.model().springs[*batch];
        let strain = springs.iter().map(|&spring| {
            let spring = &batch.springs[spring];
            let strain = spring.strain(positions);
            if batch.is_weave() {
                for end in spring.ends {
                    let sum = &mut sums[end as usize - cloth.particles.start];
                    *sum = (sum.0 + strain, sum.1 + 1.0);
                }
            }
            single(strain)
        });
        strain.collect()
    });
    let spring_strain = spring_strain.collect();
    ClothFrame {
        positions: positions[cloth.particles.clone()]
            .iter()
            .map(|&p| point(p))
            .collect(),
        strain: sums
            .iter()
            .map(|(sum, count)| single(sum / count.max(1.0)))
            .collect(),
        spring_strain,
        pins: None,
    }
}

/// Path, label with unit, and value of every series, in a fixed order.
fn series(simulation: &Simulation, error: Option<f64>) -> Vec<(String, String, f64)> {
    let (model, stats) = (simulation.model(), simulation.stats());
    let balance = simulation.balance();
    let energies = &balance.energies;
    let mut all = Vec::new();
    let mut add = |path: String, label: String, value: f64| all.push((path, label, value));
    let mut energy = |name: &str, value: f64| {
        add(
            format!("energy/{name}"),
            format!("{} (J)", name.replace('_', " ")),
            value,
        );
    };
    energy("kinetic", energies.kinetic);
    energy("gravitational", energies.gravitational);
    for (family, value) in &energies.elastic {
        energy(&format!("elastic_{family}"), *value);
    }
    energy("total", energies.total());
    for (cause, value) in &balance.dissipated {
        energy(&format!("dissipated_by_{cause}"), *value);
    }
    for (cause, value) in &balance.work {
        energy(&format!("work_by_{cause}"), *value);
    }
    energy("residual", balance.residual);
    energy("exchanged", balance.exchanged);
    add(
        "strain/max".into(),
        "largest strain (m/m)".into(),
        stats.strain,
    );
    add(
        "strain/mean".into(),
        "mean |strain| (m/m)".into(),
        mean_strain(simulation),
    );
    if !model.obstacles.is_empty() {
        add(
            "contact/depth".into(),
            "deepest penetration (m)".into(),
            stats.depth,
        );
        add(
            "contact/count".into(),
            "particles in contact".into(),
            f64::from(index(simulation.contacts().list.len())),
        );
    }
    add(
        "solver/iterations".into(),
        "solver iterations a step".into(),
        f64::from(stats.solve.iterations),
    );
    if let Some(error) = error {
        let label = "time step, estimated (m)".into();
        add("error/time_step".into(), label, error);
    }
    all
}

/// Mean of |ε| over structural and shear springs; 0 without springs.
pub fn mean_strain(simulation: &Simulation) -> f64 {
    let positions = &simulation.state().positions;
    let springs = simulation.model().weave().flat_map(|batch| &batch.springs);
    let (sum, count) = springs.fold((0.0, 0.0), |(sum, count), s| {
        (sum + s.strain(positions).abs(), count + 1.0)
    });
    sum / f64::max(count, 1.0)
}

fn histogram(simulation: &Simulation, range: f64) -> Histogram {
    let width = 2.0 * range / f64::from(CLASSES - 1);
    let mut counts = vec![0; CLASSES as usize];
    let positions = &simulation.state().positions;
    for spring in simulation.model().weave().flat_map(|batch| &batch.springs) {
        let class = ((spring.strain(positions) + range) / width)
            .round()
            .clamp(0.0, f64::from(CLASSES - 1));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped just above"
        )]
        let class = class as usize;
        counts[class] += 1;
    }
    Histogram {
        first: single(-range),
        width: single(width),
        counts,
    }
}

fn checkpoint(simulation: &Simulation) -> Checkpoint {
    let state = simulation.state();
    let cloths = simulation.model().cloths.iter().map(|cloth| {
        let particles = cloth.particles.clone().map(|i| {
            let (x, v) = (state.positions[i], state.velocities[i]);
            [x.x, x.y, x.z, v.x, v.y, v.z]
        });
        ClothCheckpoint {
            name: cloth.name.clone(),
            particles: particles.collect(),
        }
    });
    Checkpoint {
        step: simulation.stats().steps,
        time: state.time,
        cloths: cloths.collect(),
    }
}

/// Recorded positions are `f32`: 1e-7 m at a metre from the origin.
fn point(p: DVec3) -> [f32; 3] {
    p.as_vec3().to_array()
}

#[expect(clippy::cast_possible_truncation, reason = "recorded values are f32")]
fn single(x: f64) -> f32 {
    x as f32
}

/// More than 2³² particles don't fit into any memory that runs this.
#[expect(clippy::cast_possible_truncation, reason = "see above")]
fn index(i: usize) -> u32 {
    i as u32
}
