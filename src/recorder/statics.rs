//! What is recorded once: the scene's text, triangles, obstacles, and how things are drawn.
//!
//! Rerun lets static data shadow later data of the same component, so what moves may not appear
//! here at all.

use std::sync::Arc;

use rerun::external::arrow::array::{StringArray, UInt64Array};
use rerun::log::Chunk;
use rerun::{AnyValues, LineStrips3D, Mesh3D, Points3D, Radius, RecordingStream};
use rerun::{RecordingStreamResult, Rgba32, SeriesLines, TextDocument, ViewCoordinates};

use super::entity::{self, ClothPaths};
use super::{checkpoint, color, drawing, normals, panels, properties};
use crate::frame::{ClothHeader, Header, ObstacleHeader, Series};

/// Component of `/scene` that holds the scene's TOML as it was run, for those who read it back.
pub(crate) const TOML: &str = "toml";
/// The same with the cloths' names.
pub(crate) const CLOTHS: &str = "cloths";
/// The same with the obstacles' names.
pub(crate) const OBSTACLES: &str = "obstacles";

/// The same with what the recording is a branch of.
pub(crate) const BRANCH: &str = "branch_of";
/// The same with the number of frames, at the end of a complete recording.
pub(crate) const FRAMES: &str = "frames";
/// Component of `/scene/meshes/<path>` with the text of an OBJ mesh.
pub(crate) const TEXT: &str = "text";

/// Width of a spring's line, in points of the screen.
const SPRING_WIDTH: f32 = 0.9;
/// Width of a chain's line: it is all there is to see of it.
const CHAIN_WIDTH: f32 = 2.5;
/// Radius of a chain's particles where there are few of them.
const MASS_RADIUS: f32 = 6.0;
/// A chain of up to so many particles is looked at for its masses.
const FEW_PARTICLES: usize = 8;
/// Radius of a pin.
const PIN_RADIUS: f32 = 3.0;
/// Radius of a contact: as small as still shows its colour.
const CONTACT_RADIUS: f32 = 1.2;
/// Radius of what should not be: not to be overlooked.
const PENETRATION_RADIUS: f32 = 4.0;

/// Logs everything static.
pub(super) fn log(stream: &RecordingStream, header: &Header) -> RecordingStreamResult<()> {
    stream.log_static(entity::WORLD, &ViewCoordinates::RIGHT_HAND_Y_UP())?;
    properties::log(stream, &header.facts)?;
    log_scene(stream, header)?;
    if let Some(start) = &header.start {
        checkpoint::log_start(stream, start)?;
    }
    for cloth in &header.cloths {
        log_cloth(stream, header, cloth)?;
    }
    for obstacle in &header.obstacles {
        log_obstacle(stream, obstacle)?;
    }
    let audited = |series: &Series| series.path.starts_with("contact/");
    if header.series.iter().any(audited) {
        let penetrations = Points3D::update_fields()
            .with_radii([Radius::new_ui_points(PENETRATION_RADIUS)])
            .with_colors([color::PENETRATING]);
        stream.log_static(entity::body(entity::PENETRATIONS), &penetrations)?;
    }
    if !header.obstacles.is_empty() {
        let radii = [Radius::new_ui_points(CONTACT_RADIUS)];
        let contacts = Points3D::update_fields().with_radii(radii);
        stream.log_static(entity::body(entity::CONTACTS), &contacts)?;
    }
    log_series(stream, &header.series)
}

