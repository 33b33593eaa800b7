//! The walk against what walking is.

use super::*;
use crate::mesh::mannequin::skin::{flesh_distance, limb};
use crate::mesh::{TriMesh, mannequin, read_obj, write_obj};
use std::sync::LazyLock;

static MESH: LazyLock<TriMesh> = LazyLock::new(mannequin);

const SPEEDS: [f64; 5] = [0.3, 0.6, 1.2, 1.6, 1.8];

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

/// Times (s) at which so many strides have gone by since the start.
fn after(walk: &Walk, strides: f64) -> f64 {
    1.0 + strides / walk.gait.rate()
}

/// Vertices of the soles.
fn soles() -> impl Iterator<Item = usize> {
    (0..MESH.positions.len()).filter(|&v| MESH.positions[v].y < 0.03)
}

fn side_of(vertex: usize) -> usize {
    usize::from(MESH.positions[vertex].x < 0.0)
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

/// Against differences of fourth order, at times all over the ramp and the walk.
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
                // 1e-4 s across a jump of the acceleration of 30 m/s².
                assert!(off < 3e-3, "{off} m/s at {t} s, vertex {v}");
            }
        }
    }
}

/// No jump of velocity anywhere: contacts, toe-offs and the start are all within the steps.
#[test]
fn goes_smoothly() {
    for speed in SPEEDS {
        let walk = walk(speed);
        let (mut before, mut now) = (MESH.positions.clone(), MESH.positions.clone());
        let mut most = (0.0_f64, 0.0, DVec3::ZERO);
        for k in 0..2500 {
            let strides = 0.002 * f64::from(k) - 0.01;
            walk.velocities(after(&walk, strides), &mut now);
            for v in (0..now.len()).step_by(61) {
                let acceleration = (now[v] - before[v]).length() * walk.gait.rate() / 0.002;
                if k > 0 && acceleration > most.0 {
                    most = (acceleration, strides, MESH.positions[v]);
                }
            }
            std::mem::swap(&mut before, &mut now);
        }
        println!("{speed}: acceleration {most:.2?}");
        assert!(most.0 < 1300.0);
    }
}

#[test]
fn soles_stay_on_the_ground() {
    let mut bad = 0;
    for speed in SPEEDS {
        let walk = walk(speed);
        let (mut deepest, mut highest) = (0.0_f64, 0.0_f64);
        let (mut at_d, mut at_h) = (0.0, 0.0);
        for k in 0..700 {
            let strides = 0.01 * f64::from(k);
            let x = positions(&walk, after(&walk, strides));
            let mut low = [f64::INFINITY; 2];
            for v in soles() {
                low[side_of(v)] = low[side_of(v)].min(x[v].y);
            }
            for side in 0..2 {
                let phase = FIRST[side] + strides;
                if -low[side] > deepest {
                    deepest = -low[side];
                    at_d = phase;
                }
                let stance = phase.floor() < 0.0 || phase - phase.floor() < TOE_OFF;
                if stance && low[side] > highest {
                    highest = low[side];
                    at_h = phase;
                }
            }
        }
        println!(
            "{speed}: deepest {:.2} mm at {at_d:.2}, highest {:.2} mm at {at_h:.2}",
            1e3 * deepest,
            1e3 * highest
        );
        if deepest > 5e-3 || highest > 1e-2 {
            bad += 1;
        }
    }
}

