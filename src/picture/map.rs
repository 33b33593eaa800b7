//! Maps of what becomes of two dials: a panel a case, a column a value along a logarithmic axis, a row a
//! value of the other dial, with a line across.

use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{Area, Drawn, FAINT, FONT, PictureError, draw_checked};

/// Heights of names and numbers (pixels).
const NAME: i32 = 21;
const SMALL: i32 = 17;

/// Pixels left of the panels for the rows' names, and below them for steps and legend; between panels.
const LEFT: i32 = 108;
const STEPS: i32 = 52;
const LEGEND: i32 = 30;
const GAP: [i32; 2] = [18, 34];

/// A map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// What it is of.
    pub title: String,
    /// The steps (s), growing.
    pub columns: Vec<f64>,
    /// What the rows are called, from below.
    pub rows: Vec<String>,
    /// What the rows differ in.
    pub row_axis: String,
    /// What becomes of a cell; those that occur are in the legend.
    pub kinds: Vec<Kind>,
    /// The panels.
    pub panels: Vec<Panel>,
    /// What the legend calls the line.
    pub line: String,
}

/// What becomes of a cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kind {
    /// What the legend calls it.
    pub name: String,
    /// Red, green and blue.
    pub color: [u8; 3],
    /// Whether a cross goes through it.
    pub crossed: bool,
}

/// One panel of a map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// What it is called.
    pub name: String,
    /// The kind of each cell, by row and column; what is empty stays white.
    pub cells: Vec<Vec<Option<usize>>>,
    /// Where the line is in each row (s).
    pub line: Vec<Option<f64>>,
}

/// Draws a map.
///
/// # Errors
///
/// When there is nothing to draw, a step is no positive number, or the file can't be written.
pub fn map(path: &Path, map: &Map) -> Result<(), PictureError> {
    draw_checked(path, &map.title, check(map), |area| paint(area, map))
}

fn check(map: &Map) -> Result<(), String> {
    if map.panels.is_empty() || map.rows.is_empty() || map.columns.is_empty() {
        return Err("there is no cell".to_owned());
    }
    let is_step = |x: &f64| x.is_finite() && *x > 0.0;
    match map.columns.iter().find(|x| !is_step(x)) {
        Some(step) => Err(format!("{step} s is no step of a logarithmic axis")),
        None => Ok(()),
    }
}

/// Where a panel's corner is, and how large it is (pixels).
#[derive(Clone, Copy)]
struct Place {
    left: i32,
    top: i32,
    width: i32,
    height: i32,
}

fn paint<'a>(area: &Area<'a>, map: &Map) -> Drawn<'a> {
    let (width, height) = area.dim_in_pixel();
    let [width, height] = [width, height].map(u32::cast_signed);
    let legend = legend_rows(map, width);
    let lines = legend.last().map_or(0, |item| item.row + 1);
    let below = STEPS + LEGEND * lines;
    let count = i32::try_from(map.panels.len()).unwrap_or(i32::MAX);
    let columns = match count {
        1..=3 => count,
        4 => 2,
        5 | 6 => 3,
        _ => 4,
    };
    let rows = (count - 1) / columns + 1;
    let cell = [
        (width - LEFT) / columns - GAP[0],
        (height - below) / rows - GAP[1],
    ];
    for (panel, i) in map.panels.iter().zip(0..) {
        let (column, row) = (i % columns, i / columns);
        let place = Place {
            left: LEFT + column * (cell[0] + GAP[0]),
            top: row * (cell[1] + GAP[1]) + GAP[1],
            width: cell[0],
            height: cell[1],
        };
        paint_panel(area, map, panel, place)?;
        if column == 0 {
            name_rows(area, map, place)?;
        }
        if i + columns >= count {
            name_steps(area, map, place)?;
        }
    }
    name_axis(area, map, [height - below, 0])?;
    paint_legend(area, map, &legend, height - LEGEND * lines)
}

/// Where a step is between the left (0) and the right (1) of a panel, and the borders of its columns.
fn share(map: &Map, step: f64) -> f64 {
    let borders = borders(map);
    let [first, last] = [0, borders.len() - 1].map(|i| borders[i].ln());
    (step.ln() - first) / (last - first)
}

/// Borders of the columns (s): half-way in ratio, the outermost as far out as the next is in.
fn borders(map: &Map) -> Vec<f64> {
    let steps = &map.columns;
    let middle = |i: usize| (steps[i] * steps[i + 1]).sqrt();
    let last = steps.len() - 1;
    if last == 0 {
        return vec![0.5 * steps[0], 2.0 * steps[0]];
    }
    let mut borders = vec![steps[0] * steps[0] / middle(0)];
    borders.extend((0..last).map(middle));
    borders.push(steps[last] * steps[last] / middle(last - 1));
    borders
}

