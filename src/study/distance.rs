//! How far two states are from each other.

use glam::DVec3;

/// Distances of particles from where they should be (m).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distance {
    /// Root of the mean square over particles, and over states where there are several.
    pub rms: f64,
    /// The largest.
    pub largest: f64,
}

impl Distance {
    /// Distance of two states with the same particles.
    pub fn between(a: &[DVec3], b: &[DVec3]) -> Self {
        let squares = || a.iter().zip(b).map(|(a, b)| a.distance_squared(*b));
        #[expect(clippy::cast_precision_loss, reason = "fewer than 2⁵³ particles")]
        let count = a.len().max(1) as f64;
        Self {
            rms: (squares().sum::<f64>() / count).sqrt(),
            largest: squares().fold(0.0, f64::max).sqrt(),
        }
    }

    /// Distance of two sequences of states, at the same times.
    pub fn over(a: &[Vec<DVec3>], b: &[Vec<DVec3>]) -> Self {
        let each: Vec<Self> = a.iter().zip(b).map(|(a, b)| Self::between(a, b)).collect();
        Self::of_all(&each)
    }

    /// The distance over several times, by the distance at each.
    pub fn of_all(each: &[Self]) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "a few states")]
        let count = each.len().max(1) as f64;
        let squares: f64 = each.iter().map(|d| d.rms * d.rms).sum();
        Self {
            rms: (squares / count).sqrt(),
            largest: each.iter().map(|d| d.largest).fold(0.0, f64::max),
        }
    }

    /// The largest distances of two sequences of states at any one of their times.
    pub fn worst(a: &[Vec<DVec3>], b: &[Vec<DVec3>]) -> Self {
        let each = a.iter().zip(b).map(|(a, b)| Self::between(a, b));
        each.fold(Self::default(), |worst, here| Self {
            rms: worst.rms.max(here.rms),
            largest: worst.largest.max(here.largest),
        })
    }
}

/// Diagonal of the box around points (m).
pub fn diagonal(points: &[DVec3]) -> f64 {
    let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    low.distance(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_known_states() {
        let still = vec![DVec3::ZERO; 4];
        let mut moved = still.clone();
        moved[2] = DVec3::new(0.0, 2.0, 0.0);
        let one = Distance::between(&still, &moved);
        assert_eq!((one.rms, one.largest), (1.0, 2.0));
        let (before, after) = ([still.clone(), still.clone()], [moved, still]);
        let both = Distance::over(&before, &after);
        assert!((both.rms - 0.5_f64.sqrt()).abs() < 1e-15, "{both:?}");
        assert_eq!(both.largest, 2.0);
        assert_eq!(Distance::worst(&before, &after), one);
    }
}
