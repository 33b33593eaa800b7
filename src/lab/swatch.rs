//! Swatches: pieces of a cloth as it is discretised, held along their border.

use crate::energy::potential;
use crate::mesh::{edge_uses, triangle_area};
use crate::model::Model;
use crate::scene::{
    BendingName, Built, Cloth, LoadedScene, Pin, SceneError, Shape, SheetShape, Start, build,
};
use crate::simulation::{Rest, settle};
use crate::state::State;
use glam::{DMat2, DVec2, DVec3, dvec2, dvec3};

/// Force that may be left on a free particle, over the largest pull: lengths of swatches round at
/// 10⁻¹⁵ of the swatch, 10⁻¹¹ of the strains that are imposed.
const TOLERANCE: f64 = 1e-9;

/// A flat piece of cloth whose border is held.
#[derive(Debug)]
pub struct Swatch {
    model: Model,
    /// Place of each particle in its plane (m), along axis 1 and axis 2.
    places: Vec<DVec2>,
    /// Area (m²).
    area: f64,
}

/// A swatch that was deformed.
#[derive(Debug)]
pub struct Deformed {
    /// Where the particles are.
    pub state: State,
    /// How the inner ones came to rest.
    pub rest: Rest,
}

impl Swatch {
    /// `cells` by `cells` cells of a sheet of a scene, or the whole of a flat mesh; `None` where the
    /// mesh isn't flat. Axis 1 is the warp, a sheet's x; of a mesh, its x, or z if it stands across.
    ///
    /// # Errors
    ///
    /// A mesh that can't be read.
    ///
    /// # Panics
    ///
    /// For chains and blocks.
    pub fn cut(
        loaded: &LoadedScene,
        cloth: &Cloth,
        cells: u32,
    ) -> Result<Option<Self>, SceneError> {
        let shape = match &cloth.shape {
            Shape::Sheet(sheet) => Shape::Sheet(resized(sheet, [cells; 2])),
            Shape::Obj(_) => cloth.shape.clone(),
            Shape::Chain(_) | Shape::Block(_) => panic!("swatches are cut from surfaces"),
        };
        // Flat and held in its plane, a swatch has no use for hinges.
        let bending = BendingName::None;
        let cloth = Cloth {
            shape,
            bending,
            ..cloth.clone()
        };
        let Built { model, state, .. } = alone(loaded, cloth, Vec::new(), 0.0)?;
        Ok(Self::flat(model, &state.positions))
    }

    fn flat(mut model: Model, positions: &[DVec3]) -> Option<Self> {
        let triangles = model.cloths[0].triangles.clone();
        let corners = |t: &[u32; 3]| t.map(|vertex| positions[vertex as usize]);
        let normal: DVec3 = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = corners(t);
                (b - a).cross(c - a)
            })
            .sum();
        let places = in_plane(positions, normal.try_normalize()?)?;
        for (edge, uses) in edge_uses(&triangles) {
            if uses[0] + uses[1] == 1 {
                edge.iter()
                    .for_each(|&vertex| model.inverse_masses[vertex as usize] = 0.0);
            }
        }
        Some(Self {
            model,
            places,
            area: triangles.iter().map(|t| triangle_area(corners(t))).sum(),
        })
    }

    /// The same swatch with its axes turned by an angle (rad) from 1 towards 2.
    #[must_use]
    pub fn turned(mut self, angle: f64) -> Self {
        let back = DMat2::from_angle(-angle);
        self.places
            .iter_mut()
            .for_each(|place| *place = back * *place);
        self
    }

    /// The swatch with its border moved by a deformation gradient, the rest where it comes to rest
    /// in the plane.
    pub fn deformed(&self, gradient: DMat2) -> Deformed {
        let moved = |place: &DVec2| {
            let p = gradient * *place;
            // Exactly in a plane, where no force leads out of it.
            dvec3(p.x, 0.0, p.y)
        };
        let mut state = State::at_rest(self.places.iter().map(moved).collect());
        let rest = settle(&self.model, &mut state, TOLERANCE);
        Deformed { state, rest }
    }

    /// Mean stress (σ₁₁, σ₂₂, σ₁₂) of each family of springs (N/m): the virial Σ f ⊗ d / area, with
    /// the force f on the spring's first particle and its span d.
    pub fn stresses(&self, state: &State) -> Vec<(&'static str, DVec3)> {
        let stress = |springs: &[crate::force::Spring]| {
            let each = springs.iter().map(|spring| {
                let d = spring.span(&state.positions);
                let f = crate::force::force(d, spring.stiffness, spring.rest_length);
                dvec3(f.x * d.x, f.z * d.z, f.x * d.z)
            });
            each.sum::<DVec3>() / self.area
        };
        let families = self.model.springs.iter();
        families
            .map(|batch| (batch.family, stress(&batch.springs)))
            .collect()
    }

    /// Elastic energy by area (J/m²).
    pub fn energy(&self, state: &State) -> f64 {
        potential(&self.model, state) / self.area
    }
}

