//! The skin that walks: as much as standing, and through itself nowhere.

use super::*;
use crate::mesh::mannequin::skin::{flesh_distance, limb};

#[test]
fn keeps_its_volume_and_turns_no_triangle_over() {
    for speed in SPEEDS {
        let walk = walk(speed);
        for k in 0..60 {
            let mesh = TriMesh {
                positions: positions(&walk, after(&walk, 0.05 * f64::from(k))),
                triangles: MESH.triangles.clone(),
            };
            let change = mesh.volume() / MESH.volume() - 1.0;
            assert!(change.abs() < 0.03, "{change}");
            let turned = turned_over(&mesh);
            assert!(turned <= 2, "{turned} at {k}, {speed} m/s");
        }
    }
}

/// Triangles that face against the mean of those around their corners.
fn turned_over(mesh: &TriMesh) -> usize {
    let normal = |t: [u32; 3]| {
        let [a, b, c] = mesh.corners(t);
        (b - a).cross(c - a)
    };
    let mut around = vec![DVec3::ZERO; mesh.positions.len()];
    for &t in &mesh.triangles {
        for v in t {
            around[v as usize] += normal(t);
        }
    }
    let against = |t: [u32; 3]| {
        let mean: DVec3 = t.iter().map(|&v| around[v as usize]).sum();
        normal(t).dot(mean) <= 0.0
    };
    mesh.triangles.iter().filter(|t| against(**t)).count()
}

/// Vertices of arms and legs away from where these join the trunk, each with its limb.
fn free_vertices(rest: &[DVec3; LINKS]) -> Vec<(usize, usize)> {
    let nearest = |p: DVec3| {
        let each = (0..LINKS).map(|link| (flesh_distance(link, p), link));
        each.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1
    };
    let roots = [
        (0, 0.0),
        (UPPER_ARM[0], 0.20),
        (UPPER_ARM[1], 0.20),
        (THIGH[0], 0.28),
        (THIGH[1], 0.28),
    ];
    let each = MESH
        .positions
        .iter()
        .enumerate()
        .map(|(v, p)| (v, *p, limb(nearest(*p))));
    let free =
        each.filter(|(_, p, own)| *own > 0 && p.distance(rest[roots[*own].0]) > roots[*own].1);
    free.map(|(v, _, own)| (v, own)).collect()
}

/// Arms keep clear of trunk and legs, and the legs of each other, by their flesh as the pose carries it.
#[test]
fn limbs_keep_out_of_the_body() {
    let rest = skeleton::rest();
    let free = free_vertices(&rest);
    assert!(free.len() > 4000);
    for speed in SPEEDS {
        let walk = walk(speed);
        let mut least = f64::INFINITY;
        for k in 0..60 {
            let strides = 0.05 * f64::from(k);
            let pose = walk.pose(strides / walk.gait.rate());
            let changes = skeleton::changes(&pose, &walk.rest);
            let x = positions(&walk, after(&walk, strides));
            for link in 0..LINKS {
                let joint = rest[link] + changes[link].turn * rest[link] + changes[link].shift;
                let back = pose.turns[link].inverse();
                let others = free.iter().filter(|(_, own)| *own != limb(link));
                for &(v, _) in others.filter(|(v, _)| joint.distance(x[*v]) < 0.6) {
                    let gap = flesh_distance(link, rest[link] + back * (x[v] - joint));
                    least = least.min(gap);
                }
            }
        }
        assert!(least > 0.01, "{least} m between limbs, {speed} m/s");
    }
}

/// No edge goes through a triangle that it isn't joined to.
#[test]
fn skin_does_not_cross_itself() {
    let sides = MESH
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let edges: Vec<[u32; 2]> = sides.filter(|[a, b]| a < b).collect();
    for speed in SPEEDS {
        let walk = walk(speed);
        for k in 0..24 {
            let strides = 0.1 * f64::from(k);
            let crossings = crossings(&positions(&walk, after(&walk, strides)), &edges);
            assert!(crossings == 0, "{crossings} at {strides}, {speed} m/s");
        }
    }
}

/// How many edges go through triangles. Both are shorter than the cells in which they are looked for.
fn crossings(x: &[DVec3], edges: &[[u32; 2]]) -> usize {
    let key = |p: DVec3| (p / 0.03).floor().as_i64vec3().to_array();
    let mut cells: BTreeMap<[i64; 3], Vec<[u32; 2]>> = BTreeMap::new();
    for &[a, b] in edges {
        let middle = 0.5 * (x[a as usize] + x[b as usize]);
        cells.entry(key(middle)).or_default().push([a, b]);
    }
    let mut found = 0;
    for &t in &MESH.triangles {
        let corners = t.map(|v| x[v as usize]);
        let [i, j, k] = key((corners[0] + corners[1] + corners[2]) / 3.0);
        for cell in 0..27 {
            let near = [i + cell % 3 - 1, j + cell / 3 % 3 - 1, k + cell / 9 - 1];
            for edge in cells.get(&near).into_iter().flatten() {
                let joined = edge.iter().any(|v| t.contains(v));
                let ends = edge.map(|v| x[v as usize]);
                found += usize::from(!joined && goes_through(ends, corners));
            }
        }
    }
    found
}

/// Whether a segment goes through a triangle, by the signs of volumes of tetrahedra.
fn goes_through([u, w]: [DVec3; 2], [p, q, r]: [DVec3; 3]) -> bool {
    let volume = |i: DVec3, j: DVec3, k: DVec3, l: DVec3| (j - i).cross(k - i).dot(l - i);
    let around = [volume(u, w, p, q), volume(u, w, q, r), volume(u, w, r, p)];
    let inside = around.iter().all(|s| *s > 0.0) || around.iter().all(|s| *s < 0.0);
    inside && volume(p, q, r, u) * volume(p, q, r, w) < 0.0
}
