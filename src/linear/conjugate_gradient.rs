//! Conjugate gradients with a preconditioner of one or two levels that also keeps constraints.
//!
//! Source: Baraff and Witkin 1998, section 5.3 (the modified method), in the form in which a
//! constrained direction has no entry in the preconditioner: search directions never leave the
//! space that the constraints allow, so that no separate filter is needed.

use super::cholesky::Work;
use super::team::{self, Member, Sums};
use super::{CHUNK, Coarse, Constraint, PairMatrix};
use glam::{DMat3, DVec3};
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock};

/// Work arrays of the solver; one entry a particle.
#[derive(Clone, Debug, Default)]
pub struct ConjugateGradient {
    /// Residual b − A x; after a solve, what the constraints have to supply.
    pub residual: Vec<DVec3>,
    /// Preconditioned residual.
    z: Vec<DVec3>,
    /// Search direction.
    p: Vec<DVec3>,
    /// A p.
    q: Vec<DVec3>,
}

/// How a solve went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solve {
    /// Iterations done.
    pub iterations: u32,
    /// Preconditioned residual norm at the end, relative to the reference that was given.
    pub residual: f64,
    /// Whether the tolerance was reached.
    pub converged: bool,
    /// Whether a step was taken by implicit Euler, since its own scheme would have made energy.
    pub damped: bool,
}

impl Solve {
    /// Nothing had to be solved.
    pub const NONE: Self = Self {
        iterations: 0,
        residual: 0.0,
        converged: true,
        damped: false,
    };
}

/// When a solve ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Relative residual that is good enough.
    pub tolerance: f64,
    /// Residual norm that counts as 1 when the first residual is smaller.
    pub floor: f64,
    /// Iterations after which the solve gives up.
    pub max_iterations: u32,
}

/// A x = b with the preconditioner's 3 × 3 blocks.
#[derive(Clone, Copy, Debug)]
pub struct System<'a> {
    /// A.
    pub matrix: &'a PairMatrix,
    /// What is given of x.
    pub constraints: &'a [Constraint],
    /// The inverse of A's diagonal block on free directions, nothing on constrained ones.
    pub inverse: &'a [DMat3],
    /// The coarse level, if there is one.
    pub coarse: Option<&'a Coarse>,
    /// The right hand side.
    pub b: &'a [DVec3],
}

impl ConjugateGradient {
    /// Work arrays for `rows` block rows.
    pub fn new(rows: usize) -> Self {
        let zero = vec![DVec3::ZERO; rows];
        Self {
            residual: zero.clone(),
            z: zero.clone(),
            p: zero.clone(),
            q: zero,
        }
    }

    /// Solves A x = b from the guess in `x`, until √(rᵀ P r) ≤ `tolerance` · max(√(r₀ᵀ P r₀), `floor`), P
    /// being the first level of the preconditioner, so that a coarse one changes the way and not the end.
    ///
    /// Along constrained directions `x` keeps its guess. Runs on all threads of the pool it is
    /// called in; the result doesn't depend on their number.
    pub fn solve(&mut self, system: System<'_>, x: &mut [DVec3], limits: Limits) -> Solve {
        self.p.copy_from_slice(x);
        let chunks = x.len().div_ceil(CHUNK);
        let Self { residual, z, p, q } = self;
        let mut parts = residual
            .chunks_mut(CHUNK)
            .zip(z.chunks_mut(CHUNK))
            .zip(q.chunks_mut(CHUNK));
        let lane = |x| {
            let ((residual, z), q) = parts.next().unwrap_or_default();
            Mutex::new(Lane { x, residual, z, q })
        };
        let shared = Shared {
            system,
            limits,
            lanes: x.chunks_mut(CHUNK).map(lane).collect(),
            directions: p.chunks_mut(CHUNK).map(RwLock::new).collect(),
            planes: planes(system.constraints),
            restricted: (0..chunks)
                .map(|chunk| {
                    let patches = system
                        .coarse
                        .map_or(0, |coarse| coarse.of_chunk(chunk).len());
                    RwLock::new(vec![DVec3::ZERO; patches])
                })
                .collect(),
            curvature: Sums::new(chunks),
            norm: Sums::new(chunks),
        };
        team::run(chunks, |member| shared.run(member))
    }
}

