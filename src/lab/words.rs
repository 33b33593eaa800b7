//! The swatch tests in words and tables, for people.

use super::cantilever::{Cantilever, GAMMA};
use super::digits::{clean, number, percent};
use super::elastica::elastica;
use super::finding::{Bending, Finding, Tested};
use super::membrane::{FRAME_ANGLE, Membrane, MembraneSeries};
use super::table::{ANGLES, ENTRIES};
use crate::mesh::Diagonals;
use crate::scene::{Material, Shape};
use std::f64::consts::FRAC_PI_4;

/// Shares below this are rounding, or what is left of the border in an extrapolation.
const NOTHING: f64 = 1e-5;

/// A report in Markdown.
pub fn markdown(file: &str, findings: &[Finding]) -> String {
    let mut lines = vec![format!("# Swatch tests of {file}")];
    for finding in findings {
        match finding {
            Finding::Tested(tested) => add_cloth(&mut lines, tested),
            Finding::Skipped { cloth, reason } => {
                lines.push(format!("\n## {cloth}\n\nNot tested: it {reason}."));
            }
        }
    }
    lines.push(String::new());
    lines.join("\n")
}

fn add_cloth(lines: &mut Vec<String>, tested: &Tested) {
    lines.push(format!("\n## {}\n\n{}", tested.cloth.name, about(tested)));
    let membrane = &tested.membrane.limit;
    lines.push(format!(
        "\n### Stretch and shear\n\n{} {} {}\n",
        shear_sentence(membrane, &tested.cloth.material),
        bias_sentence(membrane),
        parts_sentence(membrane)
    ));
    add_pulls(lines, membrane);
    add_entries(lines, &tested.membrane);
    lines.push("\n### Bending\n".to_owned());
    match &tested.bending {
        Bending::NoStrip(why) => lines.push((*why).to_owned()),
        Bending::Strips(strips) => match &strips[..] {
            [warp, weft] if weft.agrees_with(warp) => {
                add_cantilever(lines, warp);
                lines.push("A strip along the weft shows the same.".to_owned());
            }
            all => all.iter().for_each(|c| add_cantilever(lines, c)),
        },
    }
}

fn about(tested: &Tested) -> String {
    let cloth = &tested.cloth;
    let shape = match &cloth.shape {
        Shape::Sheet(sheet) => {
            let [u, v] = super::swatch::cell(sheet).map(|h| number(1000.0 * h));
            format!("Cells of {u} mm by {v} mm, {}", diagonals(sheet.diagonals))
        }
        _ => "A flat mesh as it is, its x axis as warp".to_owned(),
    };
    let springs: Vec<String> = cloth.springs.iter().map(|s| format!("{s:?}")).collect();
    let material = &cloth.material;
    let stiffness = match (material.stretch, material.spring_constant) {
        (Some(stretch), _) => format!("modulus {} N/m", number(stretch)),
        (_, Some(constant)) => format!("{} N/m for every spring", number(constant)),
        _ => String::new(),
    };
    format!(
        "{shape}; springs: {}; {stiffness}.",
        springs.join(", ").to_lowercase()
    )
}

fn diagonals(diagonals: Diagonals) -> &'static str {
    match diagonals {
        Diagonals::None => "no diagonals",
        Diagonals::OneWay => "diagonals one way",
        Diagonals::Alternating => "alternating diagonals",
        Diagonals::Both => "both diagonals",
    }
}

/// Does anything resist shear, and how does that compare with the material?
fn shear_sentence(membrane: &Membrane, material: &Material) -> String {
    let c = &membrane.elasticity;
    let [along, bias] = [0.0, FRAC_PI_4].map(|angle| c.moduli(angle));
    if along.shear == 0.0 {
        return "Nothing resists shear: pulled at 45° the cloth follows without resistance."
            .to_owned();
    }
    let wanted = material.stretch.map_or_else(String::new, |stretch| {
        format!(
            ", where an isotropic cloth of its modulus has {}",
            number(0.375 * stretch)
        )
    });
    let anisotropy = c.anisotropy();
    let directions = if anisotropy < 1.001 {
        "it is as stiff in every direction".to_owned()
    } else {
        format!(
            "pulled at 45° it is {} times as stiff as along the warp, and its stiffest direction {} times its softest",
            number(bias.young / along.young),
            number(anisotropy)
        )
    };
    format!(
        "It resists shear with G = {} N/m along the weave{wanted}; {directions}.",
        number(along.shear)
    )
}

fn bias_sentence(membrane: &Membrane) -> String {
    let coupling = membrane.elasticity.moduli(0.0).coupling;
    match membrane.frame_bias() {
        None => "Sheared in a frame it stores no energy.".to_owned(),
        Some(bias) if bias < 1.0 + NOTHING && coupling.abs() < NOTHING => {
            "Neither sense of shear is favoured, and a strip that is pulled stays straight."
                .to_owned()
        }
        Some(bias) => format!(
            "It is biased: sheared in a frame by {FRAME_ANGLE} rad, one sense takes {} times the energy of the other, and a pull along the warp shears the cloth by {} of its strain.",
            number(bias),
            clean(coupling, 1.0)
        ),
    }
}