/// The model list and the TOML, to read and to run again.
fn log_scene(stream: &RecordingStream, header: &Header) -> RecordingStreamResult<()> {
    let text = format!(
        "### {}\n\n{}\n{}\n\n#### Scene\n\n```toml\n{}\n```\n",
        header.scene,
        properties::table(&header.facts),
        header.model_list.trim_end(),
        header.scene_toml.trim_end()
    );
    stream.log_static(entity::SCENE, &TextDocument::from_markdown(text))?;
    let cloths = header.cloths.iter().map(|cloth| cloth.name.as_str());
    let obstacles = header.obstacles.iter().map(|o| o.name.as_str());
    let mut values = AnyValues::default();
    for (component, texts) in [
        (TOML, vec![header.scene_toml.as_str()]),
        (CLOTHS, cloths.collect()),
        (OBSTACLES, obstacles.collect()),
        (BRANCH, vec![header.branch.as_str()]),
    ] {
        values = values.with_component_from_data(component, Arc::new(StringArray::from(texts)));
    }
    stream.log_static(entity::SCENE, &values)?;
    for (path, text) in &header.meshes {
        let values = AnyValues::default()
            .with_component_from_data(TEXT, Arc::new(StringArray::from(vec![text.as_str()])));
        stream.log_static(
            entity::path(&[entity::SCENE, entity::MESHES, path]),
            &values,
        )?;
    }
    Ok(())
}

/// Says that the recording is complete, and how many frames it has.
pub(super) fn log_end(stream: &RecordingStream, frames: u64) -> RecordingStreamResult<()> {
    let frames = Arc::new(UInt64Array::from(vec![frames]));
    let values = AnyValues::default().with_component_from_data(FRAMES, frames);
    stream.log_static(entity::SCENE, &values)
}

/// What this chunk of `/scene` says to those who read it back: the texts of one of its components.
pub(crate) fn texts_of(chunk: &Chunk, component: &'static str) -> Option<Vec<String>> {
    let texts = chunk.iter_slices::<String>(component.into()).next()?;
    Some(texts.iter().map(|text| text.as_str().to_owned()).collect())
}

fn log_cloth(
    stream: &RecordingStream,
    header: &Header,
    cloth: &ClothHeader,
) -> RecordingStreamResult<()> {
    let paths = ClothPaths::new(cloth);
    let chain = cloth.triangles.is_empty();
    if chain {
        let few = cloth.particles <= FEW_PARTICLES;
        let radius = if few { MASS_RADIUS } else { CHAIN_WIDTH / 2.0 };
        let points = Points3D::update_fields().with_radii([Radius::new_ui_points(radius)]);
        stream.log_static(paths.mesh, &points)?;
    } else {
        let mesh = Mesh3D::update_fields().with_triangle_indices(&cloth.triangles);
        stream.log_static(paths.mesh, &mesh)?;
    }
    let width = if chain { CHAIN_WIDTH } else { SPRING_WIDTH };
    for (f, path) in paths.springs.into_iter().enumerate() {
        if drawing::draws(header.spring_detail, cloth, f) {
            let lines = LineStrips3D::update_fields().with_radii([Radius::new_ui_points(width)]);
            stream.log_static(path, &lines)?;
        }
    }
    if !cloth.pins.is_empty() {
        let pins = Points3D::update_fields()
            .with_radii([Radius::new_ui_points(PIN_RADIUS)])
            .with_colors([color::PIN]);
        stream.log_static(paths.pins, &pins)?;
    }
    Ok(())
}

fn log_obstacle(stream: &RecordingStream, obstacle: &ObstacleHeader) -> RecordingStreamResult<()> {
    let mut mesh = Mesh3D::update_fields()
        .with_triangle_indices(&obstacle.triangles)
        .with_albedo_factor(Rgba32::from(color::OBSTACLE));
    if !obstacle.moves {
        mesh = mesh
            .with_vertex_positions(&obstacle.positions)
            .with_vertex_normals(normals::smooth(&obstacle.positions, &obstacle.triangles));
    }
    stream.log_static(entity::body(&obstacle.name), &mesh)
}

/// Names and colours of the series; the colours repeat only within a plot of more than eight.
pub(crate) fn log_series(stream: &RecordingStream, all: &[Series]) -> RecordingStreamResult<()> {
    for panel in panels::of(all) {
        for (n, series) in panel.series.iter().enumerate() {
            let style = SeriesLines::new()
                .with_names([series.label.as_str()])
                .with_colors([color::SERIES[n % color::SERIES.len()]])
                .with_widths([1.5]);
            stream.log_static(entity::series(&series.path), &style)?;
        }
    }
    Ok(())
}
