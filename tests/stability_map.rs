//! Maps of where schemes are stable: the edge that runs find is the one that is forecast.

use crate::support::{fresh_folder, written};
use muslin::integrator::Integrator;
use muslin::scene::{IntegratorName, LoadedScene};
use muslin::study::stability::{Axis, Cell, Dials, HEADER, Map, Row, Verdict, csv, map, picture};
use muslin::study::{StudyError, Subject};
use std::sync::atomic::{AtomicBool, Ordering};

/// A chain of 20 links that swings down from one end.
const CHAIN: &str = "name = \"chain\"\nduration = 1.0\n[[cloth]]\nname = \"chain\"\nshape = { chain = { length = 1.0, links = 20 } }\nmaterial = { linear_density = 0.05, stretch = 50.0 }\ndamping = { mass = 2.0, stiffness = 0.001 }\n[[pin]]\ncloth = \"chain\"\nselect = { corner = [\"left\"] }\n";

/// A sheet that swings down from an edge.
const SHEET: &str = "name = \"sheet\"\nduration = 1.0\n[[cloth]]\nname = \"sheet\"\nshape = { sheet = { size = [1.0, 1.0], cells = [20, 20], diagonals = \"both\" } }\nmaterial = { area_density = 0.2, stretch = 100.0 }\ndamping = { mass = 2.0, stiffness = 0.001 }\n";

const EDGE: &str = "[[pin]]\ncloth = \"sheet\"\nselect = { edge = \"left\" }\n";

const EXPLICIT: [IntegratorName; 4] = [
    IntegratorName::Euler,
    IntegratorName::SymplecticEuler,
    IntegratorName::Verlet,
    IntegratorName::Rk4,
];

/// A small table under the sheet, whose rim hangs over.
fn table() -> String {
    let slab = concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/slab.obj");
    format!(
        "[[obstacle]]\nname = \"table\"\nshape = {{ obj = {{ path = {slab:?}, scale = 0.25 }} }}\ntranslate = [0.0, -0.004, 0.0]\n"
    )
}

fn mapped(loaded: LoadedScene, threads: usize, dials: &Dials) -> Result<Map, StudyError> {
    let stop = AtomicBool::new(false);
    let duration = loaded.scene.duration;
    let subject = Subject::new(loaded, duration, 1, threads, &stop)?;
    map(&subject, dials, &|_, _| {})
}

fn dials(axis: Axis, factors: &[f64]) -> Dials {
    Dials {
        axis,
        factors: factors.to_vec(),
        schemes: EXPLICIT.to_vec(),
        columns: 14,
        horizon: 0.15,
        work: 4e5,
        ..Dials::default()
    }
}

fn has_diverged(cell: &Cell) -> bool {
    cell.verdict == Verdict::Diverged
}

/// One column beyond the forecast every run diverges, and one below it none does.
fn follows(what: &str, map: &Map) {
    let ratio = map.steps[1] / map.steps[0];
    assert!(
        (1.1..2.3).contains(&ratio),
        "{what}: a coarse grid, {ratio}"
    );
    let mut both = 0;
    for row in &map.rows {
        let (name, factor) = (row.scheme.name(), row.factor);
        let limit = row.forecast.expect("a limit of an explicit scheme");
        assert!(limit > 0.0, "{what}: {name} × {factor}");
        for cell in &row.cells {
            let share = cell.step / limit;
            let wrong =
                share > ratio && !has_diverged(cell) || share < 1.0 / ratio && has_diverged(cell);
            assert!(
                !wrong,
                "{what}: {name} × {factor} at {share} of its limit: {cell:?}"
            );
        }
        let diverged = row.cells.iter().filter(|cell| has_diverged(cell)).count();
        both += usize::from((1..row.cells.len()).contains(&diverged));
    }
    // Nearly all rows have their edge on the map.
    assert!(4 * both >= 3 * map.rows.len(), "{what}: {both} edges");
}

