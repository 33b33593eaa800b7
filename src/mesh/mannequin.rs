//! A shop-window mannequin: a standing figure of 1.75 m for cloth to hang on.
//!
//! The figure is a table of joints, at the places where a body's joints are, and a table of flesh:
//! rounded cones, each carried by the bone between two joints. Flesh is joined by a smooth union
//! and its surface cut into triangles. Proportions follow the body segment lengths, as shares of
//! the stature, of Winter, "Biomechanics and Motor Control of Human Movement", figure 4.1.
//!
//! Metres, y up, facing +z, so that the figure's left is +x; the soles are at y = 0 and the neck
//! stands on x = z = 0. The arms hang 22° from the vertical. Hands are mittens with a thumb, and
//! the face has a nose and a chin: finer features would take more triangles than cloth can feel.

use glam::DVec3;

use super::TriMesh;
use super::implicit::{RoundCone, Sample, smooth_min, triangulate};

/// Height of the figure (m).
pub const STATURE: f64 = 1.75;

/// Grid spacing of the surface (m): gives about 20,000 triangles.
const CELL: f64 = 0.0155;

/// How often the triangles are evened out.
const ROUNDS: usize = 12;

/// Which half of the body something belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// On the plane x = 0.
    Middle,
    /// At x > 0.
    Left,
    /// At x < 0.
    Right,
}

/// Centre of a joint, or the end of a limb.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Anatomical name, the same on both sides.
    pub name: &'static str,
    /// Half of the body.
    pub side: Side,
    /// Position when standing (m).
    pub position: DVec3,
}

/// What a bone is part of; parts keep apart where they are not joined by a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Region {
    Trunk,
    Arm,
    Leg,
}

/// The line between two joints.
#[derive(Clone, Copy, Debug)]
struct Bone {
    name: &'static str,
    region: Region,
    from: &'static str,
    to: &'static str,
}

/// A rounded cone of flesh on a bone.
#[derive(Clone, Copy, Debug)]
struct Flesh {
    /// The bone that carries it.
    bone: &'static str,
    /// Its shape when standing.
    cone: RoundCone,
    /// Width of the fillet to the flesh above it in the table (m).
    blend: f64,
}

/// Joints of the middle and of the left side; the right side is their mirror image.
const JOINTS: [(&str, [f64; 3]); 20] = [
    ("pelvis", [0.0, 0.955, -0.010]),
    ("spine", [0.0, 1.100, -0.025]),
    ("chest", [0.0, 1.250, -0.030]),
    ("neck", [0.0, 1.460, 0.0]),
    ("head", [0.0, 1.570, 0.0]),
    ("crown", [0.0, 1.750, 0.0]),
    ("clavicle", [0.020, 1.425, 0.025]),
    ("shoulder", [0.168, 1.405, -0.015]),
    ("elbow", [0.284, 1.122, -0.025]),
    ("wrist", [0.378, 0.888, -0.005]),
    ("knuckle", [0.409, 0.803, 0.005]),
    ("fingertip", [0.434, 0.715, 0.015]),
    ("hip", [0.088, 0.920, -0.005]),
    ("knee", [0.100, 0.500, 0.0]),
    ("ankle", [0.108, 0.080, -0.030]),
    ("heel", [0.108, 0.030, -0.060]),
    ("ball", [0.122, 0.025, 0.100]),
    ("toe", [0.130, 0.018, 0.160]),
    ("jaw", [0.050, 1.595, 0.010]),
    ("chin", [0.0, 1.545, 0.070]),
];

/// Bones, each once for both sides.
const BONES: [Bone; 16] = [
    bone("abdomen", Region::Trunk, "pelvis", "spine"),
    bone("lumbar", Region::Trunk, "spine", "chest"),
    bone("ribs", Region::Trunk, "chest", "neck"),
    bone("cervical", Region::Trunk, "neck", "head"),
    bone("skull", Region::Trunk, "head", "crown"),
    bone("mandible", Region::Trunk, "jaw", "chin"),
    bone("collarbone", Region::Trunk, "clavicle", "shoulder"),
    bone("ilium", Region::Trunk, "pelvis", "hip"),
    bone("upper arm", Region::Arm, "shoulder", "elbow"),
    bone("forearm", Region::Arm, "elbow", "wrist"),
    bone("palm", Region::Arm, "wrist", "knuckle"),
    bone("fingers", Region::Arm, "knuckle", "fingertip"),
    bone("thigh", Region::Leg, "hip", "knee"),
    bone("shank", Region::Leg, "knee", "ankle"),
    bone("foot", Region::Leg, "ankle", "ball"),
    bone("toes", Region::Leg, "ball", "toe"),
];

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
/// Out of the back of the left hand: across the arm, in the plane of the figure.
const HAND: [f64; 3] = [0.940, 0.341, 0.0];

