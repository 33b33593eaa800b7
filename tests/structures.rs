//! Structures at rest against closed forms: hanging strips, catenaries.

use crate::support::{fresh_folder, strip, written};
use glam::DVec3;
use muslin::scene::{self, Built};
use muslin::simulation::settle;

/// Builds a scene and moves it to rest.
fn at_rest(text: &str) -> Built {
    let mut built = scene::build(&written("rest", text)).unwrap();
    let rest = settle(&built.model, &mut built.state, 1e-9);
    assert!(rest.found, "{rest:?}");
    built
}

const DENSITY: f64 = 0.2;
const MODULUS: f64 = 400.0;
const WIDTH: f64 = 0.04;

/// How much a strip of 1 m, hung by its edge, grows under its own weight, over σ g L²/(2 E₂).
fn growth(shape: &str, springs: &str) -> f64 {
    // Turned so that −x is up.
    let text = format!(
        "name = \"strip\"\nduration = 1.0\n[[cloth]]\nname = \"strip\"\nshape = {shape}\nrotate = [0, 0, -90]\nsprings = {springs}\nmaterial = {{ area_density = {DENSITY}, stretch = {MODULUS:.1} }}\n[[pin]]\ncloth = \"strip\"\nselect = {{ box = [[-1, 0.499999, -1], [1, 1, 1]] }}\n"
    );
    let positions = at_rest(&text).state.positions;
    let lowest = positions.iter().map(|x| x.y).fold(f64::INFINITY, f64::min);
    (-0.5 - lowest) / (DENSITY * 9.81 / (2.0 * MODULUS))
}

fn sheet(cells: [u32; 2], diagonals: &str) -> String {
    format!(
        "{{ sheet = {{ size = [1.0, {WIDTH}], cells = {cells:?}, diagonals = \"{diagonals}\" }} }}"
    )
}

/// A narrow strip hung by its edge grows by σ g L²/(2 E₂): the modulus is what the material asks for,
/// whatever carries it. (Narrow, because the pinned edge can't contract.)
#[test]
fn a_hanging_strip_is_as_long_as_its_weight_makes_it() {
    let path = fresh_folder("strip").join("strip.obj");
    std::fs::write(&path, equilateral(1.0, WIDTH, WIDTH / 4.0)).unwrap();
    let mesh = format!("{{ obj = {{ path = \"{}\" }} }}", path.display());
    let all = "[\"structural\", \"shear\"]";
    for (what, shape, springs) in [
        (
            "structural only",
            sheet([50, 2], "none"),
            "[\"structural\"]",
        ),
        ("both diagonals", sheet([100, 4], "both"), all),
        ("both diagonals, finer", sheet([200, 8], "both"), all),
        ("equilateral mesh", mesh, all),
    ] {
        let error = growth(&shape, springs) - 1.0;
        println!("hanging strip, {what}: {:+.2} %", 100.0 * error);
        assert!(error.abs() < 0.004, "{what}: {:.3} % off", 100.0 * error);
    }
}

/// With alternating diagonals, every other vertex of a free border has no diagonal: a strip is softer
/// there, by a share of one over its cells across. In the limit it is not.
#[test]
fn alternating_diagonals_reach_the_modulus_in_the_limit() {
    let all = "[\"structural\", \"shear\"]";
    let [coarse, fine] = [4, 8].map(|n| growth(&sheet([25 * n, n], "alternating"), all));
    println!(
        "hanging strip, alternating: {:+.2} %, {:+.2} %",
        100.0 * (coarse - 1.0),
        100.0 * (fine - 1.0)
    );
    assert!(
        (fine - 1.0).abs() < 0.6 * (coarse - 1.0).abs(),
        "{coarse}, {fine}"
    );
    let limit = 2.0 * fine - coarse;
    assert!(
        (limit - 1.0).abs() < 0.005,
        "{coarse}, {fine}: limit {limit}"
    );
}

