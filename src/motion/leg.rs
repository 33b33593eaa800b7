//! A leg between hip and ankle: two rods and a knee that bends one way.

use glam::{DQuat, DVec3};

/// Thigh and shank of the standing leg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leg {
    /// From hip to knee when standing (m).
    pub(super) thigh: DVec3,
    /// From knee to ankle when standing (m).
    pub(super) shank: DVec3,
}

/// How thigh and shank have turned in space since the leg stood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bent {
    pub(super) thigh: DQuat,
    pub(super) shank: DQuat,
    /// Flexion of the knee (rad), 0 when straight.
    pub(super) flexion: f64,
}

/// A knee is never straighter (rad): there the angle's rate would be infinite. No walk comes to it.
const STRAIGHTEST: f64 = 0.02;

impl Leg {
    /// The knee's turn κ from standing, and its flexion, at which the ankle is `reach` (m) from the hip.
    ///
    /// With u thigh, w shank, and the knee's hinge along x: |u + Rx(κ) w|² = u² + w² + 2 (uₓ wₓ + r cos(κ − κ₀)),
    /// where r is the product of the lengths of u and w across x and κ₀ the turn at which these are in line;
    /// κ − κ₀ is the flexion.
    fn knee(&self, reach: f64) -> [f64; 2] {
        let (u, w) = (self.thigh, self.shank);
        let (straight, r) = self.hinge();
        let dot = 0.5 * (reach * reach - u.length_squared() - w.length_squared());
        let cos = (dot - u.x * w.x) / r;
        let flexion = cos.clamp(-1.0, STRAIGHTEST.cos()).acos();
        [straight + flexion, flexion]
    }

    /// The knee's turn κ₀ when straight, and r.
    fn hinge(&self) -> (f64, f64) {
        let (u, w) = (self.thigh, self.shank);
        let (a, b) = (u.y * w.y + u.z * w.z, u.z * w.y - u.y * w.z);
        (b.atan2(a), a.hypot(b))
    }

    /// Distance from hip to ankle (m) with the knee bent by `flexion` (rad).
    pub(super) fn reach(&self, flexion: f64) -> f64 {
        let (straight, _) = self.hinge();
        (self.thigh + DQuat::from_rotation_x(straight + flexion) * self.shank).length()
    }

    /// From hip to ankle in the plane of walking (m) with the thigh forwards by `thigh` and the knee bent (rad).
    pub(super) fn ankle(&self, thigh: f64, flexion: f64) -> DVec3 {
        let rod = |v: DVec3, angle: f64| {
            let length = v.y.hypot(v.z);
            DVec3::new(v.x, -length * angle.cos(), length * angle.sin())
        };
        rod(self.thigh, thigh) + rod(self.shank, thigh - flexion)
    }

    /// The leg whose ankle is at `to` (m) from its hip: Rz(γ) Rx(α) for the thigh, the knee's hinge in it.
    pub(super) fn reaching(&self, to: DVec3) -> Bent {
        let [turn, flexion] = self.knee(to.length());
        let q = self.thigh + DQuat::from_rotation_x(turn) * self.shank;
        // Rx moves q to depth z of the target, Rz then swings it sideways; both leave its length.
        let down = (q.y * q.y + q.z * q.z - to.z * to.z).max(0.0).sqrt();
        let forwards = (-to.z).atan2(down) - (-q.z).atan2(-q.y);
        let sideways = to.y.atan2(to.x) - (-down).atan2(q.x);
        let thigh = DQuat::from_rotation_z(sideways) * DQuat::from_rotation_x(forwards);
        Bent {
            thigh,
            shank: thigh * DQuat::from_rotation_x(turn),
            flexion,
        }
    }
}
