//! Runs laid over each other on one timeline, coloured by their distance to the reference.

use super::front::series;
use super::sweep::{Error, Row};
use super::track::Track;
use super::{Distance, Reference, Setting, StudyError, Subject, digits};
use crate::frame::{Capture, ClothFrame, ClothHeader, Colors, Frame, Header, Series, SpringDetail};
use glam::DVec3;

/// Recorded frames in a simulated second.
pub const FPS: f64 = 60.0;

/// Error (m) that is good enough to look at: the cheapest setting of each scheme below it is shown.
const GOOD: f64 = 0.01;

/// Runs laid over each other.
#[derive(Debug)]
pub struct Overlay {
    /// What stays the same.
    pub header: Header,
    /// What moves.
    pub frames: Vec<Frame>,
}

/// One of the runs.
struct Layer {
    name: String,
    frames: Vec<Vec<DVec3>>,
}

/// The settings worth a look: of each scheme the cheapest with an error of at most 1 cm, or else the most
/// exact.
pub fn shown(rows: &[Row]) -> Vec<Setting> {
    let pick = |list: &[&Row]| {
        let ended = || list.iter().filter(|row| row.error != Error::None);
        let good = ended().filter(|row| row.at_most() <= GOOD);
        let cheapest = good.min_by(|a, b| a.seconds_per_second.total_cmp(&b.seconds_per_second));
        let best = || ended().min_by(|a, b| a.at_most().total_cmp(&b.at_most()));
        cheapest.or_else(best).map(|row| row.setting)
    };
    series(rows)
        .iter()
        .filter_map(|(_, list)| pick(list))
        .collect()
}

/// Runs settings again and lays them over the reference, each as a cloth of its own.
///
/// # Errors
///
/// As [`Subject::run`].
pub fn overlay(
    subject: &Subject<'_>,
    reference: &Reference,
    settings: &[Setting],
) -> Result<Overlay, StudyError> {
    let mut layers = vec![Layer {
        name: "the reference".to_owned(),
        frames: reference.track.frames.clone(),
    }];
    for &setting in settings {
        let mut track = Track::new(FPS);
        subject.run(setting, &mut |simulation| track.see(simulation))?;
        layers.push(Layer {
            name: format!("{} at {}", setting.series(), setting.dial()),
            frames: track.frames,
        });
    }
    let simulation = subject.simulation(reference.setting)?;
    let (_, header) = Capture::new(&subject.loaded, &simulation);
    let mut triangles = Vec::new();
    for cloth in &simulation.model().cloths {
        triangles.extend(&cloth.triangles);
    }
    let range = largest(&layers);
    let header = layered(header, &layers, &triangles, range);
    let frames = (0..layers[0].frames.len())
        .map(|k| frame(&layers, k))
        .collect();
    Ok(Overlay { header, frames })
}

/// The header of a run, with a cloth and two series for each layer.
fn layered(header: Header, layers: &[Layer], triangles: &[[u32; 3]], range: f64) -> Header {
    let cloth = |layer: &Layer| ClothHeader {
        name: layer.name.clone(),
        particles: layer.frames.first().map_or(0, Vec::len),
        triangles: triangles.to_vec(),
        ..ClothHeader::default()
    };
    let curve = |kind: &str, layer: &Layer| Series {
        path: format!("{kind}/{}", layer.name.replace('/', " ")),
        label: format!("{} (mm)", layer.name),
    };
    let runs = || layers.iter().skip(1);
    let curves = runs().map(|run| curve("error", run));
    Header {
        scene: format!("{}-study", header.scene),
        #[expect(clippy::cast_possible_truncation, reason = "a length for colours")]
        strain_range: range as f32,
        colors: Colors::Distance,
        spring_detail: SpringDetail::Off,
        cloths: layers.iter().map(cloth).collect(),
        series: curves
            .chain(runs().map(|run| curve("largest", run)))
            .collect(),
        model_list: format!(
            "Runs of {} laid over each other. Colour: distance to the reference, red at {} mm.",
            header.scene,
            digits(1000.0 * range)
        ),
        ..header
    }
}

/// The distance (m) that is shown red: the median run's largest.
fn largest(layers: &[Layer]) -> f64 {
    let reference = &layers[0].frames;
    let mut each: Vec<f64> = layers[1..]
        .iter()
        .map(|layer| Distance::over(&layer.frames, reference).largest)
        .collect();
    each.sort_by(f64::total_cmp);
    each.get(each.len() / 2).copied().unwrap_or(0.0).max(1e-9)
}

fn frame(layers: &[Layer], k: usize) -> Frame {
    let reference = &layers[0].frames[k];
    // A run that failed stays where it was last.
    let at = |layer: &'_ Layer| {
        layer
            .frames
            .get(k)
            .or(layer.frames.last())
            .cloned()
            .unwrap_or_default()
    };
    let mut cloths = Vec::new();
    let [mut rms, mut largest] = [Vec::new(), Vec::new()];
    for (n, layer) in layers.iter().enumerate() {
        let positions = at(layer);
        if n > 0 {
            let distance = Distance::between(&positions, reference);
            rms.push(1000.0 * distance.rms);
            largest.push(1000.0 * distance.largest);
        }
        cloths.push(cloth_frame(&positions, reference));
    }
    rms.extend(largest);
    #[expect(clippy::cast_precision_loss, reason = "a few frames")]
    let time = k as f64 / FPS;
    Frame {
        index: k as u64,
        time,
        cloths,
        values: rms,
        ..Frame::default()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "drawn in f32")]
fn cloth_frame(positions: &[DVec3], reference: &[DVec3]) -> ClothFrame {
    let distances = positions
        .iter()
        .zip(reference)
        .map(|(a, b)| a.distance(*b) as f32);
    ClothFrame {
        positions: positions.iter().map(|p| p.as_vec3().to_array()).collect(),
        strain: distances.collect(),
        ..ClothFrame::default()
    }
}
