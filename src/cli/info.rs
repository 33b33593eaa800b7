//! `muslin info`: what a recording holds.

use super::Failure;
use super::args::InfoArgs;
use crate::frame::Facts;
use crate::replay::{Info, Summary};
use serde_json::{Map, Value, json};
use std::fmt::Write as _;

pub(super) fn run(args: &InfoArgs) -> Result<(), Failure> {
    let info = Info::read(&args.recording).map_err(Failure::input)?;
    if args.json {
        let text = serde_json::to_string_pretty(&for_machines(&info)).map_err(Failure::run)?;
        println!("{text}");
    } else {
        print!("{}", for_people(&info).map_err(Failure::run)?);
    }
    Ok(())
}

/// The strain that a spring had at most.
const STRAIN: &str = "strain/max";
/// How deep cloth was in a body (m).
const DEPTH: &str = "contact/depth";

/// The series of a group by the rest of their names.
fn group<'a>(info: &'a Info, name: &'a str) -> impl Iterator<Item = (&'a str, &'a Summary)> {
    let series = info.series.iter();
    series.filter_map(move |(path, summary)| {
        Some((path.strip_prefix(name)?.strip_prefix('/')?, summary))
    })
}

fn for_machines(info: &Info) -> Value {
    let last = |(name, summary): (&str, &Summary)| (name.to_owned(), json!(summary.last));
    let greatest = |path: &str| {
        let summary = info.series.get(path)?;
        Some(json!({ "largest": summary.largest, "at_s": summary.at, "last": summary.last }))
    };
    let sizes = info.sizes.iter();
    let sizes: Vec<Value> = sizes
        .map(|size| json!({ "entity": size.entity, "bytes": size.bytes, "rows": size.rows }))
        .collect();
    let mut told = json!({
        "complete": info.complete,
        "branch": (!info.branch.is_empty()).then_some(&info.branch),
        "frames": info.frames,
        "first_s": info.span.map(|span| span.0),
        "last_s": info.span.map(|span| span.1),
        "energy": group(info, "energy").map(last).collect::<Map<_, _>>(),
        "strain": greatest(STRAIN),
        "depth_m": greatest(DEPTH),
        "checkpoints_s": info.checkpoints,
        "log": info.log,
        "bytes": info.bytes,
        "bytes_per_frame": info.bytes_per_frame(),
        "bytes_per_particle_and_frame": info.bytes_per_particle_and_frame(),
        "sizes": sizes,
    });
    if let (Some(facts), Some(fields)) = (&info.facts, told.as_object_mut()) {
        fields.extend(of_itself(facts));
    }
    told
}

/// What a recording says about itself.
fn of_itself(facts: &Facts) -> Map<String, Value> {
    let cloths = facts.cloths.iter().zip(&facts.materials);
    let cloths: Vec<Value> = cloths
        .map(|(name, material)| json!({ "name": name, "material": material }))
        .collect();
    let fields = [
        ("scene", json!(facts.scene)),
        ("version", json!(facts.version)),
        ("scheme", json!(facts.scheme)),
        ("dt_s", json!(facts.dt)),
        ("machine", json!(facts.machine)),
        ("units", json!(facts.units)),
        ("random_numbers", json!(facts.random_numbers)),
        ("models", json!(facts.models)),
        ("cloths", json!(cloths)),
        ("particles", json!(facts.particles)),
        ("triangles", json!(facts.triangles)),
        ("springs", json!(facts.springs)),
    ];
    let fields = fields.into_iter();
    fields
        .map(|(name, value)| (name.to_owned(), value))
        .collect()
}

fn for_people(info: &Info) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    about(&mut text, info)?;
    happened(&mut text, info)?;
    sizes(&mut text, info)?;
    Ok(text)
}

