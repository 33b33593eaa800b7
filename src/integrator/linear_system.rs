//! The linear systems of the implicit schemes, and how they are solved.
//!
//! A v = b with A = M − γ ∂f/∂v − γ² ∂f/∂x, symmetric and positive definite, γ the time (s) that one
//! evaluation of the forces stands for, on the directions that constraints leave free.

use super::constraint::constrain;
use crate::collision::Contacts;
use crate::force::{Damping, Jacobian, Stiffness};
use crate::linear::{
    Assembly, Cholesky, Coarse, ConjugateGradient, Constraint, Limits, NotPositiveDefinite,
    PairMatrix, Pattern, Slot, Solve, System,
};
use crate::model::{Cloth, Model};
use crate::scene::LinearSolverName;
use crate::state::{Archive, State};
use glam::{DMat3, DVec3};

/// How the linear systems of a scheme are solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linear {
    /// By which method.
    pub solver: LinearSolverName,
    /// Residual at which conjugate gradients end, relative to their start.
    pub tolerance: f64,
}

impl Linear {
    /// By the method that is expected to take less time, conjugate gradients to `tolerance`.
    pub const fn to(tolerance: f64) -> Self {
        Self {
            solver: LinearSolverName::Auto,
            tolerance,
        }
    }
}

/// Iterations after which conjugate gradients give up when they were asked for: `drape` takes 40 on
/// average.
const MAX_ITERATIONS: u32 = 2000;

/// Iterations before a factorisation is thought of: it is never cheaper than these.
const FIRST_ITERATIONS: u32 = 100;

/// Time of a multiplication in an iteration of conjugate gradients, on two threads and bound by memory,
/// over that of one in a factorisation on one: 1.4 to 1.8 for sheets of 40² to 100² cells with and
/// without hinges, where 180 to 600 iterations take as long as a factorisation.
const ITERATION_WORTH: f64 = 1.6;

/// Solves by factorisation, or with the coarse level, before simpler ones are tried again, after those
/// took too long.
const DEARER_SOLVES: u32 = 20;

/// Iterations with one level beyond which two take less time.
const COARSE_FROM: u32 = 50;

/// Matrix, constraints and solvers; one entry a particle unless it says otherwise.
#[derive(Debug)]
pub(super) struct LinearSystem {
    linear: Linear,
    /// A.
    matrix: PairMatrix,
    /// Slots in the matrix of each stiffness, then of each damping.
    slots: Vec<Vec<Slot>>,
    /// γ of the matrix (s).
    gamma: f64,
    pub(super) constraints: Vec<Constraint>,
    /// Diagonal blocks of A.
    diagonal: Vec<DMat3>,
    /// Preconditioner: the inverse of each diagonal block on the free directions.
    inverse: Vec<DMat3>,
    iterative: ConjugateGradient,
    direct: Option<Box<Direct>>,
    /// Whether a factorisation was thought of.
    asked: bool,
    coarse: Option<Coarse>,
    /// Solves still to be done with the coarse level.
    coarse_solves: u32,
    /// Solves still to be done by factorisation.
    direct_solves: u32,
    /// A v, while momentum is balanced or a direct solution checked.
    product: Vec<DVec3>,
}

impl LinearSystem {
    pub(super) fn new(model: &Model, linear: Linear) -> Self {
        let particles = model.particles();
        let mut patterns: Vec<Pattern> = model.stiffnesses().map(Stiffness::pattern).collect();
        patterns.extend(model.dampings().map(Damping::pattern));
        let matrix = PairMatrix::with_patterns(particles, &patterns);
        let slots = patterns.iter().map(|pattern| matrix.slots(pattern));
        Self {
            linear,
            slots: slots.collect(),
            matrix,
            gamma: 0.0,
            constraints: vec![Constraint::Free; particles],
            diagonal: vec![DMat3::ZERO; particles],
            inverse: vec![DMat3::ZERO; particles],
            iterative: ConjugateGradient::new(particles),
            direct: None,
            asked: false,
            coarse: None,
            coarse_solves: 0,
            direct_solves: 0,
            product: vec![DVec3::ZERO; particles],
        }
    }

