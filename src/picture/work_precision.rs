//! Work–precision diagrams: what accuracy costs, both on logarithmic axes.
//!
//! The error lies along x and the time along y, as in the diagrams of Hairer and Wanner 1996 and of
//! `DiffEqDevTools`: a line further left and lower is better.

use std::path::Path;

use plotters::coord::combinators::LogCoord;
use plotters::prelude::*;

use super::{Area, COLORS, Canvas, Drawn, FAINT, FONT, LABEL, PictureError, draw_checked};

/// A line of the diagram: one scheme.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WorkLine {
    /// What the legend calls it.
    pub name: String,
    /// Its settings, long steps first.
    pub marks: Vec<Mark>,
}

/// A setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Its error in the unit of the axis; of a failed run nothing that counts.
    pub error: f64,
    /// Seconds a simulated second.
    pub seconds: f64,
    /// What is known of it.
    pub kind: MarkKind,
    /// Whether no other is better: then its dot is filled.
    pub front: bool,
}

/// What is known of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkKind {
    /// Its error: a dot.
    Known,
    /// Its error is at most what is said: an arrow to the left of the dot.
    AtMost,
    /// It didn't come to its end: a cross at the right edge.
    Failed,
}

type LogPlane = Cartesian2d<LogCoord<f64>, LogCoord<f64>>;

/// Draws a diagram. `shaded` is an error below which nothing can be told.
///
/// # Errors
///
/// When no setting has an error and a time, or the file can't be written.
pub fn work_precision(
    path: &Path,
    title: &str,
    [x, y]: [&str; 2],
    lines: &[WorkLine],
    shaded: f64,
) -> Result<(), PictureError> {
    let marks = || lines.iter().flat_map(|line| &line.marks);
    let known = || marks().filter(|mark| mark.kind != MarkKind::Failed);
    let usable = known().all(|mark| mark.error > 0.0 && mark.error.is_finite())
        && marks().all(|mark| mark.seconds > 0.0 && mark.seconds.is_finite());
    let checked = match (known().next(), usable) {
        (None, _) => Err("no run came to its end".to_owned()),
        (_, false) => Err("an error or a time is no positive number".to_owned()),
        _ => Ok(()),
    };
    let errors = decades(known().map(|mark| mark.error));
    let seconds = decades(marks().map(|mark| mark.seconds));
    draw_checked(path, title, checked, |area| {
        paint(area, [x, y], lines, [errors, seconds], shaded)
    })
}

/// A range that holds all values, with some room.
fn decades(values: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let low = values.clone().fold(f64::INFINITY, f64::min);
    let high = values.fold(0.0, f64::max);
    [low / 1.8, high * 1.8]
}

fn paint<'a>(
    area: &Area<'a>,
    [x, y]: [&str; 2],
    lines: &[WorkLine],
    [errors, seconds]: [[f64; 2]; 2],
    shaded: f64,
) -> Drawn<'a> {
    let mut chart = ChartBuilder::on(area)
        .margin(20)
        .margin_right(330) // the legend
        .x_label_area_size(80)
        .y_label_area_size(110)
        .build_cartesian_2d(
            (errors[0]..errors[1]).log_scale(),
            (seconds[0]..seconds[1]).log_scale(),
        )?;
    chart
        .configure_mesh()
        .light_line_style(WHITE.mix(0.0))
        .bold_line_style(FAINT)
        .x_label_formatter(&|&value| label(value))
        .y_label_formatter(&|&value| label(value))
        .x_desc(x)
        .y_desc(y)
        .axis_desc_style((FONT, LABEL))
        .label_style((FONT, LABEL))
        .draw()?;
    if shaded > errors[0] {
        let corners = [(errors[0], seconds[0]), (shaded, seconds[1])];
        chart
            .plotting_area()
            .draw(&Rectangle::new(corners, FAINT.mix(0.35).filled()))?;
    }
    for (n, line) in lines.iter().enumerate() {
        draw_line(&mut chart, n, line, errors[1])?;
    }
    draw_legend(area, lines)
}