/// Flesh of the middle and of the left side, in the order in which it is joined.
#[rustfmt::skip]
const FLESH: [Flesh; 43] = [
    // Trunk, from the pelvis up.
    flesh("ilium", [0.0, 0.955, -0.004], 0.092, [0.072, 0.920, -0.006], 0.090, 0.04),
    flesh("ilium", [0.070, 0.895, -0.050], 0.066, [0.060, 0.940, -0.040], 0.055, 0.04),
    flesh("abdomen", [0.0, 0.970, 0.004], 0.148, [0.0, 1.095, 0.004], 0.121, 0.04).flat(Z, 0.68),
    flesh("lumbar", [0.0, 1.095, 0.004], 0.121, [0.0, 1.200, 0.000], 0.136, 0.03).flat(Z, 0.68),
    flesh("ribs", [0.0, 1.200, 0.0], 0.136, [0.0, 1.310, -0.006], 0.150, 0.03).flat(Z, 0.70),
    flesh("ribs", [0.020, 1.375, -0.014], 0.074, [0.110, 1.385, -0.018], 0.060, 0.08),
    flesh("ribs", [0.058, 1.315, 0.058], 0.042, [0.105, 1.350, 0.032], 0.040, 0.06),
    flesh("ribs", [0.085, 1.360, -0.060], 0.044, [0.075, 1.230, -0.045], 0.044, 0.06),
    flesh("collarbone", [0.010, 1.485, -0.018], 0.034, [0.140, 1.420, -0.018], 0.036, 0.06),
    flesh("cervical", [0.0, 1.410, 0.0], 0.060, [0.0, 1.480, 0.0], 0.052, 0.05),
    flesh("cervical", [0.0, 1.480, 0.0], 0.052, [0.0, 1.590, 0.0], 0.050, 0.02),
    // Head.
    flesh("skull", [0.0, 1.656, -0.004], 0.094, [0.0, 1.646, 0.014], 0.086, 0.02).flat(X, 0.80),
    flesh("skull", [0.0, 1.630, 0.034], 0.062, [0.0, 1.572, 0.050], 0.036, 0.04).flat(X, 0.92),
    flesh("mandible", [0.042, 1.600, 0.008], 0.020, [0.010, 1.556, 0.066], 0.016, 0.04),
    flesh("skull", [0.0, 1.650, 0.094], 0.005, [0.0, 1.618, 0.108], 0.009, 0.02),
    // Arm.
    flesh("upper arm", [0.168, 1.402, -0.015], 0.050, [0.200, 1.325, -0.018], 0.048, 0.02),
    flesh("upper arm", [0.200, 1.325, -0.018], 0.048, [0.284, 1.122, -0.025], 0.036, 0.02),
    flesh("upper arm", [0.222, 1.270, -0.008], 0.038, [0.255, 1.190, -0.012], 0.034, 0.03),
    flesh("upper arm", [0.215, 1.290, -0.030], 0.038, [0.250, 1.200, -0.034], 0.032, 0.03),
    flesh("forearm", [0.284, 1.122, -0.025], 0.036, [0.303, 1.074, -0.022], 0.040, 0.02),
    flesh("forearm", [0.303, 1.074, -0.022], 0.040, [0.374, 0.898, -0.006], 0.026, 0.02),
    flesh("palm", [0.374, 0.898, -0.006], 0.026, [0.383, 0.874, -0.003], 0.028, 0.02)
        .flat(HAND, 0.80),
    flesh("palm", [0.386, 0.866, -0.001], 0.032, [0.406, 0.812, 0.003], 0.040, 0.02)
        .flat(HAND, 0.42),
    flesh("fingers", [0.406, 0.812, 0.003], 0.040, [0.421, 0.765, 0.006], 0.037, 0.01)
        .flat(HAND, 0.40),
    flesh("fingers", [0.421, 0.765, 0.006], 0.037, [0.427, 0.732, 0.009], 0.028, 0.01)
        .flat(HAND, 0.42),
    flesh("palm", [0.384, 0.868, 0.014], 0.018, [0.390, 0.838, 0.050], 0.016, 0.02),
    flesh("palm", [0.390, 0.838, 0.050], 0.016, [0.397, 0.806, 0.072], 0.013, 0.01),
    // Leg.
    flesh("thigh", [0.090, 0.890, -0.004], 0.086, [0.095, 0.720, 0.000], 0.074, 0.02),
    flesh("thigh", [0.095, 0.720, 0.000], 0.074, [0.100, 0.520, 0.0], 0.051, 0.02),
    flesh("thigh", [0.102, 0.780, 0.026], 0.056, [0.101, 0.600, 0.018], 0.044, 0.04),
    flesh("thigh", [0.093, 0.780, -0.026], 0.056, [0.098, 0.600, -0.012], 0.044, 0.04),
    flesh("shank", [0.100, 0.530, 0.010], 0.046, [0.100, 0.470, 0.008], 0.045, 0.04),
    flesh("shank", [0.100, 0.470, 0.002], 0.048, [0.102, 0.380, -0.008], 0.048, 0.03),
    flesh("shank", [0.102, 0.380, -0.008], 0.048, [0.108, 0.130, -0.028], 0.031, 0.02),
    flesh("shank", [0.102, 0.395, -0.030], 0.040, [0.105, 0.270, -0.034], 0.030, 0.06),
    flesh("shank", [0.108, 0.130, -0.028], 0.031, [0.108, 0.078, -0.028], 0.033, 0.02),
    flesh("foot", [0.108, 0.085, -0.048], 0.020, [0.108, 0.030, -0.056], 0.031, 0.04),
    flesh("foot", [0.109, 0.072, -0.018], 0.032, [0.118, 0.038, 0.065], 0.028, 0.04),
    flesh("foot", [0.108, 0.020, -0.050], 0.028, [0.124, 0.018, 0.085], 0.034, 0.03),
    flesh("foot", [0.106, 0.024, 0.100], 0.025, [0.146, 0.018, 0.088], 0.021, 0.03),
    flesh("toes", [0.106, 0.024, 0.100], 0.025, [0.113, 0.016, 0.160], 0.019, 0.02),
    flesh("toes", [0.128, 0.020, 0.098], 0.023, [0.132, 0.015, 0.152], 0.017, 0.02),
    flesh("toes", [0.146, 0.018, 0.088], 0.021, [0.149, 0.014, 0.134], 0.016, 0.02),
];

