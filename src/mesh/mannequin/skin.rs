//! The mannequin's skin: which links move a place on it, and by how much of each.
//!
//! A link's share falls with the distance d from its flesh as exp(−d/σ), so that skin goes over smoothly
//! from the flesh of one link to the next. Trunk and limbs share only around the joint where the limb
//! begins: an arm that hangs by the flank doesn't pull at it. Shares w of neighbours are then spread by
//! (Σ w)² = 1 over the links (squares) and the half links between them (products).

use super::skeleton::{Change, LINKS, TABLE, THIGH, UPPER_ARM, parent, rest, row};
use super::{Body, FLESH, Side, mirrored};
use crate::mesh::implicit::Sample;
use glam::{DMat3, DVec3};

/// Length over which a link's share falls by e (m): a knee bends over some 8 cm.
const FALL: f64 = 0.016;

/// How far the two legs share the skin between them, from the middle (m).
const BETWEEN_LEGS: f64 = 0.008;

/// Links that move one vertex; with the shares that are left out, below a thousandth, none has more.
const MOST: usize = 8;

/// Smallest share that counts.
const LEAST: f64 = 1e-3;

/// How far a vertex may lie from the skin as described (m).
const OFF: f64 = 1e-3;

/// Vertices of the mesh that [`super::mannequin`] gives.
const VERTICES: usize = 9700;

/// Shares of the links in the motion of one vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Influence {
    count: u8,
    links: [u8; MOST],
    shares: [f64; MOST],
}

/// A mannequin's skin.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Skin {
    influences: Vec<Influence>,
}

impl Skin {
    /// The skin through the vertices of the standing mannequin.
    ///
    /// # Errors
    ///
    /// A mesh that isn't the mannequin, as it stands in its own coordinates.
    pub(crate) fn new(positions: &[DVec3]) -> Result<Self, String> {
        if positions.len() != VERTICES {
            return Err(format!(
                "the mesh has {} vertices, and the mannequin that can walk {VERTICES}; take meshes/mannequin.obj \
                 or what `muslin mannequin` writes, at scale 1",
                positions.len()
            ));
        }
        let body = Body::standing();
        for (vertex, &p) in positions.iter().enumerate() {
            let off = body.sample(p).distance.abs();
            if off.is_nan() || off > OFF {
                return Err(format!(
                    "vertex {vertex} at {p} m is {:.1} mm off the mannequin that can walk; take meshes/mannequin.obj \
                     as it is, standing on y = 0 and facing +z",
                    1e3 * off
                ));
            }
        }
        let rest = rest();
        let influences = positions.iter().map(|&p| Influence::at(p, &rest));
        Ok(Self {
            influences: influences.collect(),
        })
    }

    /// How the links' changes together change a vertex.
    #[inline]
    pub(crate) fn change(&self, vertex: usize, changes: &[Change; 2 * LINKS]) -> Change {
        let influence = &self.influences[vertex];
        let mut sum = Change {
            turn: DMat3::ZERO,
            shift: DVec3::ZERO,
        };
        for k in 0..usize::from(influence.count) {
            let (change, share) = (
                &changes[usize::from(influence.links[k])],
                influence.shares[k],
            );
            sum.turn += change.turn * share;
            sum.shift += change.shift * share;
        }
        sum
    }
}

impl Influence {
    fn at(p: DVec3, rest: &[DVec3; LINKS]) -> Self {
        let single = shares(p, rest);
        let mut spread = [0.0; 2 * LINKS];
        for a in 0..LINKS {
            spread[a] += single[a] * single[a];
            for b in 0..a {
                // What two links share that don't hang on each other, as both legs do, moves with the
                // one above the latter.
                let joint = if parent(a) == b { LINKS + a } else { parent(a) };
                spread[joint] += 2.0 * single[a] * single[b];
            }
        }
        let mut order: Vec<usize> = (0..2 * LINKS).filter(|&k| spread[k] > LEAST).collect();
        order.sort_by(|&a, &b| spread[b].total_cmp(&spread[a]));
        order.truncate(MOST);
        let total: f64 = order.iter().map(|&k| spread[k]).sum();
        let mut influence = Self {
            count: 0,
            links: [0; MOST],
            shares: [0.0; MOST],
        };
        for (k, &link) in order.iter().enumerate() {
            influence.count += 1;
            influence.links[k] = u8::try_from(link).unwrap_or_default();
            influence.shares[k] = spread[link] / total;
        }
        influence
    }
}

/// What part of the body a link belongs to: 0 the trunk, then arms and legs, left and right.
pub(crate) fn limb(link: usize) -> usize {
    let (row, side) = row(link);
    match (side, row) {
        (Side::Middle, _) => 0,
        (Side::Left, 6..=8) => 1,
        (Side::Right, 6..=8) => 2,
        (Side::Left, _) => 3,
        (Side::Right, _) => 4,
    }
}

/// Each link's share of a place on the skin; their sum is 1.
fn shares(p: DVec3, rest: &[DVec3; LINKS]) -> [f64; LINKS] {
    let distances: [f64; LINKS] = std::array::from_fn(|link| flesh_distance(link, p));
    let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
    let mut shares = distances.map(|d| (-(d - least) / FALL).exp());
    let mut limbs = [0.0; 5];
    for link in 0..LINKS {
        shares[link] *= match limb(link) {
            3 => smoothstep(0.5 + 0.5 * p.x / BETWEEN_LEGS),
            4 => smoothstep(0.5 - 0.5 * p.x / BETWEEN_LEGS),
            _ => 1.0,
        };
        limbs[limb(link)] += shares[link];
    }
    let main = (1..5).fold(0, |main, k| if limbs[k] > limbs[main] { k } else { main });
    for link in 0..LINKS {
        shares[link] *= bond(main, limb(link), p, rest);
    }
    let total: f64 = shares.iter().sum();
    shares.map(|share| share / total)
}

/// How far a place of one limb may move with another: not at all but around the joint between them.
fn bond(main: usize, other: usize, p: DVec3, rest: &[DVec3; LINKS]) -> f64 {
    // The folds of skin at armpit, groin and seat are within the first length (m) of the joint.
    let around = |link: usize, from: f64, to: f64| {
        let away = p.distance(rest[link]);
        smoothstep((to - away) / (to - from))
    };
    match (main.min(other), main.max(other)) {
        (a, b) if a == b => 1.0,
        (0, 1) => around(UPPER_ARM[0], 0.12, 0.20),
        (0, 2) => around(UPPER_ARM[1], 0.12, 0.20),
        (0, 3) => around(THIGH[0], 0.16, 0.28),
        (0, 4) => around(THIGH[1], 0.16, 0.28),
        (3, 4) => 1.0, // kept apart by `BETWEEN_LEGS`
        _ => 0.0,
    }
}

/// Distance from the flesh that a link carries (m).
pub(crate) fn flesh_distance(link: usize, p: DVec3) -> f64 {
    let (row, side) = row(link);
    let own = if side == Side::Right { mirrored(p) } else { p };
    let carried = |bone: &str| TABLE[row].bones.contains(&bone);
    let mut body = Sample::EMPTY;
    for flesh in FLESH.iter().filter(|flesh| carried(flesh.bone)) {
        body = flesh.cone.join(body, own, flesh.blend);
        if side == Side::Middle && (flesh.cone.a.x != 0.0 || flesh.cone.b.x != 0.0) {
            body = flesh.cone.join(body, mirrored(p), flesh.blend);
        }
    }
    body.distance
}

/// 0 up to 0 and 1 from 1 on, with s² (3 − 2 s) between.
fn smoothstep(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    s * s * (3.0 - 2.0 * s)
}
