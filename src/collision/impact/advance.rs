//! When two features that move in straight lines come too close: conservative advancement.
//!
//! Along any direction n the gap between two features is at least the smallest of n·(xᵢ − xⱼ) over
//! the vertices i of the first and j of the second. Each of these is linear in time. So with n from
//! closest point to closest point, it is known exactly how long that direction keeps them apart;
//! from there on the next closest points tell. This is additive conservative advancement (Li,
//! Kaufman and Jiang 2021, "Codimensional incremental potential contact") with a bound of the motion
//! along n instead of in all directions: never a shorter advance, and a common motion drops out.
//!
//! Whatever rounding does to the closest points, n is some direction, and the gap along it a lower
//! bound. So nothing is missed; a wrong n only costs an advance.

use super::Features;
use glam::DVec3;

/// Two features that came too close.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Meeting {
    /// When, as a share of the step; until then they are apart.
    pub time: f64,
    /// Weights of the closest points then.
    pub weights: [f64; 4],
    /// Unit vector from the second feature to the first.
    pub normal: DVec3,
}

/// Rounding of a gap, relative to coordinates and motion: some 15 operations of 1.1e-16 each.
const ROUNDING: f64 = 4e-15;

/// Advances after which features that turn close to each other count as meeting: of the tests' 1.8
/// million cases the longest takes 411.
const MOST_ADVANCES: u32 = 1000;

/// When four vertices that move in straight lines from `start` to `end` bring their features closer
/// than `separation` (m); `None` if never.
///
/// The answer may be a meeting too early, or of features that are farther apart by up to `band` (m),
/// never one too late or none too few. Each advance ends in the middle of the band and is as long as
/// the gap takes to shrink by half of it at least. With a quarter of the separation the tests' pairs take 1 to 6
/// advances on average, with a tenth 10 % more, with half 8 % fewer.
pub fn meeting(
    features: Features,
    start: [DVec3; 4],
    end: [DVec3; 4],
    separation: f64,
    band: f64,
) -> Option<Meeting> {
    let origin = start[0];
    let x: [DVec3; 4] = std::array::from_fn(|i| start[i] - origin);
    let v: [DVec3; 4] = std::array::from_fn(|i| end[i] - start[i]);
    let size = (0..4).fold(DVec3::ZERO, |size, i| size.max(x[i].abs()).max(v[i].abs()));
    let rounding = ROUNDING * size.max_element();
    let (near, aim) = (
        separation + band + 4.0 * rounding,
        separation + 0.5 * band + 2.0 * rounding,
    );
    let mut time = 0.0;
    let mut normal = DVec3::ZERO;
    let mut weights = [0.0; 4];
    for _ in 0..MOST_ADVANCES {
        let now: [DVec3; 4] = std::array::from_fn(|i| x[i] + v[i] * time);
        let closest = features.closest(now);
        weights = closest.weights;
        normal = closest.between.normalize_or(normal);
        let (mut gap, mut safe) = apart(features, &now, &v, normal, aim);
        if gap <= near && closest.between.length() > near {
            // Closest points inside nearly degenerate features are known badly, what is
            // perpendicular to both features isn't.
            let across = features.across(now).normalize_or(normal);
            normal = across * across.dot(normal).signum();
            (gap, safe) = apart(features, &now, &v, normal, aim);
        }
        // Not (gap > near): with a NaN, too.
        if gap.partial_cmp(&near) != Some(std::cmp::Ordering::Greater) {
            break;
        }
        time += safe;
        if time >= 1.0 {
            return None;
        }
    }
    Some(Meeting {
        time,
        weights,
        normal,
    })
}

/// The gap between the features along a direction (m), and how long it stays above `aim`.
fn apart(
    features: Features,
    x: &[DVec3; 4],
    v: &[DVec3; 4],
    normal: DVec3,
    aim: f64,
) -> (f64, f64) {
    let (x, v) = (x.map(|x| normal.dot(x)), v.map(|v| normal.dot(v)));
    let split = features.split();
    let (mut least, mut safe) = (f64::MAX, f64::MAX);
    for i in 0..split {
        for j in split..4 {
            let (gap, rate) = (x[i] - x[j], v[i] - v[j]);
            least = least.min(gap);
            if rate < 0.0 {
                safe = safe.min((gap - aim) / -rate);
            }
        }
    }
    (least, safe)
}
