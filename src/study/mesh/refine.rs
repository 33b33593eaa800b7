//! A scene at other resolutions: every shape that is made of cells has more of them, in proportion.

use crate::scene::{Scene, Select, Shape};
use crate::study::StudyError;

/// The changes that give the first cloth that is made of cells `cells` of them along its longest row,
/// and the others as many times theirs.
pub(super) fn changes(scene: &Scene, cells: u32) -> Result<Vec<String>, StudyError> {
    let own = scene.cloth.iter().find_map(|cloth| longest(&cloth.shape));
    let Some(own) = own else {
        return Err(StudyError::Ask(
            "--cells: every cloth is a mesh from a file, which has the resolution that it has; give a sheet, chain or block"
                .to_owned(),
        ));
    };
    let mut changes = Vec::new();
    for (i, cloth) in scene.cloth.iter().enumerate() {
        let (key, counts): (&str, &[u32]) = match &cloth.shape {
            Shape::Sheet(sheet) => ("sheet.cells", &sheet.cells),
            Shape::Chain(chain) => ("chain.links", std::slice::from_ref(&chain.links)),
            Shape::Block(block) => ("block.cells", &block.cells),
            Shape::Obj(_) => continue,
        };
        let counted = |pin: &crate::scene::Pin| {
            pin.cloth == cloth.name && matches!(pin.select, Select::Vertices(_))
        };
        if let Some(pin) = scene.pin.iter().position(counted) {
            return Err(StudyError::Ask(format!(
                "--cells: pin.{pin} selects vertices by their numbers, which are others on another mesh; select an edge, a corner or a box"
            )));
        }
        let refined: Option<Vec<u32>> = counts.iter().map(|&n| scaled(n, cells, own)).collect();
        let Some(refined) = refined else {
            return Err(StudyError::Ask(format!(
                "--cells {cells}: {} has {counts:?} cells, which is no whole number of them times {cells}/{own}; use multiples of {own}",
                cloth.name
            )));
        };
        let value = match refined.as_slice() {
            [links] => links.to_string(),
            several => format!("{several:?}"),
        };
        changes.push(format!("cloth.{i}.shape.{key}={value}"));
    }
    Ok(changes)
}

/// Cells along the longest row of a shape; none of a mesh.
fn longest(shape: &Shape) -> Option<u32> {
    match shape {
        Shape::Sheet(sheet) => sheet.cells.iter().max().copied(),
        Shape::Chain(chain) => Some(chain.links),
        Shape::Block(block) => block.cells.iter().max().copied(),
        Shape::Obj(_) => None,
    }
}

/// n times `cells`/`own`, where that is a whole number above 0.
fn scaled(n: u32, cells: u32, own: u32) -> Option<u32> {
    let product = u64::from(n) * u64::from(cells);
    let whole = product.is_multiple_of(u64::from(own)) && product > 0;
    whole
        .then(|| u32::try_from(product / u64::from(own)).ok())
        .flatten()
}

/// The factor by which each resolution is finer than the one before.
///
/// # Errors
///
/// When they are fewer than two, don't grow, or not by one factor.
pub(super) fn ratio(cells: &[u32]) -> Result<f64, StudyError> {
    let ask = || {
        let given: Vec<String> = cells.iter().map(u32::to_string).collect();
        StudyError::Ask(format!(
            "--cells {}: give two resolutions or more that grow by one factor, such as 20,40,80",
            given.join(",")
        ))
    };
    let [first, second, ..] = cells else {
        return Err(ask());
    };
    let by_one_factor = cells.windows(2).all(|pair| {
        u64::from(pair[0]) * u64::from(*second) == u64::from(pair[1]) * u64::from(*first)
    });
    if *first == 0 || second <= first || !by_one_factor {
        return Err(ask());
    }
    Ok(f64::from(*second) / f64::from(*first))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load;

    fn of(scene: &str, set: &[&str], cells: u32) -> Result<Vec<String>, String> {
        let set: Vec<String> = set.iter().map(|&s| s.to_owned()).collect();
        changes(&load(scene, &set).unwrap().scene, cells).map_err(|error| error.to_string())
    }

    #[test]
    fn every_shape_grows_in_proportion() {
        assert_eq!(
            of("drape", &[], 30).unwrap(),
            ["cloth.0.shape.sheet.cells=[30, 30]"]
        );
        assert_eq!(
            of("chain", &[], 100).unwrap(),
            ["cloth.0.shape.chain.links=100"]
        );
        assert_eq!(
            of("block", &[], 9).unwrap(),
            ["cloth.0.shape.block.cells=[9, 9, 9]"]
        );
        let strips = of("spring-constants", &[], 8).unwrap();
        assert_eq!(strips[1], "cloth.1.shape.sheet.cells=[2, 16]");
        for (scene, cells) in [("drape", 30), ("chain", 100), ("block", 9)] {
            let loaded = load(scene, &[]).unwrap();
            let changes = of(scene, &[], cells).unwrap();
            loaded
                .with(&changes)
                .unwrap_or_else(|error| panic!("{error}"));
        }
    }

    #[test]
    fn what_cannot_be_refined_is_said() {
        for (scene, set, cells, words) in [
            ("thin-shell", &[][..], 40, "mesh from a file"),
            ("edge-springs", &[], 30, "multiples of 20"),
            (
                "hanging-cloth",
                &["pin.0.select={ vertices = [0] }"],
                40,
                "pin.0 selects vertices by their numbers",
            ),
        ] {
            let error = of(scene, set, cells).unwrap_err();
            assert!(error.contains(words), "{scene}: {error}");
        }
    }

    #[test]
    fn resolutions_grow_by_one_factor() {
        assert_eq!(ratio(&[20, 40, 80]).unwrap(), 2.0);
        assert_eq!(ratio(&[20, 30, 45]).unwrap(), 1.5);
        for wrong in [&[][..], &[20], &[20, 40, 60], &[40, 20], &[20, 20], &[0, 0]] {
            assert!(ratio(wrong).is_err(), "{wrong:?}");
        }
    }
}
