//! Swatch tests against homogenised values (Van Gelder 1998) and the heavy elastica.

use crate::support::{strip, written};
use glam::{DVec3, dvec3};
use muslin::lab::cantilever::{self, Cut};
use muslin::lab::elasticity::Elasticity;
use muslin::lab::membrane::{self, Membrane, MembraneSeries};
use muslin::lab::swatch::Swatch;
use muslin::scene::{LoadedScene, Shape};
use std::time::Instant;

/// A scene of one cloth of modulus 100 N/m and 0.2 kg/m².
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

fn tested(loaded: &LoadedScene) -> MembraneSeries {
    membrane::test(loaded, &loaded.scene.cloth[0])
        .unwrap_or_else(|error| panic!("{error}"))
        .expect("a flat cloth")
}

#[test]
fn explore() {
    for diagonals in ["none", "alternating", "one-way"] {
        for springs in [
            "[\"structural\", \"shear\"]",
            "[\"structural\", \"shear\", \"bend\"]",
        ] {
            let start = Instant::now();
            let loaded = sheet(diagonals, &format!("springs = {springs}"));
            let series = tested(&loaded);
            println!(
                "{diagonals} {springs} {:?} {:.2?}",
                series.order,
                start.elapsed()
            );
            for (cells, m) in &series.swatches {
                println!(
                    "{cells:?} {:?} asym {:e} frame {:?}  {}",
                    m.elasticity, m.asymmetry, m.frame, m.settled
                );
            }
            println!(
                "limit {:?} E45 {:?}",
                series.limit.elasticity,
                series.limit.elasticity.moduli(0.785398)
            );
            for law in ["none", "edge-spring"] {
                let loaded = sheet(
                    diagonals,
                    &format!("springs = {springs}\nbending = \"{law}\""),
                );
                let cloth = &loaded.scene.cloth[0];
                let Shape::Sheet(shape) = &cloth.shape else {
                    panic!()
                };
                for cut in [Cut::Warp] {
                    let start = Instant::now();
                    let Some(c) = cantilever::test(&loaded, cloth, shape, cut).unwrap() else {
                        continue;
                    };
                    println!(
                        "  {law} {cut:?} L {} own {} limit {:?} {:.2?}",
                        c.length,
                        c.own_cells,
                        c.limit,
                        start.elapsed()
                    );
                    for s in &c.strips {
                        println!(
                            "    {} drop {} reach {} D {:e} {:?}",
                            s.cells, s.drop, s.reach, s.rigidity, s.rest
                        );
                    }
                }
            }
        }
    }
}
