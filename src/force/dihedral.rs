//! The dihedral angle of a hinge and its derivatives.
//!
//! A hinge is two triangles on one edge: its corners are [a, b, c, d], the first triangle a → b → c,
//! the second b → a → d. With e = b − a, N₁ = e × (c − a), N₂ = (d − a) × e:
//!
//! θ = atan2((N₁ × N₂) · ê, N₁ · N₂),
//!
//! 0 when flat, positive where the hinge is convex seen from the side to which the normals point.
//!
//! Source: the gradient is that of Bridson, Marino and Fedkiw 2003 and of Grinspun et al. 2003. The
//! second derivative is written here as a sum over the two triangles, see [`Wing`].

use crate::linear::outer;
use glam::{DMat2, DMat3, DVec2, DVec3};

/// The dihedral angle θ (rad) and its gradient ∂θ/∂x (1/m) by corner.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dihedral {
    /// The angle.
    pub fold: Fold,
    /// ∂θ/∂a, ∂θ/∂b, ∂θ/∂c, ∂θ/∂d.
    pub gradient: [DVec3; 4],
}

/// A dihedral angle by sine and cosine, both times one positive factor: not every law needs the angle
/// itself, whose arctangent takes longer than all the rest of a hinge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fold {
    sine: f64,
    cosine: f64,
}

impl Fold {
    /// θ in −π … π; 0 where a triangle has collapsed.
    #[inline]
    pub fn angle(self) -> f64 {
        self.sine.atan2(self.cosine)
    }

    /// sin θ/2 = s/√(2r (r + c)) with r² = s² + c², or the same by the other half for blunt angles.
    #[inline]
    pub fn half_sine(self) -> f64 {
        let Self { sine, cosine } = self;
        let r = (sine * sine + cosine * cosine).sqrt();
        if r == 0.0 {
            0.0 // collapsed, or smaller than 10⁻⁴⁰ m
        } else if cosine > 0.0 {
            sine / (2.0 * r * (r + cosine)).sqrt()
        } else {
            (0.5 * (r - cosine) / r).sqrt().copysign(sine)
        }
    }
}

impl From<f64> for Fold {
    /// The fold of an angle (rad).
    fn from(angle: f64) -> Self {
        let (sine, cosine) = angle.sin_cos();
        Self { sine, cosine }
    }
}

/// (Altitude/edge)² below which a triangle counts as collapsed: its normal is rounding, so the angle
/// is taken as 0 and has no derivatives.
const COLLAPSED: f64 = 1e-16;

impl Dihedral {
    /// The angle and its gradient at a hinge's corners (m); all zero where a triangle has collapsed.
    #[inline(always)] // as a call, a force pass takes 58 ns a hinge instead of 21
    pub fn of([a, b, c, d]: [DVec3; 4]) -> Self {
        let (e, p, q) = (b - a, c - a, d - a);
        let (n1, n2) = (e.cross(p), q.cross(e));
        let (edge, area1, area2) = (e.length_squared(), n1.length_squared(), n2.length_squared());
        if area1.min(area2) <= COLLAPSED * edge * edge {
            return Self::default();
        }
        let (length, per_edge) = (edge.sqrt(), edge.recip());
        let (at_c, at_d) = (n1 * (-length / area1), n2 * (-length / area2));
        let (foot1, foot2) = (p.dot(e) * per_edge, q.dot(e) * per_edge);
        Self {
            fold: Fold {
                // (N₁ × N₂) · ê = −|e| (d − a) · N₁.
                sine: -length * q.dot(n1),
                cosine: n1.dot(n2),
            },
            gradient: [
                at_c * (foot1 - 1.0) + at_d * (foot2 - 1.0),
                -(at_c * foot1 + at_d * foot2),
                at_c,
                at_d,
            ],
        }
    }
}

