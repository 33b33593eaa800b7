//! Constraints in an order that caches like and threads can share.
//!
//! Particles lie in fixed chunks. The constraints with particles in one set of chunks make a
//! cluster. Clusters are coloured so that those of one colour share no chunk: threads relax them at
//! once, a colour after another. Within a cluster the constraints are coloured too, so that
//! neighbours in the list don't wait for each other's results. Nothing of this depends on the number
//! of threads.

use super::color::colors;
use crate::force::{Hinge, Spring};
use crate::model::Model;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Mutex;

/// Particles in a chunk. Their 32 KiB stay in the first-level cache while the constraints inside are
/// relaxed.
pub(super) const CHUNK: usize = 1024;

/// A spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Link {
    /// Its particles: number in the chunk, plus [`CHUNK`] times the place of the chunk in the cluster.
    pub(super) ends: [u32; 2],
    /// Rest length ℓ₀ (m).
    pub(super) rest_length: f64,
    /// 1/k (m/N).
    pub(super) compliance: f64,
}

/// A hinge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crease {
    /// Its particles, as those of a [`Link`].
    pub(super) corners: [u32; 4],
    /// Rest angle θ₀ (rad).
    pub(super) rest_angle: f64,
    /// 1/k (1/(N·m)).
    pub(super) compliance: f64,
}

/// A constraint on a few particles.
pub(super) trait Element: Copy {
    /// Its particles.
    fn places(&self) -> &[u32];

    /// The same.
    fn places_mut(&mut self) -> &mut [u32];
}

impl Element for Link {
    fn places(&self) -> &[u32] {
        &self.ends
    }

    fn places_mut(&mut self) -> &mut [u32] {
        &mut self.ends
    }
}

impl Element for Crease {
    fn places(&self) -> &[u32] {
        &self.corners
    }

    fn places_mut(&mut self) -> &mut [u32] {
        &mut self.corners
    }
}

/// A cluster's constraints of one kind, sorted by colour.
#[derive(Debug)]
pub(super) struct Constraints<E> {
    pub(super) elements: Vec<E>,
    /// Damping time τ of each (s); empty where none is damped.
    pub(super) times: Vec<f64>,
    /// Lagrange multiplier of each, when a step has several sweeps.
    pub(super) multipliers: Vec<f64>,
    /// Where each colour ends.
    pub(super) ends: Vec<usize>,
}

impl<E> Default for Constraints<E> {
    fn default() -> Self {
        Self {
            elements: Vec::new(),
            times: Vec::new(),
            multipliers: Vec::new(),
            ends: Vec::new(),
        }
    }
}

/// The constraints with particles in one set of chunks.
#[derive(Debug, Default)]
pub(super) struct Cluster {
    /// The chunks, ascending.
    pub(super) chunks: Vec<usize>,
    pub(super) springs: Constraints<Link>,
    pub(super) edge_springs: Constraints<Crease>,
    pub(super) discrete_shells: Constraints<Crease>,
}

/// The clusters of a model.
#[derive(Debug)]
pub(super) struct Plan {
    /// Sorted by colour. First those inside of one chunk: one for each, in order, empty or not.
    pub(super) clusters: Vec<Mutex<Cluster>>,
    /// Which clusters have each colour.
    pub(super) phases: Vec<Range<usize>>,
}

/// Ascending chunks of a cluster's particles, [`NONE`] behind the last.
type Key = [usize; 4];

const NONE: usize = usize::MAX;

impl Plan {
    /// Sorts a model's springs and hinges into clusters.
    pub(super) fn of(model: &Model, iterations: u32) -> Self {
        let chunks = model.particles().div_ceil(CHUNK);
        let own = |chunk| ([chunk, NONE, NONE, NONE], Cluster::default());
        let mut found: BTreeMap<Key, Cluster> = (0..chunks).map(own).collect();
        let keep = iterations > 1;
        add(&mut found, springs(model), keep, |c| &mut c.springs);
        let [edge_springs, discrete_shells] = hinges(model);
        add(&mut found, edge_springs, keep, |c| &mut c.edge_springs);
        add(&mut found, discrete_shells, keep, |c| {
            &mut c.discrete_shells
        });
        let mut clusters: Vec<Cluster> = found
            .into_iter()
            .map(|(key, cluster)| Cluster {
                chunks: key.into_iter().filter(|&chunk| chunk != NONE).collect(),
                ..cluster
            })
            .collect();
        clusters.sort_by_key(|cluster| cluster.chunks.len());
        let sets: Vec<Vec<u32>> = clusters
            .iter()
            .map(|cluster| cluster.chunks.iter().map(|&chunk| index(chunk)).collect())
            .collect();
        let colors = colors(chunks, sets.iter().map(Vec::as_slice));
        let (clusters, ends) = by_color(clusters, &colors);
        let starts = std::iter::once(0).chain(ends.iter().copied());
        Self {
            clusters: clusters.into_iter().map(Mutex::new).collect(),
            phases: starts.zip(&ends).map(|(start, &end)| start..end).collect(),
        }
    }
}

