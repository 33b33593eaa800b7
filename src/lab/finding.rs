//! What the swatch tests of a scene's cloths found.

use super::cantilever::{self, Cantilever, Cut};
use super::membrane::{self, MembraneSeries};
use crate::scene::{BendingName, Cloth, LoadedScene, SceneError, Shape, SpringKind};

/// One cloth of a scene after its tests.
#[derive(Clone, Debug)]
pub enum Finding {
    /// It was tested.
    Tested(Box<Tested>),
    /// It was not.
    Skipped {
        /// Its name.
        cloth: String,
        /// Why not.
        reason: String,
    },
}

/// A cloth that was tested.
#[derive(Clone, Debug)]
pub struct Tested {
    /// The cloth.
    pub cloth: Cloth,
    /// Its stretch and shear.
    pub membrane: MembraneSeries,
    /// Its bending.
    pub bending: Bending,
}

/// What was found of bending.
#[derive(Clone, Debug)]
pub enum Bending {
    /// No strip was cut; why.
    NoStrip(&'static str),
    /// Strips along warp and weft.
    Strips(Vec<Cantilever>),
}

/// Tests the cloths of a scene, one after another; `say` is told what is being done.
///
/// # Errors
///
/// A mesh that can't be read.
pub fn run(loaded: &LoadedScene, say: &mut dyn FnMut(&str)) -> Result<Vec<Finding>, SceneError> {
    let mut findings: Vec<Finding> = Vec::new();
    for cloth in &loaded.scene.cloth {
        let skipped = |reason: String| Finding::Skipped {
            cloth: cloth.name.clone(),
            reason,
        };
        let finding = if let Some(reason) = reason_not_to(cloth) {
            skipped(reason.to_owned())
        } else if let Some(same) = tested_before(&findings, cloth) {
            skipped(format!("is the same cloth as {same}"))
        } else {
            test(loaded, cloth, say)?.map_or_else(
                || skipped(CURVED.to_owned()),
                |t| Finding::Tested(Box::new(t)),
            )
        };
        findings.push(finding);
    }
    Ok(findings)
}

const CURVED: &str = "is a curved mesh: stretch and shear are measured on flat ones only";

fn reason_not_to(cloth: &Cloth) -> Option<&'static str> {
    match cloth.shape {
        Shape::Chain(_) => Some("is a chain: it has no plane to be stretched and sheared in"),
        Shape::Block(_) => Some("is a block: swatches are cut from cloth"),
        _ if cloth.springs.contains(&SpringKind::ZeroLength) => {
            Some("has springs without rest length: it has no shape to deform from")
        }
        _ => None,
    }
}

/// Name of a cloth in the list that no test could tell from this one.
fn tested_before(findings: &[Finding], cloth: &Cloth) -> Option<String> {
    let key = key(cloth);
    findings.iter().find_map(|finding| match finding {
        Finding::Tested(tested) if self::key(&tested.cloth) == key => {
            Some(tested.cloth.name.clone())
        }
        _ => None,
    })
}

/// All of a cloth that its tests depend on.
fn key(cloth: &Cloth) -> String {
    let shape = match &cloth.shape {
        Shape::Sheet(sheet) => format!("{:?} {:?}", super::swatch::cell(sheet), sheet.diagonals),
        other => format!("{other:?}"),
    };
    let Cloth {
        springs,
        bending,
        material,
        ..
    } = cloth;
    format!("{shape} {springs:?} {bending:?} {material:?}")
}

fn test(
    loaded: &LoadedScene,
    cloth: &Cloth,
    say: &mut dyn FnMut(&str),
) -> Result<Option<Tested>, SceneError> {
    say(&format!("{}: stretch and shear", cloth.name));
    let Some(membrane) = membrane::test(loaded, cloth)? else {
        return Ok(None);
    };
    Ok(Some(Tested {
        cloth: cloth.clone(),
        membrane,
        bending: bending(loaded, cloth, say)?,
    }))
}

fn bending(
    loaded: &LoadedScene,
    cloth: &Cloth,
    say: &mut dyn FnMut(&str),
) -> Result<Bending, SceneError> {
    let Some(rigidity) = cantilever::rigidity(cloth) else {
        let asks = cloth.bending != BendingName::None || cloth.springs.contains(&SpringKind::Bend);
        return Ok(Bending::NoStrip(if asks {
            "It resists no bending: its rigidity is 0."
        } else {
            "It resists no bending: it has neither hinges nor bend springs."
        }));
    };
    debug_assert!(rigidity > 0.0);
    let Shape::Sheet(sheet) = &cloth.shape else {
        return Ok(Bending::NoStrip(
            "No cantilever was cut: strips of several resolutions are cut from sheets, and this is a mesh.",
        ));
    };
    let mut strips = Vec::new();
    for cut in [Cut::Warp, Cut::Weft] {
        say(&format!(
            "{}: cantilever along the {}",
            cloth.name,
            cut.name()
        ));
        strips.extend(cantilever::test(loaded, cloth, sheet, cut)?);
    }
    Ok(Bending::Strips(strips))
}
