//! The spring constant of each spring of a cloth: which law of [`stiffness`] applies to it.

use super::schema::{Cloth, Shape, SheetShape, SpringKind};
use super::stiffness;
use crate::mesh::{Diagonals, Segment};
use glam::DVec3;

/// Spring constant (N/m) of a spring of a cloth that spans `span` (m) at rest; `bends` bend springs run
/// along it.
pub(super) fn spring_constant(
    kind: SpringKind,
    cloth: &Cloth,
    segment: &Segment,
    span: DVec3,
    bends: u32,
) -> f64 {
    if let Some(constant) = cloth.material.spring_constant {
        return constant;
    }
    let has = |kind| cloth.springs.contains(&kind);
    let (area, length) = (segment.area, span.length());
    let stretch = cloth.material.stretch.unwrap_or(0.0);
    let rigidity = if has(SpringKind::Bend) {
        cloth.material.bend.unwrap_or(0.0)
    } else {
        0.0
    };
    match &cloth.shape {
        Shape::Chain(_) if kind == SpringKind::Bend => {
            stiffness::bend_chain(rigidity, stretch, length)
        }
        Shape::Chain(_) => stiffness::link(stretch, rigidity, bends, length),
        Shape::Block(_) => stiffness::block(stretch, area, span, has(SpringKind::Shear)),
        Shape::Obj(_) => stiffness::edge(stretch, area, length),
        Shape::Sheet(SheetShape { diagonals, .. }) => {
            // Without shear springs the weave carries the load alone, whatever the triangles look like.
            let carrying = if has(SpringKind::Shear) {
                *diagonals
            } else {
                Diagonals::None
            };
            match kind {
                SpringKind::Shear => stiffness::shear(stretch, area, length, *diagonals),
                SpringKind::Bend => stiffness::bend(rigidity, stretch, area, length, carrying),
                SpringKind::Structural | SpringKind::ZeroLength => {
                    stiffness::structural(stretch, rigidity, bends, area, length, carrying)
                }
            }
        }
    }
}

/// The plate rigidity (N·m) that the bend springs of a sheet's cells can stand for at most, where that
/// is less than what its material asks for.
pub(super) fn capped_rigidity(cloth: &Cloth) -> Option<f64> {
    let (Shape::Sheet(sheet), Some(stretch), Some(asked)) =
        (&cloth.shape, cloth.material.stretch, cloth.material.bend)
    else {
        return None;
    };
    if !cloth.springs.contains(&SpringKind::Bend) {
        return None;
    }
    let carrying = if cloth.springs.contains(&SpringKind::Shear) {
        sheet.diagonals
    } else {
        Diagonals::None
    };
    let borne = |axis: usize| {
        let cell = sheet.size[axis] / f64::from(sheet.cells[axis]);
        stiffness::bearable(asked, stretch, cell, carrying)
    };
    Some(borne(0).min(borne(1))).filter(|&borne| borne < asked)
}
