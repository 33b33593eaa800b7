//! Against the surface itself.

use super::plan::Plan;
use super::*;
use crate::mesh::{Surface, TriMesh, block, read_obj};
use glam::{dvec3, vec4};

fn mannequin() -> Surface {
    let text = include_str!("../../../meshes/mannequin.obj");
    Surface::new(&read_obj(text, 1.0).unwrap().0).unwrap()
}

fn cube() -> Surface {
    Surface::new(&block([1.0, 1.0, 1.0], [1, 1, 1]).mesh).unwrap()
}

/// Points up to `far` (m) from a surface.
fn around(mesh: &TriMesh, far: f64, count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let triangle = mesh.triangles[(i * 7919) as usize % mesh.triangles.len()];
        let [a, b, c] = mesh.corners(triangle);
        let turn = f64::from(i);
        let share = (turn * 0.618_033_988_749_895).fract();
        let out = dvec3((turn * 0.7).sin(), (turn * 1.3).cos(), (turn * 2.1).sin());
        a.lerp(b, share).lerp(c, (turn * 0.414).fract()) + out * (far * (turn * 0.731).fract())
    })
}

#[test]
fn interpolation_is_exact_for_quadratic_fields() {
    let field = |[x, y, z]: [f32; 3]| {
        let distance = 0.3 + x - 2.0 * y + 0.5 * z + 3.0 * x * x - y * y + 0.7 * z * z + x * y
            - 2.0 * y * z
            + 1.5 * z * x;
        let gradient = [
            1.0 + 6.0 * x + y + 1.5 * z,
            -2.0 - 2.0 * y + x - 2.0 * z,
            0.5 + 1.4 * z - 2.0 * y + 1.5 * x,
        ];
        vec4(gradient[0], gradient[1], gradient[2], distance)
    };
    #[expect(clippy::cast_precision_loss, reason = "0 to 4")]
    let place = |n: usize| [n % ROW, n / ROW % ROW, n / ROW / ROW].map(|i| i as f32);
    let samples: Vec<Vec4> = (0..SAMPLES).map(|n| field(place(n))).collect();
    for i in 0..11 {
        for t in [
            [0.0; 3],
            [1.0; 3],
            [0.1 * i as f32, 0.3, 0.9],
            [0.7, 0.05 * i as f32, 0.2],
        ] {
            let (found, bend) = interpolate(&samples, t).unwrap();
            let exact = field(t);
            let error = (found + Vec4::W * bend - exact).abs().max_element();
            assert!(error < 2e-6, "{t:?}: {found} and {bend}, not {exact}");
        }
    }
}

#[test]
fn errors_are_as_told_within_the_bound_and_fall_with_the_cell() {
    let surface = mannequin();
    let mut coarser: Option<f64> = None;
    for cell in [0.02, 0.01, 0.005] {
        let grid = DistanceGrid::new(&surface, cell, 0.02).unwrap();
        let (mut sum, mut count) = (0.0, 0.0);
        for p in around(surface.mesh(), 0.022, 20_000) {
            let exact = surface.nearest(p, f64::MAX).unwrap().distance;
            match grid.nearest(p, f64::MAX) {
                Some(found) => {
                    let error = (found.distance - exact).abs();
                    assert!(
                        error < 1.3 * cell,
                        "cell {cell} at {p}: {found:?}, not {exact}"
                    );
                    assert!((found.normal.length() - 1.0).abs() < 1e-12);
                    if exact.abs() < cell {
                        sum += error * error;
                        count += 1.0;
                    }
                }
                None => assert!(exact.abs() > 0.02 - 1.3 * cell, "none at {p}: {exact}"),
            }
        }
        let measured = f64::sqrt(sum / count);
        let told = grid.error();
        assert!(
            (0.5..1.5).contains(&(measured / told.root_mean_square)),
            "cell {cell}: {measured}, told {told:?}"
        );
        assert!(
            told.largest > told.root_mean_square && told.largest < 1.3 * cell,
            "{told:?}"
        );
        assert!(
            coarser.is_none_or(|coarser| measured < 0.6 * coarser),
            "{coarser:?} {measured}"
        );
        coarser = Some(measured);
    }
}

