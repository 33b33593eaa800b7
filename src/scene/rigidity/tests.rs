use super::*;
use crate::mesh::{Diagonals, Sheet, TriMesh, hinges};
use std::f64::consts::PI;

fn sheet(diagonals: Diagonals, cells: [u32; 2], cell: [f64; 2]) -> TriMesh {
    let size = [0, 1].map(|i| cell[i] * f64::from(cells[i]));
    let sheet = Sheet {
        size,
        cells,
        diagonals,
        opening: None,
    };
    sheet.lattice().unwrap().mesh
}

/// Sheared until its triangles are equilateral.
fn equilateral(cells: [u32; 2]) -> TriMesh {
    let mut mesh = sheet(Diagonals::OneWay, cells, [0.01, 0.01]);
    for p in &mut mesh.positions {
        *p = DVec3::new(p.x - 0.5 * p.z, 0.0, 0.75_f64.sqrt() * p.z);
    }
    mesh
}

/// Grid points moved by up to `jitter` cells both ways, each cell cut along the diagonal that leaves
/// the smaller angles opposite to it (Delaunay within the cell).
fn jittered(cells: [u32; 2], jitter: f64, seed: u64) -> TriMesh {
    let mut mesh = sheet(Diagonals::OneWay, cells, [0.01, 0.01]);
    let mut state = seed;
    let mut random = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        2.0 * (state >> 11) as f64 / (1_u64 << 53) as f64 - 1.0
    };
    for p in &mut mesh.positions {
        *p += 0.01 * jitter * DVec3::new(random(), 0.0, random());
    }
    for pair in mesh.triangles.chunks_exact_mut(2) {
        let ([a, c, b], [_, d, _]) = (pair[0], pair[1]);
        let angle = |tip: u32, ends: [u32; 2]| {
            let [p, q] =
                ends.map(|end| mesh.positions[end as usize] - mesh.positions[tip as usize]);
            p.angle_between(q)
        };
        // A cell so crushed that the other diagonal lies outside of it keeps its own.
        let falls = [angle(a, [b, d]), angle(c, [b, d])];
        if angle(b, [a, c]) + angle(d, [a, c]) > PI && falls.iter().sum::<f64>() < PI {
            pair.copy_from_slice(&[[a, d, b], [b, d, c]]);
        }
    }
    mesh
}

fn stiffnesses(mesh: &TriMesh, rigidity: f64) -> Vec<f64> {
    all_stiffnesses(&mesh.positions, &hinges(&mesh.triangles), rigidity)
}

fn all_stiffnesses(positions: &[DVec3], hinges: &[[u32; 4]], rigidity: f64) -> Vec<f64> {
    let measured = Rigidity::of(positions, hinges, None);
    let corners = hinges
        .iter()
        .map(|hinge| hinge.map(|vertex| positions[vertex as usize]));
    corners
        .map(|corners| measured.stiffness(corners, rigidity))
        .collect()
}

/// The plate of a net with given stiffnesses, measured in a few patches twice as large as those that
/// the stiffnesses come from.
fn plate(mesh: &TriMesh, k: &[f64]) -> Plate {
    let hinges = hinges(&mesh.triangles);
    let reach = Reach {
        rings: 8,
        core: 7,
        depth: 8,
    };
    let net = Net::new(&mesh.positions, &hinges, k);
    let (plate, patches) = net.measure(DVec3::X, reach, 12);
    assert_eq!(patches, 12);
    plate
}

/// Mean of the rigidities of wide sheet and narrow strip along x.
fn mean_rigidity(plate: &Plate) -> f64 {
    plate.compliance(0.0).recip()
}

const SQUARE: [f64; 2] = [0.01, 0.01];

/// Rigidities of sheet and strip in units of k for the plain law k ℓ²/A on the regular nets, in closed
/// form. On the equilateral net and the grid with one diagonal no vertex moves, and the values are
/// those of Seung and Nelson 1988 and of a direct sum.
#[test]
fn regular_nets_have_the_rigidity_of_closed_form() {
    let cases = [
        (sheet(Diagonals::OneWay, [40, 20], SQUARE), [1.0, 0.8]),
        (equilateral([40, 20]), [1.0, 8.0 / 9.0]),
        (
            sheet(Diagonals::Alternating, [40, 20], SQUARE),
            [5.0 / 6.0, 0.8],
        ),
    ];
    for (mesh, expected) in cases {
        let plain = |hinge: &[u32; 4]| {
            let [a, b, c, d] = hinge.map(|vertex| mesh.positions[vertex as usize]);
            let areas = (b - a).cross(c - a).length() + (b - a).cross(d - a).length();
            2.0 * (b - a).length_squared() / areas
        };
        let k: Vec<_> = hinges(&mesh.triangles).iter().map(plain).collect();
        let measured = plate(&mesh, &k).rigidities(0.0);
        for (measured, expected) in measured.into_iter().zip(expected) {
            assert!(
                (measured - expected).abs() < 1e-9,
                "{measured} k against {expected} k"
            );
        }
    }
}

