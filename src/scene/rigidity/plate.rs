//! The plate that a net of hinges is on average, and its compliance in any direction.

use crate::linear::outer;
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// Energy and curvature of a net under uniform bending moments, summed over patches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plate {
    /// Energies ½ m · E m (J) of the moments m = (xx, yy, xy), x along the cloth's long axis.
    energy: DMat3,
    /// Curvatures K m = ∫ κ dA (m) with κ = (κxx, κyy, κxy).
    curvature: DMat3,
    /// Area that they were measured on (m²).
    area: f64,
}

impl Plate {
    /// Nothing measured yet.
    pub(super) const NONE: Self = Self {
        energy: DMat3::ZERO,
        curvature: DMat3::ZERO,
        area: 0.0,
    };

    /// Adds a share of a hinge of stiffness k with the area it has of it (m²): it turns by θ · m and
    /// then has the curvature `bend` θ · m, integrated over its whole area (m).
    pub(super) fn add_hinge(&mut self, k: f64, theta: DVec3, bend: DVec3, share: f64, area: f64) {
        self.energy += share * k * outer(theta, theta);
        self.curvature += share * outer(bend, theta);
        self.area += area;
    }

    /// Adds a hinge of stiffness k that turns by θ · κ where the curvature is prescribed, on its area
    /// (m²).
    pub(super) fn add_bent_hinge(&mut self, k: f64, theta: DVec3, area: f64) {
        self.energy += k * outer(theta, theta);
        self.curvature += area * DMat3::IDENTITY;
        self.area += area;
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.energy += other.energy;
        self.curvature += other.curvature;
        self.area += other.area;
    }

    /// Whether the rigidity is known in every direction.
    pub(super) fn is_measured(&self) -> bool {
        let [wide, narrow] = self.rigidities(0.0);
        self.area > 0.0 && self.tensor().is_finite() && wide > 0.0 && narrow > 0.0
    }

    /// M of the energy density ½ κ · M κ (J/m²): A K⁻ᵀ E K⁻¹.
    fn tensor(&self) -> DMat3 {
        let inverse = (self.curvature * self.area.recip()).inverse();
        inverse.transpose() * self.energy * self.area.recip() * inverse
    }

    /// Rigidities of a wide sheet and of a narrow strip bent along the direction at an angle (rad)
    /// from x: M₁₁ and 1/(M⁻¹)₁₁ of the turned M, per unit of area. The strip is free to curve
    /// sideways and to twist; of a net that doesn't resist that at all, it is taken for the sheet.
    pub(super) fn rigidities(&self, angle: f64) -> [f64; 2] {
        let (sin, cos) = angle.sin_cos();
        let (xx, yy, xy) = (cos * cos, sin * sin, cos * sin);
        let tensor = self.tensor();
        let wide = DVec3::new(xx, yy, xy).dot(tensor * DVec3::new(xx, yy, xy));
        let moment = DVec3::new(xx, yy, 2.0 * xy);
        let narrow = moment.dot(tensor.inverse() * moment).recip();
        [wide, if narrow > 0.0 { narrow.min(wide) } else { wide }]
    }

    /// One over the geometric mean of the rigidities of sheet and strip: the factor that serves both
    /// best, too stiff for the one by as much as too limp for the other.
    pub(super) fn compliance(&self, angle: f64) -> f64 {
        let [wide, narrow] = self.rigidities(angle);
        (wide * narrow).sqrt().recip()
    }

    /// Mean compliance over all directions.
    pub(super) fn mean_compliance(&self) -> f64 {
        let directions = (0..12).map(|i| self.compliance(f64::from(i) * PI / 12.0));
        directions.sum::<f64>() / 12.0
    }
}

/// The longest axis of a cloth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes {
    /// Direction of the largest variance, a unit vector.
    pub(super) long: DVec3,
    /// Second variance over the largest, λ₂/λ₁: 0 for a thread, 1 for a square or a circle.
    pub(super) slenderness: f64,
}

/// Principal axes of a set of points.
pub(super) fn axes(points: impl Iterator<Item = DVec3> + Clone) -> Axes {
    let (sum, count) = points
        .clone()
        .fold((DVec3::ZERO, 0.0), |(sum, count), p| (sum + p, count + 1.0));
    let mean = sum / f64::max(count, 1.0);
    let covariance = points.fold(DMat3::ZERO, |total, p| total + outer(p - mean, p - mean));
    let long = largest(covariance);
    let first = long.dot(covariance * long);
    let rest = covariance - first * outer(long, long);
    let across = largest(rest);
    let second = across.dot(rest * across);
    let slenderness = second / first;
    Axes {
        long,
        slenderness: if slenderness.is_finite() {
            slenderness.clamp(0.0, 1.0)
        } else {
            1.0
        },
    }
}

/// Variance of a set of points along a unit vector (m²).
pub(super) fn variance(points: impl Iterator<Item = DVec3> + Clone, axis: DVec3) -> f64 {
    let (sum, count) = points.clone().fold((0.0, 0.0), |(sum, count), p| {
        (sum + p.dot(axis), count + 1.0)
    });
    let mean = sum / f64::max(count, 1.0);
    let squares = points.map(|p| (p.dot(axis) - mean).powi(2));
    squares.sum::<f64>() / f64::max(count, 1.0)
}

/// Eigenvector of the largest eigenvalue of a positive matrix: squared 32 times, its columns point
/// along it. The x axis for a matrix of zeros.
fn largest(matrix: DMat3) -> DVec3 {
    let mut power = matrix;
    for _ in 0..32 {
        let trace = power.x_axis.x + power.y_axis.y + power.z_axis.z;
        power *= trace.recip();
        power = power * power;
    }
    let columns = [power.x_axis, power.y_axis, power.z_axis];
    let longer = |a: DVec3, b: DVec3| if b.length() > a.length() { b } else { a };
    let column = columns.into_iter().fold(DVec3::ZERO, longer);
    column.try_normalize().unwrap_or(DVec3::X)
}
