//! `muslin mannequin`: the mannequin's mesh, or its poncho's, from its description.

use super::Failure;
use crate::mesh;
use anyhow::Context as _;
use std::path::Path;

const MANNEQUIN: &str =
    "An adult mannequin, 1.75 m, metres, y up, facing +z, closed.\nWritten by `muslin mannequin`.";
const PONCHO: &str =
    "A poncho on the mannequin, metres, y up.\nWritten by `muslin mannequin --poncho`.";

pub(super) fn run(out: &Path, poncho: bool) -> Result<(), Failure> {
    let (mesh, about) = if poncho {
        (mesh::poncho(), PONCHO)
    } else {
        (mesh::mannequin(), MANNEQUIN)
    };
    std::fs::write(out, mesh::write_obj(&mesh, about))
        .with_context(|| format!("{} can't be written; choose another path", out.display()))
        .map_err(Failure::Input)?;
    println!(
        "{}: {} vertices, {} triangles",
        out.display(),
        mesh.positions.len(),
        mesh.triangles.len()
    );
    Ok(())
}
