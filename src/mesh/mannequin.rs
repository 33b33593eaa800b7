//! A shop-window mannequin: a standing figure of 1.75 m for cloth to hang on.
//!
//! The figure is a table of joints, at the places where a body's joints are, and a table of flesh:
//! rounded cones, each carried by the bone between two joints. Flesh is joined by a smooth union
//! and its surface cut into triangles. The joints are within 3 cm of the segment
//! lengths, as shares of the stature, in Winter, "Biomechanics and Motor Control of Human Movement".
//!
//! Metres, y up, facing +z, so that the figure's left is +x; the soles are at y = 0 and the neck
//! stands on x = z = 0. The arms hang 22° from the vertical. Hands are mittens with a thumb, and
//! the face has a nose and a chin: finer features would take more triangles than cloth can feel.

pub(crate) mod skeleton;
pub(crate) mod skin;

use glam::DVec3;

use super::TriMesh;
use super::implicit::{RoundCone, Sample, smooth_min, triangulate};

/// Height of the figure (m).
pub(crate) const STATURE: f64 = 1.75;

/// Grid spacing of the surface (m): gives about 20,000 triangles.
const CELL: f64 = 0.0155;

/// How often the triangles are evened out.
const ROUNDS: usize = 10;

/// Rounding of the soles' edges (m).
const SOLE_EDGE: f64 = 0.010;

/// Width of the fillet between parts that only touch (m): narrower than a cell.
const LEAST_FILLET: f64 = 0.012;

/// Which half of the body something belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// On the plane x = 0.
    Middle,
    /// At x > 0.
    Left,
    /// At x < 0.
    Right,
}

/// Centre of a joint, or the end of a limb.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Joint {
    /// Anatomical name, the same on both sides.
    pub(crate) name: &'static str,
    /// Half of the body.
    pub(crate) side: Side,
    /// Position when standing (m).
    pub(crate) position: DVec3,
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
    flesh("ilium", [0.0, 0.955, -0.002], 0.090, [0.066, 0.920, -0.004], 0.088, 0.04),
    flesh("ilium", [0.066, 0.895, -0.046], 0.066, [0.056, 0.950, -0.036], 0.052, 0.06),
    flesh("abdomen", [0.0, 0.975, -0.002], 0.146, [0.0, 1.095, 0.000], 0.122, 0.04).flat(Z, 0.68),
    flesh("lumbar", [0.0, 1.095, 0.000], 0.121, [0.0, 1.200, 0.000], 0.136, 0.03).flat(Z, 0.70),
    flesh("ribs", [0.0, 1.200, 0.0], 0.136, [0.0, 1.310, -0.006], 0.150, 0.03).flat(Z, 0.73),
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
    flesh("thigh", [0.086, 0.880, -0.004], 0.084, [0.094, 0.720, 0.000], 0.071, 0.02),
    flesh("thigh", [0.094, 0.720, 0.000], 0.071, [0.100, 0.520, 0.0], 0.051, 0.02),
    flesh("thigh", [0.100, 0.840, 0.010], 0.060, [0.101, 0.560, 0.014], 0.044, 0.04),
    flesh("thigh", [0.093, 0.840, -0.014], 0.060, [0.098, 0.560, -0.008], 0.042, 0.04),
    flesh("shank", [0.100, 0.535, 0.008], 0.045, [0.100, 0.470, 0.006], 0.044, 0.03),
    flesh("shank", [0.100, 0.470, 0.002], 0.048, [0.102, 0.380, -0.008], 0.048, 0.03),
    flesh("shank", [0.102, 0.380, -0.008], 0.048, [0.108, 0.125, -0.028], 0.029, 0.02),
    flesh("shank", [0.102, 0.395, -0.030], 0.040, [0.105, 0.270, -0.034], 0.030, 0.06),
    flesh("shank", [0.108, 0.125, -0.028], 0.029, [0.108, 0.078, -0.028], 0.033, 0.02),
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

/// Rounded cones and the widths of their fillets (m).
type Parts = Vec<(RoundCone, f64)>;

/// The flesh of the whole figure.
struct Body {
    /// Each with its twin on the other side; those in the middle without.
    trunk: Vec<(RoundCone, Option<RoundCone>, f64)>,
    arms: Pair,
    legs: Pair,
}

/// Two limbs and how they join the trunk.
struct Pair {
    /// Left, then right.
    limbs: [Parts; 2],
    /// Joints where the limbs begin, left then right (m).
    roots: [DVec3; 2],
    /// Width of the fillet to the trunk at the root (m).
    blend: f64,
    /// Distance from the root at which the limb comes free of the trunk (m).
    reach: f64,
}

