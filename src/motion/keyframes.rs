//! Prescribed rigid motion: keyframes, and the placement and its rate at any time between them.
//!
//! Each component of translation and each angle is a piecewise cubic Hermite function of time, monotone
//! between two keys (Fritsch and Carlson 1980): it doesn't overshoot, and two equal keys hold still.
//! Slopes are zero at the first and the last key; before and after them the motion stands still. Position
//! and velocity are value and derivative of one function, which is continuously differentiable.

use glam::{DMat3, DVec3};

/// Where a motion is at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keyframe {
    /// The time (s).
    pub time: f64,
    /// How far it has moved from where it started (m).
    pub translate: DVec3,
    /// By how much it has turned, about x, then y, then z (rad); beyond a turn it goes on turning.
    pub rotate: DVec3,
}

/// A rigid motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    knots: Vec<Knot>,
}

/// A keyframe: translation (m) and angles (rad), and their rates (m/s, rad/s).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Knot {
    time: f64,
    value: [f64; 6],
    slope: [f64; 6],
}

/// Where a rigid motion has brought things, and how fast they go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Rotation R about x, then y, then z.
    turn: DMat3,
    /// Translation of the centre (m).
    shift: DVec3,
    /// Its rate (m/s).
    velocity: DVec3,
    /// Angular velocity ω (rad/s).
    spin: DVec3,
}

impl Motion {
    /// The motion through keyframes of increasing time; without any it stands still.
    pub fn new(keyframes: &[Keyframe]) -> Self {
        let mut knots: Vec<Knot> = keyframes
            .iter()
            .map(|key| {
                let ([x, y, z], [a, b, c]) = (key.translate.to_array(), key.rotate.to_array());
                Knot {
                    time: key.time,
                    value: [x, y, z, a, b, c],
                    slope: [0.0; 6],
                }
            })
            .collect();
        for k in 1..knots.len().saturating_sub(1) {
            let [before, here, after] = [knots[k - 1], knots[k], knots[k + 1]];
            knots[k].slope = std::array::from_fn(|c| {
                let ahead = [here.time - before.time, after.time - here.time];
                let rise = [
                    here.value[c] - before.value[c],
                    after.value[c] - here.value[c],
                ];
                monotone_slope(ahead, rise)
            });
        }
        Self { knots }
    }

    /// Whether it ever turns.
    pub fn turns(&self) -> bool {
        let turned = |knot: &Knot| knot.value[3..].iter().any(|&angle| angle != 0.0);
        self.knots.iter().any(turned)
    }

    /// The placement at a time (s).
    pub fn at(&self, time: f64) -> Placement {
        let [value, rate] = self.components(time);
        let angle = |c: usize| [value[3 + c], rate[3 + c]];
        let ([a, da], [b, db], [c, dc]) = (angle(0), angle(1), angle(2));
        let (about_y, about_z) = (DMat3::from_rotation_y(b), DMat3::from_rotation_z(c));
        Placement {
            turn: about_z * about_y * DMat3::from_rotation_x(a),
            shift: DVec3::new(value[0], value[1], value[2]),
            velocity: DVec3::new(rate[0], rate[1], rate[2]),
            // Ṙ Rᵀ = [ω]×: each rate is about its axis as turned by the rotations that follow it.
            spin: DVec3::Z * dc + about_z * (DVec3::Y * db + about_y * (DVec3::X * da)),
        }
    }

    /// Values of the components and their rates.
    fn components(&self, time: f64) -> [[f64; 6]; 2] {
        let after = self.knots.partition_point(|knot| knot.time <= time);
        let (Some(first), Some(last)) = (self.knots.first(), self.knots.last()) else {
            return [[0.0; 6]; 2];
        };
        if after == 0 {
            return [first.value, [0.0; 6]];
        }
        if after == self.knots.len() {
            return [last.value, [0.0; 6]];
        }
        let [from, to] = [self.knots[after - 1], self.knots[after]];
        let each: [[f64; 2]; 6] = std::array::from_fn(|c| {
            let ends = [from.value[c], to.value[c]];
            hermite(
                [from.time, to.time],
                ends,
                [from.slope[c], to.slope[c]],
                time,
            )
        });
        [each.map(|[value, _]| value), each.map(|[_, rate]| rate)]
    }
}

