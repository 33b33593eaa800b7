//! The legend of the colours: a strip with its ends named, in a view of its own.

use rerun::{Image, Points2D, RecordingStream, RecordingStreamResult};

use super::{color, entity};
use crate::frame::{Colors, Header};

/// Size of the strip, in pixels of its own picture: as wide and low as its place in the layout.
const SIZE: [u32; 2] = [512, 18];

/// Logs the legend.
pub(super) fn log(stream: &RecordingStream, header: &Header) -> RecordingStreamResult<()> {
    let [width, height] = SIZE;
    let [low, high] = ends(header);
    let column = |x: u32| {
        let share = (x as f32 + 0.5) / width as f32;
        color::of_strain(low + share * (high - low), header.strain_range)
    };
    let row = (0..width).flat_map(|x| {
        let [r, g, b, _] = column(x).to_array();
        [r, g, b]
    });
    let row: Vec<u8> = row.collect();
    let picture = Image::from_rgb24(row.repeat(height as usize), SIZE);
    stream.log_static(entity::path(&[entity::LEGEND]), &picture)?;
    let x = width as f32;
    // Labels stand below their places.
    let places = [0.03, 0.97].map(|share| [share * x, 0.0]);
    let numbers = [low, high].map(|at| said(header, at));
    let labels = Points2D::new(places)
        .with_radii([0.0])
        .with_colors([[235_u8, 235, 235]])
        .with_labels(numbers)
        .with_show_labels(true);
    stream.log_static(entity::path(&[entity::LEGEND, "numbers"]), &labels)
}

/// What the view is called.
pub(super) fn title(header: &Header) -> &'static str {
    match header.colors {
        Colors::Strain => "Colours: strain of cloth and springs, blue compressed, red stretched",
        Colors::Distance => "Colours: distance",
    }
}

/// What the ends of the strip stand for.
fn ends(header: &Header) -> [f32; 2] {
    match header.colors {
        Colors::Strain => [-header.strain_range, header.strain_range],
        Colors::Distance => [0.0, header.strain_range],
    }
}

fn said(header: &Header, value: f32) -> String {
    let short = |x: f32| {
        let text = format!("{x:.2}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    match header.colors {
        Colors::Strain if value > 0.0 => format!("+{} %", short(100.0 * value)),
        Colors::Strain => format!("{} %", short(100.0 * value)),
        Colors::Distance => format!("{} mm", short(1000.0 * value)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_are_named_with_their_units() {
        let mut header = Header {
            strain_range: 0.05,
            ..Header::default()
        };
        let all = |header: &Header| ends(header).map(|at| said(header, at));
        assert_eq!(all(&header), ["-5 %", "+5 %"]);
        header.colors = Colors::Distance;
        header.strain_range = 0.0125;
        assert_eq!(all(&header), ["0 mm", "12.5 mm"]);
    }
}