/// Joints of the standing figure: the middle ones once, the others left and right.
pub(crate) fn joints() -> Vec<Joint> {
    let mut joints = Vec::with_capacity(2 * JOINTS.len());
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
            add(Side::Right, mirrored(position));
        }
    }
    joints
}

/// The mannequin's surface: closed, triangles counter-clockwise seen from outside.
///
/// The same bits every time.
pub fn mannequin() -> TriMesh {
    let body = Body::standing();
    // The planes x = 0 and y = 0 lie half-way between grid points, where no sample is exactly
    // zero and left mirrors right.
    let half_width = 31.5 * CELL;
    let min = DVec3::new(-half_width, -1.5 * CELL, -0.15);
    let max = DVec3::new(half_width, STATURE + 2.0 * CELL, 0.22);
    let mut mesh = triangulate(|p| body.sample(p), min, max, CELL, ROUNDS);
    stand(&mut mesh);
    mesh
}

/// Shifts and stretches heights, by a tenth of a millimetre, to be 0 to [`STATURE`] exactly.
fn stand(mesh: &mut TriMesh) {
    let heights = || mesh.positions.iter().map(|p| p.y);
    let low = heights().fold(f64::INFINITY, f64::min);
    let high = heights().fold(f64::NEG_INFINITY, f64::max);
    for p in &mut mesh.positions {
        p.y = (p.y - low) / (high - low) * STATURE;
    }
}

/// The same place on the other side.
fn mirrored(p: DVec3) -> DVec3 {
    DVec3::new(-p.x, p.y, p.z)
}

/// The same flesh on the other side.
fn mirrored_cone(cone: &RoundCone) -> RoundCone {
    RoundCone {
        a: mirrored(cone.a),
        b: mirrored(cone.b),
        flat_axis: mirrored(cone.flat_axis),
        ..*cone
    }
}

/// Flesh on the bones of a region, in the order of the table.
fn flesh_of(region: Region) -> impl Iterator<Item = &'static Flesh> {
    FLESH.iter().filter(move |flesh| {
        let bone = BONES.iter().find(|bone| bone.name == flesh.bone);
        bone.is_some_and(|bone| bone.region == region)
    })
}

impl Body {
    /// The figure of the tables.
    fn standing() -> Self {
        let two_sided = |cone: &RoundCone| cone.a.x != 0.0 || cone.b.x != 0.0;
        Self {
            trunk: flesh_of(Region::Trunk)
                .map(|&Flesh { cone, blend, .. }| {
                    let twin = two_sided(&cone).then(|| mirrored_cone(&cone));
                    (cone, twin, blend)
                })
                .collect(),
            arms: Pair::standing(Region::Arm, 0.05),
            legs: Pair::standing(Region::Leg, 0.05),
        }
    }

    /// Distance to the skin at `p`.
    fn sample(&self, p: DVec3) -> Sample {
        let mut trunk = Sample::EMPTY;
        for (cone, twin, blend) in &self.trunk {
            trunk = match twin {
                None => cone.join(trunk, p, *blend),
                Some(twin) => {
                    let both = smooth_min(cone.sample(p), twin.sample(p), *blend);
                    smooth_min(trunk, both, *blend)
                }
            };
        }
        let ground = Sample {
            distance: p.y,
            gradient: DVec3::Y,
        };
        let legs = -smooth_min(-self.legs.sample(p), ground, SOLE_EDGE);
        let body = smooth_min(trunk, legs, self.legs.fillet(p));
        smooth_min(body, self.arms.sample(p), self.arms.fillet(p))
    }
}

impl Pair {
    /// The limbs of a region, joined to the trunk over the first half of their first bone.
    fn standing(region: Region, blend: f64) -> Self {
        let joints = joints();
        let place = |name, side| {
            let joint = joints.iter().find(|j| j.name == name && j.side == side);
            joint.map_or(DVec3::ZERO, |joint| joint.position)
        };
        let first = BONES.iter().find(|bone| bone.region == region);
        let ends = first.map_or([DVec3::ZERO; 2], |bone| {
            [bone.from, bone.to].map(|name| place(name, Side::Left))
        });
        let left: Parts = flesh_of(region).map(|f| (f.cone, f.blend)).collect();
        let right = left.iter().map(|(c, k)| (mirrored_cone(c), *k)).collect();
        Self {
            limbs: [left, right],
            roots: [ends[0], mirrored(ends[0])],
            blend,
            reach: 0.5 * ends[0].distance(ends[1]),
        }
    }

