//! Stretch and shear: the elasticity of a swatch, measured at its border.
//!
//! The border takes small uniform strains of either sign, the inside comes to rest, and central
//! differences of the mean stress give C, as a whole and by family of springs. A border that is held
//! makes irregular nets a little stiffer than they are; nets whose vertices are centres of symmetry
//! have the exact values of an endless net, but for springs between second neighbours, which are
//! missing at the border.

use super::elasticity::Elasticity;
use super::limit::{Limit, limit};
use super::swatch::Swatch;
use crate::scene::{Cloth, LoadedScene, SceneError, Shape};
use glam::{DMat2, DMat3, DVec3, dvec2};

/// Strain that is imposed: the error of the differences is its square.
const STRAIN: f64 = 1e-4;

/// Shear angle of the picture frame (rad).
pub const FRAME_ANGLE: f64 = 0.2;

/// Cells along a side of a sheet's swatches.
pub const CELLS: [u32; 3] = [12, 24, 48];

/// What one swatch shows in its plane.
#[derive(Clone, Debug)]
pub struct Membrane {
    /// Elasticity of the whole, made symmetric.
    pub elasticity: Elasticity,
    /// What each family of springs adds to it.
    pub families: Vec<(&'static str, Elasticity)>,
    /// How far the measured C was from symmetric, over its largest entry.
    pub asymmetry: f64,
    /// Energy (J/m²) in a picture frame, sheared by ±[`FRAME_ANGLE`].
    pub frame: [f64; 2],
    /// Whether every search for rest found it.
    pub settled: bool,
}

/// What the swatches of a cloth show, and what they tend to.
#[derive(Clone, Debug)]
pub struct MembraneSeries {
    /// Cells along a side and what was measured; a mesh is tested as it is, without a number.
    pub swatches: Vec<(Option<u32>, Membrane)>,
    /// The limit of many cells; the measured one of a mesh.
    pub limit: Membrane,
    /// Observed order of C₁₁; none where the swatches agree.
    pub order: Option<f64>,
}

/// Tests swatches of a sheet, or a mesh as it is; `None` where it isn't flat.
///
/// # Errors
///
/// A mesh that can't be read.
pub fn test(loaded: &LoadedScene, cloth: &Cloth) -> Result<Option<MembraneSeries>, SceneError> {
    if matches!(cloth.shape, Shape::Obj(_)) {
        let swatch = Swatch::cut(loaded, cloth, 0)?;
        return Ok(swatch.map(|swatch| MembraneSeries::of_mesh(measure(&swatch))));
    }
    let mut swatches = Vec::new();
    for cells in CELLS {
        let Some(swatch) = Swatch::cut(loaded, cloth, cells)? else {
            return Ok(None);
        };
        swatches.push((Some(cells), measure(&swatch)));
    }
    Ok(Some(MembraneSeries::of_sheet(swatches)))
}

/// Measures a swatch.
pub fn measure(swatch: &Swatch) -> Membrane {
    let mut settled = true;
    let mut stresses = |gradient: DMat2| {
        let deformed = swatch.deformed(gradient);
        settled &= deformed.rest.found;
        swatch.stresses(&deformed.state)
    };
    let differences = [0, 1, 2].map(|strain| {
        let [more, less] = [STRAIN, -STRAIN].map(|by| stresses(strained(strain, by)));
        let slope = |(a, b): (&(_, DVec3), &(_, DVec3))| (a.0, (a.1 - b.1) / (2.0 * STRAIN));
        more.iter().zip(&less).map(slope).collect::<Vec<_>>()
    });
    let families: Vec<(&'static str, Elasticity)> = (0..differences[0].len())
        .map(|i| {
            let [a, b, c] = [0, 1, 2].map(|strain| differences[strain][i].1);
            (differences[0][i].0, Elasticity(DMat3::from_cols(a, b, c)))
        })
        .collect();
    let whole = Elasticity(families.iter().map(|(_, part)| part.0).sum());
    let frame = [FRAME_ANGLE, -FRAME_ANGLE].map(|angle| {
        let deformed = swatch.deformed(framed(angle));
        settled &= deformed.rest.found;
        swatch.energy(&deformed.state)
    });
    Membrane {
        elasticity: whole.symmetric(),
        asymmetry: whole.asymmetry(),
        families,
        frame,
        settled,
    }
}

/// Strain number 0, 1 or 2: along axis 1, along axis 2, engineering shear.
fn strained(number: usize, by: f64) -> DMat2 {
    let half = 0.5 * by;
    match number {
        0 => DMat2::from_diagonal(dvec2(1.0 + by, 1.0)),
        1 => DMat2::from_diagonal(dvec2(1.0, 1.0 + by)),
        _ => DMat2::from_cols(dvec2(1.0, half), dvec2(half, 1.0)),
    }
}

/// The picture frame of the textile laboratory: threads keep their length, and the right angle
/// between them shrinks by the shear angle (rad).
fn framed(angle: f64) -> DMat2 {
    let (s, c) = (0.5 * angle).sin_cos();
    DMat2::from_cols(dvec2(c, s), dvec2(s, c))
}

impl Membrane {
    /// Energy of one sense of shear over the other's, 1 or more; none where neither takes any.
    pub fn frame_bias(&self) -> Option<f64> {
        let [low, high] = [
            self.frame[0].min(self.frame[1]),
            self.frame[0].max(self.frame[1]),
        ];
        let scale = self.elasticity.scale() * FRAME_ANGLE * FRAME_ANGLE;
        (low > 1e-9 * scale).then(|| high / low)
    }
}

impl MembraneSeries {
    fn of_mesh(measured: Membrane) -> Self {
        Self {
            swatches: vec![(None, measured.clone())],
            limit: measured,
            order: None,
        }
    }

    fn of_sheet(swatches: Vec<(Option<u32>, Membrane)>) -> Self {
        let all: Vec<&Membrane> = swatches.iter().map(|(_, membrane)| membrane).collect();
        let scale = all[2].elasticity.scale();
        let tends = |of: &dyn Fn(&Membrane) -> f64, scale: f64| {
            let values = [0, 1, 2].map(|i| of(all[i]));
            let finest = Limit {
                value: values[2],
                order: None,
            };
            limit(values, 1e-8 * scale).unwrap_or(finest)
        };
        let tensor = |of: &dyn Fn(&Membrane) -> Elasticity| {
            let entry = |i, j| tends(&|m: &Membrane| of(m).0.col(j)[i], scale).value;
            let column = |j| DVec3::new(entry(0, j), entry(1, j), entry(2, j));
            Elasticity(DMat3::from_cols(column(0), column(1), column(2)))
        };
        let families = (0..all[0].families.len())
            .map(|k| (all[0].families[k].0, tensor(&|m| m.families[k].1)))
            .collect();
        let energy = scale * FRAME_ANGLE * FRAME_ANGLE;
        let asymmetries = all.iter().map(|m| m.asymmetry);
        let limit = Membrane {
            elasticity: tensor(&|m| m.elasticity),
            families,
            asymmetry: asymmetries.fold(0.0, f64::max),
            frame: [0, 1].map(|sense| tends(&|m| m.frame[sense], energy).value),
            settled: all.iter().all(|m| m.settled),
        };
        let order = tends(&|m| m.elasticity.at(1, 1), scale).order;
        Self {
            limit,
            order,
            swatches,
        }
    }
}