    /// Carries over which way the next solves go.
    pub(super) fn carry(&mut self, archive: &mut Archive) {
        archive.small(&mut self.coarse_solves);
        archive.small(&mut self.direct_solves);
        let mut asked = self.asked;
        archive.flag(&mut asked);
        if asked {
            self.direct();
        }
    }

    /// Carries over the size of the last matrix, by which a stage that had nothing to do tells what is rounding.
    pub(super) fn carry_diagonal(&mut self, archive: &mut Archive) {
        archive.real(&mut self.gamma);
        archive.each(&mut self.diagonal, |archive, block| {
            archive.real(&mut block.x_axis.x);
            archive.real(&mut block.y_axis.y);
        });
    }

    /// Takes the constraints of pins and lasting contacts.
    pub(super) fn constrain(&mut self, model: &Model, contacts: &Contacts) {
        constrain(model, contacts, &mut self.constraints);
    }

    /// Sets A at a state.
    pub(super) fn assemble(&mut self, model: &Model, gamma: f64, state: &State) {
        let Self { matrix, slots, .. } = self;
        matrix.clear(&model.masses);
        let mut slots = slots.iter();
        for (law, slots) in model.stiffnesses().zip(slots.by_ref()) {
            let kind = Jacobian::Definite;
            law.add_jacobian(state, gamma * gamma, kind, &mut Assembly { matrix, slots });
        }
        for (law, slots) in model.dampings().zip(slots) {
            law.add_jacobian(state, gamma, &mut Assembly { matrix, slots });
        }
        matrix.diagonal(&mut self.diagonal);
        let blocks = self.diagonal.iter().zip(&self.constraints);
        for (inverse, (block, constraint)) in self.inverse.iter_mut().zip(blocks) {
            *inverse = constraint.inverse(*block);
        }
        self.gamma = gamma;
    }

    /// The least impulse (N·s) that means anything on each particle: a few roundings of its position
    /// x times its stiffness, γ k |x|.
    pub(super) fn rounding<'a>(&'a self, positions: &'a [DVec3]) -> impl Iterator<Item = f64> + 'a {
        let each = self.diagonal.iter().zip(positions);
        each.map(|(block, x)| {
            let largest = block.x_axis.x.max(block.y_axis.y).max(block.z_axis.z);
            4.0 * f64::EPSILON * largest / self.gamma * x.length()
        })
    }

    /// Solves A v = b from the guess in `v`, which keeps its values along constrained directions, until
    /// the residual has fallen to `tolerance` times itself or `floor`.
    pub(super) fn solve(
        &mut self,
        b: &[DVec3],
        v: &mut [DVec3],
        tolerance: f64,
        floor: f64,
    ) -> Solve {
        let limits = |max_iterations| Limits {
            tolerance,
            floor,
            max_iterations,
        };
        match self.linear.solver {
            LinearSolverName::ConjugateGradient => {
                self.iterate(b, v, limits(MAX_ITERATIONS), false)
            }
            LinearSolverName::Cholesky => {
                if self.direct().is_some() {
                    self.factor_and_solve(b, v, limits(MAX_ITERATIONS))
                } else {
                    self.iterate(b, v, limits(MAX_ITERATIONS), false)
                }
            }
            LinearSolverName::Auto => self.solve_by_the_cheaper(b, v, limits),
        }
    }

