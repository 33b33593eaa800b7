//! The walk against what walking is.

mod skin;

use super::*;
use crate::mesh::mannequin::skeleton::{FOREARM, HAND, UPPER_ARM};
use crate::mesh::{TriMesh, mannequin, read_obj, write_obj};
use crate::motion::gait::{self, TOE_OFF};
use std::collections::BTreeMap;
use std::sync::LazyLock;

static MESH: LazyLock<TriMesh> = LazyLock::new(mannequin);

const SPEEDS: [f64; 5] = [0.3, 0.6, 1.2, 1.6, 1.8];

/// A walk that starts at 1 s.
fn walk(speed: f64) -> Walk {
    let gait = Gait {
        speed,
        start: 1.0,
        on_the_spot: false,
    };
    Walk::new(&MESH.positions, gait).unwrap()
}

fn positions(walk: &Walk, time: f64) -> Vec<DVec3> {
    let mut out = vec![DVec3::ZERO; MESH.positions.len()];
    walk.positions(time, &mut out);
    out
}

/// The time (s) at which so many strides have gone by since the start.
fn after(walk: &Walk, strides: f64) -> f64 {
    1.0 + strides / walk.gait.rate()
}

/// Vertices of the soles, each with its side.
fn soles() -> Vec<(usize, usize)> {
    let low = MESH
        .positions
        .iter()
        .enumerate()
        .filter(|(_, p)| p.y < 0.03);
    low.map(|(v, p)| (v, usize::from(p.x < 0.0))).collect()
}

/// Whether a foot is on the ground after so many strides.
fn stands(side: usize, strides: f64) -> bool {
    let phase = FIRST[side] + strides;
    phase < 0.0 || phase - phase.floor() < TOE_OFF
}

#[test]
fn stands_exactly_until_the_start() {
    let walk = walk(1.2);
    for time in [-5.0, 0.0, 1.0] {
        assert!(positions(&walk, time) == MESH.positions);
    }
    let moved = |time: f64| {
        let now = positions(&walk, time);
        let each = now.iter().zip(&MESH.positions).map(|(a, b)| a.distance(*b));
        each.fold(0.0, f64::max)
    };
    // Inverse kinematics gives the standing leg back; from there it goes with the time squared.
    assert!(moved(1.0_f64.next_up()) < 1e-12);
    let [early, later] = [1e-3, 2e-3].map(|t| moved(1.0 + t));
    assert!(early < 1e-5 && later < 4.5 * early, "{early} {later}");
}

/// Against differences of fourth order, at times all over the first strides.
#[test]
fn velocity_is_the_derivative_of_position() {
    for speed in SPEEDS {
        let walk = walk(speed);
        let mut velocity = MESH.positions.clone();
        for k in 0..300 {
            let t = 0.9 + 0.0137 * f64::from(k);
            walk.velocities(t, &mut velocity);
            let h = 1e-4;
            let x = [-2.0, -1.0, 1.0, 2.0].map(|s| positions(&walk, t + s * h));
            for v in (0..velocity.len()).step_by(97) {
                let slope = ((x[2][v] - x[1][v]) * 8.0 - (x[3][v] - x[0][v])) / (12.0 * h);
                let off = (velocity[v] - slope).length();
                // Across a jump of the acceleration of 150 m/s² differences are h/2 of it off.
                assert!(off < 8e-3, "{off} m/s at {t} s, vertex {v}, {speed} m/s");
            }
        }
    }
}

/// No jump of the velocity: it changes by less than 1 cm/s from just before to just after each hundredth of a
/// stride, among them every contact, toe-off and place of the tables.
#[test]
fn goes_smoothly() {
    for speed in SPEEDS {
        let walk = walk(speed);
        let (mut before, mut now) = (MESH.positions.clone(), MESH.positions.clone());
        for k in 0..300 {
            let time = after(&walk, 0.01 * f64::from(k));
            let apart = 3e-6;
            walk.velocities(time - apart, &mut before);
            walk.velocities(time + apart, &mut now);
            for v in (0..now.len()).step_by(61) {
                let jump = (now[v] - before[v]).length();
                assert!(jump < 0.01, "{jump} m/s at {k} %, {speed} m/s");
            }
        }
    }
}

/// In stance no sole is deeper in the ground than 5 mm or higher over it than 1 cm, and none is ever deeper.
#[test]
fn soles_stay_on_the_ground() {
    for speed in SPEEDS {
        let walk = walk(speed);
        for k in 0..700 {
            let strides = 0.01 * f64::from(k);
            let x = positions(&walk, after(&walk, strides));
            let mut low = [f64::INFINITY; 2];
            for (v, side) in soles() {
                low[side] = low[side].min(x[v].y);
            }
            for side in 0..2 {
                assert!(low[side] > -5e-3, "{low:?} m at {strides}, {speed} m/s");
                let hovers = stands(side, strides) && low[side] > 1e-2;
                assert!(!hovers, "{low:?} m at {strides}, {speed} m/s");
            }
        }
    }
}

