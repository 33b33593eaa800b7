//! Against parry, against all triangles one by one, against the solid angle.

use super::*;
use crate::mesh::{block, read_obj};
use glam::dvec3;
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQueryWithLocation as _;
use parry3d_f64::shape::{TriMesh as ParryMesh, TriMeshFlags};
use std::f64::consts::TAU;

/// A thin wedge: its sharp edges and vertices are where a triangle's own normal misleads.
fn wedge() -> TriMesh {
    let positions = vec![
        dvec3(0.0, 0.0, 0.0),
        dvec3(1.0, 0.1, 0.0),
        dvec3(1.0, -0.1, 0.0),
        dvec3(0.0, 0.0, 1.0),
        dvec3(1.0, 0.1, 1.0),
        dvec3(1.0, -0.1, 1.0),
    ];
    let triangles = vec![
        [0, 1, 2],
        [3, 5, 4],
        [0, 4, 1],
        [0, 3, 4],
        [0, 2, 5],
        [0, 5, 3],
        [1, 5, 2],
        [1, 4, 5],
    ];
    TriMesh {
        positions,
        triangles,
    }
}

/// Inside by half-spaces: the wedge is convex.
fn inside(mesh: &TriMesh, p: DVec3) -> bool {
    mesh.triangles.iter().all(|&triangle| {
        let [a, b, c] = mesh.corners(triangle);
        (b - a).cross(c - a).dot(p - a) < 0.0
    })
}

#[test]
fn the_sign_is_right_near_edges_and_vertices() {
    let mesh = wedge();
    assert!(crate::mesh::open_edge(&mesh).is_none() && mesh.volume() > 0.0);
    let surface = Surface::new(&mesh).unwrap();
    let mut tried = 0;
    for corner in &mesh.positions {
        for i in 0..1000_u32 {
            let turn = f64::from(i);
            let direction = dvec3((turn * 0.7).sin(), (turn * 1.3).cos(), (turn * 2.1).sin());
            for scale in [1e-6, 1e-3, 0.05] {
                let p = *corner + direction * scale;
                let nearest = surface.nearest(p, f64::MAX).unwrap();
                if nearest.distance.abs() < 1e-12 {
                    continue; // on the surface: neither side
                }
                assert_eq!(
                    nearest.distance < 0.0,
                    inside(&mesh, p),
                    "at {p}: {nearest:?}"
                );
                assert!((nearest.point + nearest.normal * nearest.distance - p).length() < 1e-12);
                tried += 1;
            }
        }
    }
    assert!(tried > 17_900, "{tried}");
}

#[test]
fn a_point_on_an_edge_has_a_normal_that_points_out() {
    let surface = Surface::new(&wedge()).unwrap();
    let nearest = surface.nearest(dvec3(0.0, 0.0, 0.5), 1.0).unwrap();
    assert!(
        nearest.distance.abs() < 1e-12 && nearest.normal.x < -0.09,
        "{nearest:?}"
    );
    assert!(surface.nearest(dvec3(0.0, 2.0, 0.5), 1.0).is_none());
}

/// A direction, by a turn number.
fn direction(i: u32) -> DVec3 {
    let turn = f64::from(i);
    dvec3((turn * 0.7).sin(), (turn * 1.3).cos(), (turn * 2.1).sin())
}

/// A number in 0..1, by a turn number.
fn share(i: u32) -> f64 {
    (f64::from(i) * 0.618_033_988_749_895).fract()
}

fn mannequin() -> TriMesh {
    read_obj(include_str!("../../../meshes/mannequin.obj"), 1.0)
        .unwrap()
        .0
}

/// A ball of which every vertex is pulled out or pushed in at random: spikes, hollows and saddles.
fn urchin(spikes: f64) -> TriMesh {
    let mut mesh = block([2.0, 2.0, 2.0], [6, 7, 8]).mesh;
    for (i, p) in (0..).zip(&mut mesh.positions) {
        let radius = 1.0 + spikes * (share(i) - 0.5);
        *p = p.try_normalize().map_or(DVec3::ZERO, |out| out * radius);
    }
    mesh
}

/// How often a closed mesh winds around a point: 1 inside, 0 outside.
///
/// w = Σ Ω / 4π,  tan(Ω/2) = a·(b × c) / (abc + (a·b) c + (b·c) a + (c·a) b). Source: Van Oosterom
/// and Strackee 1983.
fn winding(mesh: &TriMesh, p: DVec3) -> f64 {
    let solid = mesh.triangles.iter().map(|&triangle| {
        let [a, b, c] = mesh.corners(triangle).map(|corner| corner - p);
        let [la, lb, lc] = [a, b, c].map(DVec3::length);
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        a.dot(b.cross(c)).atan2(below) / TAU
    });
    solid.sum()
}

