//! Taking frames from a simulation.

use super::series::series;
use super::{
    Audited, Checkpoint, ClothCheckpoint, ClothFrame, ClothHeader, ContactMark, Event, Facts,
    Frame, Header, Histogram, ObstacleHeader, Series, SpringDetail, SpringFamily,
};
use crate::collision::{Audit, Findings, Obstacle};
use crate::mesh::TriMesh;
use crate::model::Cloth;
use crate::scene::{LoadedScene, SpringDetailName, mesh_texts, model_list};
use crate::simulation::{Simulation, audit_of};
use crate::state::{Archive, Damaged};
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
    /// Measures what contact has failed to keep apart; none without contact.
    audit: Option<Audit>,
    audited: Audited,
    /// What is drawn of each obstacle where it starts.
    drawings: Vec<TriMesh>,
    /// Error of the time step (m): not a number before it is known, `None` where nobody asks.
    error: Option<f64>,
}

/// Meshes of so many bytes in all go into the recording: a sequence of 100 bodies of 20,000 triangles.
const MOST_MESHES: usize = 256 << 20;

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
        let obstacles = &model.obstacles;
        let capture = Self {
            audit: model.has_contact().then(|| audit_of(model)),
            audited: Audited::default(),
            drawings: obstacles.iter().map(|o| o.shape.drawing()).collect(),
            springs,
            strain_range: record.strain_range,
            frames: 0,
            released: model.released(),
            error: (record.error > 0.0).then_some(f64::NAN),
        };
        // The names of the series depend on what may be found, not on what is.
        let nothing = model.has_contact().then(|| Findings::none(obstacles.len()));
        let header = Header {
            scene: loaded.scene.name.clone(),
            scene_toml: loaded.text.clone(),
            meshes: meshes(loaded),
            branch: String::new(),
            start: None,
            model_list: model_list(&loaded.scene, model),
            facts: Facts::of(loaded, simulation),
            strain_range: single(record.strain_range),
            view: record
                .view
                .map(|corners| corners.map(|corner| point(corner.into()))),
            flat: !record.normals,
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
            obstacles: obstacles
                .iter()
                .zip(&capture.drawings)
                .map(|(obstacle, drawing)| obstacle_header(obstacle, drawing))
                .collect(),
            series: series(simulation, nothing.as_ref(), capture.error)
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

    /// What the audit has found in all frames; `None` without contact.
    pub fn audited(&self) -> Option<Audited> {
        self.audit.is_some().then_some(self.audited)
    }

    fn look(&mut self, simulation: &Simulation) -> Option<Findings> {
        let cloth = &simulation.state().positions[..simulation.model().cloth_particles()];
        let obstacles = &simulation.model().obstacles;
        let audit = self.audit.as_mut()?;
        Some(audit.look(obstacles, simulation.bodies(), cloth))
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
        let findings = self.look(simulation);
        if let Some(findings) = &findings {
            self.audited.add(findings);
        }
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
            obstacles: self.obstacles(simulation),
            penetrations: findings
                .iter()
                .flat_map(|findings| &findings.marks)
                .map(|&p| point(p))
                .collect(),
            values: series(simulation, findings.as_ref(), self.error)
                .into_iter()
                .map(|(_, _, value)| value)
                .collect(),
            histogram: histogram(simulation, self.strain_range),
            events,
            hash: state.hash(),
            checkpoint: with_checkpoint.then(|| checkpoint(simulation)),
        }
    }

    /// The frame of the current state with a checkpoint, from which [`Self::go_on`] goes on bit for bit.
    pub fn checkpoint_frame(&mut self, simulation: &mut Simulation, events: Vec<Event>) -> Frame {
        let mut archive = Archive::pack();
        simulation.carry(&mut archive);
        self.carry(&mut archive);
        let mut frame = self.frame(simulation, events, true);
        if let Some(checkpoint) = &mut frame.checkpoint {
            checkpoint.luggage = archive.into_bytes();
        }
        frame
    }

    /// Takes a simulation of the same scene, scheme and step, and the frames of it, to a checkpoint.
    ///
    /// # Errors
    ///
    /// When it is of another model or version. Neither can be used then.
    pub fn go_on(
        &mut self,
        simulation: &mut Simulation,
        checkpoint: &Checkpoint,
    ) -> Result<(), Damaged> {
        let mut archive = Archive::unpack(checkpoint.luggage.clone());
        simulation.go_on(checkpoint.step, &checkpoint.state(), &mut archive)?;
        self.carry(&mut archive);
        archive.finish()
    }

    /// The error of the time step so far (m), if it is known.
    pub fn known_error(&self) -> Option<f64> {
        self.error.filter(|error| error.is_finite())
    }

    fn carry(&mut self, archive: &mut Archive) {
        archive.count(&mut self.frames);
        archive.option(&mut self.error, Archive::real);
        self.audited.carry(archive);
    }
}

/// The texts of the meshes that a scene names. Those that can't be read again are left out: the scene's own file is
/// asked then.
fn meshes(loaded: &LoadedScene) -> Vec<(String, String)> {
    let texts = mesh_texts(loaded).unwrap_or_default();
    let bytes: usize = texts.values().map(String::len).sum();
    if bytes > MOST_MESHES {
        return Vec::new();
    }
    texts.into_iter().collect()
}

impl Capture {
    /// Where the vertices of obstacles that move are (m).
    fn obstacles(&self, simulation: &Simulation) -> Vec<Option<Vec<[f32; 3]>>> {
        let (obstacles, bodies) = (&simulation.model().obstacles, simulation.bodies());
        let each = obstacles.iter().zip(&self.drawings).enumerate();
        let positions = each.map(|(k, (obstacle, drawing))| {
            obstacle.motion.as_ref()?;
            let vertices = bodies.vertices(obstacles, k)[1];
            Some(if vertices.is_empty() {
                let starts = drawing.positions.iter();
                starts.map(|&start| point(bodies.now(k, start))).collect()
            } else {
                vertices.iter().map(|&p| point(p)).collect()
            })
        });
        positions.collect()
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

fn obstacle_header(obstacle: &Obstacle, mesh: &TriMesh) -> ObstacleHeader {
    ObstacleHeader {
        name: obstacle.name.clone(),
        moves: obstacle.motion.is_some(),
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
        luggage: Vec::new(),
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
