//! A study of meshes as a CSV table, and in words.

use super::{MeshStudy, STEP_SHARE, Verdict};
use crate::study::{Distance, digits, when};
use std::fmt::Write as _;

/// The columns of the table.
pub const HEADER: &str = "cells,particles,seconds_per_second,rms_to_next_m,largest_to_next_m,rms_to_limit_m,largest_to_limit_m,order,own_step_rms_m,own_step_largest_m,step_left_rms_m,converged";

/// A row a resolution; numbers round-trip, and what is not known is empty.
///
/// `seconds_per_second` and `own_step` are of the scene's own setting; `step_left` is what is left of
/// the step's error in the converged runs that the meshes are compared by.
pub fn csv(study: &MeshStudy) -> String {
    let mut text = format!("{HEADER}\n");
    let number = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:?}"));
    let both = |d: Option<Distance>| {
        format!(
            "{},{}",
            number(d.map(|d| d.rms)),
            number(d.map(|d| d.largest))
        )
    };
    for row in &study.resolutions {
        // Writing to a string can't fail.
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{:?},{} at {}",
            row.cells,
            row.particles,
            number(row.own.map(|(seconds, _)| seconds)),
            both(row.to_next),
            both(row.to_limit),
            number(row.order),
            both(row.own.map(|(_, error)| error)),
            row.step_left.rms,
            row.converged.integrator.name(),
            row.converged.dial()
        );
    }
    text
}

/// A section in Markdown.
pub fn markdown(study: &MeshStudy) -> String {
    let mut lines = vec![format!(
        "## Error of the mesh\n\nThe scene on ever finer meshes, each with steps so short that only the mesh makes a difference, compared at the particles of the coarsest mesh {}. Beside it what {} at {} costs and errs on each mesh: that is the error of the step.\n",
        when(study.times, study.duration),
        study.setting.series(),
        study.setting.dial()
    )];
    lines.push("| cells | particles | s per simulated s | to the next mesh (mm RMS) | largest | error of the mesh (mm RMS) | largest | order | error of the step (mm RMS) |\n|---|---|---|---|---|---|---|---|---|".to_owned());
    for row in &study.resolutions {
        let number = |x: Option<f64>| x.map_or_else(|| "–".to_owned(), digits);
        let both = |d: Option<Distance>| {
            let rms = number(d.map(|d| 1000.0 * d.rms));
            format!("{rms} | {}", number(d.map(|d| 1000.0 * d.largest)))
        };
        lines.push(format!(
            "| {} | {} | {} | {} | {} | {} | {} |",
            row.cells,
            row.particles,
            row.own
                .map_or_else(|| "–".to_owned(), |(seconds, _)| digits(seconds)),
            both(row.to_next),
            both(row.to_limit),
            row.order
                .map_or_else(|| "–".to_owned(), |order| format!("{order:.2}")),
            number(row.own.map(|(_, error)| 1000.0 * error.rms)),
        ));
    }
    lines.push(format!("\n{}", conclusion(study)));
    lines.push(format!("\n{}", remainder(study)));
    if !study.fixed.is_empty() {
        lines.push(format!(
            "\n{} can't be refined, being meshes from files, and don't count.",
            study.fixed.join(", ")
        ));
    }
    lines.push(String::new());
    lines.join("\n")
}

/// What the meshes say.
fn conclusion(study: &MeshStudy) -> String {
    let millimetres = |x: f64| format!("{} mm", digits(1000.0 * x));
    match (study.verdict, study.resolutions.as_slice()) {
        (Verdict::Converges(order), [.., finest]) => format!(
            "The meshes tend to a limit with order {order:.2}; the error of a mesh is its distance to that limit, {} on the finest.",
            finest
                .to_limit
                .map_or_else(String::new, |limit| millimetres(limit.rms))
        ),
        (Verdict::Below(floor), _) => format!(
            "The last two meshes agree to {} RMS, which is as far as this study can tell: no error of the mesh is left to be seen.",
            millimetres(floor)
        ),
        (Verdict::NoLimit, _) => "The differences between meshes don't shrink: there is no limit to extrapolate to, and the error of a mesh is at least the distance to the next. Cloth that buckles folds at the size of its cells until these are finer than its folds; and spring constants that are given as such are another cloth on each mesh.".to_owned(),
        _ => "Two meshes have a difference, but no order and no limit: give three.".to_owned(),
    }
}

/// What is left of the step.
fn remainder(study: &MeshStudy) -> String {
    let left = digits(1000.0 * study.step_left());
    if study.is_of_the_mesh() {
        format!(
            "Of the step, at most {left} mm RMS is left in these differences, less than {:.0} % of any of them.",
            100.0 * STEP_SHARE
        )
    } else {
        format!(
            "Of the step, up to {left} mm RMS is left in these differences, more than {:.0} % of the smallest: they are of mesh and step together. A shorter --duration, or more time, makes it less.",
            100.0 * STEP_SHARE
        )
    }
}
