//! What a recording says about itself: properties for programs, a table for people.

use std::sync::Arc;

use rerun::external::arrow::array::{ArrayRef, Float64Array, StringArray, UInt64Array};
use rerun::log::Chunk;
use rerun::{AnyValues, EntityPath, RecordingStream, RecordingStreamResult};

use super::entity;
use crate::frame::Facts;

const SCENE: &str = "scene";
const VERSION: &str = "version";
const SCHEME: &str = "scheme";
/// Time step (s).
const DT: &str = "dt";
const MACHINE: &str = "machine";
const UNITS: &str = "units";
const RANDOM_NUMBERS: &str = "random_numbers";
const MODELS: &str = "models";
const CLOTHS: &str = "cloths";
const MATERIALS: &str = "materials";
const PARTICLES: &str = "particles";
const TRIANGLES: &str = "triangles";
const SPRINGS: &str = "springs";

/// Where they are: a property of the recording, which the viewer shows with its name.
pub(crate) fn path() -> EntityPath {
    EntityPath::properties().join(&entity::path(&[entity::APPLICATION]))
}

/// Logs the properties.
pub(super) fn log(stream: &RecordingStream, facts: &Facts) -> RecordingStreamResult<()> {
    let texts = |texts: &[String]| -> ArrayRef { Arc::new(StringArray::from_iter_values(texts)) };
    let text = |text: &String| texts(std::slice::from_ref(text));
    let count = |count: u64| -> ArrayRef { Arc::new(UInt64Array::from(vec![count])) };
    let mut values = AnyValues::default();
    for (component, data) in [
        (SCENE, text(&facts.scene)),
        (VERSION, text(&facts.version)),
        (SCHEME, text(&facts.scheme)),
        (DT, Arc::new(Float64Array::from(vec![facts.dt]))),
        (MACHINE, text(&facts.machine)),
        (UNITS, text(&facts.units)),
        (RANDOM_NUMBERS, text(&facts.random_numbers)),
        (MODELS, texts(&facts.models)),
        (CLOTHS, texts(&facts.cloths)),
        (MATERIALS, texts(&facts.materials)),
        (PARTICLES, count(facts.particles)),
        (TRIANGLES, count(facts.triangles)),
        (SPRINGS, count(facts.springs)),
    ] {
        values = values.with_component_from_data(component, data);
    }
    stream.send_property(entity::APPLICATION, &values)
}

/// Reads them from the rows at [`path`].
pub(crate) fn read(chunk: &Chunk) -> Option<Facts> {
    let texts = |component: &'static str| {
        let texts = chunk.iter_slices::<String>(component.into()).next()?;
        Some(
            texts
                .iter()
                .map(|text| text.as_str().to_owned())
                .collect::<Vec<_>>(),
        )
    };
    let text = |component: &'static str| texts(component)?.pop();
    let count = |component: &'static str| {
        let counts = chunk.iter_slices::<u64>(component.into()).next()?;
        counts.first().copied()
    };
    let dt = chunk.iter_slices::<f64>(DT.into()).next()?;
    Some(Facts {
        scene: text(SCENE)?,
        version: text(VERSION)?,
        scheme: text(SCHEME)?,
        dt: *dt.first()?,
        machine: text(MACHINE)?,
        units: text(UNITS)?,
        random_numbers: text(RANDOM_NUMBERS)?,
        models: texts(MODELS)?,
        cloths: texts(CLOTHS)?,
        materials: texts(MATERIALS)?,
        particles: count(PARTICLES)?,
        triangles: count(TRIANGLES)?,
        springs: count(SPRINGS)?,
    })
}

/// The same as a table in Markdown; what is modelled stands in a list beside it.
pub(super) fn table(facts: &Facts) -> String {
    let dt = format!("{} s", facts.dt);
    let mut rows: Vec<(String, &str)> = vec![
        ("scheme".to_owned(), &facts.scheme),
        ("time step".to_owned(), &dt),
        ("units".to_owned(), &facts.units),
        ("random numbers".to_owned(), &facts.random_numbers),
        ("muslin".to_owned(), &facts.version),
        ("machine".to_owned(), &facts.machine),
    ];
    for (cloth, material) in facts.cloths.iter().zip(&facts.materials) {
        rows.push((format!("material of {cloth}"), material));
    }
    let row =
        |(name, value): &(String, &str)| format!("| {name} | {} |\n", value.replace('|', "\\|"));
    let rows: String = rows.iter().map(row).collect();
    format!("| | |\n|---|---|\n{rows}")
}