#[test]
fn on_a_flat_face_answers_are_those_of_the_plane() {
    let grid = DistanceGrid::new(&cube(), 0.03, 0.1).unwrap();
    for i in 0..200 {
        let share = f64::from(i) / 200.0;
        let p = dvec3(0.3 * (share * 40.0).sin(), 0.41 + 0.18 * share, 0.3 * share);
        let found = grid.nearest(p, 1.0).unwrap();
        assert!(
            (found.distance - (p.y - 0.5)).abs() < 1e-7,
            "{p}: {found:?}"
        );
        assert!((found.normal - DVec3::Y).length() < 1e-6, "{p}: {found:?}");
        assert_eq!(grid.nearest(p, found.distance.abs()), None);
    }
    for far in [
        DVec3::ZERO,
        dvec3(0.0, 0.61, 0.0),
        DVec3::splat(1e300),
        DVec3::NAN,
    ] {
        assert_eq!(grid.nearest(far, f64::MAX), None, "{far}");
    }
}

#[test]
fn what_is_known_of_far_points_is_never_more_than_the_distance() {
    let surface = mannequin();
    let grid = DistanceGrid::new(&surface, 0.01, 0.02).unwrap();
    for p in around(surface.mesh(), 0.8, 10_000) {
        let exact = surface.nearest(p, f64::MAX).unwrap().distance;
        let least = grid.at_least(p);
        let brick = 0.04 * 3.0_f64.sqrt();
        assert!(least.abs() <= exact.abs(), "{p}: {least}, is {exact}");
        assert!(
            least == 0.0 || (least < 0.0) == (exact < 0.0),
            "{p}: {least}, is {exact}"
        );
        // Outside the grid that of the body's box is known.
        let inside = p.x.abs() < 0.46 && p.y > -0.02 && p.y < 1.77 && p.z > -0.13 && p.z < 0.19;
        assert!(
            !inside || least.abs() >= exact.abs() - brick,
            "{p}: {least}, is {exact}"
        );
    }
}

#[test]
fn the_same_grid_comes_from_any_number_of_threads() {
    let surface = cube();
    let [one, three] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap()
            .install(|| DistanceGrid::new(&surface, 0.02, 0.05).unwrap())
    });
    assert_eq!((one.samples, one.error), (three.samples, three.error));
}

#[test]
fn lengths_that_are_none_and_grids_that_are_too_large_are_refused_with_a_remedy() {
    let surface = cube();
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let fault = DistanceGrid::new(&surface, bad, 0.1)
            .unwrap_err()
            .to_string();
        assert!(
            fault.starts_with("the cell of a distance grid is"),
            "{fault}"
        );
        let fault = DistanceGrid::new(&surface, 0.1, bad)
            .unwrap_err()
            .to_string();
        assert!(
            fault.contains("band") && fault.contains("write a positive length"),
            "{fault}"
        );
    }
    for cell in [0.002, 1e-300] {
        let fault = DistanceGrid::new(&surface, cell, 0.05).unwrap_err();
        let BadGrid::TooFine { enough, .. } = fault else {
            panic!("{fault}")
        };
        assert!(
            fault
                .to_string()
                .contains("the 256 MB that it may; write cells of 0.00"),
            "{fault}"
        );
        // What is told to write fits, and not by making it needlessly coarse.
        let plan = Plan::new(&surface, enough, 0.05);
        let near = plan.empty().find_near(&surface, 0.05);
        let bytes = near * SAMPLES * size_of::<Vec4>();
        let share = bytes as f64 / DistanceGrid::LIMIT as f64;
        assert!(
            (0.5..0.99).contains(&share),
            "cell {cell}: {fault}: takes {bytes} B"
        );
    }
}