/// A number of an axis of decades.
fn label(value: f64) -> String {
    if (0.001..10_000.0).contains(&value) {
        super::tick(value)
    } else {
        format!("{value:.0e}").replace('-', "−")
    }
}

fn draw_line<'a>(
    chart: &mut ChartContext<'a, Canvas<'a>, LogPlane>,
    n: usize,
    line: &WorkLine,
    right: f64,
) -> Drawn<'a> {
    let color = COLORS[n % COLORS.len()];
    let known = |mark: &&Mark| mark.kind == MarkKind::Known;
    let points: Vec<(f64, f64)> = line
        .marks
        .iter()
        .filter(known)
        .map(|mark| (mark.error, mark.seconds))
        .collect();
    let plane = chart.plotting_area();
    if n < COLORS.len() {
        plane.draw(&PathElement::new(points, color.stroke_width(3)))?;
    } else {
        // Two lines of one colour: the second is dashed.
        chart.draw_series(DashedLineSeries::new(points, 10, 6, color.stroke_width(3)))?;
    }
    let plane = chart.plotting_area();
    for mark in &line.marks {
        let at = (mark.error, mark.seconds);
        match mark.kind {
            MarkKind::Known => {}
            MarkKind::AtMost => {
                let arrow = EmptyElement::at(at)
                    + PathElement::new([(0, 0), (-22, 0)], color.stroke_width(2))
                    + PathElement::new([(-14, -6), (-22, 0), (-14, 6)], color.stroke_width(2));
                plane.draw(&arrow)?;
            }
            MarkKind::Failed => {
                let at = (right, mark.seconds);
                plane.draw(&Cross::new(at, 8, color.stroke_width(3)))?;
                continue;
            }
        }
        if mark.front {
            plane.draw(&Circle::new(at, 8, color.filled()))?;
        } else {
            plane.draw(&Circle::new(at, 6, WHITE.filled()))?;
            plane.draw(&Circle::new(at, 6, color.stroke_width(2)))?;
        }
    }
    Ok(())
}

/// Names to the right, and what the marks mean.
fn draw_legend<'a>(area: &Area<'a>, lines: &[WorkLine]) -> Drawn<'a> {
    let (width, _) = area.dim_in_pixel();
    let left = width.cast_signed() - 318;
    let text = |text: &str, at| Text::new(text.to_owned(), at, (FONT, LABEL));
    let mut y = 34;
    for (n, line) in lines.iter().enumerate() {
        let color = COLORS[n % COLORS.len()];
        let dash = if n < COLORS.len() { 38 } else { 10 };
        for start in (0..38)
            .step_by(16)
            .take_while(|start| dash < 38 || *start == 0)
        {
            let ends = [
                (left + start, y + 12),
                (left + start + dash.min(38 - start), y + 12),
            ];
            area.draw(&PathElement::new(ends, color.stroke_width(4)))?;
        }
        area.draw(&text(&line.name, (left + 50, y)))?;
        y += 32;
    }
    y += 24;
    let at = |y: i32| (left + 18, y + 12);
    area.draw(&Circle::new(at(y), 8, BLACK.filled()))?;
    area.draw(&text("none is better", (left + 50, y)))?;
    area.draw(&Circle::new(at(y + 32), 6, BLACK.stroke_width(2)))?;
    area.draw(&text("dominated", (left + 50, y + 32)))?;
    area.draw(&Cross::new(at(y + 64), 8, BLACK.stroke_width(3)))?;
    area.draw(&text("failed", (left + 50, y + 64)))?;
    let (x, y) = at(y + 96);
    area.draw(&PathElement::new(
        [(x - 3, y - 6), (x - 11, y), (x - 3, y + 6)],
        BLACK.stroke_width(2),
    ))?;
    area.draw(&PathElement::new(
        [(x + 11, y), (x - 11, y)],
        BLACK.stroke_width(2),
    ))?;
    area.draw(&text("less than can be told", (left + 50, y - 12)))
}
