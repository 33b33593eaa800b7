//! The elasticity of a thin sheet in its plane, and how it depends on direction.

use glam::{DMat3, DVec3, dvec3};

/// Elasticity C of a sheet (N/m), σ = C ε, in Voigt's notation with engineering shear:
/// ε = (ε₁₁, ε₂₂, γ = 2 ε₁₂), axis 1 along the warp, 2 along the weft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elasticity(pub DMat3);

/// What a pull tells of a sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moduli {
    /// Modulus E = 1/S₁₁ (N/m) along the pull, sides free.
    pub young: f64,
    /// Poisson's ratio ν = −S₁₂/S₁₁.
    pub poisson: f64,
    /// Shear modulus G = 1/S₆₆ (N/m) in the axes along and across the pull.
    pub shear: f64,
    /// Shear γ by strain ε of the pull, S₁₆/S₁₁: 0 where a strip that is pulled stays straight.
    pub coupling: f64,
}

/// Share of the largest stiffness below which there is none: central differences are exact to 10⁻⁸.
const NOTHING: f64 = 1e-6;

impl Elasticity {
    /// C with i, j from 1 to 3: C₆₆ is `at(3, 3)` (N/m).
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.0.col(j - 1)[i - 1]
    }

    /// The isotropic sheet of modulus E (N/m) with the only Poisson's ratio of springs, ν = 1/3:
    /// C₁₁ = 9/8 E, C₁₂ = C₆₆ = 3/8 E.
    pub fn isotropic(young: f64) -> Self {
        let [a, b] = [1.125 * young, 0.375 * young];
        Self(DMat3::from_cols(
            dvec3(a, b, 0.0),
            dvec3(b, a, 0.0),
            dvec3(0.0, 0.0, b),
        ))
    }

    /// The same sheet in axes that are turned by an angle (rad) from warp towards weft.
    ///
    /// With c, s its cosine and sine, K = (c² s² 2cs; s² c² −2cs; −cs cs c²−s²) turns stresses, and
    /// C′ = K C Kᵀ.
    #[must_use]
    pub fn turned(&self, angle: f64) -> Self {
        let (s, c) = angle.sin_cos();
        let k = DMat3::from_cols(
            dvec3(c * c, s * s, -c * s),
            dvec3(s * s, c * c, c * s),
            dvec3(2.0 * c * s, -2.0 * c * s, c * c - s * s),
        );
        Self(k * self.0 * k.transpose())
    }

    /// C and its transpose, halved: what an energy can have.
    #[must_use]
    pub fn symmetric(&self) -> Self {
        Self((self.0 + self.0.transpose()) * 0.5)
    }

    /// Largest difference of C from its transpose, over its largest entry.
    pub fn asymmetry(&self) -> f64 {
        let difference = self.0 - self.0.transpose();
        largest(&difference) / largest(&self.0)
    }

    /// The largest entry (N/m).
    pub fn scale(&self) -> f64 {
        largest(&self.0)
    }

    /// The moduli of a pull at an angle (rad) from warp towards weft.
    ///
    /// What the sheet doesn't resist at all has modulus 0, and ν and the coupling are then those of
    /// the motion without energy.
    pub fn moduli(&self, angle: f64) -> Moduli {
        let scale = self.scale();
        if scale <= 0.0 {
            return Moduli {
                young: 0.0,
                poisson: 0.0,
                shear: 0.0,
                coupling: 0.0,
            };
        }
        // A little of everything makes C regular where it isn't.
        let regular = self.turned(angle).0 + DMat3::from_diagonal(DVec3::splat(1e-9 * scale));
        let s = regular.inverse();
        let modulus = |compliance: f64| {
            let modulus = 1.0 / compliance;
            if modulus > NOTHING * scale {
                modulus
            } else {
                0.0
            }
        };
        Moduli {
            young: modulus(s.x_axis.x),
            poisson: -s.x_axis.y / s.x_axis.x,
            shear: modulus(s.z_axis.z),
            coupling: s.x_axis.z / s.x_axis.x,
        }
    }

    /// Largest E of all directions over the smallest; infinite where a direction has none.
    pub fn anisotropy(&self) -> f64 {
        let all = (0..180).map(|degrees| self.moduli(f64::from(degrees).to_radians()).young);
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for young in all {
            low = low.min(young);
            high = high.max(young);
        }
        high / low
    }
}

fn largest(matrix: &DMat3) -> f64 {
    let entries = matrix.to_cols_array();
    entries.iter().fold(0.0, |most, x| x.abs().max(most))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_isotropic_sheet_is_the_same_in_every_direction() {
        let sheet = Elasticity::isotropic(80.0);
        for degrees in 0..180 {
            let moduli = sheet.moduli(f64::from(degrees).to_radians());
            assert!((moduli.young / 80.0 - 1.0).abs() < 1e-8, "{moduli:?}");
            assert!((moduli.poisson - 1.0 / 3.0).abs() < 1e-8, "{moduli:?}");
            assert!((moduli.shear / 30.0 - 1.0).abs() < 1e-8, "{moduli:?}");
            assert!(moduli.coupling.abs() < 1e-8, "{moduli:?}");
        }
        assert!((sheet.anisotropy() - 1.0).abs() < 1e-8);
    }

    /// Threads that resist nothing but their own stretch: pulled at 45° they only turn.
    #[test]
    fn a_weave_without_shear_has_no_modulus_at_an_angle() {
        let weave = Elasticity(DMat3::from_diagonal(dvec3(50.0, 50.0, 0.0)));
        let along = weave.moduli(0.0);
        assert!((along.young / 50.0 - 1.0).abs() < 1e-8, "{along:?}");
        assert_eq!((along.shear, along.poisson), (0.0, 0.0));
        let across = weave.moduli(0.25 * std::f64::consts::PI);
        assert_eq!(across.young, 0.0);
        assert!((across.poisson - 1.0).abs() < 1e-6, "{across:?}");
        assert!(weave.anisotropy().is_infinite());
    }

    #[test]
    fn a_quarter_turn_exchanges_warp_and_weft_and_turns_the_coupling_round() {
        let c = DMat3::from_cols(
            dvec3(5.0, 1.0, 0.3),
            dvec3(1.0, 3.0, 0.2),
            dvec3(0.3, 0.2, 2.0),
        );
        let turned = Elasticity(c).turned(0.5 * std::f64::consts::PI).0;
        let expected = DMat3::from_cols(
            dvec3(3.0, 1.0, -0.2),
            dvec3(1.0, 5.0, -0.3),
            dvec3(-0.2, -0.3, 2.0),
        );
        assert!(turned.abs_diff_eq(expected, 1e-12), "{turned}");
    }
}
