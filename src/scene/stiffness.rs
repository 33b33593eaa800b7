//! Spring constants from a material, so that a finer mesh is the same cloth.
//!
//! A spring that stands for an area A of cloth of in-plane modulus E₂ (N/m) has k = c E₂ A / ℓ²
//! (the form of Van Gelder 1998), with the factor c of each topology chosen so that the net is an
//! isotropic plate: with C11 = `k_s` + `k_d` and C12 = C66 = `k_d` for a square grid with both diagonals,
//! plane stress with ν = 1/3 (the only ratio that central springs can have) asks for
//! `k_s` = ¾ E₂ and `k_d` = ⅜ E₂. A single diagonal in a cell takes the place of two.
//!
//! Second-neighbour springs also carry load along the weave, and the more the finer the mesh. What
//! they carry is taken from the springs between neighbours, so that the sum stays the material's.

use crate::mesh::Diagonals;
use glam::DVec3;

/// k of a spring along the weave (N/m). `area` (m²): the cells on both sides of it. `rigidity`
/// (N·m): the plate rigidity D of the bend springs beside it, 0 without.
///
/// With diagonals k = ¾ E₂ on a square grid; without, where nothing else carries load, k = E₂; less
/// 2 `k_b` for each of the `bends` bend springs along it, two inside: their energy in a strain ε is
/// ½ `k_b` (2h ε)², half of it for each of the two pieces that they span.
pub(super) fn structural(
    stretch: f64,
    rigidity: f64,
    bends: u32,
    area: f64,
    length: f64,
    diagonals: Diagonals,
) -> f64 {
    let square = length * length;
    area * (factor(diagonals) * stretch
        - 16.0 * f64::from(bends) * bearable(rigidity, stretch, length, diagonals) / square)
        / square
}

/// c of the springs along the weave.
fn factor(diagonals: Diagonals) -> f64 {
    if diagonals == Diagonals::None {
        0.5
    } else {
        0.375
    }
}

/// Plate rigidity (N·m) whose bend springs take at most half of what the springs between neighbours
/// carry: on meshes finer than ℓ² = 64 D / (c E₂), 2.4 mm for the poncho of `drape`, the cloth bends
/// more easily than asked.
pub(super) fn bearable(rigidity: f64, stretch: f64, length: f64, diagonals: Diagonals) -> f64 {
    rigidity.min(factor(diagonals) * stretch * length * length / 64.0)
}

/// k of a spring along a diagonal (N/m). `area` (m²): its cell.
///
/// On a square grid ⅜ E₂ with two diagonals a cell, ¾ E₂ with one.
pub(super) fn shear(stretch: f64, area: f64, length: f64, diagonals: Diagonals) -> f64 {
    let factor = if diagonals == Diagonals::Both {
        0.75
    } else {
        1.5
    };
    factor * stretch * area / (length * length)
}

/// k of a spring of length ℓ = 2h between second neighbours of a sheet (N/m): 16 D / h² on a square
/// grid. `area` (m²): the cells beside both pieces that it spans.
///
/// Turning by an angle θ a cell shortens the spring by δ = 2h (1 − cos θ/2) ≈ h θ²/4 and stores
/// ½ k δ² = k h² θ⁴/32, where a plate stores ½ D θ² for a cell. They are equal at θ = 1 for this k.
/// Below, the spring is softer than the plate: second-neighbour springs hardly resist a gentle curve.
pub(super) fn bend(
    rigidity: f64,
    stretch: f64,
    area: f64,
    length: f64,
    diagonals: Diagonals,
) -> f64 {
    64.0 * bearable(rigidity, stretch, 0.5 * length, diagonals) * area / length.powi(4)
}

/// k of a spring on a mesh's edge (N/m): E₂ A/ℓ², `area` (m²) that of the one or two triangles
/// beside it.
///
/// On equilateral triangles this is the isotropic plate of ν = 1/3; on others an exact match is
/// impossible, `muslin lab` measures what it comes to.
///
/// Source: Van Gelder 1998.
pub(super) fn edge(stretch: f64, area: f64, length: f64) -> f64 {
    stretch * area / (length * length)
}

/// k of a spring of a block (N/m): c E V/ℓ² with Young's modulus E (Pa) and the `volume` V (m³) of
/// the cells around it.
///
/// On cubes of side a, springs along the edges (`k_s`), the faces' diagonals (`k_f`) and the inner
/// diagonals (`k_b`) give C11 = (`k_s` + 2 `k_f` + 4/3 `k_b`)/a and C12 = C44 = (`k_f` + 4/3 `k_b`)/a.
/// Isotropic, with the only Poisson's ratio that central springs can have, ν = 1/4, is C11 = 1.2 E,
/// C44 = 0.4 E. Of the choices that are left, `k_b` = `k_f`/2: `k_s` = 0.56 E a, `k_f` = 0.24 E a,
/// `k_b` = 0.12 E a. An edge has four cells around it, a face two. Without diagonals `k_s` = E a.
pub(super) fn block(young: f64, volume: f64, span: DVec3, has_diagonals: bool) -> f64 {
    let axes = span.abs().cmpgt(DVec3::splat(1e-9 * span.length()));
    let factor = match axes.bitmask().count_ones() {
        1 if has_diagonals => 0.14,
        1 => 0.25,
        2 => 0.24,
        _ => 0.36,
    };
    factor * young * volume / span.length_squared()
}

