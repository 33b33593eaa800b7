//! A material in a file of its own, as a scene of one sheet.

use super::fault::{Fault, SceneError};
use super::load::{LoadedScene, parse, read_file, with_changes};
use super::schema::{
    BendingName, Cloth, Damping, Material, Record, Scene, Shape, SheetShape, Solver, SpringKind,
    Start, structural_and_shear,
};
use super::validate::{self, positive};
use crate::mesh::Diagonals;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Cells along a side of the sheet.
const CELLS: u32 = 50;

/// What a material's file may say.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialFile {
    /// As in `[cloth.material]`.
    material: Material,
    /// As of a cloth.
    #[serde(default = "structural_and_shear")]
    springs: Vec<SpringKind>,
    /// As of a cloth.
    #[serde(default)]
    bending: BendingName,
    /// As of a sheet.
    #[serde(default)]
    diagonals: Diagonals,
    /// Width of a cell (m).
    #[serde(default = "centimetre")]
    cell: f64,
}

fn centimetre() -> f64 {
    0.01
}

/// Reads a TOML file with a table `[material]` and, if it likes, `springs`, `bending`, `diagonals`
/// and `cell` (m, 0.01 by default), and sets `changes` (`key=value`) in it: a scene of one sheet of
/// that material, named after the file.
///
/// # Errors
///
/// An unreadable file, a fault in the TOML or in what it asks for.
pub fn load_material(path: &Path, changes: &[String]) -> Result<LoadedScene, SceneError> {
    let mut file = path.display().to_string();
    let mut text = read_file(path, "")?;
    let mut read: MaterialFile = parse(&text, &file)?;
    let changed = !changes.is_empty();
    if changed {
        text = with_changes(&text, &file, changes)?;
        file = format!("{file} with {}", changes.join(" "));
        read = parse(&text, &file).map_err(|fault| SceneError {
            line: None,
            ..fault
        })?;
    }
    let cell = read.cell;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let loaded = LoadedScene {
        scene: scene(&stem, read),
        text,
        file,
        path: Some(path.to_path_buf()),
        changed,
        meshes: BTreeMap::new(),
    };
    match positive("cell", cell).and_then(|()| validate::check(&loaded.scene)) {
        Ok(()) => Ok(loaded),
        Err(fault) => Err(loaded.error(&in_file(&fault))),
    }
}

/// A fault of the scene as one of the file.
fn in_file(Fault { path, cause }: &Fault) -> Fault {
    let path = path.strip_prefix("cloth.0.").unwrap_or(path);
    Fault::new(path, cause.clone())
}

fn scene(name: &str, read: MaterialFile) -> Scene {
    let MaterialFile {
        material,
        springs,
        bending,
        diagonals,
        cell,
    } = read;
    let shape = Shape::Sheet(SheetShape {
        size: [f64::from(CELLS) * cell; 2],
        cells: [CELLS; 2],
        diagonals,
        opening: None,
    });
    let cloth = Cloth {
        name: name.to_owned(),
        shape,
        translate: [0.0; 3],
        rotate: [0.0; 3],
        start: Start::default(),
        springs,
        bending,
        material,
        damping: Damping::default(),
    };
    Scene {
        name: name.to_owned(),
        duration: 1.0,
        gravity: [0.0; 3],
        cloth: vec![cloth],
        pin: Vec::new(),
        obstacle: Vec::new(),
        self_collision: None,
        strain_limit: None,
        solver: Solver::default(),
        record: Record::default(),
    }
}