/// What it is a recording of.
fn about(text: &mut String, info: &Info) -> std::fmt::Result {
    match &info.facts {
        None => writeln!(
            text,
            "a recording that doesn't say of what: by another program, or an older muslin"
        )?,
        Some(facts) => {
            writeln!(
                text,
                "{}: {} with steps of {} s, by muslin {}",
                facts.scene, facts.scheme, facts.dt, facts.version
            )?;
            writeln!(text, "on {}", facts.machine)?;
            let Facts {
                particles,
                triangles,
                springs,
                ..
            } = facts;
            writeln!(
                text,
                "{particles} particles, {triangles} triangles, {springs} springs; {}; random numbers: {}",
                facts.units, facts.random_numbers
            )?;
            for (cloth, material) in facts.cloths.iter().zip(&facts.materials) {
                writeln!(text, "  {cloth}: {material}")?;
            }
            writeln!(text, "modelled:")?;
            for model in &facts.models {
                writeln!(text, "  {model}")?;
            }
        }
    }
    if !info.branch.is_empty() {
        writeln!(text, "{}", info.branch)?;
    }
    match info.complete {
        true => writeln!(text, "complete"),
        false => writeln!(
            text,
            "CUT: its end is missing, the run was killed or goes on; this is what is left"
        ),
    }
}

/// What happened in it.
fn happened(text: &mut String, info: &Info) -> std::fmt::Result {
    match info.span {
        Some((first, last)) => writeln!(text, "{} frames from {first} to {last} s", info.frames)?,
        None => writeln!(text, "no frames")?,
    }
    if let Some(strain) = info.series.get(STRAIN) {
        writeln!(
            text,
            "largest strain of a frame {:.3} % at {:.3} s, at the end {:.3} %",
            100.0 * strain.largest,
            strain.at,
            100.0 * strain.last
        )?;
    }
    if let Some(depth) = info.series.get(DEPTH) {
        writeln!(
            text,
            "deepest penetration of a frame {:.4} mm at {:.3} s",
            1000.0 * depth.largest,
            depth.at
        )?;
    }
    let mut energies = group(info, "energy").peekable();
    if energies.peek().is_some() {
        writeln!(text, "energies at the end (J):")?;
    }
    for (name, summary) in energies {
        writeln!(
            text,
            "  {:<36}{:>14.6}",
            name.replace('_', " "),
            summary.last
        )?;
    }
    match info.checkpoints.as_slice() {
        [] => writeln!(text, "no checkpoints: can't be resumed or exported")?,
        times => {
            let times: Vec<String> = times.iter().map(|time| format!("{time:.3}")).collect();
            writeln!(
                text,
                "{} checkpoints, at {} s",
                times.len(),
                times.join(", ")
            )?;
        }
    }
    let log = info
        .log
        .iter()
        .map(|(level, count)| format!("{count} {level}"));
    let log: Vec<String> = log.collect();
    writeln!(
        text,
        "log: {}",
        if log.is_empty() {
            "nothing".to_owned()
        } else {
            log.join(", ")
        }
    )
}

/// What takes the space.
#[expect(clippy::cast_precision_loss, reason = "files stay below 2⁵³ bytes")]
fn sizes(text: &mut String, info: &Info) -> std::fmt::Result {
    write!(text, "{:.2} MB in the file", info.bytes as f64 / 1e6)?;
    if let Some(bytes) = info.bytes_per_frame() {
        write!(text, ", {bytes:.0} bytes a frame")?;
    }
    if let Some(bytes) = info.bytes_per_particle_and_frame() {
        write!(text, ", {bytes:.1} bytes a particle and frame")?;
    }
    writeln!(text, "; by entity, compressed as they are there:")?;
    for size in &info.sizes {
        let share = 100.0 * size.bytes as f64 / info.bytes.max(1) as f64;
        writeln!(
            text,
            "  {:<44}{:>12} {share:>5.1} % {:>8} rows",
            size.entity, size.bytes, size.rows
        )?;
    }
    Ok(())
}
