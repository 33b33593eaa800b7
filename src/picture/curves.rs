//! Curves in space, at equal scales.

use std::path::Path;

use plotters::prelude::*;

use super::{Area, Drawn, FAINT, FONT, LABEL, PictureError, Series, draw, draw_series, tick};

/// Pixels below and left of the axes, for numbers and names; and around them.
const BELOW: u32 = 80;
const LEFT: u32 = 110;
const AROUND: u32 = 20;

/// Draws curves of points (x, y) in metres, at the same scale along both axes.
///
/// # Errors
///
/// When there is no point, one is not finite, or the file can't be written.
pub fn curves(path: &Path, title: &str, series: &[Series]) -> Result<(), PictureError> {
    draw(path, title, series, |area| paint(area, series))
}

fn paint<'a>(area: &Area<'a>, series: &[Series]) -> Drawn<'a> {
    let (width, height) = area.dim_in_pixel();
    let plot = [width - LEFT - 2 * AROUND, height - BELOW - 2 * AROUND];
    let [x, y] = equal_ranges(series, plot);
    let mut chart = ChartBuilder::on(area)
        .margin(AROUND)
        .x_label_area_size(BELOW)
        .y_label_area_size(LEFT)
        .build_cartesian_2d(x[0]..x[1], y[0]..y[1])?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(FAINT)
        .x_label_formatter(&|&x| tick(x))
        .y_label_formatter(&|&y| tick(y))
        .x_desc("x (m)")
        .y_desc("y (m)")
        .axis_desc_style((FONT, LABEL))
        .label_style((FONT, LABEL))
        .draw()?;
    draw_series(
        &mut chart,
        series,
        |[x, y]| (x, y),
        // A strip that hangs to the right of its clamp leaves this corner free.
        SeriesLabelPosition::LowerLeft,
    )
}

/// Ranges of x and y that hold all points with a margin, as many metres a pixel in both.
fn equal_ranges(series: &[Series], plot: [u32; 2]) -> [[f64; 2]; 2] {
    let points = || series.iter().flat_map(|series| &series.points);
    let bounds = [0, 1].map(|axis| {
        let low = points().fold(f64::INFINITY, |low, point| low.min(point[axis]));
        let high = points().fold(f64::NEG_INFINITY, |high, point| high.max(point[axis]));
        [low, high]
    });
    let scale = |axis: usize| 1.12 * (bounds[axis][1] - bounds[axis][0]) / f64::from(plot[axis]);
    // A single point has no size; it is drawn within a metre.
    let mut metres_a_pixel = scale(0).max(scale(1));
    if metres_a_pixel <= 0.0 {
        metres_a_pixel = 1.0 / f64::from(plot[0]);
    }
    [0, 1].map(|axis| {
        let middle = 0.5 * (bounds[axis][0] + bounds[axis][1]);
        let half = 0.5 * metres_a_pixel * f64::from(plot[axis]);
        [middle - half, middle + half]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_metre_is_as_long_on_both_axes() {
        for points in [
            vec![[0.0, 0.0], [0.3, -0.1]],
            vec![[1.0, 2.0], [1.01, 5.0]],
            vec![[1.0; 2]],
        ] {
            let series = [Series {
                points: points.clone(),
                ..Series::default()
            }];
            let [x, y] = equal_ranges(&series, [1000, 700]);
            assert!(((x[1] - x[0]) / (y[1] - y[0]) - 1000.0 / 700.0).abs() < 1e-12);
            for [px, py] in points {
                assert!(x[0] < px && px < x[1] && y[0] < py && py < y[1]);
            }
        }
    }
}
