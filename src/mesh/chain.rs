//! A chain: particles in a row.

use super::{Lattice, Segment, TriMesh};
use glam::DVec3;

/// A chain of `links` equal links along +x, centred on the origin, `length` (m) long.
///
/// Its ends are the corners `left` and `right`. A vertex stands for half of each link beside it.
pub fn chain(length: f64, links: u32) -> Lattice {
    let link = length / f64::from(links);
    let positions = (0..=links)
        .map(|i| DVec3::X * (f64::from(i) * link - 0.5 * length))
        .collect();
    let shares = (0..=links)
        .map(|i| {
            if i == 0 || i == links {
                0.5 * link
            } else {
                link
            }
        })
        .collect();
    let pieces = |reach: u32| {
        (reach..=links)
            .map(|i| Segment {
                ends: [i - reach, i],
                area: 0.0,
            })
            .collect()
    };
    Lattice {
        mesh: TriMesh {
            positions,
            triangles: Vec::new(),
        },
        shares,
        structural: pieces(1),
        bend: pieces(2),
        corners: vec![("left".to_owned(), 0), ("right".to_owned(), links)],
        ..Lattice::default()
    }
}