    /// Conjugate gradients, with a coarse level when they take long, for as long as a factorisation would
    /// take; then the factorisation, for a while. Counts decide, not clocks: the same scene takes the same
    /// way on every machine.
    fn solve_by_the_cheaper(
        &mut self,
        b: &[DVec3],
        v: &mut [DVec3],
        limits: impl Fn(u32) -> Limits,
    ) -> Solve {
        if self.direct_solves > 0 {
            self.direct_solves -= 1;
            return self.factor_and_solve(b, v, limits(MAX_ITERATIONS));
        }
        let mut coarse = self.coarse_solves > 0 && self.prepare_coarse();
        self.coarse_solves = self.coarse_solves.saturating_sub(1);
        let mut solve = self.iterate(b, v, limits(FIRST_ITERATIONS), coarse);
        if !coarse && solve.iterations > COARSE_FROM {
            self.coarse_solves = DEARER_SOLVES;
        }
        if !coarse && !solve.converged {
            coarse = self.prepare_coarse();
            solve = self.go_on(b, v, limits(FIRST_ITERATIONS), coarse, solve);
        }
        if solve.converged {
            return solve;
        }
        let even = self.direct().map_or(MAX_ITERATIONS, |direct| direct.worth);
        let rest = limits(even.saturating_sub(solve.iterations));
        solve = self.go_on(b, v, rest, coarse, solve);
        if !solve.converged && self.direct.is_some() {
            self.direct_solves = DEARER_SOLVES;
            let iterations = solve.iterations;
            solve = self.factor_and_solve(b, v, limits(MAX_ITERATIONS));
            solve.iterations += iterations;
        }
        solve
    }

    /// More conjugate gradients from where the last ended.
    fn go_on(
        &mut self,
        b: &[DVec3],
        v: &mut [DVec3],
        limits: Limits,
        coarse: bool,
        last: Solve,
    ) -> Solve {
        // What is left to gain is relative to the first residual, not to the one reached by now.
        let rest = Limits {
            tolerance: (limits.tolerance / last.residual.max(f64::MIN_POSITIVE)).min(1.0),
            floor: 0.0,
            ..limits
        };
        let solve = self.iterate(b, v, rest, coarse);
        Solve {
            iterations: last.iterations + solve.iterations,
            residual: last.residual * solve.residual,
            ..solve
        }
    }

    /// Conjugate gradients, with the coarse level if asked for; it has to be prepared.
    fn iterate(&mut self, b: &[DVec3], v: &mut [DVec3], limits: Limits, coarse: bool) -> Solve {
        let system = System {
            matrix: &self.matrix,
            constraints: &self.constraints,
            inverse: &self.inverse,
            coarse: self.coarse.as_ref().filter(|_| coarse),
            b,
        };
        self.iterative.solve(system, v, limits)
    }

    /// Factorises the coarse level of the present matrix; false when it is of no use.
    fn prepare_coarse(&mut self) -> bool {
        if self.coarse.is_none() {
            self.coarse = Coarse::new(&self.matrix);
        }
        let level = self.coarse.as_mut();
        level.is_some_and(|level| level.prepare(&self.matrix, &self.constraints).is_ok())
    }

    /// The factorisation's work space, if the factor fits into memory.
    fn direct(&mut self) -> Option<&mut Direct> {
        if !self.asked {
            self.asked = true;
            self.direct = Direct::new(&self.matrix).map(Box::new);
        }
        self.direct.as_deref_mut()
    }

    /// Solves for the part of v along free directions: with v = v̄ + P u, v̄ what is prescribed and P the
    /// projection on the free directions, (P A P + 1 − P) u = P (b − A v̄).
    fn factor_and_solve(&mut self, b: &[DVec3], v: &mut [DVec3], limits: Limits) -> Solve {
        self.matrix.multiply(v, &mut self.product);
        let Some(direct) = &mut self.direct else {
            let coarse = self.prepare_coarse();
            return self.iterate(b, v, limits, coarse);
        };
        for (i, constraint) in self.constraints.iter().enumerate() {
            direct.unknown[i] = constraint.project(b[i] - self.product[i]);
        }
        let factored = direct.factor(&self.matrix, &self.diagonal, &self.constraints);
        if factored.is_err() {
            // Not positive definite to rounding: what conjugate gradients make of it is better than nothing.
            self.direct_solves = 0;
            let coarse = self.prepare_coarse();
            return self.iterate(b, v, limits, coarse);
        }
        direct.cholesky.solve(&mut direct.unknown);
        for (v, (u, constraint)) in v
            .iter_mut()
            .zip(direct.unknown.iter().zip(&self.constraints))
        {
            *v += constraint.project(*u);
        }
        self.matrix.multiply(v, &mut self.product);
        for (residual, (b, product)) in self
            .iterative
            .residual
            .iter_mut()
            .zip(b.iter().zip(&self.product))
        {
            *residual = *b - *product;
        }
        Solve::NONE
    }

