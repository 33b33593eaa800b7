//! Bending: a strip that hangs from a clamp under its own weight, against the heavy elastica.

use super::elastica::{elastica, gamma_of_drop};
use super::limit::{Limit, limit};
use super::swatch::{alone, cell};
use crate::scene::{
    BendingName, Built, Cloth, LoadedScene, Pin, SceneError, Select, Shape, SheetShape, SpringKind,
};
use crate::simulation::{Rest, settle};
use glam::DVec3;

/// Γ = σ g L³/D of the strips: long enough to hang well down, short enough to tell D by its drop.
pub const GAMMA: f64 = 10.0;

/// Earth's (m/s²).
pub const GRAVITY: f64 = 9.81;

/// Cells along a strip where the cloth's own don't fit.
const CELLS: u32 = 10;

/// The cloth's own cells are used from so many to so many along a strip; below, there is no curve,
/// beyond, twice and four times as many take long.
const OWN_CELLS: [f64; 2] = [5.0, 20.0];

/// Fewer of the cloth's own cells than this can't show the curve.
const FEW_CELLS: f64 = 3.0;

/// Width of a strip over its length, for all resolutions, so that they have a limit.
const WIDTH: f64 = 0.4;

/// Force that may be left on a particle, over the largest pull.
const TOLERANCE: f64 = 1e-7;

/// Which thread runs along a strip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// The warp: a sheet's x.
    Warp,
    /// The weft: a sheet's z.
    Weft,
}

/// What strips of a cloth show at three resolutions.
#[derive(Clone, Debug)]
pub struct Cantilever {
    /// Which thread runs along them.
    pub cut: Cut,
    /// Their free length (m).
    pub length: f64,
    /// The material's plate rigidity D (N·m).
    pub rigidity: f64,
    /// How many of the cloth's own cells fit into the length.
    pub own_cells: f64,
    /// The strips, from coarse to fine.
    pub strips: Vec<Strip>,
    /// What D tends to on finer meshes (N·m), if it does.
    pub limit: Option<Limit>,
}

/// One strip at rest.
#[derive(Clone, Debug)]
pub struct Strip {
    /// Cells along it.
    pub cells: u32,
    /// Mean line across the width, from the clamp (m): forwards and upwards.
    pub line: Vec<[f64; 2]>,
    /// Drop H/L of the free end.
    pub drop: f64,
    /// Reach W/L of the free end.
    pub reach: f64,
    /// Rigidity D (N·m) of the elastica with this drop; 0 for a strip that hangs straight down.
    pub rigidity: f64,
    /// How it came to rest.
    pub rest: Rest,
}

impl Cut {
    fn axis(self) -> usize {
        match self {
            Self::Warp => 0,
            Self::Weft => 1,
        }
    }

    /// `warp` or `weft`.
    pub fn name(self) -> &'static str {
        ["warp", "weft"][self.axis()]
    }

    /// Angle of the strip's length to the warp (degrees).
    pub fn angle(self) -> f64 {
        90.0 * self.axis() as f64
    }
}

/// The plate rigidity D (N·m) that a sheet's bending stands for; `None` where nothing bends.
///
/// Bend springs of one raw constant k stand for D = k h²/16, the inverse of what a rigidity makes of
/// them.
pub fn rigidity(cloth: &Cloth) -> Option<f64> {
    let given = cloth.material.bend.filter(|&bend| bend > 0.0);
    if cloth.bending != BendingName::None {
        return given;
    }
    if !cloth.springs.contains(&SpringKind::Bend) {
        return None;
    }
    match (cloth.material.spring_constant, &cloth.shape) {
        (Some(constant), Shape::Sheet(sheet)) => {
            let [u, v] = cell(sheet);
            Some(constant * u * v / 16.0)
        }
        _ => given,
    }
}

/// Cuts strips along a thread and lets them hang; `None` where nothing bends.
///
/// # Errors
///
/// None for sheets that could be built.
pub fn test(
    loaded: &LoadedScene,
    cloth: &Cloth,
    sheet: &SheetShape,
    cut: Cut,
) -> Result<Option<Cantilever>, SceneError> {
    let (Some(rigidity), Some(density)) = (rigidity(cloth), cloth.material.area_density) else {
        return Ok(None);
    };
    let length = (GAMMA * rigidity / (density * GRAVITY)).cbrt();
    let own = cell(sheet);
    let own_cells = length / own[cut.axis()];
    let first = if (OWN_CELLS[0]..=OWN_CELLS[1]).contains(&own_cells) {
        whole(own_cells)
    } else {
        CELLS
    };
    let aspect = own[1 - cut.axis()] / own[cut.axis()];
    let mut strips = Vec::new();
    for cells in [first, 2 * first, 4 * first] {
        let piece = Piece::new(cloth, sheet, cut, [length, aspect], cells);
        strips.push(piece.hang(loaded, rigidity)?);
    }
    let rigidities = [0, 1, 2].map(|i| strips[i].rigidity);
    Ok(Some(Cantilever {
        cut,
        length,
        rigidity,
        own_cells,
        limit: limit(rigidities, 1e-9 * rigidity).map(|limit| Limit {
            // What falls to nothing is extrapolated beyond it.
            value: limit.value.max(0.0),
            ..limit
        }),
        strips,
    }))
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "small and positive"
)]
fn whole(x: f64) -> u32 {
    x.round() as u32
}

