//! Passes over touches on two threads: those of either half of the cloth at once, then those between the halves.
//!
//! What the halves are depends on the touches alone, so that any number of threads gives the same bits.

use super::slowing::Slowed;
use super::touch::{Touch, difference};
use glam::DVec3;

/// Touches from which on there are halves: fewer aren't worth sorting.
const WORTH_HALVING: usize = 1024;

/// Visits of the last pass from which on threads help: to wake one takes 5 µs.
const WORTH_SHARING: usize = 256;

/// Both halves.
const HALVES: usize = 2;

/// No vertex of any touch.
const NONE: u32 = u32::MAX;

/// Touches that have nothing to do any more.
const DONE: u32 = u32::MAX;

/// What a pass changes of the vertices of touches, and which touches still have something to do: those of which a vertex
/// was changed since they were visited. In a rope of folds most need a few of thirty passes.
#[derive(Clone, Debug, Default)]
pub(super) struct Halves {
    /// Which half each vertex is in, before the touches are sorted.
    side: Vec<u8>,
    /// How many of the step's touches are among the vertices of either half; all others follow.
    counts: [usize; HALVES],
    /// Touches of the second half and of none, while they are sorted.
    others: [Vec<Touch>; HALVES],
    /// Place of each vertex among `members`.
    slots: Vec<u32>,
    /// The vertices of the touches, those of the first half first.
    members: Vec<u32>,
    /// How many are of the first half.
    first: usize,
    /// What is changed, of each member.
    values: Vec<DVec3>,
    /// 1/mass of each member (1/kg).
    inverse_masses: Vec<f64>,
    /// When each member was changed last, in visits.
    changed: Vec<u32>,
    /// The members of each touch.
    corners: Vec<[u32; 4]>,
    /// When each touch was visited last.
    seen: Vec<u32>,
    now: u32,
    /// Visits of the last pass.
    visits: usize,
}

/// What a touch sees of its vertices.
pub(super) struct Local<'a> {
    corners: [u32; 4],
    values: &'a mut [DVec3],
    inverse_masses: &'a [f64],
}

/// What a visit to a touch did, or a pass over all.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Visit {
    /// What there was to do.
    pub(super) most: f64,
    /// By how much the difference of the closest points' values was changed.
    pub(super) moved: f64,
    pub(super) slowed: Slowed,
}

impl Local<'_> {
    /// Σ wᵢ aᵢ: difference of the values between the closest points.
    pub(super) fn difference(&self, weights: &[f64; 4]) -> DVec3 {
        difference(self.values, self.corners, weights)
    }

    /// The part of it that solids and pinned particles have.
    pub(super) fn driven(&self, weights: &[f64; 4]) -> DVec3 {
        let term = |k: usize| {
            let i = self.corners[k] as usize;
            let fixed = self.inverse_masses[i] == 0.0;
            if fixed {
                self.values[i] * weights[k]
            } else {
                DVec3::ZERO
            }
        };
        term(0) + term(1) + term(2) + term(3)
    }

    /// aᵢ ← aᵢ + wᵢ p / mᵢ: leaves Σ mᵢ aᵢ of free vertices as it is.
    pub(super) fn shift(&mut self, weights: &[f64; 4], p: DVec3) {
        for (&i, w) in self.corners.iter().zip(weights) {
            self.values[i as usize] += p * (w * self.inverse_masses[i as usize]);
        }
    }
}

impl Halves {
    pub(super) fn new(vertices: usize) -> Self {
        Self {
            side: vec![0; vertices],
            slots: vec![NONE; vertices],
            ..Self::default()
        }
    }