#[test]
fn the_edge_is_where_it_is_forecast() {
    let table = table();
    for (what, text) in [
        ("chain", CHAIN.to_owned()),
        ("sheet", format!("{SHEET}{EDGE}")),
        ("contact", format!("{SHEET}{table}")),
    ] {
        let dials = dials(Axis::Stiffness, &[0.1, 1.0, 10.0, 100.0]);
        let map = mapped(written("map", &text), 2, &dials).unwrap();
        assert_eq!(map.rows.len(), 16);
        follows(what, &map);
    }
}

#[test]
fn the_edge_is_where_it_is_forecast_along_other_axes() {
    for (axis, factors) in [
        (Axis::MassRatio, &[1e-3, 1e-2, 1e-1, 1.0]),
        (Axis::Damping, &[0.1, 1.0, 3.0, 10.0]),
    ] {
        let map = mapped(written("map", CHAIN), 2, &dials(axis, factors)).unwrap();
        follows(axis.name(), &map);
    }
}

fn forecasts(map: &Map, scheme: Integrator) -> Vec<f64> {
    let rows = map.rows.iter().filter(|row| row.scheme == scheme);
    rows.map(|row| row.forecast.unwrap()).collect()
}

/// A long chain of masses m and m f in turns, undamped: ω² = 2 k (1/m + 1/(m f)) at most, dt ω = 2. The
/// ends are pinned, which lets the fastest mode have a node there.
#[test]
fn factors_act_as_in_closed_form() {
    let text = CHAIN
        .replace("links = 20", "links = 200")
        .replace(
            "mass = 2.0, stiffness = 0.001",
            "mass = 0.0, stiffness = 0.0",
        )
        .replace("[\"left\"]", "[\"left\", \"right\"]");
    let (k, m): (f64, f64) = (50.0 * 200.0, 0.05 / 200.0);
    for (axis, factors, inverse) in [
        (Axis::Stiffness, [0.01, 1.0, 100.0], [0.02, 2.0, 200.0]),
        (Axis::MassRatio, [1e-4, 0.1, 1.0], [10_001.0, 11.0, 2.0]),
    ] {
        let dials = Dials {
            schemes: vec![IntegratorName::Verlet],
            steps: vec![1e-6],
            work: 1.0,
            ..dials(axis, &factors)
        };
        let map = mapped(written("map", &text), 1, &dials).unwrap();
        for (found, inverse) in forecasts(&map, Integrator::Verlet).iter().zip(inverse) {
            let exact = 2.0 / (2.0 * k * inverse / m).sqrt();
            // The forecast's iteration ends within half a percent of ω².
            assert!(
                (found / exact - 1.0).abs() < 3e-3,
                "{axis:?}: {found}, {exact}"
            );
        }
    }
}

/// Free fall is exact under Verlet; symplectic Euler is ½ g t dt too deep.
#[test]
fn errors_are_those_of_free_fall() {
    let text = CHAIN
        .split("[[pin]]")
        .next()
        .unwrap()
        .replace("mass = 2.0", "mass = 0.0");
    let dials = Dials {
        schemes: vec![IntegratorName::SymplecticEuler, IntegratorName::Verlet],
        steps: vec![0.001, 0.002, 0.003, 0.005],
        factors: vec![0.01], // whose limit is beyond all of them
        ..Dials::default()
    };
    let map = mapped(written("map", &text), 1, &dials).unwrap();
    assert!(
        (map.tolerance / 0.01 - 1.0).abs() < 1e-9,
        "{}",
        map.tolerance
    );
    let known = map.errors[0];
    assert!(known < 0.5 * map.tolerance, "{known}");
    let [euler, verlet] = map.rows.as_slice() else {
        panic!("{map:?}")
    };
    let verdicts = |row: &Row| {
        row.cells
            .iter()
            .map(|cell| cell.verdict)
            .collect::<Vec<_>>()
    };
    use Verdict::{Completed, Inaccurate, NotRun};
    assert_eq!(verdicts(euler), [NotRun, Completed, Completed, Inaccurate]);
    assert_eq!(verdicts(verlet), [NotRun, NotRun, Completed, Completed]);
    for (cell, dt) in euler.cells[1..].iter().zip([0.002, 0.003, 0.005]) {
        let exact = 0.5 * 9.81 * cell.compared * dt;
        let rms = cell.rms.unwrap();
        assert!((rms - exact).abs() < known, "{dt}: {rms}, {exact}");
    }
    assert!(
        verlet.cells[2..]
            .iter()
            .all(|cell| cell.rms.unwrap() < known)
    );
}

