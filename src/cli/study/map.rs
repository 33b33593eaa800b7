//! Where each scheme is stable.

use super::failure;
use super::sweep::bar;
use crate::cli::args::StudyArgs;
use crate::cli::{Failure, folder};
use crate::study::Subject;
use crate::study::stability::{self, Axis, Dials};
use std::path::Path;

pub(super) fn run(
    subject: &Subject<'_>,
    args: &StudyArgs,
    axis: Axis,
    out: &Path,
) -> Result<String, Failure> {
    let dials = Dials {
        axis,
        schemes: args.schemes.clone(),
        steps: args.steps.clone(),
        horizon: subject.duration,
        ..Dials::default()
    };
    let bar = bar(0);
    let map = stability::map(subject, &dials, &|finished, of| {
        bar.set_length(of as u64);
        bar.set_position(finished as u64);
    });
    bar.finish_and_clear();
    let map = map.map_err(failure)?;
    if map.rows.is_empty() {
        return Err(Failure::run("stopped before the first row was done"));
    }
    if subject.is_stopped() {
        eprintln!("stopped: {} rows are kept", map.rows.len());
    }
    let name = format!("stability-{}", axis.name());
    folder::write(out, &format!("{name}.csv"), &stability::csv(&map))?;
    let picture = out.join(format!("{name}.png"));
    stability::picture(&picture, &subject.loaded.scene.name, &map).map_err(Failure::run)?;
    Ok(format!("{}: {name}.csv and {name}.png\n", out.display()))
}
