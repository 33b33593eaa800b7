//! `muslin mannequin`: the mannequin's mesh, from its description.

use super::Failure;
use crate::mesh;
use anyhow::Context as _;
use std::path::Path;

pub(super) fn run(out: &Path) -> Result<(), Failure> {
    let mesh = mesh::mannequin();
    let about = "An adult mannequin, 1.75 m, metres, y up, facing +z, closed.\nWritten by `muslin mannequin`.";
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