const fn bone(name: &'static str, region: Region, from: &'static str, to: &'static str) -> Bone {
    Bone {
        name,
        region,
        from,
        to,
    }
}

/// Round flesh from the ball of centre `a` and radius `ra` to that of `b` and `rb` (m).
const fn flesh(
    bone: &'static str,
    a: [f64; 3],
    ra: f64,
    b: [f64; 3],
    rb: f64,
    blend: f64,
) -> Flesh {
    let cone = RoundCone {
        a: DVec3::from_array(a),
        b: DVec3::from_array(b),
        ra,
        rb,
        flat_axis: DVec3::Z,
        flatness: 1.0,
    };
    Flesh { bone, cone, blend }
}

impl Flesh {
    /// The same, thinner along the unit vector `axis` by the factor `flatness`.
    const fn flat(mut self, axis: [f64; 3], flatness: f64) -> Self {
        self.cone.flat_axis = DVec3::from_array(axis);
        self.cone.flatness = flatness;
        self
    }
}

/// An arm or a leg: its flesh, and how it joins the trunk.
struct Limb {
    flesh: Vec<(RoundCone, f64)>,
    /// Where the limb begins (m).
    root: DVec3,
}

/// The flesh of the whole body, side by side.
struct Body {
    /// Left, then right or the same again; and the blend (m).
    trunk: Vec<(RoundCone, Option<RoundCone>, f64)>,
    arms: [Limb; 2],
    legs: [Limb; 2],
}

/// Joints of the standing figure: the middle ones once, the others left and right.
pub fn joints() -> Vec<Joint> {
    let mut joints = Vec::new();
    for (name, position) in JOINTS {
        let position = DVec3::from_array(position);
        let mut add = |side, position| {
            joints.push(Joint {
                name,
                side,
                position,
            });
        };
        if position.x == 0.0 {
            add(Side::Middle, position);
        } else {
            add(Side::Left, position);
            add(Side::Right, mirror(position));
        }
    }
    joints
}