/// Points near the surface and far from it, on both sides, beside faces, edges and vertices.
fn around(mesh: &TriMesh, count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(|i| {
        let triangle = mesh.triangles[(i * 7919) as usize % mesh.triangles.len()];
        let [a, b, c] = mesh.corners(triangle);
        let (v, w) = match i % 4 {
            0 => (0.0, 0.0),
            1 => (share(i), 0.0),
            _ => (share(i), (1.0 - share(i)) * share(7 * i)),
        };
        let far = [1e-5, 1e-3, 0.005, 0.05, 0.4][i as usize % 5];
        a + (b - a) * v + (c - a) * w + direction(i) * far
    })
}

/// The distance is that of the closest triangle; point, weights, normal and sign belong together.
fn check(surface: &Surface, p: DVec3) -> Nearest {
    let mesh = surface.mesh();
    let nearest = surface.nearest(p, f64::MAX).unwrap();
    let all = mesh
        .triangles
        .iter()
        .map(|&triangle| (closest_point(mesh.corners(triangle), p).point - p).length());
    let least = all.fold(f64::INFINITY, f64::min);
    assert!(
        (nearest.distance.abs() - least).abs() < 1e-15,
        "{p}: {nearest:?}, {least}"
    );
    let corners = mesh.corners(mesh.triangles[nearest.triangle as usize]);
    let [u, v, w] = nearest.weights;
    let point = corners[0] * u + corners[1] * v + corners[2] * w;
    assert!((point - nearest.point).length() < 1e-14, "{p}: {nearest:?}");
    assert!((nearest.point + nearest.normal * nearest.distance - p).length() < 1e-14);
    assert!(
        (nearest.normal.length() - 1.0).abs() < 1e-14,
        "{p}: {nearest:?}"
    );
    let inside = winding(mesh, p);
    assert!(
        (inside - inside.round()).abs() < 1e-6,
        "{p} is on the surface"
    );
    assert_eq!(
        nearest.distance < 0.0,
        inside > 0.5,
        "{p}: {nearest:?}, winding {inside}"
    );
    for reach in [0.99 * least, 1.01 * least] {
        let found = surface.nearest(p, reach);
        assert_eq!(
            found,
            (reach > least).then_some(nearest),
            "{p} within {reach}"
        );
    }
    nearest
}

#[test]
fn the_closest_of_all_triangles_is_found_on_the_mannequin() {
    let mesh = mannequin();
    let surface = Surface::new(&mesh).unwrap();
    for p in around(&mesh, 300) {
        check(&surface, p);
    }
}

#[test]
fn signs_are_right_on_spikes_and_saddles_and_stay_right_when_the_body_moves() {
    let mut surface = Surface::new(&urchin(1.0)).unwrap();
    let mut disagreed = 0;
    for spikes in [1.0, 0.3, 1.7] {
        let mesh = urchin(spikes);
        surface.move_to(&mesh.positions);
        let anew = Surface::new(&mesh).unwrap();
        for p in around(&mesh, 4000) {
            let nearest = check(&surface, p);
            assert_eq!(
                Some(nearest.distance),
                anew.nearest(p, f64::MAX).map(|n| n.distance)
            );
            let face = surface.area_normal(nearest.triangle).dot(p - nearest.point);
            disagreed += u32::from((face < 0.0) != (nearest.distance < 0.0));
        }
    }
    // The nearest triangle's own normal is wrong for these.
    assert!(
        disagreed > 100,
        "{disagreed}: nothing here needs a pseudo-normal"
    );
}

#[test]
fn distances_are_those_of_parry() {
    for mesh in [mannequin(), urchin(1.0), wedge()] {
        let parry = |p: DVec3| Vector::new(p.x, p.y, p.z);
        let positions = mesh.positions.iter().map(|&p| parry(p)).collect();
        let flags = TriMeshFlags::ORIENTED;
        let theirs = ParryMesh::with_flags(positions, mesh.triangles.clone(), flags).unwrap();
        let ours = Surface::new(&mesh).unwrap();
        for p in around(&mesh, 20_000) {
            let (found, _) = theirs.project_local_point_and_get_location(parry(p), false);
            let distance = (found.point - parry(p)).length();
            let nearest = ours.nearest(p, f64::MAX).unwrap();
            assert!(
                (nearest.distance.abs() - distance).abs() < 1e-14,
                "{p}: {nearest:?}"
            );
            assert_eq!(
                nearest.distance < 0.0,
                found.is_inside,
                "{p}: {nearest:?}, {found:?}"
            );
        }
    }
}

#[test]
fn the_pseudo_normal_of_a_vertex_is_weighted_by_angles() {
    // A cube's corner has one or two triangles of each face: only angles make them equal.
    let cube = "v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n\
        f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    let (mesh, _) = read_obj(cube, 1.0).unwrap();
    let surface = Surface::new(&mesh).unwrap();
    for &corner in &mesh.positions {
        let nearest = surface.nearest(corner, 1.0).unwrap();
        let diagonal = corner / 3.0_f64.sqrt();
        assert!(
            (nearest.normal - diagonal).length() < 1e-14,
            "{corner}: {nearest:?}"
        );
    }
}