/// k of a chain's link (N/m): (E A − 32 n B / ℓ²) / ℓ, with `stretch` = E A (N), the bending stiffness
/// B = E I (N·m²) of its bend springs, 0 without, and the number n of `bends` along it.
pub(super) fn link(stretch: f64, rigidity: f64, bends: u32, length: f64) -> f64 {
    let borne = 32.0 * f64::from(bends) * bearable_chain(rigidity, stretch, length);
    (stretch - borne / (length * length)) / length
}

/// The bend springs of a chain, like those of a sheet, take at most half of its load.
fn bearable_chain(rigidity: f64, stretch: f64, length: f64) -> f64 {
    rigidity.min(stretch * length * length / 128.0)
}

/// k of a spring of length ℓ = 2h between second neighbours of a chain (N/m): 16 B / h³.
pub(super) fn bend_chain(rigidity: f64, stretch: f64, length: f64) -> f64 {
    128.0 * bearable_chain(rigidity, stretch, 0.5 * length) / length.powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Segment, Sheet, block as lattice};

    /// Energy density of a uniformly strained sheet against ½ C₁₁ ε² with C₁₁ = 9/8 E₂, the plate of
    /// ν = 1/3, whatever the mesh and the bend springs, up to its border.
    #[test]
    fn a_finer_mesh_is_the_same_cloth() {
        let (stretch, rigidity, strain) = (100.0, 5e-5, 1e-3);
        for cells in [1, 2, 3, 20, 80] {
            for diagonals in [Diagonals::Alternating, Diagonals::Both] {
                let sheet = Sheet {
                    size: [1.0, 1.0],
                    cells: [cells, cells],
                    diagonals,
                    opening: None,
                };
                let lattice = sheet.lattice().unwrap();
                let mut energy = 0.0;
                let mut add = |segment: &Segment, k: &dyn Fn(f64) -> f64| {
                    let [a, b] = segment.ends.map(|end| lattice.mesh.positions[end as usize]);
                    let stretched = DVec3::new((b - a).x * (1.0 + strain), 0.0, (b - a).z);
                    let longer = stretched.length() - (b - a).length();
                    energy += 0.5 * k((b - a).length()) * longer * longer;
                };
                for (s, bends) in lattice.structural.iter().zip(lattice.bends_along()) {
                    add(s, &|l| {
                        structural(stretch, rigidity, bends, s.area, l, diagonals)
                    });
                }
                lattice
                    .shear
                    .iter()
                    .for_each(|s| add(s, &|l| shear(stretch, s.area, l, diagonals)));
                lattice
                    .bend
                    .iter()
                    .for_each(|s| add(s, &|l| bend(rigidity, stretch, s.area, l, diagonals)));
                let exact = 0.5 * 1.125 * stretch * strain * strain;
                assert!(
                    (energy / exact - 1.0).abs() < 2.0 * strain,
                    "{cells} cells, {diagonals:?}: {}",
                    energy / exact
                );
            }
        }
    }

    /// A block of cubes, in uniform strain, against the isotropic solid of ν = 1/4:
    /// ½ C11 ε² stretched, ½ C44 γ² sheared, and E ε²/2 without diagonals.
    #[test]
    fn a_block_is_an_isotropic_solid() {
        let (young, strain) = (2e4, 1e-4);
        let block_of = |cells: u32| lattice([0.3, 0.2, 0.1], [3 * cells, 2 * cells, cells]);
        for cells in [1, 3] {
            let lattice = block_of(cells);
            let energy_density = |deform: &dyn Fn(DVec3) -> DVec3, diagonals: bool| {
                let energy_of = |segment: &Segment| {
                    let [a, b] = segment.ends.map(|end| lattice.mesh.positions[end as usize]);
                    let longer = (deform(b) - deform(a)).length() - (b - a).length();
                    0.5 * block(young, segment.area, b - a, diagonals) * longer * longer
                };
                let shear: &[Segment] = if diagonals { &lattice.shear } else { &[] };
                let springs = lattice.structural.iter().chain(shear);
                springs.map(energy_of).sum::<f64>() / (0.3 * 0.2 * 0.1)
            };
            let along = |x: DVec3| DVec3::new(x.x * (1.0 + strain), x.y, x.z);
            let sheared = |x: DVec3| DVec3::new(x.x + strain * x.y, x.y, x.z);
            let unit = 0.5 * young * strain * strain;
            for (name, energy, exact) in [
                ("C11", energy_density(&along, true), 1.2),
                ("C44", energy_density(&sheared, true), 0.4),
                ("E without diagonals", energy_density(&along, false), 1.0),
            ] {
                assert!(
                    (energy / unit / exact - 1.0).abs() < 1e-3,
                    "{name}: {}",
                    energy / unit
                );
            }
        }
    }
}
