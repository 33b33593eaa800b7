//! Hinge stiffness from a material's plate rigidity, so that any mesh of a cloth bends as that plate.
//!
//! Two steps. The *weight* of a hinge comes from its own two triangles, so that the net bends more
//! nearly alike in all directions ([`Spread::weight`]). Then one *factor* per cloth is measured on the
//! mesh itself (numerical homogenisation): small patches are bent by uniform moments at their rim,
//! their vertices take the heights of least energy, and the energy of each patch's core is compared
//! with a plate's of the same mean curvature.
//!
//! Left out: a free strip of such a net is 1 − ν² as stiff as a wide sheet, with ν between −0.25 and
//! −0.4; only terms that couple neighbouring hinges could change that. The factor serves the geometric
//! mean of the two, so that strips are a few percent too limp and sheets as much too stiff.

mod net;
mod patch;
mod plate;
mod spread;

use glam::DVec3;
use net::{Net, Reach};
use plate::Plate;
use spread::Spread;

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

/// Stiffness k (N·m) of each hinge, E = ½ k (θ − θ₀)² (J), so that the cloth bends as a plate of
/// rigidity D (N·m).
///
/// k = C D w, with the weight w of the hinge's own triangles ([`Spread::weight`]) and the compliance C
/// of the cloth's net of hinges per unit of D. `hinges` are [a, b, c, d]: edge a → b of
/// the triangles (a, b, c) and (b, a, d). `positions` (m) are the rest shape, flat or not. Finite and
/// not negative for any input; a hinge of a triangle without area has none.
pub(super) fn hinge_stiffnesses(
    positions: &[DVec3],
    hinges: &[[u32; 4]],
    rigidity: f64,
) -> Vec<f64> {
    let weights: Vec<f64> = hinges
        .iter()
        .map(|hinge| Spread::new(hinge.map(|vertex| positions[vertex as usize])).weight())
        .collect();
    let net = Net::new(positions, hinges, &weights);
    let stiffness = rigidity * compliance(&net);
    let k = |weight| Some(stiffness * weight).filter(|k: &f64| k.is_finite() && *k > 0.0);
    weights.into_iter().map(|w| k(w).unwrap_or(0.0)).collect()
}

/// Compliance C of the net with k = weight: what k = weight · D is to be multiplied with.
///
/// C = `C_long` + (λ₂/λ₁)² (C̄ − `C_long`): along the cloth's long axis for a strip, the mean C̄ of all
/// directions for a cloth as wide as long, which has no axis. λ are the variances of its vertices;
/// the squares grow with length as a cantilever's drop does.
fn compliance(net: &Net<'_>) -> f64 {
    let axes = plate::axes(net.used());
    let plate = measure(net, axes.long);
    let share = axes.slenderness * axes.slenderness;
    let compliance = plate.compliance(0.0) * (1.0 - share) + plate.mean_compliance() * share;
    if compliance.is_nan() {
        return 1.0;
    }
    compliance.clamp(1.0 / FACTOR, FACTOR)
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
