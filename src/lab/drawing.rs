//! The pictures of the swatch tests.

use super::cantilever::{Cantilever, GAMMA};
use super::elastica;
use super::finding::{Bending, Tested};
use super::membrane::{Membrane, MembraneSeries};
use crate::picture::{PictureError, Series, curves, polar};
use std::path::{Path, PathBuf};

/// Points of the elastica.
const POINTS: u32 = 200;

/// Draws the pictures of a cloth into a folder; returns their files.
///
/// # Errors
///
/// A file that can't be written.
pub fn pictures(folder: &Path, tested: &Tested) -> Result<Vec<PathBuf>, PictureError> {
    let name = file_name(&tested.cloth.name);
    let mut files = vec![folder.join(format!("stiffness-{name}.png"))];
    let title = format!(
        "Stiffness of {} by direction, warp at 0°",
        tested.cloth.name
    );
    let stretch = tested.cloth.material.stretch;
    polar(
        &files[0],
        &title,
        "N/m",
        &stiffness(&tested.membrane, stretch),
    )?;
    if let Bending::Strips(strips) = &tested.bending {
        files.push(folder.join(format!("cantilever-{name}.png")));
        let title = format!("{} under its own weight from a clamp", tested.cloth.name);
        let series: Vec<Series> = cantilever(strips);
        curves(&files[1], &title, &series)?;
    }
    Ok(files)
}

/// A cloth's name as part of a file's.
fn file_name(cloth: &str) -> String {
    let plain = |c: char| {
        if c.is_alphanumeric() || "-_.".contains(c) {
            c
        } else {
            '-'
        }
    };
    cloth.chars().map(plain).collect()
}

fn stiffness(series: &MembraneSeries, stretch: Option<f64>) -> Vec<Series> {
    let mut lines = Vec::new();
    // Swatches that agree are one line.
    if series.order.is_some() {
        for (cells, membrane) in &series.swatches {
            let cells = cells.map_or_else(String::new, |n| format!(", {n} × {n} cells"));
            lines.push(around(format!("E{cells}"), membrane, |moduli| moduli.young));
        }
    }
    let limit = if series.order.is_some() {
        ", limit"
    } else {
        ""
    };
    lines.push(around(format!("E{limit}"), &series.limit, |moduli| {
        moduli.young
    }));
    lines.push(around(format!("G{limit}"), &series.limit, |moduli| {
        moduli.shear
    }));
    lines.extend(stretch.map(|stretch| {
        Series {
            name: "E of the material".to_owned(),
            points: (0..=360)
                .map(|degrees| [f64::from(degrees), stretch])
                .collect(),
            reference: true,
        }
    }));
    lines
}

fn around(
    name: String,
    membrane: &Membrane,
    of: impl Fn(super::elasticity::Moduli) -> f64,
) -> Series {
    let at = |degrees: u32| {
        let angle = f64::from(degrees);
        [angle, of(membrane.elasticity.moduli(angle.to_radians()))]
    };
    Series {
        name,
        points: (0..=120).map(|k| at(3 * k)).collect(),
        reference: false,
    }
}

fn cantilever(strips: &[Cantilever]) -> Vec<Series> {
    let mut lines = Vec::new();
    // Strips that would be drawn over others are left out.
    let one = matches!(strips, [warp, weft] if weft.agrees_with(warp));
    for of_cut in if one { &strips[..1] } else { strips } {
        lines.extend(of_cut.strips.iter().map(|strip| Series {
            name: if one {
                format!("{} cells", strip.cells)
            } else {
                format!("{}, {} cells", of_cut.cut.name(), strip.cells)
            },
            points: strip.line.clone(),
            reference: false,
        }));
    }
    lines.extend(strips.first().map(|first| {
        Series {
            name: format!("heavy elastica, Γ = {GAMMA}"),
            points: elastica::curve(GAMMA, POINTS)
                .iter()
                .map(|point| point.map(|x| x * first.length))
                .collect(),
            reference: true,
        }
    }));
    lines
}