/// Sorts items by their colours; also says where each colour ends.
fn by_color<T>(items: Vec<T>, colors: &[usize]) -> (Vec<T>, Vec<usize>) {
    let mut ends = vec![0; colors.iter().max().map_or(0, |most| most + 1)];
    for &color in colors {
        ends[color] += 1;
    }
    for color in 1..ends.len() {
        ends[color] += ends[color - 1];
    }
    let mut colored: Vec<(usize, T)> = colors.iter().copied().zip(items).collect();
    colored.sort_by_key(|(color, _)| *color);
    (colored.into_iter().map(|(_, item)| item).collect(), ends)
}

/// The springs that have a free end, with τ (s).
fn springs(model: &Model) -> Vec<(Link, f64)> {
    let mut links = Vec::new();
    for batch in &model.springs {
        let damping = model
            .spring_damping
            .iter()
            .find(|damping| damping.springs.family == batch.family);
        let damped = damping.map_or((&[][..], &[][..]), |damping| {
            (&damping.springs.springs[..], &damping.times[..])
        });
        let times = times(batch.springs.iter(), damped);
        for (&spring, time) in batch.springs.iter().zip(times) {
            let Spring {
                ends,
                rest_length,
                stiffness,
            } = spring;
            let link = Link {
                ends,
                rest_length,
                compliance: 1.0 / stiffness,
            };
            links.push((link, time));
        }
    }
    links.retain(|(link, _)| is_free(model, link));
    links
}

/// The hinges that have a free corner, with τ (s): edge springs and discrete shells.
fn hinges(model: &Model) -> [Vec<(Crease, f64)>; 2] {
    let damped = model
        .hinge_damping
        .as_ref()
        .map_or((&[][..], &[][..]), |damping| {
            (&damping.hinges[..], &damping.times[..])
        });
    let creases = model
        .hinges()
        .zip(times(model.hinges(), damped))
        .map(|(hinge, time)| {
            let &Hinge {
                corners,
                rest_angle,
                stiffness,
            } = hinge;
            let crease = Crease {
                corners,
                rest_angle,
                compliance: 1.0 / stiffness,
            };
            (crease, time)
        });
    let mut edge_springs: Vec<_> = creases.collect();
    let count = |hinges: Option<usize>| hinges.unwrap_or_default();
    let bounds = count(model.edge_springs.as_ref().map(|batch| batch.hinges.len()));
    let mut discrete_shells = edge_springs.split_off(bounds);
    // A clamp's hinge has no stiffness before or after it holds.
    let acts = |crease: &Crease| crease.compliance.is_finite() && is_free(model, crease);
    edge_springs.retain(|(crease, _)| acts(crease));
    discrete_shells.retain(|(crease, _)| acts(crease));
    [edge_springs, discrete_shells]
}

/// τ of each element (s). The damped ones are listed in the same order, all or some of them.
fn times<'a, T: PartialEq + 'a>(
    elements: impl Iterator<Item = &'a T>,
    (damped, times): (&'a [T], &'a [f64]),
) -> Vec<f64> {
    let mut damped = damped.iter().zip(times).peekable();
    let time = |element: &T| {
        damped
            .next_if(|(other, _)| *other == element)
            .map_or(0.0, |(_, &time)| time)
    };
    let found = elements.map(time).collect();
    debug_assert!(damped.next().is_none(), "a damper without its element");
    found
}

fn is_free(model: &Model, element: &impl Element) -> bool {
    let mut places = element.places().iter();
    places.any(|&place| !model.is_pinned(place as usize))
}

/// Sorts constraints into their clusters.
fn add<E: Element>(
    clusters: &mut BTreeMap<Key, Cluster>,
    mut elements: Vec<(E, f64)>,
    keep: bool,
    list: impl Fn(&mut Cluster) -> &mut Constraints<E>,
) {
    elements.sort_by_key(|(element, _)| key(element));
    for group in elements.chunk_by(|a, b| key(&a.0) == key(&b.0)) {
        let key = key(&group[0].0);
        let cluster = clusters.entry(key).or_default();
        *list(cluster) = Constraints::of(group, key, keep);
    }
}

fn key(element: &impl Element) -> Key {
    let mut key = [NONE; 4];
    for (slot, &place) in key.iter_mut().zip(element.places()) {
        *slot = place as usize / CHUNK;
    }
    key.sort_unstable();
    let mut last = NONE;
    for slot in &mut key {
        if *slot == last {
            *slot = NONE;
        } else {
            last = *slot;
        }
    }
    key.sort_unstable();
    key
}