impl Placement {
    /// Position (m) and velocity (m/s) of what started at `start`, with the rotation about `center` (m):
    /// x = x₀ + s + (R − 1)(x₀ − c), v = ṡ + ω × R (x₀ − c).
    ///
    /// Exactly x₀ where nothing has moved.
    #[inline]
    pub fn of(&self, start: DVec3, center: DVec3) -> [DVec3; 2] {
        let arm = start - center;
        let turned = self.turn * arm;
        let position = start + self.shift + (turned - arm);
        [position, self.velocity + self.spin.cross(turned)]
    }
}

impl Placement {
    /// Where what is at `position` now started (m): x₀ = c + Rᵀ (x − c − s).
    #[inline]
    pub fn back(&self, position: DVec3, center: DVec3) -> DVec3 {
        center + self.turn.transpose() * (position - center - self.shift)
    }

    /// A direction as it has turned.
    #[inline]
    pub fn turned(&self, direction: DVec3) -> DVec3 {
        self.turn * direction
    }
}

/// Slope at a key between two spans of time `ahead` (s) with their rises: that of the parabola through
/// the three keys, zero where the function turns round, and at most three times the lesser of both
/// secants, which keeps both pieces monotone.
///
/// Source: Fritsch and Carlson 1980, region [0, 3]² of slopes over secants.
pub(super) fn monotone_slope(ahead: [f64; 2], rise: [f64; 2]) -> f64 {
    let secant = [rise[0] / ahead[0], rise[1] / ahead[1]];
    if secant[0] * secant[1] <= 0.0 {
        return 0.0;
    }
    let parabola = (secant[0] * ahead[1] + secant[1] * ahead[0]) / (ahead[0] + ahead[1]);
    let most = 3.0 * secant[0].abs().min(secant[1].abs());
    parabola.clamp(-most, most)
}