/// How far a place of the sole goes from where it touched down, while it touches: less than 2 cm, all from the
/// standing feet on.
#[test]
fn feet_do_not_slide() {
    for speed in SPEEDS {
        let walk = walk(speed);
        let mut touched = vec![None; MESH.positions.len()];
        let mut contacts = 0;
        for k in 0..3500 {
            let strides = 0.002 * f64::from(k);
            let x = positions(&walk, after(&walk, strides));
            for (v, side) in soles() {
                if !stands(side, strides) || x[v].y > 3e-3 {
                    touched[v] = None;
                    continue;
                }
                contacts += 1;
                let place: DVec3 = *touched[v].get_or_insert(x[v]);
                let slid = (x[v].x - place.x).hypot(x[v].z - place.z);
                assert!(
                    slid < 0.02,
                    "{slid} m at {strides}, {speed} m/s, {}",
                    MESH.positions[v]
                );
            }
        }
        assert!(contacts > 100_000);
    }
}

#[test]
fn goes_at_the_speed_asked() {
    for speed in SPEEDS {
        let walk = walk(speed);
        let mean = |x: &[DVec3]| x.iter().sum::<DVec3>() / x.len() as f64;
        let times = [4.0, 9.0].map(|strides| after(&walk, strides));
        let [from, to] = times.map(|t| mean(&positions(&walk, t)));
        let found = (to - from) / (times[1] - times[0]);
        assert!((found - DVec3::Z * speed).length() < 1e-9, "{found}");
    }
}

/// On the spot the walk is the same, seen from a body that goes with it: soles go back with the belt.
#[test]
fn walks_on_the_spot() {
    let ahead = walk(1.2);
    let gait = Gait {
        on_the_spot: true,
        ..ahead.gait
    };
    let spot = Walk::new(&MESH.positions, gait).unwrap();
    let [here, there] = [4.0, 9.0].map(|strides| positions(&spot, after(&spot, strides)));
    assert!(here.iter().zip(&there).all(|(a, b)| a.distance(*b) < 1e-12));
    let mut velocity = MESH.positions.clone();
    // The left foot is flat a fifth of a stride after its contact; the heel's skin goes a little with the shank.
    spot.velocities(after(&spot, 4.2 - FIRST[0]), &mut velocity);
    for (v, _) in soles().into_iter().filter(|(_, side)| *side == 0) {
        let off = (velocity[v] + 1.2 * DVec3::Z).length();
        let most = if MESH.positions[v].z > 0.1 {
            1e-7
        } else {
            0.02
        };
        assert!(off < most, "{off} m/s at {}", MESH.positions[v]);
    }
}

#[test]
fn bones_keep_their_lengths() {
    let walk = walk(1.5);
    for k in 0..300 {
        let pose = walk.pose(0.02 * f64::from(k));
        let changes = skeleton::changes(&pose, &walk.rest);
        let at = |link: usize, x: DVec3| x + changes[link].turn * x + changes[link].shift;
        let bones = [
            (THIGH, SHANK),
            (SHANK, FOOT),
            (FOOT, TOES),
            (UPPER_ARM, FOREARM),
            (FOREARM, HAND),
        ];
        for (side, (link, next)) in [0, 1].into_iter().flat_map(|s| bones.map(|bone| (s, bone))) {
            let ends = [link[side], next[side]].map(|joint| walk.rest[joint]);
            let moved = ends.map(|end| at(link[side], end));
            let change = moved[0].distance(moved[1]) - ends[0].distance(ends[1]);
            assert!(change.abs() < 1e-14, "{change} m");
            let apart = moved[1].distance(at(next[side], ends[1]));
            assert!(apart < 1e-13, "the next one hangs {apart} m off its end");
        }
    }
}

/// Thigh, knee and ankle (degrees) of the left leg over a stride, each with its phase.
fn angles(walk: &Walk) -> Vec<(f64, [f64; 3])> {
    let limb = walk.limb(0);
    let forwards = |v: DVec3| v.z.atan2(-v.y).to_degrees();
    let each = (0..200).map(|k| {
        let phase = 0.005 * f64::from(k);
        let moment = walk.moment((5.0 + phase - FIRST[0]) / walk.gait.rate());
        let pose = walk.upper(&moment);
        let placed = walk.placed(&pose, &moment, 0);
        let bent = walk.leg(&pose, &placed, 0);
        let shank = forwards(bent.shank * limb.shank);
        let ankle = placed.pitch[0].to_degrees() - (shank - forwards(limb.shank));
        let thigh = forwards(bent.thigh * limb.thigh);
        (phase, [thigh, bent.flexion.to_degrees(), ankle])
    });
    each.collect()
}

