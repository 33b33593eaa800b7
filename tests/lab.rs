//! Swatch tests against homogenised values (Van Gelder 1998) and the heavy elastica.

use crate::support::{fresh_folder, written};
use muslin::lab::cantilever::{self, Cantilever, Cut};
use muslin::lab::elasticity::Elasticity;
use muslin::lab::finding::{self, Bending, Finding};
use muslin::lab::membrane::{self, MembraneSeries};
use muslin::lab::swatch::Swatch;
use muslin::scene::{LoadedScene, Shape};

/// A scene of one cloth of modulus 100 N/m, 0.2 kg/m² and D = 10⁻⁵ N·m.
fn cloth(shape: &str, more: &str) -> LoadedScene {
    let text = format!(
        "name = \"swatch\"\nduration = 1.0\n[[cloth]]\nname = \"swatch\"\nshape = {shape}\n{more}\n\
         material = {{ area_density = 0.2, stretch = 100.0, bend = 1.0e-5 }}\n"
    );
    written("lab", &text)
}

fn sheet(diagonals: &str, more: &str) -> LoadedScene {
    let shape = format!(
        "{{ sheet = {{ size = [1.0, 1.0], cells = [50, 50], diagonals = \"{diagonals}\" }} }}"
    );
    cloth(&shape, more)
}

/// A mesh of 12 by 12 cells of 2 cm, each cut along one diagonal, all the same; `lean` is how far
/// each row is moved along the one below it, over a cell, and `rise` how far a row is above it.
fn mesh(lean: f64, rise: f64) -> LoadedScene {
    let mut text = String::new();
    for j in 0..=12 {
        for i in 0..=12 {
            let x = 0.02 * (f64::from(i) + lean * f64::from(j));
            text += &format!("v {x:?} 0 {:?}\n", 0.02 * rise * f64::from(j));
        }
    }
    for j in 0..12 {
        for i in 0..12 {
            let a = 13 * j + i + 1;
            let [b, c, d] = [a + 1, a + 13, a + 14];
            text += &format!("f {a} {c} {b}\nf {b} {c} {d}\n");
        }
    }
    let path = fresh_folder("lab-mesh").join("mesh.obj");
    std::fs::write(&path, text).unwrap();
    let shape = format!("{{ obj = {{ path = {:?} }} }}", path.display().to_string());
    cloth(&shape, "")
}

fn tested(loaded: &LoadedScene) -> MembraneSeries {
    membrane::test(loaded, &loaded.scene.cloth[0])
        .unwrap_or_else(|error| panic!("{error}"))
        .expect("a flat cloth")
}

/// C11, C22, C12, C66, C16, C26 in units of the modulus, to 10⁻⁶ of it; the coupling's sign is that
/// of the diagonals.
fn has(found: &Elasticity, expected: [f64; 6]) {
    let [c11, c22, c12, c66, c16, c26] = expected;
    let entries = [
        (found.at(1, 1), c11),
        (found.at(2, 2), c22),
        (found.at(1, 2), c12),
        (found.at(3, 3), c66),
        (found.at(1, 3).abs(), c16),
        (found.at(2, 3).abs(), c26),
    ];
    for (found, expected) in entries {
        assert!(
            (found / 100.0 - expected).abs() < 2e-6,
            "{found}: {expected}"
        );
    }
}

const SHEAR: &str = "springs = [\"structural\", \"shear\"]";
const ALL: &str = "springs = [\"structural\", \"shear\", \"bend\"]";