    /// Distance to the nearer limb; the two are hardly joined to each other.
    fn sample(&self, p: DVec3) -> Sample {
        let [left, right] = self.limbs.each_ref().map(|limb| {
            limb.iter().fold(Sample::EMPTY, |limb, (cone, blend)| {
                cone.join(limb, p, *blend)
            })
        });
        smooth_min(left, right, LEAST_FILLET)
    }

    /// Width of the fillet to the trunk at `p` (m): a constant one would web arm and flank.
    fn fillet(&self, p: DVec3) -> f64 {
        let [left, right] = self.roots.map(|root| root.distance(p));
        let near = (1.0 - left.min(right) / self.reach).max(0.0);
        LEAST_FILLET + self.blend * near * near * (3.0 - 2.0 * near)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use super::*;

    static MANNEQUIN: LazyLock<TriMesh> = LazyLock::new(mannequin);

    /// Smallest angle of a triangle (degrees).
    fn least_angle(mesh: &TriMesh, triangle: [u32; 3]) -> f64 {
        let p = triangle.map(|v| mesh.positions[v as usize]);
        (0..3)
            .map(|i| {
                let to = |j: usize| p[(i + j) % 3] - p[i];
                to(1).angle_between(to(2)).to_degrees()
            })
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn every_edge_is_used_once_each_way_and_the_surface_is_a_sphere() {
        let mesh = &*MANNEQUIN;
        let mut edges: Vec<[u32; 2]> = mesh
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .collect();
        edges.sort_unstable();
        assert!(edges.windows(2).all(|pair| pair[0] != pair[1]));
        assert!(
            edges
                .iter()
                .all(|&[a, b]| edges.binary_search(&[b, a]).is_ok())
        );
        let mut used: Vec<u32> = edges.iter().map(|edge| edge[0]).collect();
        used.dedup();
        assert_eq!(used.len(), mesh.positions.len());
        // V − E + F = 2: one piece without handles, as no vertex is idle.
        assert_eq!(used.len() + mesh.triangles.len(), edges.len() / 2 + 2);
        assert!((0.055..0.080).contains(&mesh.volume()));
    }

    #[test]
    fn triangles_are_many_and_well_shaped() {
        let mesh = &*MANNEQUIN;
        assert!((10_000..=30_000).contains(&mesh.triangles.len()));
        let slivers = mesh
            .triangles
            .iter()
            .filter(|&&triangle| least_angle(mesh, triangle) < 15.0)
            .count();
        assert!(slivers * 100 < mesh.triangles.len(), "{slivers} slivers");
    }

    #[test]
    fn stands_on_the_ground_upright_and_even() {
        let mesh = &*MANNEQUIN;
        let (low, high) = mesh.bounds().unwrap();
        assert!(low.y.abs() < 1e-9 && (high.y - STATURE).abs() < 1e-9);
        assert!((low.x + high.x).abs() < 1e-3);
        let neck: Vec<DVec3> = mesh
            .positions
            .iter()
            .copied()
            .filter(|p| (p.y - 1.51).abs() < 0.01)
            .collect();
        let count = f64::from(u32::try_from(neck.len()).unwrap());
        let centre = neck.iter().sum::<DVec3>() / count;
        assert!(centre.x.hypot(centre.z) < 0.01, "{centre}");
    }

    #[test]
    fn is_the_same_every_time() {
        assert!(mannequin() == *MANNEQUIN);
    }

    #[test]
    fn every_bone_has_its_joints_and_all_flesh_a_bone() {
        let known = |name| joints().iter().any(|joint| joint.name == name);
        assert!(BONES.iter().all(|bone| known(bone.from) && known(bone.to)));
        let carried = |flesh: &Flesh| BONES.iter().any(|bone| bone.name == flesh.bone);
        assert!(FLESH.iter().all(carried));
    }

    #[test]
    fn skin_is_at_distance_zero_and_distance_grows_outward() {
        let body = Body::standing();
        for p in MANNEQUIN.positions.iter().filter(|p| p.y > 0.02) {
            let Sample { distance, gradient } = body.sample(*p);
            assert!(distance.abs() < 2e-4, "{distance} at {p}");
            assert!(body.sample(*p + 0.005 * gradient).distance > distance);
        }
    }
}
