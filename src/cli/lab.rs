//! `muslin lab`: virtual swatch tests of a scene's cloths.

use super::Failure;
use super::args::LabArgs;
use super::folder;
use crate::lab::finding::{self, Finding};
use crate::lab::{drawing, table, words};
use crate::scene;
use anyhow::anyhow;
use std::io::Write as _;
use std::path::{Path, PathBuf};

pub(super) fn run(args: &LabArgs) -> Result<(), Failure> {
    let loaded = match &args.material {
        Some(file) => scene::load_material(file, &args.set),
        None => scene::load(args.scene.as_deref().unwrap_or("drape"), &args.set),
    };
    let loaded = loaded.map_err(Failure::input)?;
    // Everything that it names must be there before the tests take their time.
    scene::build(&loaded).map_err(Failure::input)?;
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{}-lab", loaded.scene.name)));
    let made = folder::make_writable(&out)?;
    let findings = finding::run(&loaded, &mut |what| eprintln!("{what}")).map_err(Failure::input);
    let findings = findings.and_then(|findings| something(&loaded.file, findings));
    if findings.is_err() && made {
        // Nothing was put into it.
        let _ = std::fs::remove_dir(&out);
    }
    let findings = findings?;
    let text = words::markdown(&loaded.file, &findings);
    write(&out, &findings, &text)?;
    let _ = std::io::stdout().write_all(text.as_bytes());
    // Whoever reads no further has seen enough.
    let _ = writeln!(
        std::io::stdout(),
        "\n{}: lab.csv, lab.md and the pictures",
        out.display()
    );
    Ok(())
}

/// The findings, if anything was tested.
fn something(file: &str, findings: Vec<Finding>) -> Result<Vec<Finding>, Failure> {
    let reasons: Vec<String> = findings
        .iter()
        .filter_map(|finding| match finding {
            Finding::Skipped { cloth, reason } => Some(format!("{cloth} {reason}")),
            Finding::Tested(_) => None,
        })
        .collect();
    if reasons.len() == findings.len() {
        return Err(Failure::Input(anyhow!(
            "{file}: there is nothing to test: {}; give a scene with a sheet or a flat mesh",
            reasons.join("; ")
        )));
    }
    Ok(findings)
}

fn write(out: &Path, findings: &[Finding], text: &str) -> Result<(), Failure> {
    folder::write(out, "lab.csv", &table::csv(findings))?;
    folder::write(out, "lab.md", text)?;
    for finding in findings {
        if let Finding::Tested(tested) = finding {
            drawing::pictures(out, tested).map_err(Failure::run)?;
        }
    }
    Ok(())
}
