//! The same piece of cloth on two meshes: particles of the coarser one, found on the finer one by where
//! they are at rest.

use crate::model::{Cloth, Model};
use crate::scene::{Scene, Shape};
use crate::study::StudyError;
use glam::DVec3;

/// A particle at rest this far (m per metre) from where another is, is the same piece of cloth.
const SAME: f64 = 1e-9;

/// A point of a mesh: the weighted mean of three of its particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::study) struct Stencil {
    corners: [usize; 3],
    weights: [f64; 3],
}

impl Stencil {
    /// Where the point is.
    pub(in crate::study) fn of(&self, positions: &[DVec3]) -> DVec3 {
        let each = self.corners.iter().zip(self.weights);
        each.map(|(&corner, weight)| positions[corner] * weight)
            .sum()
    }

    fn on(corner: usize) -> Self {
        Self {
            corners: [corner; 3],
            weights: [1.0, 0.0, 0.0],
        }
    }
}

/// Every particle of `coarse`, as a point of `fine`; of the cloths that are made of cells.
///
/// Particles of the finer mesh are met where there are any; between them it is interpolated linearly,
/// in the triangle or link that contains the point, or in the nearest one beyond a rounded border.
///
/// # Errors
///
/// When the meshes of a block don't share their particles, since its triangles are its surface only.
pub(in crate::study) fn stencils(
    scene: &Scene,
    coarse: &Model,
    fine: &Model,
) -> Result<Vec<Stencil>, StudyError> {
    let mut stencils = Vec::new();
    let each = scene.cloth.iter().zip(&coarse.cloths).zip(&fine.cloths);
    for ((cloth, from), to) in each {
        if matches!(cloth.shape, Shape::Obj(_)) {
            continue;
        }
        for &point in &coarse.rest[from.particles.clone()] {
            let found = on_particle(point, to, &fine.rest).or_else(|| match cloth.shape {
                Shape::Sheet(_) => in_triangle(point, to, &fine.rest),
                Shape::Chain(_) => in_link(point, to, &fine.rest),
                Shape::Block(_) | Shape::Obj(_) => None,
            });
            stencils.push(found.ok_or_else(|| {
                StudyError::Ask(format!(
                    "--cells: the meshes of {} don't share their particles, as those of a block must; double its cells each time",
                    cloth.name
                ))
            })?);
        }
    }
    Ok(stencils)
}

fn on_particle(point: DVec3, cloth: &Cloth, rest: &[DVec3]) -> Option<Stencil> {
    let near = (SAME * (1.0 + point.length())).powi(2);
    let mut particles = cloth.particles.clone();
    particles
        .find(|&i| rest[i].distance_squared(point) <= near)
        .map(Stencil::on)
}

/// The triangle that contains the point, or misses it by the least share of its size.
fn in_triangle(point: DVec3, cloth: &Cloth, rest: &[DVec3]) -> Option<Stencil> {
    let inside = |stencil: &Stencil| stencil.weights.iter().copied().fold(f64::MAX, f64::min);
    let all = cloth.triangles.iter().map(|triangle| {
        let corners = triangle.map(|corner| corner as usize);
        Stencil {
            corners,
            weights: barycentric(point, corners.map(|corner| rest[corner])),
        }
    });
    all.max_by(|a, b| inside(a).total_cmp(&inside(b)))
}

/// Weights of a triangle's corners whose mean is the point, projected on its plane.
fn barycentric(point: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let (p, q, r) = (b - a, c - a, point - a);
    let (pp, pq, qq) = (p.dot(p), p.dot(q), q.dot(q));
    let (rp, rq) = (r.dot(p), r.dot(q));
    let area = pp * qq - pq * pq;
    let (v, w) = ((qq * rp - pq * rq) / area, (pp * rq - pq * rp) / area);
    [1.0 - v - w, v, w]
}

/// The link of a chain, along +x, that contains the point.
fn in_link(point: DVec3, cloth: &Cloth, rest: &[DVec3]) -> Option<Stencil> {
    let Cloth { particles, .. } = cloth;
    let right = particles.clone().find(|&i| rest[i].x > point.x)?;
    let left = right
        .checked_sub(1)
        .filter(|left| *left >= particles.start)?;
    let share = (point.x - rest[left].x) / (rest[right].x - rest[left].x);
    Some(Stencil {
        corners: [left, right, right],
        weights: [1.0 - share, share, 0.0],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{build, load};

    fn model(scene: &str, change: &str) -> (Scene, Model) {
        let loaded = load(scene, &[change.to_owned()]).unwrap();
        let model = build(&loaded).unwrap().model;
        (loaded.scene, model)
    }

    /// What is linear in the material is met exactly, on meshes that share particles or don't, also
    /// around a round opening.
    #[test]
    fn linear_fields_are_met() {
        let field = |x: &DVec3| DVec3::new(x.x - 2.0 * x.z, 3.0 * x.y + 0.1, x.z + 0.5 * x.x);
        for (scene, key, meshes) in [
            (
                "drape",
                "cloth.0.shape.sheet.cells",
                ["[20, 20]", "[30, 30]"],
            ),
            (
                "drape",
                "cloth.0.shape.sheet.cells",
                ["[20, 20]", "[40, 40]"],
            ),
            (
                "hanging-cloth",
                "cloth.0.shape.sheet.cells",
                ["[9, 7]", "[13, 12]"],
            ),
            ("chain", "cloth.0.shape.chain.links", ["10", "17"]),
            (
                "block",
                "cloth.0.shape.block.cells",
                ["[2, 3, 2]", "[4, 6, 4]"],
            ),
        ] {
            let [(read, coarse), (_, fine)] = meshes.map(|n| model(scene, &format!("{key}={n}")));
            let found = stencils(&read, &coarse, &fine).unwrap();
            assert_eq!(found.len(), coarse.cloth_particles());
            let placed: Vec<DVec3> = fine.rest.iter().map(field).collect();
            for (stencil, x) in found.iter().zip(&coarse.rest) {
                let off = stencil.of(&placed).distance(field(x));
                assert!(off < 1e-12, "{scene} {meshes:?} at {x}: {off}");
                let least = stencil.weights.iter().copied().fold(f64::MAX, f64::min);
                assert!(least > -0.6, "{scene} at {x}: {stencil:?} is far off");
            }
        }
    }

    #[test]
    fn a_block_is_not_interpolated() {
        let key = "cloth.0.shape.block.cells";
        let (scene, coarse) = model("block", &format!("{key}=[2, 2, 2]"));
        let (_, fine) = model("block", &format!("{key}=[3, 3, 3]"));
        let error = stencils(&scene, &coarse, &fine).unwrap_err().to_string();
        assert!(error.contains("double its cells"), "{error}");
    }
}