#[test]
fn every_scheme_has_its_panel_for_any_number_of_threads() {
    let chain = || written("map", CHAIN);
    let all = Dials {
        schemes: Vec::new(),
        columns: 6,
        ..dials(Axis::Stiffness, &[1.0, 100.0])
    };
    let maps = [1, 2, 3].map(|threads| mapped(chain(), threads, &all).unwrap());
    assert_eq!(maps[0], maps[1]);
    assert_eq!(maps[0], maps[2]);
    let map = &maps[0];
    assert_eq!(map.rows.len(), 22);
    for row in &map.rows {
        let explicit = row.scheme.is_explicit();
        let xpbd = matches!(row.scheme, Integrator::Xpbd { .. });
        assert_eq!(row.forecast.is_some(), explicit || xpbd, "{row:?}");
        let diverged = row.cells.iter().any(has_diverged);
        assert_eq!(diverged, explicit, "{row:?}");
    }
    let text = csv(map);
    assert_eq!(text.lines().count(), 1 + 22 * 6);
    assert!(
        text.starts_with(HEADER) && text.contains("\nrk4,stiffness,100.0,"),
        "{text}"
    );
    let columns = HEADER.matches(',').count();
    assert!(
        text.lines()
            .all(|line| line.matches(',').count() == columns)
    );
    let path = fresh_folder("map").join("map.png");
    picture(&path, "chain", map).unwrap();
    assert!(path.metadata().unwrap().len() > 5_000);
}

#[test]
fn a_map_that_is_stopped_keeps_its_rows() {
    let stop = AtomicBool::new(false);
    let subject = Subject::new(written("map", CHAIN), 1.0, 1, 1, &stop).unwrap();
    let dials = dials(Axis::Stiffness, &[1.0, 10.0]);
    // Two references, two rows, and no more.
    let done = |finished, count| {
        assert_eq!(count, 10);
        if finished == 4 {
            stop.store(true, Ordering::Relaxed);
        }
    };
    let map = map(&subject, &dials, &done).unwrap();
    assert_eq!(map.rows.len(), 2);
}

#[test]
fn dials_that_make_no_sense_are_refused() {
    let good = dials(Axis::Stiffness, &[1.0]);
    for (wrong, word) in [
        (dials(Axis::Stiffness, &[0.0]), "factor 0"),
        (dials(Axis::MassRatio, &[f64::NAN]), "factor NaN"),
        (dials(Axis::Damping, &[-1.0]), "factor -1"),
        (
            Dials {
                steps: vec![1e-3, 0.0],
                ..good.clone()
            },
            "step 0",
        ),
        (
            Dials {
                horizon: 0.0,
                ..good.clone()
            },
            "horizon",
        ),
    ] {
        let error = mapped(written("map", CHAIN), 1, &wrong)
            .unwrap_err()
            .to_string();
        assert!(error.contains(word), "{error}");
    }
    let undamped = written(
        "map",
        &CHAIN.replace("stiffness = 0.001", "stiffness = 0.0"),
    );
    let error = mapped(undamped, 1, &dials(Axis::Damping, &[1.0]))
        .unwrap_err()
        .to_string();
    assert!(error.contains("nothing to multiply"), "{error}");
    assert_eq!("mass-ratio".parse(), Ok(Axis::MassRatio));
    assert!("mass".parse::<Axis>().unwrap_err().contains("mass-ratio"));
}