/// Jittered nets differ by up to 1.5 % from one part of 500 vertices to the next.
#[test]
fn cloth_of_any_mesh_bends_as_its_plate() {
    let cases = [
        (
            "alternating",
            sheet(Diagonals::Alternating, [60, 24], SQUARE),
        ),
        (
            "long cells",
            sheet(Diagonals::Alternating, [40, 24], [0.02, 0.01]),
        ),
        ("one way", sheet(Diagonals::OneWay, [60, 24], SQUARE)),
        ("equilateral", equilateral([60, 24])),
        ("jittered", jittered([60, 24], 0.2, 1)),
        ("badly jittered", jittered([60, 24], 0.4, 2)),
    ];
    for (name, mesh) in cases {
        let rigidity = mean_rigidity(&plate(&mesh, &stiffnesses(&mesh, 2.0)));
        let tolerance = if name.contains("jittered") {
            0.02
        } else {
            0.01
        };
        assert!(
            (rigidity / 2.0 - 1.0).abs() < tolerance,
            "{name}: {rigidity} of 2 N·m"
        );
    }
}

/// A square of alternating diagonals bends as its plate along its grid; its own axes would be any.
#[test]
fn a_square_bends_as_its_plate_along_given_axes() {
    let mesh = sheet(Diagonals::Alternating, [40, 40], SQUARE);
    let hinges = hinges(&mesh.triangles);
    let measured = Rigidity::of(&mesh.positions, &hinges, Some([DVec3::X, DVec3::Z]));
    let corners = hinges
        .iter()
        .map(|hinge| hinge.map(|vertex| mesh.positions[vertex as usize]));
    let k: Vec<f64> = corners
        .map(|corners| measured.stiffness(corners, 2.0))
        .collect();
    let plate = plate(&mesh, &k);
    for angle in [0.0, PI / 2.0] {
        let rigidity = plate.compliance(angle).recip();
        assert!((rigidity / 2.0 - 1.0).abs() < 0.01, "{rigidity} of 2 N·m");
    }
}

/// Four rows of cells have few vertices inside, and still the stiffness of a wide sheet.
#[test]
fn narrow_strips_have_the_stiffness_of_wide_ones() {
    let stiffest = |rows| {
        let k = stiffnesses(&sheet(Diagonals::Alternating, [80, rows], SQUARE), 1.0);
        k.into_iter().fold(0.0, f64::max)
    };
    for rows in [4, 6, 8, 12] {
        let ratio = stiffest(rows) / stiffest(16);
        assert!((ratio - 1.0).abs() < 0.005, "{rows} rows: {ratio}");
    }
}

#[test]
fn size_and_place_of_the_mesh_do_not_matter() {
    let mesh = jittered([30, 12], 0.3, 3);
    let k = stiffnesses(&mesh, 1e-4);
    let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
    let mut moved = mesh.clone();
    for p in &mut moved.positions {
        *p = 10.0 * (turn * *p) + DVec3::new(1.0, 2.0, 3.0);
    }
    for (k, other) in k.iter().zip(stiffnesses(&moved, 1e-4)) {
        assert!((k - other).abs() < 1e-6 * k, "{k} and {other} N·m");
    }
}

#[test]
fn a_half_cylinder_is_as_stiff_as_its_sheet() {
    let mesh = sheet(Diagonals::Alternating, [24, 48], SQUARE);
    let radius = 0.24 / PI;
    let mut curved = mesh.clone();
    for p in &mut curved.positions {
        let (sin, cos) = (p.x / radius).sin_cos();
        *p = DVec3::new(radius * sin, radius * cos, p.z);
    }
    for (flat, curved) in stiffnesses(&mesh, 1.0)
        .iter()
        .zip(stiffnesses(&curved, 1.0))
    {
        assert!(
            (curved / flat - 1.0).abs() < 0.03,
            "{curved} and {flat} N·m"
        );
    }
}

#[test]
fn any_hinges_have_a_stiffness() {
    let square = sheet(Diagonals::Alternating, [1, 1], SQUARE);
    let sliver = [DVec3::ZERO, DVec3::X, DVec3::X, 2.0 * DVec3::X];
    let tetrahedron = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let mut apart = sheet(Diagonals::Alternating, [3, 3], SQUARE);
    let count = u32::try_from(apart.positions.len()).unwrap();
    apart.positions.extend(tetrahedron);
    apart.triangles.extend(faces.map(|t| t.map(|v| v + count)));
    let cases = [
        (vec![], vec![]),
        (vec![DVec3::ZERO], vec![]),
        (square.positions, hinges(&square.triangles)),
        (sliver.to_vec(), vec![[0, 1, 2, 3]]),
        (vec![DVec3::ONE; 4], vec![[0, 1, 2, 3], [0, 0, 0, 0]]),
        (vec![DVec3::NAN; 4], vec![[0, 1, 2, 3]]),
        (tetrahedron.to_vec(), hinges(&faces)),
        (apart.positions, hinges(&apart.triangles)),
    ];
    for (positions, hinges) in cases {
        let k = all_stiffnesses(&positions, &hinges, 1e-4);
        assert_eq!(k.len(), hinges.len());
        assert!(k.iter().all(|k| k.is_finite() && *k >= 0.0), "{k:?}");
    }
}
