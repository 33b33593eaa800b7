//! Spring constants from a material, so that a finer mesh is the same cloth.
//!
//! A spring that stands for an area A of cloth of in-plane modulus E₂ (N/m) has k = c E₂ A / ℓ²
//! (the form of Van Gelder 1998), with the factor c of each topology chosen so that the net is an
//! isotropic plate: with C11 = k_s + k_d and C12 = C66 = k_d for a square grid with both diagonals,
//! plane stress with ν = 1/3 (the only ratio that central springs can have) asks for
//! k_s = ¾ E₂ and k_d = ⅜ E₂. A single diagonal in a cell takes the place of two.

use crate::mesh::Diagonals;

/// k of a spring along the weave (N/m). `area` (m²): the cells on both sides of it.
///
/// With diagonals k = ¾ E₂ on a square grid; without, where nothing else carries load, k = E₂.
pub fn structural(stretch: f64, area: f64, length: f64, diagonals: Diagonals) -> f64 {
    let factor = if diagonals == Diagonals::None { 0.5 } else { 0.375 };
    factor * stretch * area / (length * length)
}

/// k of a spring along a diagonal (N/m). `area` (m²): its cell.
///
/// On a square grid ⅜ E₂ with two diagonals a cell, ¾ E₂ with one.
pub fn shear(stretch: f64, area: f64, length: f64, diagonals: Diagonals) -> f64 {
    let factor = if diagonals == Diagonals::Both { 0.75 } else { 1.5 };
    factor * stretch * area / (length * length)
}

/// k of a chain's link (N/m): E A / ℓ₀, with `stretch` = E A (N).
pub fn link(stretch: f64, length: f64) -> f64 {
    stretch / length
}

/// k of a spring of length ℓ = 2h between second neighbours of a sheet (N/m): 16 D / h².
///
/// Turning by an angle θ a cell shortens the spring by δ = 2h (1 − cos θ/2) ≈ h θ²/4 and stores
/// ½ k δ² = k h² θ⁴/32, where a plate stores ½ D θ² for a cell. They are equal at θ = 1 for this k.
/// Below, the spring is softer than the plate: second-neighbour springs hardly resist a gentle curve.
pub fn bend(rigidity: f64, length: f64) -> f64 {
    64.0 * rigidity / (length * length)
}

/// The same for a chain of bending stiffness B = E I (N·m²): 16 B / h³.
pub fn bend_chain(rigidity: f64, length: f64) -> f64 {
    128.0 * rigidity / (length * length * length)
}