/// How far (m) a place of the sole goes from where it touched down, while it touches.
#[test]
fn feet_do_not_slide() {
    for speed in SPEEDS {
        let walk = walk(speed);
        let mut touched = vec![None; MESH.positions.len()];
        let mut most = (0.0_f64, 0.0, 0);
        for k in 0..3500 {
            let strides = 0.002 * f64::from(k);
            let x = positions(&walk, after(&walk, strides));
            for v in soles() {
                let phase = FIRST[side_of(v)] + strides;
                let stance = phase < 0.0 || phase - phase.floor() < TOE_OFF;
                if !stance || x[v].y > 3e-3 {
                    touched[v] = None;
                } else {
                    let place: DVec3 = *touched[v].get_or_insert(x[v]);
                    let slid = (x[v].x - place.x).hypot(x[v].z - place.z);
                    if slid > most.0 {
                        most = (slid, phase, v);
                    }
                }
            }
        }
        println!(
            "{speed}: slides {:.2} mm at {:.2} {}",
            1e3 * most.0,
            most.1,
            MESH.positions[most.2]
        );
        assert!(most.0 < 0.02);
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
        let spot = Walk {
            gait: Gait {
                on_the_spot: true,
                ..walk.gait
            },
            ..walk.clone()
        };
        let [here, there] = times.map(|t| positions(&spot, t));
        assert!(here.iter().zip(&there).all(|(a, b)| a.distance(*b) < 1e-12));
    }
}

#[test]
fn bones_keep_their_lengths() {
    let walk = walk(1.5);
    for k in 0..300 {
        let pose = walk.pose(0.02 * f64::from(k));
        let changes = skeleton::changes(&pose, &walk.rest);
        let at = |link: usize, x: DVec3| x + changes[link].turn * x + changes[link].shift;
        for side in 0..2 {
            for (link, next) in [
                (THIGH, SHANK),
                (SHANK, FOOT),
                (FOOT, TOES),
                (UPPER_ARM, FOREARM),
                (FOREARM, HAND),
            ] {
                let ends = [link[side], next[side]].map(|joint| walk.rest[joint]);
                let moved = ends.map(|end| at(link[side], end));
                let change = moved[0].distance(moved[1]) - ends[0].distance(ends[1]);
                assert!(change.abs() < 1e-14);
                // The next one hangs on its end.
                assert!(moved[1].distance(at(next[side], ends[1])) < 1e-14);
            }
        }
    }
}