/// One of a hinge's triangles: what it adds to the second derivative of θ.
///
/// Let w = δtip − (1 − s) δstart − s δend be the motion of the tip against the foot of its altitude,
/// ε = δend − δstart that of the edge, n the normal, m the direction of the altitude h. The triangle
/// turns θ by −α and twists by β; the rest happens in its plane:
///
/// α = n·w/h,  β = n·ε/|e|,  A = m·w/h,  D = ê·w/h + ½ m·ε/|e|,
/// ∂²θ = Σ (α ⊗ A + A ⊗ α + β ⊗ D + D ⊗ β) over both triangles
///
/// (the triangles' antisymmetric parts cancel). α, β act across the plane and A, D in it, so that
/// the positive part of a triangle's sum has a closed form, see [`Wing::positive_part`].
#[derive(Clone, Copy, Debug)]
struct Wing {
    /// α and β, by start, end, tip.
    across: [[DVec3; 3]; 2],
    /// A and D.
    within: [[DVec3; 3]; 2],
    /// (1 + s² + (1 − s)²)/h², ½ (1 − 2s)/(h |e|) and ½/|e|²: the forms' scalar products.
    products: [f64; 3],
}

impl Wing {
    /// The triangle start → end → tip; `None` when it has collapsed.
    #[inline]
    fn of(start: DVec3, end: DVec3, tip: DVec3) -> Option<Self> {
        let (e, p) = (end - start, tip - start);
        let (edge, area) = (e.length_squared(), e.cross(p).length_squared());
        if area <= COLLAPSED * edge * edge {
            return None;
        }
        let length = edge.sqrt();
        let (foot, altitude) = (p.dot(e) / edge, area.sqrt() / length);
        let direction = e / length;
        let normal = e.cross(p) / area.sqrt();
        let upwards = normal.cross(direction);
        let at_tip = |v: DVec3| [v * (foot - 1.0), v * -foot, v];
        let [start, end, tip] = at_tip(direction / altitude);
        let half_twist = upwards * (0.5 / length);
        let weights = 1.0 + foot * foot + (1.0 - foot) * (1.0 - foot);
        Some(Self {
            across: [
                at_tip(normal / altitude),
                [-normal / length, normal / length, DVec3::ZERO],
            ],
            within: [
                at_tip(upwards / altitude),
                [start - half_twist, end + half_twist, tip],
            ],
            products: [
                weights / (altitude * altitude),
                0.5 * (1.0 - 2.0 * foot) / (altitude * length),
                0.5 / edge,
            ],
        })
    }

    /// Two forms z with ½ |σ| Σ z ⊗ z the positive part of this triangle's σ ∂²θ, σ = ±1.
    ///
    /// With U = (α β), V = (A D), P = Uᵀ U and Q = Vᵀ V: U and V are orthogonal, so that
    /// |U Vᵀ + V Uᵀ| = U X Uᵀ + V X⁻¹ Vᵀ with X P X = Q, the geometric mean of P⁻¹ and Q, and the
    /// positive part is ½ W X Wᵀ with W = U + σ V X⁻¹. X = Z Zᵀ (Cholesky) gives z = W Z.
    #[inline]
    fn positive_part(&self, sign: f64) -> [[DVec3; 3]; 2] {
        let [size, mixed, short] = self.products;
        // α·α = A·A = size, α·β = 2 mixed, A·D = mixed, β·β = 4 short, D·D = size + short.
        let p = DMat2::from_cols(
            DVec2::new(size, 2.0 * mixed),
            DVec2::new(2.0 * mixed, 4.0 * short),
        );
        let q = DMat2::from_cols(DVec2::new(size, mixed), DVec2::new(mixed, size + short));
        let x = geometric_mean(p.inverse(), q);
        let inverse = x.inverse() * sign;
        let z11 = x.x_axis.x.sqrt();
        let z21 = x.x_axis.y / z11;
        let z22 = (x.y_axis.y - z21 * z21).max(0.0).sqrt();
        let [alpha, beta] = self.across;
        let [a, d] = self.within;
        let mut forms = [[DVec3::ZERO; 3]; 2];
        for i in 0..3 {
            let w1 = alpha[i] + a[i] * inverse.x_axis.x + d[i] * inverse.x_axis.y;
            let w2 = beta[i] + a[i] * inverse.y_axis.x + d[i] * inverse.y_axis.y;
            forms[0][i] = w1 * z11 + w2 * z21;
            forms[1][i] = w2 * z22;
        }
        forms
    }
}