/// Ranges and courses of hip, knee and ankle against the published ones, at the speed measured.
#[test]
fn joints_go_as_measured() {
    let walk = walk(1.37);
    let all = angles(&walk);
    let range = |joint: usize| {
        let each = || all.iter().map(|(_, angles)| angles[joint]);
        [
            each().fold(f64::INFINITY, f64::min),
            each().fold(f64::NEG_INFINITY, f64::max),
        ]
    };
    // Perry and Burnfield 2010: thigh 20° back to 25° ahead, knee 0-5° to 60°, ankle 15-20° down to 10° up.
    let measured = [[-20.0, 25.0], [5.0, 61.0], [-18.0, 10.0]];
    for joint in 0..3 {
        let found = range(joint);
        for end in 0..2 {
            let off = found[end] - measured[joint][end];
            assert!(off.abs() < 6.0, "joint {joint}: {found:?}");
        }
    }
    // While the foot stands. The knee is bent some 6° more than published, for feet that don't slide; swinging, it
    // lags behind by a twentieth of a stride.
    let standing = || all.iter().filter(|(phase, _)| (0.05..0.55).contains(phase));
    for (joint, curve, most) in [(0, gait::THIGH, 3.0), (1, gait::KNEE, 9.0)] {
        let squares = standing().map(|(phase, angles)| {
            let off = angles[joint] - curve.at(*phase).to_degrees();
            off * off
        });
        let off = (squares.sum::<f64>() / standing().count() as f64).sqrt();
        assert!(off < most, "joint {joint} is {off}° off");
    }
}

/// No leg is ever too short for its foot, which would then leave its path.
#[test]
fn legs_reach_their_feet() {
    for speed in SPEEDS {
        let walk = walk(speed);
        for k in 0..1500 {
            let moment = walk.moment(0.004 * f64::from(k) / walk.gait.rate());
            let pose = walk.upper(&moment);
            for side in 0..2 {
                let placed = walk.placed(&pose, &moment, side);
                let bent = walk.leg(&pose, &placed, side);
                assert!(
                    bent.flexion.to_degrees() > 4.5,
                    "{} rad at {k}",
                    bent.flexion
                );
                let pose = walk.pose(0.004 * f64::from(k) / walk.gait.rate());
                let ankle = skeleton::changes(&pose, &walk.rest)[FOOT[side]];
                let rest = walk.rest[FOOT[side]];
                let off = (rest + ankle.turn * rest + ankle.shift).distance(placed.ankle);
                assert!(off < 1e-12, "{off} m at {k}");
            }
        }
    }
}

#[test]
fn left_is_right_half_a_stride_later() {
    let walk = walk(1.2);
    let [now, later] = [3.2, 3.7].map(|strides| walk.pose(strides / walk.gait.rate()));
    for side in 0..2 {
        for link in [THIGH, SHANK, FOOT, TOES, UPPER_ARM, FOREARM, HAND] {
            let (a, b) = (now.turns[link[side]], later.turns[link[1 - side]]);
            let mirrored = DQuat::from_xyzw(b.x, -b.y, -b.z, b.w);
            assert!(a.dot(mirrored).abs() > 1.0 - 1e-12, "{a} {mirrored}");
        }
    }
}

#[test]
fn gives_the_same_bits_on_any_number_of_threads() {
    let walk = walk(1.2);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let mut velocity = MESH.positions.clone();
            walk.velocities(2.345, &mut velocity);
            (positions(&walk, 2.345), velocity)
        })
    };
    assert!(on(1) == on(2) && on(1) == on(3));
}

/// Reading orders vertices by their first use.
#[test]
fn the_file_walks_like_the_description() {
    let (file, _) = read_obj(&write_obj(&MESH, "as written"), 1.0).unwrap();
    let from_file = Walk::new(&file.positions, walk(1.2).gait).unwrap();
    let mut walked = file.positions.clone();
    from_file.positions(3.3, &mut walked);
    let described = positions(&walk(1.2), 3.3);
    let place = |p: DVec3| (1e5 * p).round().as_i64vec3().to_array();
    let all = (0..described.len()).map(|v| (place(MESH.positions[v]), v));
    let order: BTreeMap<_, _> = all.collect();
    for (p, x) in file.positions.iter().zip(walked) {
        // Printed to 5 µm; shares change over centimetres, while links move by half a metre.
        let off = order.get(&place(*p)).map(|&v| x.distance(described[v]));
        assert!(off.is_some_and(|off| off < 2e-4), "{off:?} at {p}");
    }
}

#[test]
fn says_what_it_cannot_walk() {
    let gait = walk(1.2).gait;
    let refused = |positions: &[DVec3], gait| Walk::new(positions, gait).unwrap_err();
    for speed in [0.0, 0.29, 1.81, -1.0, f64::NAN] {
        let said = refused(&MESH.positions, Gait { speed, ..gait });
        assert!(said.contains("between 0.3 and 1.8"), "{said}");
    }
    let start = f64::INFINITY;
    assert!(refused(&MESH.positions, Gait { start, ..gait }).contains("no time"));
    assert!(refused(&MESH.positions[1..], gait).contains("9699 vertices"));
    let all = |change: fn(DVec3) -> DVec3| {
        MESH.positions
            .iter()
            .map(|p| change(*p))
            .collect::<Vec<_>>()
    };
    for other in [
        all(|p| p * 1000.0),
        all(|p| p + 0.01 * DVec3::X),
        all(|p| DVec3::new(p.z, p.y, p.x)),
    ] {
        let said = refused(&other, gait);
        assert!(said.contains("off the mannequin"), "{said}");
    }
}