impl<E: Element> Constraints<E> {
    /// Those of one cluster, given by the model's particles. `keep`: whether multipliers are kept.
    fn of(group: &[(E, f64)], key: Key, keep: bool) -> Self {
        let mut group = group.to_vec();
        for place in group
            .iter_mut()
            .flat_map(|(element, _)| element.places_mut())
        {
            let chunk = *place as usize / CHUNK;
            let slot = key.iter().take_while(|&&other| other != chunk).count();
            *place = index(slot * CHUNK + *place as usize % CHUNK);
        }
        let colors = colors(4 * CHUNK, group.iter().map(|(element, _)| element.places()));
        let (group, ends) = by_color(group, &colors);
        let damped = group.iter().any(|(_, time)| *time > 0.0);
        let times = group.iter().map(|(_, time)| *time);
        Self {
            times: if damped { times.collect() } else { Vec::new() },
            multipliers: vec![0.0; if keep { group.len() } else { 0 }],
            elements: group.into_iter().map(|(element, _)| element).collect(),
            ends,
        }
    }
}

/// Particles are numbered by `u32` throughout.
#[expect(clippy::cast_possible_truncation, reason = "see above")]
fn index(i: usize) -> u32 {
    i as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;
    use std::collections::BTreeSet;

    /// A sheet of several chunks with hinges, its particles as they are or scattered over the chunks.
    fn model(scattered: bool) -> Model {
        let changes = [
            "cloth.0.shape.sheet.cells=[60, 60]",
            "cloth.0.shape.sheet.diagonals=both",
            "cloth.0.bending=edge-spring",
        ];
        let changes: Vec<String> = changes.map(str::to_owned).to_vec();
        let loaded = scene::load("hanging-cloth", &changes).unwrap();
        let mut model = scene::build(&loaded).unwrap().model;
        let count = index(model.cloth_particles());
        // 1009 has no factor in common with the number of particles, 61².
        let moved = |place: u32| {
            if scattered {
                place * 1009 % count
            } else {
                place
            }
        };
        for spring in model
            .springs
            .iter_mut()
            .flat_map(|batch| &mut batch.springs)
        {
            spring.ends = spring.ends.map(moved);
        }
        for spring in model
            .spring_damping
            .iter_mut()
            .flat_map(|d| &mut d.springs.springs)
        {
            spring.ends = spring.ends.map(moved);
        }
        let batches = model.edge_springs.iter_mut().map(|batch| &mut batch.hinges);
        let damped = model
            .hinge_damping
            .iter_mut()
            .map(|damping| &mut damping.hinges);
        for hinge in batches.chain(damped).flatten() {
            hinge.corners = hinge.corners.map(moved);
        }
        model
    }

    /// The constraints of a cluster by the model's particles; checks that a colour shares none.
    fn unpacked<E: Element>(cluster: &Cluster, constraints: &Constraints<E>) -> Vec<Vec<u32>> {
        let mut start = 0;
        let mut all = Vec::new();
        for &end in &constraints.ends {
            let mut seen = BTreeSet::new();
            for element in &constraints.elements[start..end] {
                assert!(element.places().iter().all(|&place| seen.insert(place)));
                let particle = |&place: &u32| {
                    let chunk = cluster.chunks[place as usize / CHUNK];
                    index(chunk * CHUNK + place as usize % CHUNK)
                };
                all.push(element.places().iter().map(particle).collect());
            }
            start = end;
        }
        assert_eq!(start, constraints.elements.len());
        all
    }

    #[test]
    fn every_constraint_is_in_one_cluster_and_no_color_shares_a_particle() {
        for scattered in [false, true] {
            let model = model(scattered);
            let plan = Plan::of(&model, 1);
            let chunks = model.particles().div_ceil(CHUNK);
            assert_eq!(plan.phases[0], 0..chunks);
            let clusters: Vec<Cluster> = plan
                .clusters
                .into_iter()
                .map(|cluster| cluster.into_inner().unwrap())
                .collect();
            let mut found = Vec::new();
            let mut next = 0;
            for phase in plan.phases {
                assert_eq!(phase.start, next);
                next = phase.end;
                let mut seen = BTreeSet::new();
                for cluster in &clusters[phase] {
                    assert!(cluster.chunks.iter().all(|&chunk| seen.insert(chunk)));
                    found.extend(unpacked(cluster, &cluster.springs));
                    found.extend(unpacked(cluster, &cluster.edge_springs));
                }
            }
            assert_eq!(next, clusters.len());
            let springs = model.springs.iter().flat_map(|batch| &batch.springs);
            let springs = springs.map(|spring| spring.ends.to_vec());
            let hinges = model.hinges().map(|hinge| hinge.corners.to_vec());
            let mut expected: Vec<Vec<u32>> = springs.chain(hinges).collect();
            expected.retain(|places| places.iter().any(|&p| !model.is_pinned(p as usize)));
            expected.sort();
            found.sort();
            assert!(expected.len() > 10_000 && found == expected);
        }
    }

    #[test]
    fn dampers_find_their_elements() {
        let all = ["a", "b", "b", "c"];
        assert_eq!(
            times(all.iter(), (&["b", "c"], &[1.0, 2.0])),
            [0.0, 1.0, 0.0, 2.0]
        );
        assert_eq!(
            times(all.iter(), (&all, &[1.0, 0.0, 3.0, 4.0])),
            [1.0, 0.0, 3.0, 4.0]
        );
        assert_eq!(times(all.iter(), (&[], &[])), [0.0; 4]);
    }
}