impl Place {
    #[expect(clippy::cast_possible_truncation, reason = "pixels of a picture")]
    fn x(&self, share: f64) -> i32 {
        self.left + (share * f64::from(self.width)).round() as i32
    }

    /// The lower border of a row, counted from below.
    fn y(&self, row: usize, rows: usize) -> i32 {
        let [row, rows] = [row, rows].map(|n| i32::try_from(n).unwrap_or(i32::MAX));
        self.top + self.height - self.height * row / rows
    }
}

fn paint_panel<'a>(area: &Area<'a>, map: &Map, panel: &Panel, place: Place) -> Drawn<'a> {
    let edges: Vec<i32> = borders(map)
        .iter()
        .map(|&step| place.x(share(map, step)))
        .collect();
    let rows = map.rows.len();
    for (row, cells) in panel.cells.iter().enumerate() {
        let (low, high) = (place.y(row, rows), place.y(row + 1, rows));
        for (column, kind) in cells.iter().enumerate() {
            let Some(kind) = kind.and_then(|kind| map.kinds.get(kind)) else {
                continue;
            };
            let corners = [(edges[column], high), (edges[column + 1], low)];
            paint_cell(area, kind, corners)?;
        }
    }
    let frame = [
        (place.left, place.top),
        (place.left + place.width, place.top + place.height),
    ];
    area.draw(&Rectangle::new(frame, BLACK))?;
    paint_line(area, map, panel, place)?;
    let above = (place.left + place.width / 2, place.top - 4);
    let style = text(NAME, HPos::Center, VPos::Bottom);
    area.draw(&Text::new(panel.name.as_str(), above, style))
}

fn paint_cell<'a>(area: &Area<'a>, kind: &Kind, corners: [(i32, i32); 2]) -> Drawn<'a> {
    let [red, green, blue] = kind.color;
    let color = RGBColor(red, green, blue);
    area.draw(&Rectangle::new(corners, color.filled()))?;
    area.draw(&Rectangle::new(corners, WHITE))?;
    if kind.crossed {
        let [(left, top), (right, bottom)] = corners;
        let (x, y) = (i32::midpoint(left, right), i32::midpoint(top, bottom));
        let r = (right - left).min(bottom - top) / 5;
        for sign in [-1, 1] {
            let ends = [(x - r, y - sign * r), (x + r, y + sign * r)];
            area.draw(&PathElement::new(ends, WHITE.stroke_width(2)))?;
        }
    }
    Ok(())
}

/// The line, through a row at its own step each; it ends where it leaves the panel.
fn paint_line<'a>(area: &Area<'a>, map: &Map, panel: &Panel, place: Place) -> Drawn<'a> {
    let rows = map.rows.len();
    let mut pieces: Vec<Vec<(i32, i32)>> = vec![Vec::new()];
    for (row, step) in panel.line.iter().enumerate() {
        let inside = step.map(|step| share(map, step));
        match inside.filter(|share| (0.0..=1.0).contains(share)) {
            Some(share) => {
                let x = place.x(share);
                let ends = [(x, place.y(row, rows)), (x, place.y(row + 1, rows))];
                pieces.last_mut().into_iter().for_each(|p| p.extend(ends));
            }
            None => pieces.push(Vec::new()),
        }
    }
    for piece in pieces.into_iter().filter(|piece| !piece.is_empty()) {
        area.draw(&PathElement::new(piece, BLACK.stroke_width(3)))?;
    }
    Ok(())
}

fn text(height: i32, horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
    let style = (FONT, height).into_font().color(&BLACK);
    style.pos(Pos::new(horizontal, vertical))
}

fn name_rows<'a>(area: &Area<'a>, map: &Map, place: Place) -> Drawn<'a> {
    let rows = map.rows.len();
    for (row, name) in map.rows.iter().enumerate() {
        let y = i32::midpoint(place.y(row, rows), place.y(row + 1, rows));
        let style = text(SMALL, HPos::Right, VPos::Center);
        area.draw(&Text::new(name.as_str(), (place.left - 8, y), style))?;
    }
    Ok(())
}

/// Ticks at powers of ten below a panel.
fn name_steps<'a>(area: &Area<'a>, map: &Map, place: Place) -> Drawn<'a> {
    let bottom = place.top + place.height;
    for power in -9..3 {
        let at = share(map, 10.0_f64.powi(power));
        if !(0.0..=1.0).contains(&at) {
            continue;
        }
        let x = place.x(at);
        let tick = [(x, bottom), (x, bottom + 6)];
        area.draw(&PathElement::new(tick, BLACK))?;
        let style = text(SMALL, HPos::Center, VPos::Top);
        area.draw(&Text::new(time(power), (x, bottom + 9), style))?;
    }
    Ok(())
}

