//! The error of the mesh against limits in closed form.

use crate::support::load;
use glam::DVec3;
use muslin::integrator::Integrator;
use muslin::study::mesh::{MeshStudy, Verdict, mesh_study, table};
use muslin::study::{Distance, Setting, Subject};
use std::sync::atomic::AtomicBool;

static GO_ON: AtomicBool = AtomicBool::new(false);

/// A study of the built-in chain with changes, at its end, at rest.
fn study(changes: &[&str], cells: &[u32]) -> MeshStudy {
    let loaded = load("chain", changes);
    let setting = Setting {
        integrator: Integrator::of(&loaded.scene.solver),
        dt: 0.005,
    };
    let duration = loaded.scene.duration;
    let subject = Subject::new(loaded, duration, 1, 1, &GO_ON).unwrap();
    mesh_study(&subject, setting, cells, 20.0, &mut |_| {}).unwrap()
}

const LENGTH: f64 = 1.0;
const SPAN: f64 = 0.9;
/// λ g (N/m).
const WEIGHT: f64 = 0.05 * 9.81;

/// The elastic catenary: where the piece at s along an unstretched chain hangs, x from its left end,
/// y from its ends' height, with the horizontal tension H and the vertical one V = w (L/2 − s):
/// x = H s/EA + H/w (asinh(wL/2H) − asinh(V/H)),
/// y = −w s (L − s)/(2 EA) − H/w (√(1 + (wL/2H)²) − √(1 + (V/H)²)).
///
/// Source: Irvine 1981, "Cable Structures".
fn catenary(s: f64, tension: f64, stretch: f64) -> [f64; 2] {
    let end = 0.5 * WEIGHT * LENGTH / tension;
    let here = (0.5 * LENGTH - s) * WEIGHT / tension;
    let a = tension / WEIGHT;
    [
        tension * s / stretch + a * (end.asinh() - here.asinh()),
        -0.5 * WEIGHT * s * (LENGTH - s) / stretch - a * (end.hypot(1.0) - here.hypot(1.0)),
    ]
}

/// The horizontal tension (N) that holds the ends `SPAN` apart, by bisection: more tension, more span.
fn tension(stretch: f64) -> f64 {
    let (mut low, mut high) = (1e-3, 10.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if catenary(LENGTH, middle, stretch)[0] < SPAN {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

#[test]
fn the_limit_of_coarse_chains_is_the_catenary() {
    let stretch = 20.0;
    let cells = [6, 12, 24];
    let changes = [
        "cloth.0.material.stretch=20",
        "cloth.0.damping.mass=8",
        "duration=5",
    ];
    let study = study(&changes, &cells);
    let tension = tension(stretch);
    let exact: Vec<DVec3> = (0..=cells[0])
        .map(|i| {
            let s = LENGTH * f64::from(i) / f64::from(cells[0]);
            let [x, y] = catenary(s, tension, stretch);
            DVec3::new(x - 0.5 * SPAN, 1.5 + y, 0.0)
        })
        .collect();
    println!("{}", table::markdown(&study));
    let Verdict::Converges(order) = study.verdict else {
        panic!("{:?}", study.verdict);
    };
    assert!((order - 2.0).abs() < 0.1, "order {order}");
    assert!(
        study.is_of_the_mesh(),
        "{} m of the step",
        study.step_left()
    );
    let of_limit = Distance::between(&study.limit[0], &exact).rms;
    for row in &study.resolutions {
        // What the study says of a mesh is its distance from the truth.
        let said = row.to_limit.unwrap().rms;
        println!("{} links: {said:.3e} m, limit {of_limit:.3e} m", row.cells);
        assert!(of_limit < 0.05 * said, "{} links: {said} m", row.cells);
    }
    let finest = study.resolutions.last().unwrap().to_limit.unwrap().rms;
    // The polygon cuts the arc of curvature 1/a ≈ 2 /m by h²/8a at its middles: 0.4 mm at h = 1/24 m.
    assert!((1e-5..1e-3).contains(&finest), "{finest} m");
}

/// The particles of a chain that hangs straight down are where the continuum's are, whatever the links:
/// there is no error of the mesh to be seen, and none is made up.
#[test]
fn a_chain_without_an_error_of_the_mesh_has_none() {
    let changes = [
        "pin=[{ cloth = \"chain\", select = { corner = [\"left\"] } }]",
        "cloth.0.start.stretch=[1, 1, 1]",
        "cloth.0.rotate=[0, 0, -90]",
        "cloth.0.material.stretch=20",
        "cloth.0.damping.mass=20",
        "duration=4",
    ];
    let study = study(&changes, &[5, 10, 20]);
    assert!(
        matches!(study.verdict, Verdict::Below(floor) if floor < 1e-5),
        "{:?}",
        study.verdict
    );
    assert!(study.limit.is_empty());
    assert!(table::markdown(&study).contains("no error of the mesh is left to be seen"));
}

/// With one spring constant whatever the links, a chain of twice as many hangs down by twice as much,
/// n λ g ℓ/2k at its end: there is no limit.
#[test]
fn raw_spring_constants_have_no_limit() {
    let changes = [
        "pin=[{ cloth = \"chain\", select = { corner = [\"left\"] } }]",
        "cloth.0.start.stretch=[1, 1, 1]",
        "cloth.0.rotate=[0, 0, -90]",
        "cloth.0.material.stretch=",
        "cloth.0.material.spring_constant=100",
        "cloth.0.damping.mass=10",
        "duration=4",
    ];
    let study = study(&changes, &[5, 10, 20]);
    assert_eq!(study.verdict, Verdict::NoLimit);
    let [first, second, last] = study.resolutions.as_slice() else {
        panic!("{:?}", study.resolutions);
    };
    for (row, difference) in [(first, 5.0), (second, 10.0)] {
        let exact = difference * WEIGHT * LENGTH / 200.0;
        let found = row.to_next.unwrap().largest;
        assert!(
            (found / exact - 1.0).abs() < 1e-3,
            "{found} against {exact}"
        );
    }
    assert!((second.order.unwrap() + 1.0).abs() < 1e-3, "{second:?}");
    assert!(study.limit.is_empty() && last.to_limit.is_none());
    assert!(table::markdown(&study).contains("don't shrink"));
    let csv = table::csv(&study);
    assert_eq!(csv.lines().count(), 4, "{csv}");
    let columns = table::HEADER.split(',').count();
    assert!(
        csv.lines().all(|line| line.split(',').count() == columns),
        "{csv}"
    );
}