/// OBJ text of a strip along x, centred, of equilateral triangles whose sides run along x: rows apart
/// by √3/2 sides, every other one shifted by half a side and closed by half triangles.
fn equilateral(length: f64, width: f64, side: f64) -> String {
    let rise = side * 0.75_f64.sqrt();
    let (columns, rows) = (
        (length / side).round() as u32,
        (width / rise).round() as u32,
    );
    let (mut text, mut first, mut next) = (String::new(), Vec::new(), 1);
    let mut triangles = String::new();
    for j in 0..=rows {
        first.push(next);
        let z = (f64::from(j) - 0.5 * f64::from(rows)) * rise;
        let shifted = j % 2 == 1;
        let mut xs: Vec<f64> = (0..=columns).map(|i| f64::from(i) * side).collect();
        if shifted {
            xs = (0..columns).map(|i| (f64::from(i) + 0.5) * side).collect();
            xs.insert(0, 0.0);
            xs.push(length);
        }
        for x in xs {
            text += &format!("v {} 0 {z}\n", x - 0.5 * length);
            next += 1;
        }
    }
    for j in 0..rows as usize {
        // The row with columns + 1 points, and the shifted one with columns + 2.
        let (even, odd) = if j % 2 == 0 {
            (first[j], first[j + 1])
        } else {
            (first[j + 1], first[j])
        };
        for i in 0..columns {
            triangles += &format!("f {} {} {}\n", even + i, even + i + 1, odd + i + 1);
        }
        for i in 0..=columns {
            triangles += &format!("f {} {} {}\n", even + i, odd + i, odd + i + 1);
        }
    }
    text + &triangles
}

/// Sag over span of an inextensible chain 1.25 times as long as its span: a (cosh d/2a − 1) with
/// 2 a sinh d/2a = S.
const SAG: f64 = 0.331_796_89;

#[test]
fn a_slack_chain_hangs_in_a_catenary() {
    let error = |links: u32| {
        let text = format!(
            "name = \"chain\"\nduration = 1.0\n[[cloth]]\nname = \"chain\"\nshape = {{ chain = {{ length = 1.25, links = {links} }} }}\nstart = {{ stretch = [0.8, 1.0, 1.0] }}\nmaterial = {{ linear_density = 0.1, stretch = 1.0e7 }}\n[[pin]]\ncloth = \"chain\"\nselect = {{ corner = [\"left\", \"right\"] }}\n"
        );
        let positions = at_rest(&text).state.positions;
        let lowest = positions.iter().map(|x| x.y).fold(0.0, f64::min);
        let width = (positions[links as usize] - positions[0]).length();
        assert!((width - 1.0).abs() < 1e-12);
        (-lowest / SAG - 1.0).abs()
    };
    let [coarse, middle, fine] = [24, 50, 100].map(error);
    println!("catenary: {coarse:.2e}, {middle:.2e}, {fine:.2e}");
    assert!(
        fine < 0.0001 && fine < 0.3 * middle && middle < 0.3 * coarse,
        "{coarse}, {middle}, {fine}"
    );
}

/// A mesh's springs after Van Gelder on right isosceles triangles of one direction, from formulas for
/// the energy of a uniform strain: C11 = 1.25, C12 = C66 = C16 = 0.25 E₂, on the border as inside.
#[test]
fn springs_on_a_mesh_have_van_gelders_stiffness() {
    let path = fresh_folder("grid").join("grid.obj");
    std::fs::write(
        &path,
        strip([1.0, 1.0], [8, 8], |u, v| DVec3::new(u, 0.0, v)),
    )
    .unwrap();
    let text = format!(
        "name = \"grid\"\nduration = 1.0\n[[cloth]]\nname = \"grid\"\nshape = {{ obj = {{ path = \"{}\" }} }}\nmaterial = {{ area_density = 0.2, stretch = 100.0 }}\n",
        path.display()
    );
    let built = scene::build(&written("grid", &text)).unwrap();
    let energy = |map: &dyn Fn(DVec3) -> DVec3| -> f64 {
        let mut state = built.state.clone();
        state.positions.iter_mut().for_each(|x| *x = map(*x));
        built
            .model
            .stiffnesses()
            .map(|law| law.energy(&state))
            .sum()
    };
    let e = 1e-4;
    let stretched = energy(&|x| DVec3::new(x.x * (1.0 + e), 0.0, x.z));
    let both = energy(&|x| x * (1.0 + e));
    let sheared = energy(&|x| DVec3::new(x.x + e * x.z, 0.0, x.z));
    let unit = 0.5 * 100.0 * e * e;
    for (what, value, exact) in [
        ("C11", stretched / unit, 1.25),
        ("C11 + C12", both / unit / 2.0, 1.5),
        ("C66", sheared / unit, 0.25),
    ] {
        assert!(
            (value / exact - 1.0).abs() < 1e-3,
            "{what}: {value} against {exact}"
        );
    }
}