/// Value and derivative at `time` of the cubic between two times with given ends and end slopes.
///
/// With s = (t − t₀)/(t₁ − t₀), a the slopes less the secant: p = p₀ + s Δp + s (1 − s)[(1 − s) a₀ − s a₁] h.
pub(super) fn hermite(
    [t0, t1]: [f64; 2],
    [p0, p1]: [f64; 2],
    slopes: [f64; 2],
    time: f64,
) -> [f64; 2] {
    let (h, rise) = (t1 - t0, p1 - p0);
    let s = (time - t0) / h;
    let secant = rise / h;
    let [a0, a1] = slopes.map(|slope| slope - secant);
    let value = p0 + s * rise + s * (1.0 - s) * ((1.0 - s) * a0 - s * a1) * h;
    let rate = secant + (1.0 - s) * (1.0 - 3.0 * s) * a0 + s * (3.0 * s - 2.0) * a1;
    [value, rate]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(time: f64, translate: [f64; 3], rotate: [f64; 3]) -> Keyframe {
        Keyframe {
            time,
            translate: translate.into(),
            rotate: DVec3::from_array(rotate.map(f64::to_radians)),
        }
    }

    fn wild() -> Motion {
        Motion::new(&[
            key(0.2, [0.0; 3], [0.0; 3]),
            key(0.5, [0.3, -0.1, 0.2], [90.0, 20.0, -200.0]),
            key(0.6, [0.4, -0.1, 0.9], [200.0, -70.0, -210.0]),
            key(1.4, [0.4, 0.5, -0.3], [720.0, 10.0, -300.0]),
        ])
    }

    /// Velocity against fourth-order differences of the position, at a thousand times, keys included.
    #[test]
    fn velocity_is_the_derivative_of_position() {
        let (motion, center) = (wild(), DVec3::new(0.1, 1.0, -0.4));
        let start = DVec3::new(0.7, 0.4, 0.2);
        let x = |t: f64| motion.at(t).of(start, center)[0];
        let h = 1e-4;
        for i in 0..1000 {
            // Off the keys: across one, where the second derivative jumps, differences are of first order.
            let t = 1.6 * (f64::from(i) + 0.5) / 1000.0;
            if [0.2, 0.5, 0.6, 1.4].iter().any(|k| (t - k).abs() < 2.5 * h) {
                continue;
            }
            let slope =
                ((x(t + h) - x(t - h)) * 8.0 - (x(t + 2.0 * h) - x(t - 2.0 * h))) / (12.0 * h);
            let [_, v] = motion.at(t).of(start, center);
            assert!(
                (v - slope).length() < 1e-7 * (1.0 + v.length()),
                "{v} against {slope} at {t}"
            );
        }
        for t in [0.2_f64, 0.5, 0.6, 1.4] {
            let [[x0, v0], [x1, v1]] = [t.next_down(), t].map(|t| motion.at(t).of(start, center));
            assert!(
                (x1 - x0).length() + (v1 - v0).length() < 1e-12,
                "a jump at {t}"
            );
        }
    }

    #[test]
    fn moves_rigidly_through_the_keys_and_rests_outside() {
        let motion = wild();
        let (center, a, b) = (
            DVec3::ONE,
            DVec3::new(0.7, 0.4, 0.2),
            DVec3::new(-0.2, 0.1, 3.0),
        );
        for i in 0..=32 {
            let place = motion.at(f64::from(i) * 0.05);
            let [[xa, va], [xb, vb]] = [a, b].map(|x| place.of(x, center));
            assert!(((xa - xb).length() - (a - b).length()).abs() < 1e-14);
            assert!((va - vb).dot(xa - xb).abs() < 1e-12);
            assert!((place.back(xa, center) - a).length() < 1e-14);
            assert!((place.turned(a - b) - (xa - xb)).length() < 1e-14);
        }
        assert_eq!(motion.at(0.0).of(a, center), [a, DVec3::ZERO]);
        assert_eq!(motion.at(0.2).of(a, center)[0], a);
        assert_eq!(motion.at(9.0), motion.at(1.4));
        // A turn of 720° about x and −300° about z, after the others; z last.
        let turn = DMat3::from_rotation_z(-300_f64.to_radians())
            * DMat3::from_rotation_y(10_f64.to_radians());
        let expected = center + DVec3::new(0.4, 0.5, -0.3) + turn * (a - center);
        assert!((motion.at(9.0).of(a, center)[0] - expected).length() < 1e-14);
    }

    /// Two turns are twice around, not none.
    #[test]
    fn whole_turns_count() {
        let motion = Motion::new(&[
            key(0.0, [0.0; 3], [0.0; 3]),
            key(1.0, [0.0; 3], [0.0, 720.0, 0.0]),
        ]);
        // Half-way, at a whole turn, the smooth step is fastest: 1.5 times the mean.
        let [x, v] = motion.at(0.5).of(DVec3::X, DVec3::ZERO);
        assert!((x - DVec3::X).length() < 1e-14, "{x}");
        assert!(
            (v - DVec3::NEG_Z * (1.5 * 4.0 * std::f64::consts::PI)).length() < 1e-12,
            "{v}"
        );
    }

    #[test]
    fn does_not_overshoot_and_equal_keys_hold_still() {
        let heights = [0.0, 0.1, 0.1, 2.0, 2.1, -1.0, -1.0];
        let times = [0.0, 0.4, 0.9, 1.0, 1.8, 2.0, 3.0];
        let keys: Vec<Keyframe> = times
            .iter()
            .zip(heights)
            .map(|(&t, y)| key(t, [0.0, y, 0.0], [0.0; 3]))
            .collect();
        let motion = Motion::new(&keys);
        assert!(!motion.turns());
        let y = |t: f64| motion.at(t).of(DVec3::ZERO, DVec3::ZERO)[0].y;
        for (t, h) in times.windows(2).zip(heights.windows(2)) {
            let mut last = y(t[0]);
            assert!((last - h[0]).abs() < 1e-15);
            for i in 1..=100 {
                let here = y(t[0] + (t[1] - t[0]) * f64::from(i) / 100.0);
                assert!(
                    (here - last) * (h[1] - h[0]).signum() >= -1e-15,
                    "{t:?}: {last} to {here}"
                );
                assert!(h[0] != h[1] || here == h[0], "{here}");
                last = here;
            }
        }
    }
}