    /// Cuts the touches' vertices in halves across their longest extent, by some places of all vertices (m), and sorts
    /// the touches: of the first half, of the second, of both.
    pub(super) fn sort(&mut self, touches: &mut Vec<Touch>, places: &[DVec3]) {
        self.counts = [0; HALVES];
        if touches.len() < WORTH_HALVING {
            return;
        }
        let corners = || {
            touches
                .iter()
                .map(|touch| places[touch.vertices[0] as usize])
        };
        let (low, high) = corners().fold((DVec3::MAX, DVec3::MIN), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        let axis = (high - low).max_position();
        let mut heights: Vec<f64> = corners().map(|x| x[axis]).collect();
        let middle = heights.len() / 2;
        let (_, &mut middle, _) = heights.select_nth_unstable_by(middle, f64::total_cmp);
        for touch in &*touches {
            for i in touch.vertices {
                self.side[i as usize] = u8::from(places[i as usize][axis] >= middle);
            }
        }
        let [second, between] = &mut self.others;
        second.clear();
        between.clear();
        touches.retain(|touch| {
            let sides = touch.vertices.map(|i| self.side[i as usize]);
            match sides {
                [0, 0, 0, 0] => return true,
                [1, 1, 1, 1] => second.push(*touch),
                _ => between.push(*touch),
            }
            false
        });
        self.counts = [touches.len(), second.len()];
        touches.extend_from_slice(second);
        touches.extend_from_slice(between);
    }

    /// Keeps some of the sorted touches.
    pub(super) fn retain(&mut self, touches: &mut Vec<Touch>, kept: impl Fn(&Touch) -> bool) {
        let mut begin = 0;
        for count in &mut self.counts {
            let end = begin + *count;
            *count = touches[begin..end].iter().filter(|one| kept(one)).count();
            begin = end;
        }
        touches.retain(kept);
    }

    /// Takes over the values and 1/mass of the touches' vertices. All have something to do.
    pub(super) fn take(&mut self, touches: &[Touch], values: &[DVec3], inverse_masses: &[f64]) {
        let [first, second] = self.counts;
        let sorted = first + second > 0;
        let (halves, between) = touches.split_at(first + second);
        let halves = [&halves[..first], &halves[first..]];
        self.members.clear();
        for (half, touches) in halves.into_iter().enumerate() {
            for i in touches
                .iter()
                .chain(between)
                .flat_map(|touch| touch.vertices)
            {
                let mine = !sorted || usize::from(self.side[i as usize]) == half;
                if mine && self.slots[i as usize] == NONE {
                    self.slots[i as usize] = number(self.members.len());
                    self.members.push(i);
                }
            }
            if half == 0 {
                self.first = self.members.len();
            }
        }
        let all = || self.members.iter().map(|&i| i as usize);
        self.values.clear();
        self.values.extend(all().map(|i| values[i]));
        self.inverse_masses.clear();
        self.inverse_masses.extend(all().map(|i| inverse_masses[i]));
        self.corners.clear();
        let bases = [0, number(self.first), 0];
        for (touches, base) in [halves[0], halves[1], between].into_iter().zip(bases) {
            let slot = |i: u32| self.slots[i as usize] - base;
            let corners = touches.iter().map(|touch| touch.vertices.map(slot));
            self.corners.extend(corners);
        }
        for i in &self.members {
            self.slots[*i as usize] = NONE;
        }
        self.again();
    }

    /// Lets all touches have something to do again.
    pub(super) fn again(&mut self) {
        self.changed.clear();
        self.changed.resize(self.members.len(), 1);
        self.seen.clear();
        self.seen.resize(self.corners.len(), 0);
        self.now = 1;
        self.visits = self.corners.len();
    }

    /// Gives the values back.
    pub(super) fn give(&self, values: &mut [DVec3]) {
        for (&i, value) in self.members.iter().zip(&self.values) {
            values[i as usize] = *value;
        }
    }

    /// Visits all touches that have something to do, in their order or backwards, those between the halves last.
    /// `look` says what it did, or that there will be nothing more to do. What moves less than `unheard` isn't told the
    /// neighbours.
    pub(super) fn pass(
        &mut self,
        touches: &mut [Touch],
        backwards: bool,
        unheard: f64,
        look: impl Fn(&mut Touch, &mut Local<'_>) -> Option<Visit> + Sync,
    ) -> Visit {
        let [first, second] = self.counts;
        let (touches0, rest) = touches.split_at_mut(first);
        let (touches1, between) = rest.split_at_mut(second);
        let (corners0, rest) = self.corners.split_at(first);
        let (corners1, corners) = rest.split_at(second);
        let (seen0, rest) = self.seen.split_at_mut(first);
        let (seen1, seen) = rest.split_at_mut(second);
        let (values0, values1) = self.values.split_at_mut(self.first);
        let (masses0, masses1) = self.inverse_masses.split_at(self.first);
        let (changed0, changed1) = self.changed.split_at_mut(self.first);
        let of = |touches, corners, seen, values, inverse_masses, changed| Batch {
            touches,
            corners,
            seen,
            values,
            inverse_masses,
            changed,
            now: self.now,
            visits: 0,
            whole: Visit::default(),
        };
        let mut one = of(touches0, corners0, seen0, values0, masses0, changed0);
        let mut other = of(touches1, corners1, seen1, values1, masses1, changed1);
        if self.visits >= WORTH_SHARING && second > 0 {
            rayon::join(
                || one.pass(backwards, unheard, &look),
                || other.pass(backwards, unheard, &look),
            );
        } else {
            one.pass(backwards, unheard, &look);
            other.pass(backwards, unheard, &look);
        }
        let (now, visits) = (one.now.max(other.now), one.visits + other.visits);
        let halves = one.whole.and(other.whole);
        let mut last = Batch {
            touches: between,
            corners,
            seen,
            values: &mut self.values,
            inverse_masses: &self.inverse_masses,
            changed: &mut self.changed,
            now,
            visits,
            whole: halves,
        };
        last.pass(backwards, unheard, &look);
        (self.now, self.visits) = (last.now, last.visits);
        last.whole
    }
}

/// A vertex's number or place.
#[expect(clippy::cast_possible_truncation, reason = "vertices have 32 bits")]
fn number(i: usize) -> u32 {
    i as u32
}

impl Visit {
    fn and(self, other: Self) -> Self {
        Self {
            most: self.most.max(other.most),
            moved: self.moved.max(other.moved),
            slowed: self.slowed + other.slowed,
        }
    }
}

/// Touches that no other thread shares a vertex with.
struct Batch<'a> {
    touches: &'a mut [Touch],
    corners: &'a [[u32; 4]],
    seen: &'a mut [u32],
    values: &'a mut [DVec3],
    inverse_masses: &'a [f64],
    changed: &'a mut [u32],
    now: u32,
    visits: usize,
    whole: Visit,
}

impl Batch<'_> {
    fn pass(
        &mut self,
        backwards: bool,
        unheard: f64,
        look: &impl Fn(&mut Touch, &mut Local<'_>) -> Option<Visit>,
    ) {
        let count = self.touches.len();
        for k in 0..count {
            let k = if backwards { count - 1 - k } else { k };
            let corners = self.corners[k];
            if !self.is_due(k, corners) {
                continue;
            }
            let mut local = Local {
                corners,
                values: self.values,
                inverse_masses: self.inverse_masses,
            };
            let Some(visit) = look(&mut self.touches[k], &mut local) else {
                self.seen[k] = DONE;
                continue;
            };
            self.whole = self.whole.and(visit);
            self.visits += 1;
            self.now += 1;
            self.seen[k] = self.now;
            if visit.moved > unheard {
                for i in corners {
                    self.changed[i as usize] = self.now;
                }
            }
        }
    }

    /// Whether a touch has something to do.
    #[inline]
    fn is_due(&self, touch: usize, [a, b, c, d]: [u32; 4]) -> bool {
        let changed = |i: u32| self.changed[i as usize];
        changed(a).max(changed(b)).max(changed(c)).max(changed(d)) > self.seen[touch]
    }
}

#[cfg(test)]
mod tests {
    use super::super::touch::{Vertices, separate};
    use super::*;

