//! Every figure of the swatch tests as a row of a CSV table.

use super::cantilever::{Cantilever, GAMMA};
use super::elastica::elastica;
use super::elasticity::Elasticity;
use super::finding::{Bending, Finding, Tested};
use super::membrane::{FRAME_ANGLE, Membrane};
use std::fmt::Write as _;

/// Angles of a pull to the warp (degrees).
pub const ANGLES: [f64; 7] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0];

/// The columns of the table.
pub const HEADER: &str = "cloth,test,angle_deg,cells,quantity,value,unit,reference,error\n";

/// The whole table; numbers round-trip, and what doesn't apply is empty.
///
/// `error` is the value over its reference, less 1; the value itself where the reference is 0. The
/// reference is the material that the scene asks for: the isotropic sheet of its modulus with
/// ν = 1/3, and the heavy elastica of its plate rigidity.
pub fn csv(findings: &[Finding]) -> String {
    let mut text = HEADER.to_owned();
    for finding in findings {
        if let Finding::Tested(tested) = finding {
            add_membrane(&mut text, tested);
            if let Bending::Strips(strips) = &tested.bending {
                strips
                    .iter()
                    .for_each(|c| add_cantilever(&mut text, &tested.cloth.name, c));
            }
        }
    }
    text
}

/// What rows of one test have in common.
struct Place<'a> {
    cloth: &'a str,
    test: &'static str,
    angle: Option<f64>,
    cells: &'a str,
}

impl Place<'_> {
    fn add(
        &self,
        text: &mut String,
        quantity: &str,
        value: f64,
        unit: &str,
        reference: Option<f64>,
    ) {
        let number = |x: Option<f64>| {
            x.filter(|x| !x.is_nan())
                .map_or_else(String::new, |x| format!("{x:?}"))
        };
        let error = reference.map(|reference| {
            if reference == 0.0 {
                value
            } else {
                value / reference - 1.0
            }
        });
        // Writing to a string can't fail.
        let _ = writeln!(
            text,
            "{},{},{},{},{quantity},{},{unit},{},{}",
            quoted(self.cloth),
            self.test,
            number(self.angle),
            self.cells,
            number(Some(value)),
            number(reference),
            number(error)
        );
    }
}

/// A name as CSV writes it.
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}

fn add_membrane(text: &mut String, tested: &Tested) {
    let reference = tested.cloth.material.stretch.map(Elasticity::isotropic);
    let name = &tested.cloth.name;
    for (cells, membrane) in &tested.membrane.swatches {
        let cells = cells.map_or_else(|| "mesh".to_owned(), |n| n.to_string());
        add_swatch(text, name, &cells, membrane, reference.as_ref());
    }
    if tested.membrane.swatches.len() > 1 {
        add_swatch(
            text,
            name,
            "limit",
            &tested.membrane.limit,
            reference.as_ref(),
        );
    }
}

fn add_swatch(
    text: &mut String,
    cloth: &str,
    cells: &str,
    membrane: &Membrane,
    reference: Option<&Elasticity>,
) {
    let place = |test, angle| Place {
        cloth,
        test,
        angle,
        cells,
    };
    let whole = place("membrane", None);
    for (name, i, j) in ENTRIES {
        let wanted = reference.map(|c| c.at(i, j));
        whole.add(text, name, membrane.elasticity.at(i, j), "N/m", wanted);
    }
    for (family, part) in &membrane.families {
        for (name, i, j) in ENTRIES {
            whole.add(
                text,
                &format!("{name} {family}"),
                part.at(i, j),
                "N/m",
                None,
            );
        }
    }
    whole.add(text, "asymmetry of C", membrane.asymmetry, "1", Some(0.0));
    whole.add(
        text,
        "E max / E min",
        membrane.elasticity.anisotropy(),
        "1",
        Some(1.0),
    );
    for angle in ANGLES {
        let pull = place("pull", Some(angle));
        let found = membrane.elasticity.moduli(angle.to_radians());
        let wanted = reference.map(|c| c.moduli(angle.to_radians()));
        pull.add(text, "E", found.young, "N/m", wanted.map(|w| w.young));
        pull.add(text, "nu", found.poisson, "1", wanted.map(|w| w.poisson));
        pull.add(text, "G", found.shear, "N/m", wanted.map(|w| w.shear));
        pull.add(text, "shear by strain", found.coupling, "1", Some(0.0));
    }
    let frame = place("picture frame", None);
    for (sense, energy) in [1.0, -1.0].into_iter().zip(membrane.frame) {
        let quantity = format!("energy at {} rad", sense * FRAME_ANGLE);
        frame.add(text, &quantity, energy, "J/m²", None);
    }
    if let Some(bias) = membrane.frame_bias() {
        frame.add(text, "bias", bias, "1", Some(1.0));
    }
}

/// Names of the entries of C that are reported, and where they are.
pub(super) const ENTRIES: [(&str, usize, usize); 6] = [
    ("C11", 1, 1),
    ("C22", 2, 2),
    ("C12", 1, 2),
    ("C66", 3, 3),
    ("C16", 1, 3),
    ("C26", 2, 3),
];

fn add_cantilever(text: &mut String, cloth: &str, cantilever: &Cantilever) {
    let exact = elastica(GAMMA);
    let wanted = Some(cantilever.rigidity);
    for strip in &cantilever.strips {
        let cells = strip.cells.to_string();
        let place = hanging(cloth, cantilever, &cells);
        place.add(text, "H/L", strip.drop, "1", Some(exact.drop));
        place.add(text, "W/L", strip.reach, "1", Some(exact.reach));
        place.add(text, "D", strip.rigidity, "N·m", wanted);
    }
    if let Some(limit) = cantilever.limit {
        hanging(cloth, cantilever, "limit").add(text, "D", limit.value, "N·m", wanted);
    }
    let whole = hanging(cloth, cantilever, "");
    whole.add(text, "length", cantilever.length, "m", None);
    whole.add(text, "own cells in length", cantilever.own_cells, "1", None);
}

fn hanging<'a>(cloth: &'a str, cantilever: &Cantilever, cells: &'a str) -> Place<'a> {
    Place {
        cloth,
        test: "cantilever",
        angle: Some(cantilever.cut.angle()),
        cells,
    }
}
