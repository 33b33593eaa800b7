//! The constant matrix of the global step.

use crate::force::{Dihedral, Hinge};
use crate::linear::ScalarCholesky;
use crate::model::Model;
use glam::DVec3;

/// M + dt C + dt² K for each coordinate alike, factorised: stands for the second derivative of a step's
/// energy by the velocity.
///
/// Every law adds the Laplacian of a weighted graph. A spring has [`SHARE`] of its k. A hinge has
/// k w wᵀ, w the gradient of its angle across the cloth at rest laid flat: exact for small bending,
/// where it is the quadratic bending of Bergou et al. 2006; as Σ w = 0 this is the Laplacian with
/// −k wᵢ wⱼ between its corners.
/// Dampings have τ k in place of k, and drag is like mass.
#[derive(Debug)]
pub(super) struct Matrix {
    links: Vec<Link>,
    cholesky: ScalarCholesky,
    /// K's diagonal (N/m).
    pub(super) stiffness: Vec<f64>,
    /// The step that is factorised (s); 0 before the first.
    dt: f64,
    /// Values of the matrix at the step, in the order of its rows and of its links without pins.
    diagonal: Vec<f64>,
    off: Vec<f64>,
}

/// What resists that two particles move apart.
#[derive(Clone, Copy, Debug)]
struct Link {
    ends: [u32; 2],
    /// N/m; negative where a hinge's corners go the same way.
    stiffness: f64,
    /// N·s/m.
    damping: f64,
}

/// Share of a spring's stiffness in the matrix. The whole of it bounds the true one in every direction
/// and at every length (Liu et al. 2013), but is reached only along the spring: across it, there is
/// the strain's share. With the history to correct it and the line search to guard it, half is better
/// than either: 30 iterations on a sheet of 100 × 100 particles, steps of 1/60 s, leave a residual of
/// 2.7 with 1, 0.8 with ½ and 1.4 with ¼.
const SHARE: f64 = 0.5;

/// Shares of a row's own value that are added to it while rounding leaves the matrix not positive:
/// cloth that nothing holds, 10¹³ times as stiff as its inertia.
const LIFTS: [f64; 5] = [0.0, 1e-14, 1e-12, 1e-10, 1e-6];

impl Matrix {
    /// The matrix's pattern; its values wait for a step.
    pub(super) fn new(model: &Model) -> Self {
        let links = links(model);
        let mut stiffness = vec![0.0; model.particles()];
        for link in &links {
            for end in link.ends {
                stiffness[end as usize] += link.stiffness;
            }
        }
        let free = |link: &&Link| link.is_free(model);
        let pairs: Vec<[u32; 2]> = links.iter().filter(free).map(|link| link.ends).collect();
        Self {
            cholesky: ScalarCholesky::new(model.particles(), &pairs),
            off: vec![0.0; pairs.len()],
            diagonal: vec![0.0; model.particles()],
            dt: 0.0,
            links,
            stiffness,
        }
    }

    /// Factorises the matrix of a step of `dt` (s), unless it is the last one's.
    pub(super) fn prepare(&mut self, model: &Model, dt: f64) {
        if self.dt == dt {
            return;
        }
        self.dt = dt;
        self.diagonal.copy_from_slice(&model.masses);
        if let Some(damping) = &model.mass_damping {
            for (value, drag) in self.diagonal.iter_mut().zip(&damping.drag) {
                *value += dt * drag;
            }
        }
        let mut off = self.off.iter_mut();
        for link in &self.links {
            let weight = dt * (link.damping + dt * link.stiffness);
            for end in link.ends {
                self.diagonal[end as usize] += weight;
            }
            if link.is_free(model)
                && let Some(off) = off.next()
            {
                *off = -weight;
            }
        }
        for (i, value) in self.diagonal.iter_mut().enumerate() {
            if model.is_pinned(i) {
                *value = 1.0;
            }
        }
        for lift in LIFTS {
            self.diagonal
                .iter_mut()
                .for_each(|value| *value *= 1.0 + lift);
            if self.cholesky.factor(&self.diagonal, &self.off).is_ok() {
                return;
            }
        }
    }