impl Cantilever {
    /// Whether the cloth's own cells are too long to show the curve.
    pub fn is_too_coarse(&self) -> bool {
        self.own_cells < FEW_CELLS
    }

    /// Whether strips of another cut show the same.
    pub fn agrees_with(&self, other: &Self) -> bool {
        let mut pairs = self.strips.iter().zip(&other.strips);
        let same = |(a, b): (&Strip, &Strip)| a.cells == b.cells && (a.drop - b.drop).abs() < 1e-6;
        (self.own_cells - other.own_cells).abs() < 1e-6 && pairs.all(same)
    }

    /// Width of the cloth's own cells along the strip (m).
    pub fn own_cell(&self) -> f64 {
        self.length / self.own_cells
    }
}

/// A strip to be cut.
struct Piece {
    cloth: Cloth,
    cut: Cut,
    /// Cells along its free part and across.
    cells: [u32; 2],
    /// Cells between the columns that are held: 1 where no hinge can clamp, else 0.
    held: u32,
    /// Free length (m).
    length: f64,
}

impl Piece {
    fn new(
        cloth: &Cloth,
        sheet: &SheetShape,
        cut: Cut,
        [length, aspect]: [f64; 2],
        cells: u32,
    ) -> Self {
        let held = u32::from(cloth.bending == BendingName::None);
        let piece = length / f64::from(cells);
        let across = whole(WIDTH * length / (piece * aspect)).max(2);
        let mut shape = SheetShape {
            size: [
                piece * f64::from(cells + held),
                piece * aspect * f64::from(across),
            ],
            cells: [cells + held, across],
            diagonals: sheet.diagonals,
            opening: None,
        };
        if cut == Cut::Weft {
            shape.size.reverse();
            shape.cells.reverse();
        }
        let cloth = Cloth {
            shape: Shape::Sheet(shape),
            ..cloth.clone()
        };
        Self {
            cloth,
            cut,
            cells: [cells, across],
            held,
            length,
        }
    }

    /// Particles of column number `k` along the strip.
    fn column(&self, k: u32) -> Vec<u32> {
        let [along, across] = self.cells;
        let all = 0..=across;
        match self.cut {
            Cut::Warp => all.map(|j| j * (along + self.held + 1) + k).collect(),
            Cut::Weft => all.map(|i| k * (across + 1) + i).collect(),
        }
    }

    fn pin(&self) -> Pin {
        Pin {
            cloth: self.cloth.name.clone(),
            select: Select::Vertices((0..=self.held).flat_map(|k| self.column(k)).collect()),
            clamp: self.held == 0,
            motion: None,
            release: None,
        }
    }

    fn hang(&self, loaded: &LoadedScene, rigidity: f64) -> Result<Strip, SceneError> {
        let pins = vec![self.pin()];
        let Built {
            model, mut state, ..
        } = alone(loaded, self.cloth.clone(), pins, GRAVITY)?;
        let rest = settle(&model, &mut state, TOLERANCE);
        let line = self.line(&state.positions);
        let [reach, fall] = line[line.len() - 1].map(|x| x / self.length);
        Ok(Strip {
            cells: self.cells[0],
            drop: -fall,
            reach,
            rigidity: gamma_of_drop(-fall).map_or(0.0, |gamma| rigidity * GAMMA / gamma),
            line,
            rest,
        })
    }

    /// Mean of each free column from the clamp (m): forwards and upwards.
    fn line(&self, positions: &[DVec3]) -> Vec<[f64; 2]> {
        let mean = |k: u32| {
            let column = self.column(k);
            let sum: DVec3 = column.iter().map(|&i| positions[i as usize]).sum();
            let mean = sum / column.len() as f64;
            [[mean.x, mean.y], [mean.z, mean.y]][self.cut.axis()]
        };
        let [x, y] = mean(self.held);
        let last = self.cells[0] + self.held;
        (self.held..=last)
            .map(mean)
            .map(|[u, v]| [u - x, v - y])
            .collect()
    }
}

impl Strip {
    /// Error of its drop against the elastica, over the elastica's.
    pub fn drop_error(&self) -> f64 {
        self.drop / elastica(GAMMA).drop - 1.0
    }
}
