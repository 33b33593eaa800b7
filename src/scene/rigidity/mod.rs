//! Hinge stiffness from a material's plate rigidity, so that any mesh of a cloth bends as that plate.
//!
//! A hinge has k = C D ℓ²/A: edge length ℓ, area A of its two triangles, plate rigidity D, the form of
//! Grinspun et al. 2003 and of Bridson, Marino and Fedkiw 2003. Their textbook factor C = 3 is 2.4 to
//! 3 times too stiff, and the right one depends on the mesh: 1.22 for alternating diagonals, 1.06 for
//! equilateral triangles, less for random ones. It is measured on the cloth's own mesh (numerical
//! homogenisation): small patches are bent by uniform moments at their rim, their vertices take the
//! heights of least energy, and the energy of each patch's core is compared with a plate's of the same
//! mean curvature.
//!
//! Left out: such a net has a Poisson's ratio between −0.2 and −0.4 in bending, so that a free strip is
//! 1 − ν² as stiff as a wide sheet; only terms that couple neighbouring hinges could change that. The
//! factor serves the geometric mean: along alternating diagonals, strips are 2 % too limp and sheets as
//! much too stiff; ±8 % on random points. And nets differ with direction: bent at 45° to its grid, a
//! wide sheet with alternating diagonals is 1.6 times as stiff as along it. Weighing each hinge by the
//! curvature along its edge too would even that out, at ±6 % between strip and sheet.

mod net;
mod patch;
mod plate;
mod spread;

use glam::DVec3;
use net::{Net, Reach};
use plate::Plate;
use spread::Spread;
use std::f64::consts::FRAC_PI_2;

/// Patches to try in turn, the last on any cloth.
///
/// Bent by moments at their rim, patches of regular nets have the net's exact rigidity whatever their
/// size, and irregular ones hardly depend on it; large cores average more.
const REACHES: [Reach; 4] = [
    Reach {
        rings: 4,
        core: 3,
        depth: 4,
    },
    Reach {
        rings: 3,
        core: 2,
        depth: 3,
    },
    Reach {
        rings: 2,
        core: 1,
        depth: 2,
    },
    Reach {
        rings: 2,
        core: 1,
        depth: 0,
    },
];

/// Most patches to measure; those of the largest size then cover 2000 vertices.
const PATCHES: usize = 64;

/// With fewer patches than this, smaller ones are tried: they fit in more places.
const ENOUGH_PATCHES: usize = 8;

/// No net that bends at all is further than this from the plate; a single pair of triangles may be.
const FACTOR: f64 = 20.0;

/// How a cloth's hinges have to be, so that it bends as a plate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rigidity {
    /// C of k = C D ℓ²/A.
    factor: f64,
}

impl Rigidity {
    /// Measures the net of a cloth's hinges [a, b, c, d], edge a → b of the triangles (a, b, c) and
    /// (b, a, d), in its rest shape `positions` (m), flat or not.
    ///
    /// `axes` are the directions in which the cloth is to have its rigidity, warp and weft; without,
    /// they are taken from its shape.
    pub(super) fn of(positions: &[DVec3], hinges: &[[u32; 4]], axes: Option<[DVec3; 2]>) -> Self {
        let weights: Vec<f64> = hinges
            .iter()
            .map(|hinge| Spread::new(hinge.map(|vertex| positions[vertex as usize])).weight())
            .collect();
        let net = Net::new(positions, hinges, &weights);
        let compliance = axes.map_or_else(|| in_own_axes(&net), |axes| in_axes(&net, axes));
        let factor = if compliance.is_nan() {
            1.0
        } else {
            compliance.clamp(1.0 / FACTOR, FACTOR)
        };
        Self { factor }
    }

    /// Stiffness k (N·m) of the hinge with these corners at rest, E = ½ k (θ − θ₀)² (J), of a cloth of
    /// rigidity D (N·m). Finite and not negative; 0 with a triangle without area.
    pub(super) fn stiffness(&self, corners: [DVec3; 4], rigidity: f64) -> f64 {
        let k = self.factor * rigidity * Spread::new(corners).weight();
        if k.is_finite() { k } else { 0.0 }
    }
}

/// Compliance of the net along given axes: nearer to that of the axis along which the cloth is longer,
/// by the squares of the variances λ: drop and sag grow that much faster with length. Equal parts for
/// a cloth as wide as long.
fn in_axes(net: &Net<'_>, [u, v]: [DVec3; 2]) -> f64 {
    let plate = measure(net, u);
    let [along, across] = [u, v].map(|axis| plate::variance(net.used(), axis).powi(2));
    let both = along + across;
    let share = if both > 0.0 { along / both } else { 0.5 };
    plate.compliance(0.0) * share + plate.compliance(FRAC_PI_2) * (1.0 - share)
}

/// C = `C_long` + (λ₂/λ₁)² (C̄ − `C_long`): along the cloth's long axis for a strip, the mean C̄ of all
/// directions for a cloth as wide as long, which has no axis.
fn in_own_axes(net: &Net<'_>) -> f64 {
    let axes = plate::axes(net.used());
    let plate = measure(net, axes.long);
    let share = axes.slenderness * axes.slenderness;
    plate.compliance(0.0) * (1.0 - share) + plate.mean_compliance() * share
}

/// The plate that the net is, in patches of as many rings as fit, or by its hinges one by one,
/// unrelaxed, where none fits.
fn measure(net: &Net<'_>, along: DVec3) -> Plate {
    let mut few = None;
    for reach in REACHES {
        let (plate, patches) = net.measure(along, reach, PATCHES);
        if patches >= ENOUGH_PATCHES {
            return plate;
        }
        if patches > 0 && few.is_none() {
            few = Some(plate);
        }
    }
    few.unwrap_or_else(|| net.unrelaxed(along))
}

#[cfg(test)]
mod tests;