    /// Replaces b by the x of A x = b; where particles are pinned x = b.
    pub(super) fn solve(&mut self, x: &mut [DVec3]) {
        self.cholesky.solve(x);
    }
}

impl Link {
    /// Whether neither end is pinned.
    fn is_free(&self, model: &Model) -> bool {
        self.ends.iter().all(|&end| !model.is_pinned(end as usize))
    }
}

/// What every law and damping of a model adds.
fn links(model: &Model) -> Vec<Link> {
    let springs = model.springs.iter().flat_map(|batch| &batch.springs);
    let springs = springs.map(|spring| Link {
        ends: spring.ends,
        stiffness: SHARE * spring.stiffness,
        damping: 0.0,
    });
    let dampers = model.spring_damping.iter().flat_map(|batch| {
        let each = batch.springs.springs.iter().zip(&batch.times);
        each.map(|(spring, time)| Link {
            ends: spring.ends,
            stiffness: 0.0,
            damping: SHARE * time * spring.stiffness,
        })
    });
    let hinges = model
        .hinges()
        .flat_map(|hinge| hinge_links(hinge, &model.rest, [1.0, 0.0]));
    let hinge_dampers = model.hinge_damping.iter().flat_map(|batch| {
        let each = batch.hinges.iter().zip(&batch.times);
        each.flat_map(|(hinge, time)| hinge_links(hinge, &model.rest, [0.0, *time]))
    });
    springs
        .chain(dampers)
        .chain(hinges)
        .chain(hinge_dampers)
        .collect()
}

/// The six links of a hinge; `shares` of k are its stiffness and damping (s).
fn hinge_links(hinge: &Hinge, rest: &[DVec3], shares: [f64; 2]) -> [Link; 6] {
    let weights = flat_gradient(hinge.of(rest));
    [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]].map(|[a, b]| {
        let weight = -hinge.stiffness * weights[a] * weights[b];
        Link {
            ends: [hinge.corners[a], hinge.corners[b]],
            stiffness: weight * shares[0],
            damping: weight * shares[1],
        }
    })
}

/// Gradient of a hinge's angle along the normal (1/m) when its triangles lie in one plane; zero when
/// one has collapsed.
fn flat_gradient([a, b, c, d]: [DVec3; 4]) -> [f64; 4] {
    let e = b - a;
    let [_, _, at_c, at_d] = Dihedral::of([a, b, c, d]).gradient;
    if at_c == DVec3::ZERO {
        return [0.0; 4];
    }
    let foot = |tip: DVec3| (tip - a).dot(e) / e.length_squared();
    let (at_c, at_d) = (at_c.length(), at_d.length());
    let (foot_c, foot_d) = (foot(c), foot(d));
    [
        (foot_c - 1.0) * at_c + (foot_d - 1.0) * at_d,
        -foot_c * at_c - foot_d * at_d,
        at_c,
        at_d,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where the hinge is flat, the weights are the angle's gradient along the normal; folded, they
    /// stay what they were.
    #[test]
    fn weights_are_the_gradient_of_the_flat_angle() {
        let fold = |angle: f64| {
            let tip = DVec3::new(0.5 * angle.cos(), 0.9, -0.5 * angle.sin());
            [DVec3::ZERO, DVec3::Y, DVec3::new(-0.7, 0.3, 0.0), tip]
        };
        let flat = flat_gradient(fold(0.0));
        for (weight, gradient) in flat.iter().zip(Dihedral::of(fold(0.0)).gradient) {
            assert!(
                (gradient.length() - weight.abs()).abs() < 1e-14,
                "{gradient}, {weight}"
            );
        }
        for (first, second) in [(0, 1), (1, 2), (2, 3)] {
            let gradient = Dihedral::of(fold(0.0)).gradient;
            let exact = gradient[first].dot(gradient[second]);
            assert!(
                (flat[first] * flat[second] - exact).abs() < 1e-13,
                "{first}"
            );
        }
        for (a, b) in flat.iter().zip(flat_gradient(fold(1.2))) {
            assert!((a - b).abs() < 1e-14, "{a}, {b}");
        }
        assert!(flat.iter().sum::<f64>().abs() < 1e-14);
        assert_eq!(flat_gradient([DVec3::ONE; 4]), [0.0; 4]);
    }
}
