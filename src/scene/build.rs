//! From a scene to a model and its first state.

use super::body::read_obstacle;
use super::fault::{Fault, SceneError};
use super::load::LoadedScene;
use super::parts::Parts;
use super::read_mesh::ReadMesh;
use super::room;
use super::schema::{self, BlockShape, ChainShape, Shape, SheetShape};
use super::spring_constant::capped_rigidity;
use crate::mesh::{self, Lattice, Sheet};
use crate::model::Model;
use crate::state::State;

/// A scene that is ready to run.
#[derive(Debug)]
pub struct Built {
    /// What is fixed.
    pub model: Model,
    /// The first state.
    pub state: State,
    /// What was repaired on the way, a line each.
    pub notes: Vec<String>,
}

/// Makes the model and the first state of a scene.
///
/// # Errors
///
/// A pin that selects nothing, or a clamp without a tangent to hold; an opening that doesn't fit; a
/// mesh that can't be read, isn't a cloth's, or, for an obstacle, isn't closed.
pub fn build(loaded: &LoadedScene) -> Result<Built, SceneError> {
    let scene = &loaded.scene;
    let mut parts = Parts::default();
    let mut notes = Vec::new();
    for (i, cloth) in scene.cloth.iter().enumerate() {
        let lattice = lattice(loaded, i, cloth, &mut notes)?;
        if let Some(borne) = capped_rigidity(cloth) {
            notes.push(format!(
                "cloth {}: bend springs of its cells stand for D = {borne:.2e} N·m at most, less than was asked; use larger cells, or bending = \"edge-spring\"",
                cloth.name
            ));
        }
        let pins = scene
            .pin
            .iter()
            .enumerate()
            .filter(|(_, pin)| pin.cloth == cloth.name);
        parts
            .add(cloth, lattice, pins)
            .map_err(|fault| loaded.error(&fault))?;
    }
    let obstacles = scene
        .obstacle
        .iter()
        .enumerate()
        .map(|(i, obstacle)| read_obstacle(loaded, i, obstacle, &mut notes))
        .collect::<Result<_, _>>()?;
    let (model, state) = parts.model(scene, obstacles);
    room::check(scene, &model, &mut notes).map_err(|fault| loaded.error(&fault))?;
    Ok(Built {
        model,
        state,
        notes,
    })
}

/// The shape of cloth number `i` at rest.
fn lattice(
    loaded: &LoadedScene,
    i: usize,
    cloth: &schema::Cloth,
    notes: &mut Vec<String>,
) -> Result<Lattice, SceneError> {
    match &cloth.shape {
        Shape::Chain(ChainShape { length, links }) => Ok(mesh::chain(*length, *links)),
        Shape::Block(BlockShape { size, cells }) => Ok(mesh::block(*size, *cells)),
        Shape::Sheet(shape) => sheet(shape).map_err(|cause| {
            let key = format!("cloth.{i}.shape.sheet.opening");
            loaded.error(&Fault::new(key, cause.to_string()))
        }),
        Shape::Obj(shape) => {
            let read = ReadMesh::new(loaded, &format!("cloth.{i}.shape"), shape)?;
            obj_lattice(read, notes)
        }
    }
}

fn sheet(shape: &SheetShape) -> Result<Lattice, mesh::OpeningTooLarge> {
    let SheetShape {
        size,
        cells,
        diagonals,
        opening,
    } = shape.clone();
    let sheet = Sheet {
        size,
        cells,
        diagonals,
        opening,
    };
    sheet.lattice()
}

/// A mesh as cloth: any that has two sides.
fn obj_lattice(mut read: ReadMesh, notes: &mut Vec<String>) -> Result<Lattice, SceneError> {
    if let Some(edge) = mesh::non_manifold_edge(&read.mesh) {
        return Err(read.error(format!("can't be cloth: {edge}")));
    }
    match mesh::orient_consistently(&mut read.mesh) {
        Ok(turned) => read.repairs.turned_triangles = turned,
        Err(fault) => return Err(read.error(format!("can't be cloth: {fault}"))),
    }
    notes.extend(read.note());
    Ok(mesh::cloth(read.mesh))
}
