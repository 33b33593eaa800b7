//! Which parts of the model the scene needs.

use super::{failure, own_setting};
use crate::cli::args::StudyArgs;
use crate::cli::{Failure, folder};
use crate::study::ablate::{ROUNDS, ablate, table, words};
use crate::study::{Subject, today};
use std::path::Path;

pub(super) fn run(subject: &Subject<'_>, args: &StudyArgs, out: &Path) -> Result<String, Failure> {
    let setting = own_setting(subject)?;
    let threshold = args.tolerance.first().copied();
    let ablation = ablate(subject, setting, threshold, ROUNDS, &mut |said| {
        eprintln!("{said}");
    });
    let ablation = ablation.map_err(failure)?;
    if subject.is_stopped() {
        return Err(Failure::run(
            "stopped: what a scene needs isn't known before every part was taken out; nothing is kept",
        ));
    }
    let text = words::markdown(&ablation);
    folder::write(out, "ablate.csv", &table::csv(&ablation, &today()))?;
    folder::write(out, "ablate.md", &text)?;
    Ok(format!(
        "{text}\n{}: ablate.csv and ablate.md\n",
        out.display()
    ))
}
