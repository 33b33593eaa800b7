//! The error of the mesh.

use super::{failure, own_setting};
use crate::cli::args::StudyArgs;
use crate::cli::{Failure, folder};
use crate::study::Subject;
use crate::study::mesh::{mesh_study, table};
use std::path::Path;

pub(super) fn run(subject: &Subject<'_>, args: &StudyArgs, out: &Path) -> Result<String, Failure> {
    let setting = own_setting(subject)?;
    let study = mesh_study(subject, setting, &args.cells, args.patience, &mut |said| {
        eprintln!("{said}");
    });
    let study = study.map_err(failure)?;
    if subject.is_stopped() {
        eprintln!(
            "stopped: {} of {} meshes are kept",
            study.resolutions.len(),
            args.cells.len()
        );
    }
    let text = table::markdown(&study);
    folder::write(out, "mesh.csv", &table::csv(&study))?;
    folder::write(out, "mesh.md", &text)?;
    Ok(format!("{text}\n{}: mesh.csv and mesh.md\n", out.display()))
}