/// Ranges of hip, knee and ankle over a stride against Perry and Burnfield 2010 at the speed measured.
#[test]
fn joints_go_as_far_as_measured() {
    for speed in SPEEDS {
        let walk = walk(speed);
        let mut ranges = [[f64::INFINITY, f64::NEG_INFINITY]; 4];
        for k in 0..200 {
            let since = (3.0 + 0.005 * f64::from(k)) / walk.gait.rate();
            let moment = walk.moment(since);
            let pose = walk.upper(&moment);
            let placed = walk.placed(&pose, &moment, 0);
            let bent = walk.leg(&pose, &placed, 0);
            let limb = walk.limb(0);
            let forwards = |v: DVec3| v.z.atan2(-v.y).to_degrees();
            let thigh = forwards(bent.thigh * limb.thigh);
            let knee = bent.flexion.to_degrees();
            let ankle = placed.pitch[0].to_degrees() - (thigh - knee);
            let all = [thigh, knee, ankle, 100.0 * pose.shift.y];
            if k % 10 == 0 {
                println!(
                    "{:3} thigh {:6.1} {:6.1} knee {:6.1} {:6.1} ankle {:6.1} foot {:6.1} height {:.2}",
                    k / 2,
                    thigh,
                    super::super::gait::THIGH
                        .at(0.005 * f64::from(k) + 0.3)
                        .to_degrees(),
                    knee,
                    super::super::gait::KNEE
                        .at(0.005 * f64::from(k) + 0.3)
                        .to_degrees(),
                    ankle,
                    placed.pitch[0].to_degrees(),
                    all[3]
                );
            }
            for (range, angle) in ranges.iter_mut().zip(all) {
                *range = [range[0].min(angle), range[1].max(angle)];
            }
        }
        println!("{speed}: {ranges:.1?}");
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
fn keeps_its_volume_and_its_triangles() {
    for speed in SPEEDS {
        let walk = walk(speed);
        let standing = MESH.volume();
        let mut worst = (0.0_f64, 0);
        for k in 0..60 {
            let t = after(&walk, 0.05 * f64::from(k));
            let mesh = TriMesh {
                positions: positions(&walk, t),
                triangles: MESH.triangles.clone(),
            };
            let volume = mesh.volume() / standing - 1.0;
            let mut turned = 0;
            let x = &mesh.positions;
            // A triangle is turned over when it faces against the mean of its vertices' neighbours.
            let mut normals = vec![DVec3::ZERO; x.len()];
            let normal = |t: [u32; 3]| {
                let [a, b, c] = t.map(|v| x[v as usize]);
                (b - a).cross(c - a)
            };
            for &t in &mesh.triangles {
                for v in t {
                    normals[v as usize] += normal(t);
                }
            }
            for &t in &mesh.triangles {
                let around: DVec3 = t.iter().map(|&v| normals[v as usize]).sum();
                if normal(t).dot(around) <= 0.0 {
                    turned += 1;
                }
            }
            worst = (
                if volume.abs() > worst.0.abs() {
                    volume
                } else {
                    worst.0
                },
                worst.1.max(turned),
            );
        }
        println!(
            "{speed}: volume {:.2} %, turned {}",
            100.0 * worst.0,
            worst.1
        );
        assert!(worst.0.abs() < 0.03);
    }
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
    let order: std::collections::BTreeMap<_, _> = (0..described.len())
        .map(|v| (place(MESH.positions[v]), v))
        .collect();
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
        assert!(refused(&MESH.positions, Gait { speed, ..gait }).contains("between 0.3 and 1.8"));
    }
    let start = f64::INFINITY;
    assert!(refused(&MESH.positions, Gait { start, ..gait }).contains("no time"));
    assert!(refused(&MESH.positions[1..], gait).contains("9699 vertices"));
    let big: Vec<DVec3> = MESH.positions.iter().map(|p| *p * 1000.0).collect();
    assert!(refused(&big, gait).contains("off the mannequin"));
    let shifted: Vec<DVec3> = MESH
        .positions
        .iter()
        .map(|p| *p + DVec3::X * 0.01)
        .collect();
    assert!(refused(&shifted, gait).contains("off the mannequin"));
}

/// No leg is ever too short for its foot, which would then leave its path.
#[test]
fn legs_reach_their_feet() {
    for speed in SPEEDS {
        let walk = walk(speed);
        let mut least = (f64::INFINITY, 0.0, 0);
        for k in 0..6000 {
            let strides = 0.001 * f64::from(k);
            let moment = walk.moment(strides / walk.gait.rate());
            let pose = walk.upper(&moment);
            for side in 0..2 {
                let flexion = walk
                    .leg(&pose, &walk.placed(&pose, &moment, side), side)
                    .flexion
                    .to_degrees();
                if flexion < least.0 {
                    least = (flexion, moment.strides[side], side);
                }
                if k % 5 == 0 && flexion < 2.5 {
                    println!(
                        "{speed} short {flexion:.2} at {:.3} side {side}",
                        moment.strides[side]
                    );
                }
            }
        }
        println!("crouch {:.4} {:?}", walk.crouch, walk.height);
        println!("{speed}: least flexion {least:.2?}");
    }
}

/// How deep (m) the skin of one limb goes into flesh of another part, away from where they join.
#[test]
fn limbs_keep_out_of_the_body() {
    let nearest = |p: DVec3| {
        let each = (0..LINKS).map(|link| (flesh_distance(link, p), link));
        each.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1
    };
    let rest = skeleton::rest();
    let free: Vec<(usize, usize)> = (0..MESH.positions.len())
        .filter_map(|v| {
            let p = MESH.positions[v];
            let own = limb(nearest(p));
            let root = [0, UPPER_ARM[0], UPPER_ARM[1], THIGH[0], THIGH[1]][own];
            let reach = [0.0, 0.20, 0.20, 0.28, 0.28][own];
            (own > 0 && p.distance(rest[root]) > reach).then_some((v, own))
        })
        .collect();
    assert!(free.len() > 4000);
    for speed in SPEEDS {
        let walk = walk(speed);
        let mut deepest = (f64::INFINITY, 0.0, 0, 0);
        for k in 0..60 {
            let strides = 0.05 * f64::from(k);
            let pose = walk.pose(strides / walk.gait.rate());
            let changes = skeleton::changes(&pose, &walk.rest);
            let x = positions(&walk, after(&walk, strides));
            for &(v, own) in &free {
                for link in (0..LINKS).filter(|&link| limb(link) != own) {
                    let joint = rest[link] + changes[link].turn * rest[link] + changes[link].shift;
                    if joint.distance(x[v]) > 0.6 {
                        continue;
                    }
                    let back = rest[link] + pose.turns[link].inverse() * (x[v] - joint);
                    let depth = flesh_distance(link, back);
                    if depth < deepest.0 {
                        deepest = (depth, strides, v, link);
                    }
                }
            }
        }
        println!(
            "{speed}: limbs {:.1} mm {:?} {}",
            1e3 * deepest.0,
            deepest,
            MESH.positions[deepest.2]
        );
        //assert!(deepest.0 > 0.0);
    }
}

/// Edges that go through triangles of other parts of the mesh.
#[test]
fn skin_does_not_cross_itself() {
    let mut edges: Vec<[u32; 2]> = MESH
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .filter(|[a, b]| a < b)
        .collect();
    edges.sort_unstable();
    for speed in SPEEDS {
        let walk = walk(speed);
        let mut worst = (0, 0.0, DVec3::ZERO);
        for k in 0..24 {
            let strides = 0.1 * f64::from(k);
            let x = positions(&walk, after(&walk, strides));
            let (count, place) = crossings(&x, &edges);
            if count > worst.0 {
                worst = (
                    count,
                    strides,
                    place.map_or(DVec3::ZERO, |v| MESH.positions[v as usize]),
                );
            }
        }
        println!("{speed}: crossings {worst:?}");
    }
}

fn crossings(x: &[DVec3], edges: &[[u32; 2]]) -> (usize, Option<u32>) {
    const CELL: f64 = 0.03;
    let key = |p: DVec3| (p / CELL).floor().as_i64vec3().to_array();
    let mut cells: std::collections::BTreeMap<[i64; 3], Vec<[u32; 2]>> =
        std::collections::BTreeMap::new();
    for &[a, b] in edges {
        let middle = 0.5 * (x[a as usize] + x[b as usize]);
        cells.entry(key(middle)).or_default().push([a, b]);
    }
    let mut found = 0;
    let mut place = None;
    for &t in &MESH.triangles {
        let [p, q, r] = t.map(|v| x[v as usize]);
        let middle = key((p + q + r) / 3.0);
        for cell in 0..27 {
            let at = [
                middle[0] + cell % 3 - 1,
                middle[1] + cell / 3 % 3 - 1,
                middle[2] + cell / 9 - 1,
            ];
            for &[a, b] in cells.get(&at).into_iter().flatten() {
                if t.contains(&a) || t.contains(&b) {
                    continue;
                }
                let volume =
                    |i: DVec3, j: DVec3, k: DVec3, l: DVec3| (j - i).cross(k - i).dot(l - i);
                let [u, w] = [a, b].map(|v| x[v as usize]);
                let ends = [volume(p, q, r, u), volume(p, q, r, w)];
                let around = [volume(u, w, p, q), volume(u, w, q, r), volume(u, w, r, p)];
                let one_side = around.iter().all(|s| *s > 0.0) || around.iter().all(|s| *s < 0.0);
                if ends[0] * ends[1] < 0.0 && one_side {
                    found += 1;
                    place = Some(a);
                }
            }
        }
    }
    (found, place)
}