/// The rows of one chunk, worked on by one thread.
struct Lane<'a> {
    x: &'a mut [DVec3],
    residual: &'a mut [DVec3],
    z: &'a mut [DVec3],
    q: &'a mut [DVec3],
}

/// What the threads of a solve share.
struct Shared<'a> {
    system: System<'a>,
    limits: Limits,
    lanes: Vec<Mutex<Lane<'a>>>,
    /// Search direction, by chunk: written by its own thread, read by all in another phase.
    directions: Vec<RwLock<&'a mut [DVec3]>>,
    /// Rows that are given along a normal, by chunk.
    planes: Vec<Vec<usize>>,
    /// Sums of the residuals of each patch, by chunk.
    restricted: Vec<RwLock<Vec<DVec3>>>,
    /// p · A p by chunk.
    curvature: Sums,
    /// r · P r by chunk.
    norm: Sums,
}

/// The rows that are given along a normal, by chunk.
fn planes(constraints: &[Constraint]) -> Vec<Vec<usize>> {
    let rows = |(chunk, constraints): (usize, &[Constraint])| {
        let each = constraints.iter().enumerate();
        let held = each.filter(|(_, constraint)| matches!(constraint, Constraint::Plane(_)));
        held.map(|(k, _)| chunk * CHUNK + k).collect()
    };
    constraints.chunks(CHUNK).enumerate().map(rows).collect()
}

/// A thread's own copy of what is solved on the coarse level.
struct Patches<'a> {
    coarse: &'a Coarse,
    motion: Vec<DVec3>,
    work: Work,
}

type OwnLanes<'s, 'a> = Vec<(usize, MutexGuard<'s, Lane<'a>>)>;

