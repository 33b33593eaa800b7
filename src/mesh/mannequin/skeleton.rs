//! The mannequin's skeleton: links that turn at joints, and where a pose brings what they carry.
//!
//! Between a link and the one that it hangs on lies half a link, at the same joint, which turns half as
//! far: skin that goes through it doesn't collapse when the joint bends.
//!
//! Source: Mohr and Gleicher 2003, "Building efficient, accurate character skins from examples".

use super::{Side, joints};
use glam::{DMat3, DQuat, DVec3};

/// Hips and what moves with them.
pub(crate) const PELVIS: usize = 0;
/// Between pelvis and waist.
pub(crate) const ABDOMEN: usize = 1;
/// Between waist and ribs.
pub(crate) const LUMBAR: usize = 2;
/// Ribs and collarbones.
pub(crate) const CHEST: usize = 3;
/// Neck.
pub(crate) const NECK: usize = 4;
/// Head.
pub(crate) const HEAD: usize = 5;
/// Upper arms, left and right, as all pairs here.
pub(crate) const UPPER_ARM: [usize; 2] = [6, 13];
/// Forearms.
pub(crate) const FOREARM: [usize; 2] = [7, 14];
/// Hands.
pub(crate) const HAND: [usize; 2] = [8, 15];
/// Thighs.
pub(crate) const THIGH: [usize; 2] = [9, 16];
/// Shanks.
pub(crate) const SHANK: [usize; 2] = [10, 17];
/// Feet without their toes.
pub(crate) const FOOT: [usize; 2] = [11, 18];
/// Toes.
pub(crate) const TOES: [usize; 2] = [12, 19];
/// Number of links.
pub(crate) const LINKS: usize = 20;

/// Links of one side, after the first six, which are in the middle.
const SIDE: usize = 7;

/// A link of the middle or of the left side.
pub(super) struct Link {
    /// The joint at which it turns.
    joint: &'static str,
    /// The link that it hangs on; the pelvis hangs on itself.
    parent: usize,
    /// Bones whose flesh it carries.
    pub(super) bones: &'static [&'static str],
}

pub(super) const TABLE: [Link; 13] = [
    link("pelvis", PELVIS, &["ilium"]),
    link("pelvis", PELVIS, &["abdomen"]),
    link("spine", ABDOMEN, &["lumbar"]),
    link("chest", LUMBAR, &["ribs", "collarbone"]),
    link("neck", CHEST, &["cervical"]),
    link("head", NECK, &["skull", "mandible"]),
    link("shoulder", CHEST, &["upper arm"]),
    link("elbow", UPPER_ARM[0], &["forearm"]),
    link("wrist", FOREARM[0], &["palm", "fingers"]),
    link("hip", PELVIS, &["thigh"]),
    link("knee", THIGH[0], &["shank"]),
    link("ankle", SHANK[0], &["foot"]),
    link("ball", FOOT[0], &["toes"]),
];

const fn link(joint: &'static str, parent: usize, bones: &'static [&'static str]) -> Link {
    Link {
        joint,
        parent,
        bones,
    }
}

/// The link's row in the table, and its side.
pub(super) const fn row(link: usize) -> (usize, Side) {
    if link <= HEAD {
        (link, Side::Middle)
    } else if link < UPPER_ARM[1] {
        (link, Side::Left)
    } else {
        (link - SIDE, Side::Right)
    }
}

/// The link that a link hangs on.
pub(super) const fn parent(link: usize) -> usize {
    let (row, side) = row(link);
    let parent = TABLE[row].parent;
    if matches!(side, Side::Right) && parent > HEAD {
        parent + SIDE
    } else {
        parent
    }
}

/// Where each link's joint is when standing (m).
pub(crate) fn rest() -> [DVec3; LINKS] {
    let joints = joints();
    std::array::from_fn(|link| {
        let (row, side) = row(link);
        let here = |name, side| joints.iter().find(|j| j.name == name && j.side == side);
        here(TABLE[row].joint, side).map_or(DVec3::ZERO, |joint| joint.position)
    })
}

/// How the body stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    /// How each link has turned in space since it stood.
    pub(crate) turns: [DQuat; LINKS],
    /// How far the pelvis joint has moved (m).
    pub(crate) shift: DVec3,
}

/// A rigid motion as a change: x → x + M x + s. Exactly nothing when standing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Change {
    /// M = R − 1.
    pub(crate) turn: DMat3,
    /// s (m).
    pub(crate) shift: DVec3,
}

impl Change {
    /// Nothing.
    pub(crate) const NONE: Self = Self {
        turn: DMat3::ZERO,
        shift: DVec3::ZERO,
    };

    /// A turn about a joint, which goes from `rest` by `moved` (m).
    fn about(rest: DVec3, moved: DVec3, turn: DQuat) -> Self {
        let turn = DMat3::from_quat(turn) - DMat3::IDENTITY;
        Self {
            turn,
            shift: moved - turn * rest,
        }
    }

    /// How far it moves a point (m).
    fn of(&self, x: DVec3) -> DVec3 {
        self.turn * x + self.shift
    }
}

/// What a pose does to the links, then to the half links at the same places of the list.
pub(crate) fn changes(pose: &Pose, rest: &[DVec3; LINKS]) -> [Change; 2 * LINKS] {
    let mut changes = [Change::NONE; 2 * LINKS];
    for link in 0..LINKS {
        let parent = parent(link);
        let moved = if link == PELVIS {
            pose.shift
        } else {
            changes[parent].of(rest[link])
        };
        let (above, own) = (pose.turns[parent], pose.turns[link]);
        let near = if above.dot(own) < 0.0 { -own } else { own };
        changes[link] = Change::about(rest[link], moved, own);
        let half = (above + near).normalize();
        changes[LINKS + link] = Change::about(rest[link], moved, half);
    }
    changes
}