/// How the families of springs share the load.
fn parts_sentence(membrane: &Membrane) -> String {
    let share = |i, j| {
        let whole = membrane.elasticity.at(i, j);
        let parts = membrane.families.iter();
        let shares = parts.map(|(family, c)| (*family, c.at(i, j) / whole));
        let worth = shares.filter(|(_, share)| share.abs() > 1e-4);
        let said = worth.map(|(family, share)| format!("{family} springs {:.1} %", 100.0 * share));
        said.collect::<Vec<_>>().join(", ")
    };
    let stretch = format!("Of C11, {}", share(1, 1));
    if membrane.elasticity.at(3, 3) < NOTHING * membrane.elasticity.scale() {
        return format!("{stretch}.");
    }
    format!("{stretch}; of C66, {}.", share(3, 3))
}

fn add_pulls(lines: &mut Vec<String>, membrane: &Membrane) {
    lines.push(
        "| pull at | E (N/m) | ν | G (N/m) | shear by strain |\n|---|---|---|---|---|".to_owned(),
    );
    for angle in ANGLES {
        let moduli = membrane.elasticity.moduli(angle.to_radians());
        lines.push(format!(
            "| {angle}° | {} | {} | {} | {} |",
            number(moduli.young),
            clean(moduli.poisson, 1.0),
            number(moduli.shear),
            clean(moduli.coupling, 1.0)
        ));
    }
}

/// C by resolution, and the limit's by family of springs.
fn add_entries(lines: &mut Vec<String>, series: &MembraneSeries) {
    let names: Vec<&str> = ENTRIES.iter().map(|(name, ..)| *name).collect();
    lines.push(format!(
        "\n| C (N/m) | {} |\n|---{}|",
        names.join(" | "),
        "|---".repeat(names.len())
    ));
    let mut add = |label: &str, c: &super::elasticity::Elasticity| {
        let scale = series.limit.elasticity.scale();
        let entry = |(_, i, j): &(&str, usize, usize)| clean(c.at(*i, *j), scale);
        let entries: Vec<String> = ENTRIES.iter().map(entry).collect();
        lines.push(format!("| {label} | {} |", entries.join(" | ")));
    };
    for (cells, membrane) in &series.swatches {
        let label = cells.map_or_else(|| "mesh".to_owned(), |n| format!("{n} × {n} cells"));
        add(&label, &membrane.elasticity);
    }
    if series.swatches.len() > 1 {
        add("limit", &series.limit.elasticity);
    }
    for (family, part) in &series.limit.families {
        add(&format!("of it, {family}"), part);
    }
    let order = series.order.map_or_else(
        || "The swatches agree: the border makes no difference.".to_owned(),
        |p| format!("The border's part shrinks with order {p:.2} in the cells."),
    );
    let order = if series.swatches.len() > 1 {
        order.as_str()
    } else {
        ""
    };
    lines.push(format!(
        "\n{order} C is symmetric to {:.0e}.",
        series.limit.asymmetry
    ));
    if !series.limit.settled {
        lines.push(
            "WARNING: a swatch didn't come to rest; its figures are not to be trusted.".to_owned(),
        );
    }
}

fn add_cantilever(lines: &mut Vec<String>, cantilever: &Cantilever) {
    let Cantilever {
        cut,
        length,
        rigidity,
        own_cells,
        ..
    } = cantilever;
    lines.push(format!(
        "A strip along the {}, {} mm from the clamp (Γ = {GAMMA} with D = {} N·m). {}\n",
        cut.name(),
        number(1000.0 * length),
        number(*rigidity),
        bending_sentence(cantilever)
    ));
    lines.push("| cells along | H/L | W/L | D effective (N·m) | of the material's | error of H/L |\n|---|---|---|---|---|---|".to_owned());
    for strip in &cantilever.strips {
        lines.push(format!(
            "| {} | {} | {} | {} | {} | {} |",
            strip.cells,
            number(strip.drop),
            number(strip.reach),
            number(strip.rigidity),
            number(strip.rigidity / rigidity),
            percent(strip.drop_error(), 1)
        ));
    }
    let exact = elastica(GAMMA);
    lines.push(format!(
        "| elastica | {} | {} | {} | 1 | |\n",
        number(exact.drop),
        number(exact.reach),
        number(*rigidity)
    ));
    if cantilever.is_too_coarse() {
        lines.push(format!(
            "WARNING: {} of the cloth's own cells of {} mm fit into that length: this mesh can't show this bending.\n",
            number(*own_cells),
            number(1000.0 * cantilever.own_cell())
        ));
    }
    if cantilever.strips.iter().any(|strip| !strip.rest.found) {
        lines.push(
            "WARNING: a strip didn't come to rest; its figures are not to be trusted.\n".to_owned(),
        );
    }
}

fn bending_sentence(cantilever: &Cantilever) -> String {
    let ratios: Vec<f64> = cantilever
        .strips
        .iter()
        .map(|strip| strip.rigidity / cantilever.rigidity)
        .collect();
    let [.., before, finest] = ratios[..] else {
        return String::new();
    };
    match cantilever.limit {
        _ if finest < 0.6 * before => format!(
            "Its bending goes away with the cells: the last halving left {} of it.",
            number(finest / before)
        ),
        Some(limit) => format!(
            "On ever finer cells it bends as {} of the material's D.",
            number(limit.value / cantilever.rigidity)
        ),
        None => format!(
            "On the finest cells it bends as {} of the material's D; the last halving changed that by {}.",
            number(finest),
            percent(finest / before - 1.0, 2)
        ),
    }
}
