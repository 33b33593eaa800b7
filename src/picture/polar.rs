//! Polar diagrams: how something depends on direction.

use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{
    Area, Canvas, Drawn, FAINT, FONT, LABEL, PictureError, Plane, Series, draw, draw_series, tick,
};

/// Height of the rings' numbers (pixels).
const SMALL: u32 = 20;
const GRAY: RGBColor = RGBColor(90, 90, 90);

/// Draws a polar diagram: points are an angle (degrees, counterclockwise from the right) and a radius
/// in `unit`, and are joined in their order; give the first again at the end to close a line.
///
/// # Errors
///
/// When there is no point, one is not finite, or the file can't be written.
pub fn polar(path: &Path, title: &str, unit: &str, series: &[Series]) -> Result<(), PictureError> {
    draw(path, title, series, |area| paint(area, unit, series))
}

fn paint<'a>(area: &Area<'a>, unit: &str, series: &[Series]) -> Drawn<'a> {
    let points = series.iter().flat_map(|series| &series.points);
    let largest = points.fold(0.0_f64, |most, point| most.max(point[1].abs()));
    let rings = Rings::up_to(largest);
    // The circle to the left, with room for the angles around it; the legend right of it.
    let (width, height) = area.dim_in_pixel();
    let half = 1.18 * rings.radius();
    let right = half * (2.0 * f64::from(width) / f64::from(height) - 1.0);
    let mut chart = ChartBuilder::on(area).build_cartesian_2d(-half..right, -half..half)?;
    draw_grid(chart.plotting_area(), &rings)?;
    draw_series(&mut chart, series, at, SeriesLabelPosition::UpperRight)?;
    label_grid(chart.plotting_area(), &rings, unit)
}

/// Rings and spokes.
fn draw_grid<'a>(plane: &DrawingArea<Canvas<'a>, Plane>, rings: &Rings) -> Drawn<'a> {
    for k in 1..=rings.count {
        let radius = rings.step * f64::from(k);
        let around: Vec<_> = (0..=180)
            .map(|k| at([2.0 * f64::from(k), radius]))
            .collect();
        plane.draw(&PathElement::new(around, FAINT))?;
    }
    for spoke in 0..24 {
        let angle = 15.0 * f64::from(spoke);
        // All of them would blacken the middle.
        let inner = if spoke % 6 == 0 { 0.0 } else { rings.step };
        let ends = [at([angle, inner]), at([angle, rings.radius()])];
        plane.draw(&PathElement::new(ends, FAINT))?;
    }
    Ok(())
}

/// Angles around the outermost ring, and the radius of each ring.
fn label_grid<'a>(plane: &DrawingArea<Canvas<'a>, Plane>, rings: &Rings, unit: &str) -> Drawn<'a> {
    let style = (FONT, LABEL).into_font().color(&BLACK);
    let centred = style.pos(Pos::new(HPos::Center, VPos::Center));
    for spoke in 0..12 {
        let angle = 30 * spoke;
        let beside = at([f64::from(angle), 1.08 * rings.radius()]);
        plane.draw(&Text::new(format!("{angle}°"), beside, centred.clone()))?;
    }
    let small = (FONT, SMALL).into_font().color(&GRAY);
    let small = small.pos(Pos::new(HPos::Center, VPos::Bottom));
    for k in 1..=rings.count {
        let radius = rings.step * f64::from(k);
        let number = tick(radius);
        let text = if k == rings.count {
            format!("{number} {unit}")
        } else {
            number
        };
        // Between two spokes, where measurements every 15° have no dot.
        plane.draw(&Text::new(text, at([82.5, radius]), small.clone()))?;
    }
    Ok(())
}

/// Circles at equal distances.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rings {
    /// Distance from one to the next: 1, 2 or 5 times a power of ten.
    step: f64,
    /// How many.
    count: u32,
}

impl Rings {
    /// Three to eight that hold what is up to `largest` from the middle.
    fn up_to(largest: f64) -> Self {
        if largest <= 0.0 {
            return Self {
                step: 1.0,
                count: 1,
            };
        }
        let most = largest / 3.0;
        let power = 10.0_f64.powf(most.log10().floor());
        let factor = [5.0, 2.0].into_iter().find(|factor| factor * power <= most);
        let step = factor.unwrap_or(1.0) * power;
        let count = (1..9).find(|&count| f64::from(count) * step >= largest);
        Self {
            step,
            count: count.unwrap_or(9),
        }
    }

    fn radius(&self) -> f64 {
        self.step * f64::from(self.count)
    }
}

/// Where an angle (degrees) and a radius are.
fn at([angle, radius]: [f64; 2]) -> (f64, f64) {
    let (sin, cos) = angle.to_radians().sin_cos();
    (radius * cos, radius * sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_are_few_and_hold_everything() {
        let mut largest = 1e-6;
        while largest < 1e9 {
            let rings = Rings::up_to(largest);
            assert!((3..=8).contains(&rings.count), "{largest}: {rings:?}");
            assert!(rings.radius() >= largest, "{largest}: {rings:?}");
            assert!(rings.radius() < 1.5 * largest, "{largest}: {rings:?}");
            largest *= 1.07;
        }
        assert_eq!(
            Rings::up_to(270.0),
            Rings {
                step: 50.0,
                count: 6
            }
        );
    }
}