    /// b − A v of the last solve: what the constraints have to supply (N·s), with its sign turned.
    pub(super) fn residual(&self) -> &[DVec3] {
        &self.iterative.residual
    }

    /// Shifts the velocity of every unconstrained cloth so that its residuals b − A v sum to zero.
    ///
    /// Inner forces sum to zero, so the sum of the residuals is the momentum that is still missing; a
    /// uniform velocity of it over Σ (m + γ c m) supplies it. This makes free fall exact and keeps
    /// momentum to rounding at any tolerance.
    pub(super) fn balance_momentum(&mut self, model: &Model, b: &[DVec3], v: &mut [DVec3]) {
        if !model.cloths.iter().any(|cloth| self.is_free(cloth)) {
            return;
        }
        self.matrix.multiply(v, &mut self.product);
        for cloth in model.cloths.iter().filter(|cloth| self.is_free(cloth)) {
            let range = cloth.particles.clone();
            let missing: DVec3 = range.clone().map(|i| b[i] - self.product[i]).sum();
            let shift = missing / inertia(model, cloth, self.gamma);
            v[range].iter_mut().for_each(|v| *v += shift);
        }
    }

    /// Whether nothing holds a cloth.
    pub(super) fn is_free(&self, cloth: &Cloth) -> bool {
        let mut constraints = self.constraints[cloth.particles.clone()].iter();
        constraints.all(|constraint| *constraint == Constraint::Free)
    }
}

/// Σ (m + γ c m) of a cloth (kg): what a uniform change of its velocity takes.
pub(super) fn inertia(model: &Model, cloth: &Cloth, gamma: f64) -> f64 {
    let drag = |i: usize| {
        let damping = model.mass_damping.as_ref();
        damping.map_or(0.0, |damping| gamma * damping.drag[i])
    };
    let range = cloth.particles.clone();
    range.map(|i| model.masses[i] + drag(i)).sum()
}

/// What a factorisation needs.
#[derive(Debug)]
struct Direct {
    cholesky: Cholesky,
    pairs: Vec<[u32; 2]>,
    /// Iterations of conjugate gradients that take as long as a factorisation and a solve.
    worth: u32,
    diagonal: Vec<DMat3>,
    off: Vec<DMat3>,
    unknown: Vec<DVec3>,
}

impl Direct {
    fn new(matrix: &PairMatrix) -> Option<Self> {
        let rows = matrix.masses.len();
        let pairs = matrix.pairs();
        let cholesky = Cholesky::new(rows, &pairs)?;
        let worth = ITERATION_WORTH * cholesky.operations() / matrix.operations();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a rough figure"
        )]
        Some(Self {
            worth: worth as u32,
            cholesky,
            diagonal: vec![DMat3::ZERO; rows],
            off: vec![DMat3::ZERO; pairs.len()],
            pairs,
            unknown: vec![DVec3::ZERO; rows],
        })
    }

    /// Factorises P A P + 1 − P.
    fn factor(
        &mut self,
        matrix: &PairMatrix,
        diagonal: &[DMat3],
        constraints: &[Constraint],
    ) -> Result<(), NotPositiveDefinite> {
        for (i, constraint) in constraints.iter().enumerate() {
            self.diagonal[i] = constraint.restrict(diagonal[i]);
        }
        let blocks = matrix.off_diagonal().zip(&self.pairs);
        for (own, (block, pair)) in self.off.iter_mut().zip(blocks) {
            let [row, column] = pair.map(|i| constraints[i as usize]);
            *own = if row == Constraint::Free && column == Constraint::Free {
                block
            } else {
                row.projection() * block * column.projection()
            };
        }
        self.cholesky.factor(&self.diagonal, &self.off)
    }
}
