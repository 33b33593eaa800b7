//! What is relaxed: springs and hinges as constraints.

use crate::force::{Hinge, Spring};
use crate::model::Model;

/// A spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Link {
    /// Its particles: at first by the model's numbers, in a cluster by their [`super::cluster::place`].
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

/// The springs that have a free end, with τ (s).
pub(super) fn springs(model: &Model) -> Vec<(Link, f64)> {
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
pub(super) fn hinges(model: &Model) -> [Vec<(Crease, f64)>; 2] {
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

#[cfg(test)]
mod tests {
    use super::*;

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