impl<'a> Shared<'a> {
    /// The whole solve, as one thread goes through it.
    fn run(&self, member: &Member<'_>) -> Solve {
        let lock = |chunk: usize| {
            (
                chunk,
                self.lanes[chunk]
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner),
            )
        };
        let mut own: OwnLanes<'_, 'a> = (member.thread..self.lanes.len())
            .step_by(member.threads)
            .map(lock)
            .collect();
        let mut patches = self.system.coarse.map(|coarse| Patches {
            coarse,
            motion: vec![DVec3::ZERO; coarse.count()],
            work: coarse.cholesky.work(),
        });
        let [mut norm, mut descent] = self.start(&mut own, &mut patches, member);
        let reference = norm.max(self.limits.floor * self.limits.floor);
        let goal = self.limits.tolerance * self.limits.tolerance * reference;
        let mut iterations = 0;
        while norm > goal && iterations < self.limits.max_iterations {
            let curvature = self.multiply(&mut own, member);
            if curvature <= 0.0 {
                break; // rounding, or a matrix that is not positive definite: report what there is
            }
            let previous = descent;
            norm = self.descend(&mut own, descent / curvature, member);
            descent = self.solve_coarse(&mut patches, norm);
            self.turn(&own, &patches, descent / previous, member);
            iterations += 1;
        }
        let residual = if reference > 0.0 {
            (norm / reference).sqrt()
        } else {
            0.0
        };
        Solve {
            iterations,
            residual,
            converged: norm <= goal,
            damped: false,
        }
    }

    /// r = b − A x, z = P r, p = z; returns r · P r and r · z. The directions hold x at first.
    fn start(
        &self,
        own: &mut OwnLanes<'_, 'a>,
        patches: &mut Option<Patches<'_>>,
        member: &Member<'_>,
    ) -> [f64; 2] {
        self.multiply(own, member);
        for (chunk, lane) in own.iter_mut() {
            let Lane { residual, z, q, .. } = &mut **lane;
            let first = *chunk * CHUNK;
            let mut sums = DVec3::ZERO;
            for i in 0..q.len() {
                residual[i] = self.system.b[first + i] - q[i];
                z[i] = self.system.inverse[first + i] * residual[i];
                sums += residual[i] * z[i];
            }
            self.norm
                .set(*chunk, sums.element_sum() - self.noise(*chunk, residual, z));
            self.gather(*chunk, residual);
        }
        member.wait();
        let norm = self.norm.total();
        let descent = self.solve_coarse(patches, norm);
        self.turn(own, patches, 0.0, member);
        [norm, descent]
    }

    /// q = A p; returns p · q.
    fn multiply(&self, own: &mut OwnLanes<'_, 'a>, member: &Member<'_>) -> f64 {
        let parts: Vec<_> = self
            .directions
            .iter()
            .map(|part| part.read().unwrap_or_else(PoisonError::into_inner))
            .collect();
        for (chunk, lane) in own.iter_mut() {
            let p: &[DVec3] = &parts[*chunk];
            self.system.matrix.multiply_chunk(
                *chunk,
                p,
                |row| parts[row / CHUNK][row % CHUNK],
                lane.q,
            );
            let products = p.iter().zip(&*lane.q).map(|(p, q)| *p * *q);
            self.curvature
                .set(*chunk, products.sum::<DVec3>().element_sum());
        }
        drop(parts);
        member.wait();
        self.curvature.total()
    }

    /// x += α p, r −= α q, z = P r; returns r · P r.
    fn descend(&self, own: &mut OwnLanes<'_, 'a>, alpha: f64, member: &Member<'_>) -> f64 {
        for (chunk, lane) in own.iter_mut() {
            let Lane { x, residual, z, q } = &mut **lane;
            let p = self.directions[*chunk]
                .read()
                .unwrap_or_else(PoisonError::into_inner);
            let inverse = &self.system.inverse[*chunk * CHUNK..][..q.len()];
            // Three sums side by side: in one, each addition waits for the last.
            let mut sums = DVec3::ZERO;
            for i in 0..q.len() {
                x[i] += p[i] * alpha;
                residual[i] -= q[i] * alpha;
                z[i] = inverse[i] * residual[i];
                sums += residual[i] * z[i];
            }
            self.norm
                .set(*chunk, sums.element_sum() - self.noise(*chunk, residual, z));
            self.gather(*chunk, residual);
        }
        member.wait();
        self.norm.total()
    }

    /// What is in r · z of a chunk by the directions that are given: z has nothing there but rounding, r
    /// what the constraint supplies, which is large.
    fn noise(&self, chunk: usize, residual: &[DVec3], z: &[DVec3]) -> f64 {
        let mut noise = 0.0;
        for &row in &self.planes[chunk] {
            let k = row % CHUNK;
            let free = self.system.constraints[row].project(residual[k]);
            noise += (residual[k] - free).dot(z[k]);
        }
        noise
    }

    /// Sums up the residuals of each patch of a chunk, on the free directions.
    fn gather(&self, chunk: usize, residual: &[DVec3]) {
        let Some(coarse) = self.system.coarse else {
            return;
        };
        let lock = self.restricted[chunk].write();
        let mut sums = lock.unwrap_or_else(PoisonError::into_inner);
        sums.fill(DVec3::ZERO);
        let first = coarse.of_chunk(chunk).start;
        for (k, r) in residual.iter().enumerate() {
            let row = chunk * CHUNK + k;
            sums[coarse.of_row(row) - first] += self.system.constraints[row].project(*r);
        }
    }

    /// Finds the motions of the patches; returns r · z, z with them: `norm` and what the patches' residuals
    /// and motions add. Every thread solves for itself: waiting for one that does would take as long.
    fn solve_coarse(&self, patches: &mut Option<Patches<'_>>, norm: f64) -> f64 {
        let Some(Patches {
            coarse,
            motion,
            work,
        }) = patches
        else {
            return norm;
        };
        let sums = || {
            let locks = self.restricted.iter();
            locks.map(|sums| sums.read().unwrap_or_else(PoisonError::into_inner))
        };
        for (chunk, sums) in sums().enumerate() {
            motion[coarse.of_chunk(chunk)].copy_from_slice(&sums);
        }
        coarse.cholesky.solve_with(work, motion);
        let mut descent = norm;
        for (chunk, sums) in sums().enumerate() {
            let motion = &motion[coarse.of_chunk(chunk)];
            descent += sums.iter().zip(motion).map(|(r, c)| r.dot(*c)).sum::<f64>();
        }
        descent
    }

    /// p = z + β p, z with the motions of the patches.
    fn turn(
        &self,
        own: &OwnLanes<'_, 'a>,
        patches: &Option<Patches<'_>>,
        beta: f64,
        member: &Member<'_>,
    ) {
        for (chunk, lane) in own {
            let mut p = self.directions[*chunk]
                .write()
                .unwrap_or_else(PoisonError::into_inner);
            for (p, &z) in p.iter_mut().zip(&*lane.z) {
                *p = z + *p * beta;
            }
            if let Some(Patches { coarse, motion, .. }) = patches {
                for (k, p) in p.iter_mut().enumerate() {
                    let row = *chunk * CHUNK + k;
                    *p += self.system.constraints[row].project(motion[coarse.of_row(row)]);
                }
            }
        }
        member.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::{Assembly, LineBlock, Pattern};

    /// A chain long enough for several chunks, held at its first particle.
    fn chain(rows: u32) -> PairMatrix {
        let pairs: Vec<[u32; 2]> = (1..rows).map(|j| [j - 1, j]).collect();
        let pattern = Pattern::Lines(pairs.clone());
        let mut matrix = PairMatrix::with_patterns(rows as usize, std::slice::from_ref(&pattern));
        matrix.clear(&vec![0.1; rows as usize]);
        let slots = matrix.slots(&pattern);
        let mut assembly = Assembly {
            matrix: &mut matrix,
            slots: &slots,
        };
        for element in 0..pairs.len() {
            let t = f64::from(pairs[element][0]);
            assembly.add(
                element,
                LineBlock {
                    a: 0.5,
                    e: 2.0,
                    d: DVec3::new(t.sin(), t.cos(), 0.5),
                },
            );
        }
        matrix
    }

    /// With one level and with two, and with a row that is held across one direction.
    #[test]
    fn solves_keep_constraints_and_do_not_depend_on_threads() {
        let rows = 2500;
        let matrix = chain(rows);
        let mut constraints = vec![Constraint::Free; rows as usize];
        constraints[0] = Constraint::Fixed;
        constraints[1200] = Constraint::Plane(DVec3::new(2.0, -1.0, 2.0) / 3.0);
        let mut diagonal = vec![DMat3::ZERO; rows as usize];
        matrix.diagonal(&mut diagonal);
        let blocks = constraints.iter().zip(&diagonal);
        let inverse: Vec<DMat3> = blocks.map(|(held, block)| held.inverse(*block)).collect();
        let mut coarse = Coarse::new(&matrix).unwrap();
        coarse.prepare(&matrix, &constraints).unwrap();
        let b: Vec<DVec3> = (0..rows)
            .map(|i| DVec3::new(f64::from(i).cos(), 1.0, -0.3))
            .collect();
        let limits = Limits {
            tolerance: 1e-12,
            floor: 0.0,
            max_iterations: 5000,
        };
        let mut iterations = [0; 2];
        for (levels, coarse) in [(0, None), (1, Some(&coarse))] {
            let system = System {
                matrix: &matrix,
                constraints: &constraints,
                coarse,
                inverse: &inverse,
                b: &b,
            };
            let solutions = [1, 2, 3].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                let mut x = vec![DVec3::ZERO; rows as usize];
                (x[0], x[1200]) = (DVec3::Y, DVec3::X);
                let mut solver = ConjugateGradient::new(rows as usize);
                let solve = || solver.solve(system, &mut x, limits);
                let solve = pool.build().unwrap().install(solve);
                assert!(solve.converged && solve.iterations > 10, "{solve:?}");
                iterations[levels] = solve.iterations;
                x
            });
            let x = &solutions[0];
            assert_eq!(x[0], DVec3::Y);
            let given = DVec3::new(2.0, -1.0, 2.0).dot(x[1200] - DVec3::X);
            assert!(given.abs() < 1e-12, "{given}");
            let mut product = vec![DVec3::ZERO; rows as usize];
            matrix.multiply(x, &mut product);
            let left = (0..rows as usize).map(|i| constraints[i].project(product[i] - b[i]));
            let worst = left.map(DVec3::length).fold(0.0, f64::max);
            assert!(worst < 1e-9, "residual {worst}");
            assert!(solutions[1] == *x && solutions[2] == *x);
        }
        // A chain of heavy rows has nothing smooth to take away: no more than a few iterations differ.
        assert!(iterations[1] < iterations[0] + 20, "{iterations:?}");
    }
}