/// A sheet of as many cells of the same size.
pub(super) fn resized(sheet: &SheetShape, cells: [u32; 2]) -> SheetShape {
    let size = cell(sheet);
    SheetShape {
        size: [0, 1].map(|axis| size[axis] * f64::from(cells[axis])),
        cells,
        diagonals: sheet.diagonals,
        opening: None,
    }
}

/// Width of a sheet's cell along warp and weft (m).
pub(super) fn cell(sheet: &SheetShape) -> [f64; 2] {
    [0, 1].map(|axis| sheet.size[axis] / f64::from(sheet.cells[axis]))
}

/// A cloth of a scene without everything else there, unmoved, under `gravity` (m/s²) downwards.
pub(super) fn alone(
    loaded: &LoadedScene,
    cloth: Cloth,
    pins: Vec<Pin>,
    gravity: f64,
) -> Result<Built, SceneError> {
    let cloth = Cloth {
        translate: [0.0; 3],
        rotate: [0.0; 3],
        start: Start::default(),
        ..cloth
    };
    let mut alone = loaded.clone();
    alone.scene.cloth = vec![cloth];
    alone.scene.pin = pins;
    alone.scene.obstacle = Vec::new();
    alone.scene.self_collision = None;
    alone.scene.strain_limit = None;
    alone.scene.gravity = [0.0, -gravity, 0.0];
    build(&alone)
}

/// Places in the plane across `normal` around their centre (m), axis 1 along x as far as that lies
/// in the plane, or along z; `None` where they are further from the plane than rounding.
fn in_plane(positions: &[DVec3], normal: DVec3) -> Option<Vec<DVec2>> {
    let center = positions.iter().sum::<DVec3>() / positions.len() as f64;
    let spread = |x: &DVec3| (*x - center).length();
    let size = positions.iter().map(spread).fold(0.0, f64::max);
    let off = |x: &DVec3| (*x - center).dot(normal).abs();
    if positions.iter().any(|x| off(x) > 1e-6 * size) {
        return None;
    }
    let along = if normal.x.abs() < 0.9 {
        DVec3::X
    } else {
        DVec3::Z
    };
    let warp = along.reject_from_normalized(normal).try_normalize()?;
    // A sheet's normal is +y, its weft z: warp × normal.
    let weft = warp.cross(normal);
    let place = |x: &DVec3| dvec2((*x - center).dot(warp), (*x - center).dot(weft));
    Some(positions.iter().map(place).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_lies_in_its_plane_as_it_is_and_a_bent_one_in_none() {
        let mut positions = vec![
            dvec3(-1.0, 0.0, -2.0),
            dvec3(1.0, 0.0, -2.0),
            dvec3(1.0, 0.0, 2.0),
            dvec3(-1.0, 0.0, 2.0),
        ];
        let places = in_plane(&positions, DVec3::Y).unwrap();
        for (x, place) in positions.iter().zip(&places) {
            assert_eq!([x.x, x.z], place.to_array());
        }
        positions[0].y = 0.1;
        assert_eq!(in_plane(&positions, DVec3::Y), None);
    }
}
