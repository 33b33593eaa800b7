//! Pictures (PNG) of comparisons, on plain numbers: [`polar()`] diagrams of what depends on direction,
//! [`curves()`] in space, [`work_precision()`] diagrams of what accuracy costs, and [`map()`]s of what
//! becomes of two dials.
//!
//! The font (crate `dejavu`) is part of the program: nothing is asked of the system.

mod curves;
mod map;
mod polar;
mod work_precision;

pub use curves::curves;
pub use map::{Kind, Map, Panel, map};
pub use polar::polar;
pub use work_precision::{Mark, MarkKind, WorkLine, work_precision};

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::Once;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::register_font;

/// Width and height of a picture (pixels).
pub const SIZE: [u32; 2] = [1200, 900];

const FONT: &str = "sans-serif";
const TITLE: u32 = 34;
const LABEL: u32 = 24;
const FAINT: RGBColor = RGBColor(205, 205, 205);

/// Colours of what is measured, told apart by the colour-blind too (Okabe and Ito 2008).
const COLORS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// Series of up to so many points show each as a dot.
const FEW: usize = 60;

/// A line of a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// What the legend calls it.
    pub name: String,
    /// Its points in order; what an entry is depends on the picture.
    pub points: Vec<[f64; 2]>,
    /// Whether it is what the others are compared with: drawn thin, dashed and black.
    pub reference: bool,
}

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The file can't be created or written.
    #[error("cannot write the picture {}: {source}", .path.display())]
    CannotWrite {
        /// The picture.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// There is nothing to draw, or it is not a number.
    #[error("cannot draw the picture {}: {reason}", .path.display())]
    CannotDraw {
        /// The picture.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

/// A chart's coordinates.
type Plane = Cartesian2d<RangedCoordf64, RangedCoordf64>;
type Canvas<'a> = BitMapBackend<'a>;
type Area<'a> = DrawingArea<Canvas<'a>, Shift>;
type Drawn<'a> = Result<(), DrawingAreaErrorKind<<Canvas<'a> as DrawingBackend>::ErrorType>>;

/// Draws on a white picture below a title, and writes it.
fn draw(
    path: &Path,
    title: &str,
    series: &[Series],
    paint: impl FnOnce(&Area<'_>) -> Drawn<'static>,
) -> Result<(), PictureError> {
    draw_checked(path, title, check(series), paint)
}

/// The same, where `checked` says whether there is something to draw.
fn draw_checked(
    path: &Path,
    title: &str,
    checked: Result<(), String>,
    paint: impl FnOnce(&Area<'_>) -> Drawn<'static>,
) -> Result<(), PictureError> {
    let cannot_draw = |reason: String| PictureError::CannotDraw {
        path: path.to_owned(),
        reason,
    };
    checked.map_err(cannot_draw)?;
    let [width, height] = SIZE;
    let mut pixels = vec![255; 3 * width as usize * height as usize];
    with_font();
    {
        let root = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
        let drawn = root
            .margin(20, 10, 10, 20)
            .titled(title, (FONT, TITLE))
            .and_then(|area| paint(&area))
            .and_then(|()| root.present());
        drawn.map_err(|error| cannot_draw(error.to_string()))?;
    }
    save(path, &pixels).map_err(|source| PictureError::CannotWrite {
        path: path.to_owned(),
        source,
    })
}

fn check(series: &[Series]) -> Result<(), String> {
    if series.iter().all(|series| series.points.is_empty()) {
        return Err("no series has a point".to_owned());
    }
    let finite = |series: &&Series| {
        series
            .points
            .iter()
            .flatten()
            .all(|value| value.is_finite())
    };
    match series.iter().find(|series| !finite(series)) {
        Some(series) => Err(format!("`{}` has a point that is not finite", series.name)),
        None => Ok(()),
    }
}

fn save(path: &Path, pixels: &[u8]) -> io::Result<()> {
    let mut encoder = png::Encoder::new(BufWriter::new(File::create(path)?), SIZE[0], SIZE[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(())
}

fn with_font() {
    static REGISTERED: Once = Once::new();
    REGISTERED.call_once(|| {
        let registered = register_font(FONT, FontStyle::Normal, dejavu::sans::regular());
        assert!(
            registered.is_ok(),
            "the font that comes with the program can be read"
        );
    });
}

/// A number on an axis, without the rounding of a sum of steps or the sign of nothing.
fn tick(value: f64) -> String {
    let digits = format!("{value:.9}");
    let digits = digits.trim_end_matches('0').trim_end_matches('.');
    let digits = if digits == "-0" { "0" } else { digits };
    digits.replace('-', "−")
}

/// Draws the lines of a chart, their dots and the legend.
fn draw_series<'a>(
    chart: &mut ChartContext<'a, Canvas<'a>, Plane>,
    series: &[Series],
    place: impl Fn([f64; 2]) -> (f64, f64),
    legend: SeriesLabelPosition,
) -> Drawn<'a> {
    let mut colors = COLORS.iter().cycle();
    for line in series {
        let points: Vec<(f64, f64)> = line.points.iter().map(|&point| place(point)).collect();
        if line.reference {
            chart
                .draw_series(DashedLineSeries::new(points, 9, 7, BLACK.stroke_width(2)))?
                .label(&line.name)
                .legend(|(x, y)| {
                    DashedPathElement::new([(x, y), (x + 34, y)], 9, 7, BLACK.stroke_width(2))
                });
            continue;
        }
        let color = *colors.next().unwrap_or(&BLACK);
        if points.len() <= FEW {
            let dots = points.iter().map(|&at| Circle::new(at, 5, color.filled()));
            chart.draw_series(dots)?;
        }
        chart
            .draw_series(LineSeries::new(points, color.stroke_width(3)))?
            .label(&line.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 34, y)], color.stroke_width(4)));
    }
    chart
        .configure_series_labels()
        .position(legend)
        .legend_area_size(44)
        .margin(14)
        .background_style(WHITE.mix(0.85))
        .border_style(FAINT)
        .label_font((FONT, LABEL))
        .draw()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where a test's picture goes; a folder of its own, so that two runs don't meet.
    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("muslin-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        folder
    }

    /// Pixels of a picture that differ from white, each counted once.
    fn drawn_pixels(path: &Path) -> usize {
        let decoder = png::Decoder::new(io::BufReader::new(File::open(path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        assert_eq!([reader.info().width, reader.info().height], SIZE);
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        pixels
            .chunks_exact(3)
            .filter(|pixel| *pixel != [255; 3])
            .count()
    }

    fn diagram() -> [Series; 3] {
        let around = |name: &str, share: f64, step: u32, reference| Series {
            name: name.to_owned(),
            points: (0..=360 / step)
                .map(|k| f64::from(k * step))
                .map(|angle| [angle, 180.0 + share * (4.0 * angle.to_radians()).cos()])
                .collect(),
            reference,
        };
        [
            around("E at 2 cm cells", 60.0, 15, false),
            around("E at 1 cm cells", 25.0, 15, false),
            around("E limit", 0.0, 5, true),
        ]
    }

    fn strips() -> [Series; 3] {
        let strip = |name: &str, fall: f64, points: u32, reference| Series {
            name: name.to_owned(),
            points: (0..points)
                .map(|k| f64::from(k) / f64::from(points - 1))
                .map(|s| [0.2 * s, -fall * s * s])
                .collect(),
            reference,
        };
        [
            strip("2 cm cells", 0.12, 11, false),
            strip("1 cm cells", 0.105, 21, false),
            strip("limit", 0.1, 200, true),
        ]
    }

    #[test]
    fn pictures_have_their_size_and_something_on_them() {
        let folder = folder("pictures");
        let files = ["polar.png", "strips.png"].map(|name| folder.join(name));
        polar(&files[0], "Stiffness by direction", "N/m", &diagram()).unwrap();
        curves(&files[1], "Cantilever under its own weight", &strips()).unwrap();
        for file in &files {
            let drawn = drawn_pixels(file);
            assert!((10_000..500_000).contains(&drawn), "{drawn} pixels");
        }
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn ticks_are_short() {
        let ticks = [0.1 + 0.2, -0.0, -1e-17, 200.0, -0.05].map(tick);
        assert_eq!(ticks, ["0.3", "0", "0", "200", "−0.05"]);
    }

    #[test]
    fn a_picture_that_fails_names_its_file_and_the_cause() {
        let folder = folder("no-pictures");
        let path = folder.join("nowhere").join("polar.png");
        let error = polar(&path, "", "N/m", &diagram()).unwrap_err().to_string();
        assert!(
            error.contains("polar.png") && error.contains("No such file"),
            "{error}"
        );
        let path = folder.join("curves.png");
        let error = curves(&path, "", &[]).unwrap_err().to_string();
        assert!(
            error.contains("curves.png: no series has a point"),
            "{error}"
        );
        let mut strips = strips();
        strips[1].points[3][0] = f64::NAN;
        let error = curves(&path, "", &strips).unwrap_err().to_string();
        assert!(
            error.contains("`1 cm cells` has a point that is not finite"),
            "{error}"
        );
        assert!(!path.exists(), "a picture that failed leaves no file");
        std::fs::remove_dir_all(folder).unwrap();
    }
}