/// A power of ten of seconds.
fn time(power: i32) -> String {
    let (unit, below) = match power {
        ..=-7 => ("ns", -9),
        -6..=-4 => ("µs", -6),
        -3..=-1 => ("ms", -3),
        _ => ("s", 0),
    };
    format!("{} {unit}", 10_i32.pow((power - below).unsigned_abs()))
}

/// What the axes are, each once.
fn name_axis<'a>(area: &Area<'a>, map: &Map, [bottom, left]: [i32; 2]) -> Drawn<'a> {
    let (width, _) = area.dim_in_pixel();
    let middle = (LEFT + width.cast_signed()) / 2;
    let style = text(NAME, HPos::Center, VPos::Top);
    area.draw(&Text::new("step", (middle, bottom + 24), style))?;
    let upright = (FONT, NAME)
        .into_font()
        .transform(FontTransform::Rotate270)
        .color(&BLACK)
        .pos(Pos::new(HPos::Center, VPos::Top));
    let at = (left, bottom / 2);
    area.draw(&Text::new(map.row_axis.as_str(), at, upright))
}

/// Something in the legend: a kind, or the line.
struct Item {
    kind: Option<usize>,
    row: i32,
    left: i32,
}

/// Width of a swatch (pixels) and of a letter, about; and space after an item.
const SWATCH: i32 = 30;
const LETTER: i32 = 8;
const AFTER: i32 = 22;

/// Where the kinds that occur, and the line if there is one, stand in the legend.
fn legend_rows(map: &Map, width: i32) -> Vec<Item> {
    let occurs = |kind: usize| {
        let cells = map.panels.iter().flat_map(|panel| panel.cells.iter());
        cells.flatten().any(|cell| *cell == Some(kind))
    };
    let kinds = (0..map.kinds.len()).filter(|&kind| occurs(kind)).map(Some);
    let has_line = map
        .panels
        .iter()
        .any(|p| p.line.iter().any(Option::is_some));
    let (mut row, mut left) = (0, 0);
    let mut items = Vec::new();
    for kind in kinds.chain(has_line.then_some(None)) {
        let name = kind.map_or(&map.line, |kind| &map.kinds[kind].name);
        let letters = i32::try_from(name.chars().count()).unwrap_or(i32::MAX);
        let wide = SWATCH + 8 + LETTER * letters + AFTER;
        if left > 0 && left + wide > width {
            (row, left) = (row + 1, 0);
        }
        items.push(Item { kind, row, left });
        left += wide;
    }
    items
}

fn paint_legend<'a>(area: &Area<'a>, map: &Map, items: &[Item], top: i32) -> Drawn<'a> {
    for item in items {
        let y = top + LEGEND * item.row + LEGEND / 2 + 4;
        let right = item.left + SWATCH;
        let corners = [(item.left, y - 10), (right, y + 10)];
        let name = match item.kind {
            Some(kind) => {
                paint_cell(area, &map.kinds[kind], corners)?;
                area.draw(&Rectangle::new(corners, FAINT))?;
                &map.kinds[kind].name
            }
            None => {
                let line = [(item.left, y), (right, y)];
                area.draw(&PathElement::new(line, BLACK.stroke_width(3)))?;
                &map.line
            }
        };
        let style = text(SMALL, HPos::Left, VPos::Center);
        area.draw(&Text::new(name.as_str(), (right + 8, y), style))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_share_the_axis_by_ratio() {
        let map = Map {
            columns: vec![1e-4, 1e-3, 1e-2],
            ..Map::default()
        };
        let borders = borders(&map);
        let expected = [-4.5, -3.5, -2.5, -1.5].map(|power| 10.0_f64.powf(power));
        for (border, expected) in borders.iter().zip(expected) {
            assert!((border / expected - 1.0).abs() < 1e-12, "{borders:?}");
        }
        assert!((share(&map, 1e-3) - 0.5).abs() < 1e-12);
        assert_eq!(
            [-5, -4, -1, 0].map(time),
            ["10 µs", "100 µs", "100 ms", "1 s"]
        );
    }

    #[test]
    fn what_occurs_is_in_the_legend_and_fits() {
        let kind = |name: &str| Kind {
            name: name.to_owned(),
            ..Kind::default()
        };
        let panel = Panel {
            cells: vec![vec![Some(0), Some(2)]],
            line: vec![Some(1.0)],
            ..Panel::default()
        };
        let map = Map {
            kinds: ["a", "b", "c"].map(kind).to_vec(),
            panels: vec![panel],
            line: "x".repeat(140),
            ..Map::default()
        };
        let items = legend_rows(&map, 1200);
        let found: Vec<_> = items.iter().map(|item| (item.kind, item.row)).collect();
        assert_eq!(found, [(Some(0), 0), (Some(2), 0), (None, 1)]);
    }
}