    /// Two rows of points, one above the other and too close, in no order.
    fn rows(count: u32) -> (Vertices, Vec<Touch>) {
        let place = |i: u32| {
            let (k, row) = (i / 2, f64::from(i % 2));
            let wave = f64::from(k * k % 101) / 101.0;
            DVec3::new(f64::from(k), 1e-3 * row * wave, wave)
        };
        let start: Vec<DVec3> = (0..2 * count).map(place).collect();
        let vertices = Vertices {
            end: start.clone(),
            velocity: vec![DVec3::ZERO; start.len()],
            inverse_mass: (0..2 * count).map(|i| 1.0 + f64::from(i % 7)).collect(),
            start,
        };
        // Of two neighbours each in both rows.
        let touch = |k: u32| {
            let k = k * 577 % (count - 1);
            let share = f64::from(k % 10) / 10.0;
            let mut touch = Touch {
                vertices: [2 * k + 1, 2 * k + 3, 2 * k, 2 * k + 2],
                weights: [share, 1.0 - share, -share, share - 1.0],
                normal: DVec3::Y,
                target: 2e-3,
                meets: true,
                friction: 0.3,
                ..Touch::default()
            };
            touch.weigh(&vertices);
            touch
        };
        let touches = (0..count - 1).map(touch).collect();
        (vertices, touches)
    }

    #[test]
    fn halves_keep_all_targets_and_the_momentum_with_the_same_bits_on_one_thread_and_two() {
        let ends = [1, 2].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().unwrap().install(|| {
                let (mut vertices, mut touches) = rows(4000);
                let mut halves = Halves::new(vertices.end.len());
                halves.sort(&mut touches, &vertices.start);
                let [first, second] = halves.counts;
                assert!(first > 1900 && second > 1900 && first + second >= touches.len() - 3);
                let enough = 1e-5; // 30 passes over a chain get to 2e-6
                separate(&mut touches, &mut vertices, &mut halves, true, enough);
                for touch in &touches {
                    let gap: f64 = (0..4)
                        .map(|k| vertices.end[touch.vertices[k] as usize].y * touch.weights[k])
                        .sum();
                    assert!(gap > touch.target - 2.0 * enough, "{gap}");
                }
                let moved = vertices
                    .end
                    .iter()
                    .zip(&vertices.start)
                    .zip(&vertices.inverse_mass);
                let moment: DVec3 = moved.map(|((end, start), w)| (*end - *start) / *w).sum();
                assert!(moment.length() < 1e-12, "{moment}");
                vertices.end
            })
        });
        assert_eq!(ends[0], ends[1]);
    }

    #[test]
    fn few_touches_are_left_in_their_order() {
        let (vertices, touches) = rows(1000);
        let mut sorted = touches.clone();
        Halves::new(vertices.end.len()).sort(&mut sorted, &vertices.start);
        let corners = |of: &[Touch]| -> Vec<_> { of.iter().map(|touch| touch.vertices).collect() };
        assert_eq!(corners(&sorted), corners(&touches));
    }
}