/// The mannequin's surface: closed, triangles counter-clockwise seen from outside.
///
/// The same bits every time.
pub fn mannequin() -> TriMesh {
    let body = Body::standing();
    // x = 0 is half-way between grid points, like y = 0, so that no sample is exactly zero.
    let half_span = CELL * 32.5;
    let min = DVec3::new(-half_span, -1.5 * CELL, -0.15);
    let max = DVec3::new(half_span, STATURE + 2.0 * CELL, 0.23);
    let mut mesh = triangulate(|p| body.sample(p), min, max, CELL, ROUNDS);
    stand(&mut mesh);
    mesh
}

/// Shifts and stretches heights, by about a millimetre, to be 0 to [`STATURE`] exactly.
fn stand(mesh: &mut TriMesh) {
    let heights = || mesh.positions.iter().map(|p| p.y);
    let low = heights().fold(f64::INFINITY, f64::min);
    let high = heights().fold(f64::NEG_INFINITY, f64::max);
    for p in &mut mesh.positions {
        p.y = (p.y - low) / (high - low) * STATURE;
    }
}

/// The same place on the other side.
fn mirror(p: DVec3) -> DVec3 {
    DVec3::new(-p.x, p.y, p.z)
}

/// The same flesh on the other side.
fn mirror_cone(cone: RoundCone) -> RoundCone {
    RoundCone {
        a: mirror(cone.a),
        b: mirror(cone.b),
        flat_axis: mirror(cone.flat_axis),
        ..cone
    }
}

impl Body {
    /// The figure of the tables.
    fn standing() -> Self {
        let of = |region| {
            FLESH.iter().filter(move |flesh| {
                let bone = BONES.iter().find(|bone| bone.name == flesh.bone);
                bone.is_some_and(|bone| bone.region == region)
            })
        };
        let limb = |region, root: [f64; 3]| {
            let left = Limb {
                flesh: of(region).map(|f| (f.cone, f.blend)).collect(),
                root: DVec3::from_array(root),
            };
            let right = Limb {
                flesh: of(region)
                    .map(|f| (mirror_cone(f.cone), f.blend))
                    .collect(),
                root: mirror(left.root),
            };
            [left, right]
        };
        let two_sided = |cone: RoundCone| (cone.a.x != 0.0 || cone.b.x != 0.0).then(|| mirror_cone(cone));
        Self {
            trunk: of(Region::Trunk)
                .map(|f| (f.cone, two_sided(f.cone), f.blend))
                .collect(),
            arms: limb(Region::Arm, [0.168, 1.405, -0.015]),
            legs: limb(Region::Leg, [0.088, 0.920, -0.005]),
        }
    }

    /// Distance to the skin at `p`.
    fn sample(&self, p: DVec3) -> Sample {
        let trunk = self.trunk.iter().fold(Sample::EMPTY, |trunk, (cone, twin, blend)| {
            let mut part = cone.sample(p);
            if let Some(twin) = twin {
                part = smooth_min(part, twin.sample(p), *blend);
            }
            smooth_min(trunk, part, *blend)
        });
        let ground = Sample { distance: p.y, gradient: DVec3::Y };
        let legs = pair(&self.legs, p);
        let legs = -smooth_min(-legs, ground, 0.010);
        let trunk = smooth_min(trunk, legs, joined(&self.legs, p, 0.10, 0.20));
        smooth_min(trunk, pair(&self.arms, p), joined(&self.arms, p, 0.06, 0.14))
    }
}

/// Left and right limb, hardly joined to each other.
fn pair([left, right]: &[Limb; 2], p: DVec3) -> Sample {
    smooth_min(left.sample(p), right.sample(p), 0.01)
}

/// Width of the fillet between limb and trunk (m): `blend` at the limb's root, little from `reach` on.
///
/// A constant one would web the arm to the flank.
fn joined(limbs: &[Limb; 2], p: DVec3, blend: f64, reach: f64) -> f64 {
    let [left, right] = limbs.each_ref().map(|limb| limb.root.distance(p));
    let near = (1.0 - left.min(right) / reach).max(0.0);
    0.012 + blend * near * near * (3.0 - 2.0 * near)
}

impl Limb {
    fn sample(&self, p: DVec3) -> Sample {
        self.flesh.iter().fold(Sample::EMPTY, |limb, (cone, blend)| {
            smooth_min(limb, cone.sample(p), *blend)
        })
    }
}
