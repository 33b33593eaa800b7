//! Constraints in an order that caches like and threads can share.
//!
//! Particles lie in fixed chunks. The constraints with particles in one set of chunks make a
//! cluster. Clusters are coloured so that those of one colour share no chunk: threads relax them at
//! once, a colour after another. Within a cluster the constraints are coloured too, so that
//! neighbours in the list don't wait for each other's results. Nothing of this depends on the number
//! of threads.

use super::color::colors;
use super::course::{Course, Stages};
use super::element::{Crease, Element, Link, hinges, springs};
use super::packed::Links;
use crate::linear::Chunks;
use crate::model::Model;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Mutex;

/// The constraints with particles in one set of chunks.
#[derive(Debug)]
pub(super) struct Cluster {
    /// The chunks, ascending.
    pub(super) chunks: Vec<usize>,
    pub(super) springs: Links,
    pub(super) edge_springs: Course<Crease>,
    pub(super) discrete_shells: Course<Crease>,
    /// Up to which of its particles each stage and those before it have done all.
    pub(super) settled: Vec<usize>,
}

/// The clusters of a model.
#[derive(Debug)]
pub(super) struct Plan {
    pub(super) chunks: Chunks,
    /// Sorted by colour. First those inside of one chunk: one for each, in order, empty or not.
    pub(super) clusters: Vec<Mutex<Cluster>>,
    /// Which clusters have each colour.
    pub(super) phases: Vec<Range<usize>>,
    /// The particles of each chunk that other clusters than its own move, ascending.
    pub(super) shared: Vec<Vec<u32>>,
}

/// Ascending chunks of a cluster's particles, [`NONE`] behind the last.
type Key = [usize; 4];

const NONE: usize = usize::MAX;

/// A particle of a cluster: the place of its chunk there, and its number in the chunk below.
const NUMBER: u32 = 28;

/// The place of a cluster's chunk in which a particle is, and its number there.
#[inline(always)]
pub(super) fn place(at: u32) -> (usize, usize) {
    ((at >> NUMBER) as usize, (at & ((1 << NUMBER) - 1)) as usize)
}

/// Constraints of one cluster, by the model's particles, each with its τ (s).
#[derive(Default)]
struct Found {
    springs: Vec<(Link, f64)>,
    edge_springs: Vec<(Crease, f64)>,
    discrete_shells: Vec<(Crease, f64)>,
}

impl Found {
    fn particles(&self) -> impl Iterator<Item = &u32> {
        let links = self.springs.iter().flat_map(|(link, _)| &link.ends);
        let creases = self.edge_springs.iter().chain(&self.discrete_shells);
        links.chain(creases.flat_map(|(crease, _)| &crease.corners))
    }
}

impl Plan {
    /// Sorts a model's springs and hinges into clusters.
    pub(super) fn of(model: &Model, iterations: u32) -> Self {
        let chunks = Chunks::of(model.particles());
        let own = |chunk| ([chunk, NONE, NONE, NONE], Found::default());
        let mut found: BTreeMap<Key, Found> = (0..chunks.count()).map(own).collect();
        for spring in springs(model) {
            found
                .entry(key(chunks, &spring.0))
                .or_default()
                .springs
                .push(spring);
        }
        let [edge_springs, discrete_shells] = hinges(model);
        for hinge in edge_springs {
            found
                .entry(key(chunks, &hinge.0))
                .or_default()
                .edge_springs
                .push(hinge);
        }
        for hinge in discrete_shells {
            found
                .entry(key(chunks, &hinge.0))
                .or_default()
                .discrete_shells
                .push(hinge);
        }
        let shared = shared(&found, chunks);
        let of = |(key, found)| Cluster::of(key, found, chunks, iterations > 1);
        let mut clusters: Vec<Cluster> = found.into_iter().map(of).collect();
        clusters.sort_by_key(|cluster| cluster.chunks.len());
        let sets: Vec<Vec<u32>> = clusters
            .iter()
            .map(|cluster| cluster.chunks.iter().map(|&chunk| index(chunk)).collect())
            .collect();
        let colors = colors(chunks.count(), sets.iter().map(Vec::as_slice));
        let mut colored: Vec<(usize, Cluster)> = colors.into_iter().zip(clusters).collect();
        colored.sort_by_key(|(color, _)| *color);
        let mut start = 0;
        let phase = |clusters: &[(usize, Cluster)]| {
            let end = start + clusters.len();
            std::mem::replace(&mut start, end)..end
        };
        Self {
            chunks,
            phases: colored.chunk_by(|a, b| a.0 == b.0).map(phase).collect(),
            clusters: colored
                .into_iter()
                .map(|(_, cluster)| Mutex::new(cluster))
                .collect(),
            shared,
        }
    }
}