/// C11 = `k_s` + `k_d`, C12 = C66 = `k_d`; ¾ and ⅜ for two diagonals a cell. One diagonal of
/// k = ¾ a cell adds 2k n nᵀ with n = ½ (1, 1, 1): k/2 to every entry.
#[test]
fn moduli_are_those_of_an_endless_net() {
    let isotropic = [1.125, 1.125, 0.375, 0.375, 0.0, 0.0];
    let cases = [
        ("none", [1.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
        ("one-way", [1.125, 1.125, 0.375, 0.375, 0.375, 0.375]),
        ("alternating", isotropic),
        ("both", isotropic),
    ];
    for (diagonals, expected) in cases {
        for springs in [SHEAR, ALL] {
            let series = tested(&sheet(diagonals, springs));
            has(&series.limit.elasticity, expected);
            assert!(series.limit.settled && series.limit.asymmetry < 1e-7);
            // No resolution differs from another, also where bend springs end at the border.
            assert_eq!(series.order, None, "{diagonals}, {springs}");
            let parts = series.limit.families.iter().map(|(_, part)| part.0);
            let rest = series.limit.elasticity.0 - parts.sum::<glam::DMat3>();
            let left = rest
                .to_cols_array()
                .iter()
                .fold(0.0_f64, |most, x| x.abs().max(most));
            assert!(left < 1e-3, "{diagonals}: {left} N/m");
        }
    }
}

/// Van Gelder's constants on one-diagonal squares, and on equilateral triangles.
#[test]
fn moduli_of_meshes_are_those_of_endless_nets() {
    let squares = tested(&mesh(0.0, 1.0));
    has(
        &squares.limit.elasticity,
        [1.25, 1.25, 0.25, 0.25, 0.25, 0.25],
    );
    let triangles = tested(&mesh(0.5, 0.75_f64.sqrt()));
    has(
        &triangles.limit.elasticity,
        [1.125, 1.125, 0.375, 0.375, 0.0, 0.0],
    );
    let moduli = triangles.limit.elasticity.moduli(0.3);
    assert!((moduli.poisson - 1.0 / 3.0).abs() < 1e-5, "{moduli:?}");
}

/// Moved by a centimetre, one corner makes a mesh no plane any more.
#[test]
fn a_curved_mesh_is_not_tested() {
    let mut loaded = mesh(0.0, 1.0);
    let Shape::Obj(shape) = &mut loaded.scene.cloth[0].shape else {
        panic!("a mesh");
    };
    let text = std::fs::read_to_string(&shape.path).unwrap();
    std::fs::write(
        &shape.path,
        text.replacen("v 0.0 0 0.0", "v 0.0 0.01 0.0", 1),
    )
    .unwrap();
    let findings = finding::run(&loaded, &mut |_| ()).unwrap();
    assert!(
        matches!(&findings[..], [Finding::Skipped { reason, .. }] if reason.contains("curved")),
        "{findings:?}"
    );
}

/// A pull at an angle, measured, against the law by which C turns.
#[test]
fn turned_swatches_agree_with_the_law_of_rotation() {
    let loaded = sheet("one-way", SHEAR);
    let cut = || {
        Swatch::cut(&loaded, &loaded.scene.cloth[0], 12)
            .unwrap()
            .unwrap()
    };
    let straight = membrane::measure(&cut()).elasticity;
    for degrees in [15.0_f64, 45.0, 70.0] {
        let angle = degrees.to_radians();
        let turned = membrane::measure(&cut().turned(angle)).elasticity;
        let difference = turned.0 - straight.turned(angle).0;
        let most = difference
            .to_cols_array()
            .iter()
            .fold(0.0_f64, |most, x| x.abs().max(most));
        assert!(most < 1e-5 * straight.scale(), "{degrees}°: {difference}");
    }
}

/// Threads of a picture frame keep their length: one diagonal of ℓ becomes ℓ √(1 ± sin γ) and stores
/// ½ k ℓ² (√(1 ± sin γ) − 1)² in a cell of ℓ²/2.
#[test]
fn one_diagonal_is_biased_and_two_are_not() {
    let one = tested(&sheet("one-way", SHEAR)).limit;
    let stored = |s: f64| 75.0 * ((1.0 + s * membrane::FRAME_ANGLE.sin()).sqrt() - 1.0).powi(2);
    let exact = [stored(1.0), stored(-1.0)];
    let [mut low, mut high] = one.frame;
    if low > high {
        std::mem::swap(&mut low, &mut high);
    }
    assert!((low / exact[0] - 1.0).abs() < 1e-6, "{low}: {exact:?}");
    assert!((high / exact[1] - 1.0).abs() < 1e-6, "{high}: {exact:?}");
    for diagonals in ["alternating", "both"] {
        let bias = tested(&sheet(diagonals, SHEAR)).limit.frame_bias().unwrap();
        assert!((bias - 1.0).abs() < 1e-6, "{diagonals}: {bias}");
    }
    assert_eq!(tested(&sheet("none", SHEAR)).limit.frame_bias(), None);
}

fn hanging(loaded: &LoadedScene, cut: Cut) -> Cantilever {
    let cloth = &loaded.scene.cloth[0];
    let Shape::Sheet(shape) = &cloth.shape else {
        panic!("a sheet");
    };
    let found = cantilever::test(loaded, cloth, shape, cut);
    found
        .unwrap_or_else(|error| panic!("{error}"))
        .expect("it bends")
}

#[test]
fn hinges_bend_as_the_plate_that_they_stand_for() {
    for law in ["edge-spring", "discrete-shell"] {
        let loaded = sheet("alternating", &format!("{SHEAR}\nbending = \"{law}\""));
        for cut in [Cut::Warp, Cut::Weft] {
            let found = hanging(&loaded, cut);
            assert!(found.is_too_coarse(), "{} cells", found.own_cells);
            let finest = &found.strips[2];
            assert!(finest.cells == 40 && finest.rest.found, "{:?}", finest.rest);
            assert!(
                (finest.rigidity / 1e-5 - 1.0).abs() < 0.02,
                "{law} {cut:?}: {finest:?}"
            );
            assert!(
                finest.drop_error().abs() < 0.01,
                "{law} {cut:?}: {finest:?}"
            );
        }
    }
}

/// Second neighbours resist a curve by the square of its angle a cell: four times less on half the
/// cells.
#[test]
fn bend_springs_bend_ever_more_easily_on_finer_cells() {
    let found = hanging(&sheet("both", ALL), Cut::Warp);
    for pair in found.strips.windows(2) {
        let ratio = pair[1].rigidity / pair[0].rigidity;
        assert!((0.2..0.3).contains(&ratio), "{ratio}");
    }
    assert!(found.strips[0].rigidity < 0.2 * found.rigidity);
}

#[test]
fn what_has_no_hinges_has_no_strip() {
    let findings = finding::run(&sheet("both", SHEAR), &mut |_| ()).unwrap();
    let [Finding::Tested(tested)] = &findings[..] else {
        panic!("{findings:?}");
    };
    let said =
        matches!(tested.bending, Bending::NoStrip(why) if why.contains("resists no bending"));
    assert!(said, "{:?}", tested.bending);
}
