//! The dial of contact as a CSV table and in words.

use super::{Contact, Measured, Row};
use crate::mesh::GridError;
use crate::scene::Scene;
use crate::study::ablate::table::quoted;
use crate::study::table::number;
use crate::study::{Subject, digits, when};
use std::fmt::Write as _;

/// The columns of `contact.csv`.
pub const HEADER: &str = "distance,cell_m,ccd,depth_m,inside,crossings,missed,rms_m,largest_m,detect_s,respond_s,impacts_s,contact_share,seconds_per_second,grid_largest_m,grid_rms_m,dominated,outcome,reason,setting,duration_s,times,threads,halved_rms_m,halved_largest_m";

/// A row a setting; numbers round-trip, and what doesn't apply or isn't known is empty. Times of stages
/// are of a step; the grid's error is that of the worst obstacle. What all rows share stands in each.
pub fn csv(subject: &Subject<'_>, study: &Contact) -> String {
    let setting = &study.setting;
    let shared = format!(
        "{},{:?},{},{},{:?},{:?}",
        quoted(&format!("{} at {}", setting.series(), setting.dial())),
        subject.duration,
        subject.times,
        subject.threads,
        study.halved.rms,
        study.halved.largest
    );
    let mut text = format!("{HEADER}\n");
    for row in &study.rows {
        let (outcome, reason) = match &row.came {
            Ok(_) => ("completed", String::new()),
            Err(failed) => (failed.name, quoted(&failed.why)),
        };
        // Writing to a string can't fail.
        let _ = writeln!(
            text,
            "{},{},{},{},{},{outcome},{reason},{shared}",
            if row.dial.cell.is_some() {
                "grid"
            } else {
                "exact"
            },
            number(row.dial.cell),
            row.dial.ccd,
            row.came
                .as_ref()
                .map_or_else(|_| ",".repeat(12), |came| figures(came, setting.dt)),
            study.is_dominated(row),
        );
    }
    text
}

/// From `depth_m` to `grid_rms_m`.
fn figures(measured: &Measured, dt: f64) -> String {
    let Measured {
        audited,
        missed,
        distance,
        time,
        ..
    } = measured;
    let [detect, respond, impacts] = time.stages;
    let grid = worst(measured);
    format!(
        "{:?},{},{},{missed},{:?},{:?},{detect:?},{respond:?},{impacts:?},{:?},{:?},{},{}",
        audited.depth,
        audited.inside,
        audited.crossings,
        distance.rms,
        distance.largest,
        time.share(dt),
        time.seconds_per_second,
        number(grid.map(|error| error.largest)),
        number(grid.map(|error| error.root_mean_square))
    )
}

/// The error of the grid that is farthest off.
fn worst(measured: &Measured) -> Option<GridError> {
    let errors = measured.grids.iter().map(|(_, error)| *error);
    errors.max_by(|a, b| a.largest.total_cmp(&b.largest))
}

/// The study in words.
pub fn markdown(subject: &Subject<'_>, study: &Contact) -> String {
    let mut text = format!("# {}: the dial of contact\n\n", subject.loaded.scene.name);
    about(&mut text, subject, study);
    let _ = writeln!(
        text,
        "| distances | CCD | deepest (mm) | inside | crossings | missed | RMS (mm) | largest (mm) | detect, respond, impacts (ms a step) | of the step | ms per 1/60 s | |\n|---|---|---|---|---|---|---|---|---|---|---|---|"
    );
    for row in &study.rows {
        line(&mut text, study, row);
    }
    grids(&mut text, study);
    text
}

fn about(text: &mut String, subject: &Subject<'_>, study: &Contact) {
    let scene = &subject.loaded.scene;
    let _ = writeln!(
        text,
        "Each setting runs {} s by {} at {} on {} thread(s), and is audited with exact geometry every 1/60 s; times are the least of repeated runs, which differed by {:.0} % under the first setting. {}\n",
        digits(subject.duration),
        study.setting.series(),
        study.setting.dial(),
        subject.threads,
        100.0 * study.noise,
        obstacles(scene)
    );
    let _ = writeln!(
        text,
        "RMS and largest are distances of the particles from the run with exact distances and CCD, {}. Halving the step of that run moves them by {} mm RMS, {} mm at most: smaller distances are lost in the error of the step, and where folds decide the least detail makes larger ones. A dominated setting is slower than another and in nothing better.\n",
        when(subject.times, subject.duration),
        digits(1000.0 * study.halved.rms),
        digits(1000.0 * study.halved.largest)
    );
}

/// Which obstacles take part, and how.
fn obstacles(scene: &Scene) -> String {
    let (mut on_grid, mut others) = (Vec::new(), Vec::new());
    for obstacle in &scene.obstacle {
        let list = if obstacle.takes_grid() {
            &mut on_grid
        } else {
            &mut others
        };
        list.push(obstacle.name.as_str());
    }
    let mut said = format!(
        "Continuous detection (CCD) is turned of every obstacle, the grid of {}",
        on_grid.join(", ")
    );
    if on_grid.is_empty() {
        said = "No obstacle is an OBJ that keeps its shape, as a grid needs: only continuous detection (CCD) is turned".to_owned();
    } else if !others.is_empty() {
        let _ = write!(
            said,
            ", not of {}: no OBJ that keeps its shape",
            others.join(", ")
        );
    }
    said + "."
}

fn line(text: &mut String, study: &Contact, row: &Row) {
    let (distances, ccd) = (row.dial.distances(), row.dial.continuous());
    let measured = match &row.came {
        Ok(measured) => measured,
        Err(failed) => {
            let dashes = "– | ".repeat(9);
            let _ = writeln!(
                text,
                "| {distances} | {ccd} | {dashes}{}: {} |",
                failed.name, failed.why
            );
            return;
        }
    };
    let (audited, time) = (&measured.audited, &measured.time);
    let verdict = if study.is_dominated(row) {
        "dominated"
    } else {
        "**front**"
    };
    let _ = writeln!(
        text,
        "| {distances} | {ccd} | {} | {} | {} | {} | {} | {} | {} | {:.0} % | {} | {verdict} |",
        digits(1000.0 * audited.depth),
        audited.inside,
        audited.crossings,
        measured.missed,
        digits(1000.0 * measured.distance.rms),
        digits(1000.0 * measured.distance.largest),
        time.stages.map(|stage| digits(1000.0 * stage)).join(", "),
        100.0 * time.share(study.setting.dt),
        digits(time.seconds_per_second * 1000.0 / 60.0),
    );
}

/// How far the grids' own distances are off.
fn grids(text: &mut String, study: &Contact) {
    text.push('\n');
    let with_ccd = study.rows.iter().filter(|row| row.dial.ccd);
    let all = with_ccd.filter_map(|row| Some((row.dial, row.came.as_ref().ok()?)));
    for (dial, measured) in all {
        for (name, error) in &measured.grids {
            let _ = writeln!(
                text,
                "- the {} of {name} is off by {} mm at most, {} mm RMS",
                dial.distances(),
                digits(1000.0 * error.largest),
                digits(1000.0 * error.root_mean_square)
            );
        }
    }
}