fn key(chunks: Chunks, element: &impl Element) -> Key {
    let mut key = [NONE; 4];
    for (slot, &particle) in key.iter_mut().zip(element.places()) {
        *slot = chunks.at(particle as usize);
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

impl Cluster {
    fn of(key: Key, found: Found, chunks: Chunks, keep: bool) -> Self {
        let own: Vec<usize> = key.into_iter().filter(|&chunk| chunk != NONE).collect();
        let mut stages = match own[..] {
            [chunk] => Stages::of(chunks.range(chunk).len()),
            _ => Stages::one(),
        };
        let springs = course(found.springs, &own, chunks, &mut stages, keep);
        let edge_springs = course(found.edge_springs, &own, chunks, &mut stages, keep);
        let discrete_shells = course(found.discrete_shells, &own, chunks, &mut stages, keep);
        let lowest = springs.lowest().zip(edge_springs.lowest());
        let lowest = lowest.zip(discrete_shells.lowest());
        let mut settled: Vec<usize> = lowest.map(|((a, b), c)| a.min(b).min(c)).collect();
        let mut least = usize::MAX;
        for settled in settled.iter_mut().rev() {
            least = least.min(std::mem::replace(settled, least));
        }
        Self {
            chunks: own,
            springs: Links::of(springs),
            edge_springs,
            discrete_shells,
            settled,
        }
    }
}

/// The constraints of one kind in a cluster of some chunks, in order.
fn course<E: Element>(
    mut constraints: Vec<(E, f64)>,
    own: &[usize],
    chunks: Chunks,
    stages: &mut Stages,
    keep: bool,
) -> Course<E> {
    let places = |constraints: &[(E, f64)]| -> Vec<u32> {
        let places = constraints.iter().flat_map(|(element, _)| element.places());
        places.copied().collect()
    };
    let mut all = places(&constraints);
    all.sort_unstable();
    all.dedup();
    let mut ranked = constraints.clone();
    let ranked_places = ranked
        .iter_mut()
        .flat_map(|(element, _)| element.places_mut());
    for place in ranked_places {
        *place = index(all.partition_point(|other| other < place));
    }
    let colors = colors(
        all.len(),
        ranked.iter().map(|(element, _)| element.places()),
    );
    let moved = constraints
        .iter_mut()
        .flat_map(|(element, _)| element.places_mut());
    for place in moved {
        let chunk = chunks.at(*place as usize);
        let slot = own.iter().take_while(|&&other| other != chunk).count();
        *place = (index(slot) << NUMBER) | index(*place as usize - chunks.range(chunk).start);
    }
    Course::of(&constraints, &colors, stages, keep)
}

/// The particles of each chunk that clusters of several chunks move, by their numbers there.
fn shared(found: &BTreeMap<Key, Found>, chunks: Chunks) -> Vec<Vec<u32>> {
    let mut shared = vec![Vec::new(); chunks.count()];
    let several = found.iter().filter(|(key, _)| key[1] != NONE);
    for &particle in several.flat_map(|(_, found)| found.particles()) {
        let chunk = chunks.at(particle as usize);
        shared[chunk].push(particle - index(chunks.range(chunk).start));
    }
    for list in &mut shared {
        list.sort_unstable();
        list.dedup();
        list.shrink_to_fit();
    }
    shared
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

    /// The constraints of a cluster by the model's particles, from the runs of one list; checks that a
    /// run shares none, and that a stage leaves alone what those before it have settled.
    fn unpacked<P: Copy, E: Element, F: Fn(P) -> E>(
        cluster: &Cluster,
        chunks: Chunks,
        course: &Course<P>,
        unpack: impl Fn(usize) -> F,
    ) -> Vec<Vec<u32>> {
        let mut all = Vec::new();
        let mut settled = 0;
        for (stage, &next) in cluster.settled.iter().enumerate() {
            let unpack = unpack(stage);
            for run in course.runs(stage) {
                let mut seen = BTreeSet::new();
                for &packed in &course.elements[run] {
                    let element = unpack(packed);
                    let particle = |&at: &u32| {
                        let (slot, number) = place(at);
                        assert!(number >= settled);
                        index(chunks.range(cluster.chunks[slot]).start + number)
                    };
                    let particles: Vec<u32> = element.places().iter().map(particle).collect();
                    assert!(particles.iter().all(|&particle| seen.insert(particle)));
                    all.push(particles);
                }
            }
            settled = next;
        }
        all
    }

    #[test]
    fn every_constraint_is_in_one_cluster_and_no_run_shares_a_particle() {
        for scattered in [false, true] {
            let model = model(scattered);
            let Plan {
                chunks,
                clusters,
                phases,
                shared,
            } = Plan::of(&model, 1);
            assert_eq!(phases[0], 0..chunks.count());
            let clusters = clusters.into_iter().map(Mutex::into_inner);
            let clusters: Vec<Cluster> = clusters.collect::<Result<_, _>>().unwrap();
            let mut found = Vec::new();
            let mut next = 0;
            for phase in phases {
                assert_eq!(phase.start, next);
                next = phase.end;
                let mut seen = BTreeSet::new();
                for cluster in &clusters[phase] {
                    assert!(cluster.chunks.iter().all(|&chunk| seen.insert(chunk)));
                    let before = found.len();
                    match &cluster.springs {
                        Links::Packed(packed) => {
                            let links = &packed.course;
                            found.extend(unpacked(cluster, chunks, links, |s| packed.links.at(s)));
                        }
                        Links::Whole(course) => {
                            found.extend(unpacked(cluster, chunks, course, |_| |link| link));
                        }
                    }
                    let creases = &cluster.edge_springs;
                    found.extend(unpacked(cluster, chunks, creases, |_| |crease| crease));
                    if cluster.chunks.len() > 1 {
                        for &particle in found[before..].iter().flatten() {
                            let chunk = chunks.at(particle as usize);
                            let number = particle - index(chunks.range(chunk).start);
                            assert!(shared[chunk].contains(&number));
                        }
                    }
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
}