/// A # B, the symmetric positive definite X with X A⁻¹ X = B, of two such 2 × 2 matrices:
/// √(αβ) (A/α + B/β)/√det(A/α + B/β) with α = √det A, β = √det B.
fn geometric_mean(a: DMat2, b: DMat2) -> DMat2 {
    let (alpha, beta) = (a.determinant().sqrt(), b.determinant().sqrt());
    let sum = a * (1.0 / alpha) + b * (1.0 / beta);
    sum * (alpha * beta / sum.determinant()).sqrt()
}

/// The pairs of a hinge's corners in the order of a [`Hessian`]'s blocks.
pub(super) const PAIRS: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Corners of the two wings, start, end, tip; and the blocks of start–end, start–tip and end–tip.
const WINGS: [([usize; 3], [usize; 3]); 2] = [([0, 1, 2], [0, 1, 3]), ([1, 0, 3], [0, 4, 2])];

/// A hinge's second derivatives between different corners; those on the diagonal are minus the sums
/// of their rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hessian(pub(super) [DMat3; 6]);

impl Hessian {
    /// `slope` ∇θ ⊗ ∇θ: all that damping has, and an energy at rest.
    #[inline]
    pub(super) fn gauss_newton(gradient: &[DVec3; 4], slope: f64) -> Self {
        Self(PAIRS.map(|[i, j]| outer(gradient[i] * slope, gradient[j])))
    }

    /// Adds `moment` ∂²θ, so that the sum is the second derivative of an energy with E″ and E′.
    pub(super) fn add_curvature(&mut self, corners: [DVec3; 4], moment: f64) {
        let Some(wings) = wings(corners) else { return };
        for (wing, (_, blocks)) in wings.iter().zip(WINGS) {
            for k in 0..2 {
                let (u, v) = (&wing.across[k], &wing.within[k]);
                self.add_outer(blocks, u, v, moment);
                self.add_outer(blocks, v, u, moment);
            }
        }
    }

    /// Adds the positive part of each triangle's share of `moment` ∂²θ: the sum is then positive
    /// semi-definite, and not below the second derivative.
    pub(super) fn add_positive_curvature(&mut self, corners: [DVec3; 4], moment: f64) {
        if moment == 0.0 {
            return;
        }
        let Some(wings) = wings(corners) else { return };
        for (wing, (_, blocks)) in wings.iter().zip(WINGS) {
            for form in wing.positive_part(moment.signum()) {
                self.add_outer(blocks, &form, &form, 0.5 * moment.abs());
            }
        }
    }

    /// Adds `factor` uᵢ ⊗ vⱼ of a wing's corners. The wings run along the edge in opposite directions;
    /// the block of the edge is stored for the first one's.
    #[inline]
    fn add_outer(
        &mut self,
        [edge, start_tip, end_tip]: [usize; 3],
        u: &[DVec3; 3],
        v: &[DVec3; 3],
        factor: f64,
    ) {
        let [start, end] = [u[0] * factor, u[1] * factor];
        self.0[edge] += if start_tip == 1 {
            outer(start, v[1])
        } else {
            outer(end, v[0])
        };
        self.0[start_tip] += outer(start, v[2]);
        self.0[end_tip] += outer(end, v[2]);
    }
}

/// The two wings; `None` when a triangle has collapsed, where θ has no derivatives.
#[inline]
fn wings(corners: [DVec3; 4]) -> Option<[Wing; 2]> {
    let [([a, b, c], _), ([d, e, f], _)] = WINGS;
    let first = Wing::of(corners[a], corners[b], corners[c])?;
    Some([first, Wing::of(corners[d], corners[e], corners[f])?])
}
