//! Does what a scene asks for make sense? The first fault, with its key.

use super::fault::Fault;
use super::schema::{
    ChainShape, Cloth, ObjShape, Obstacle, ObstacleShape, Scene, Shape, SheetShape, SpringKind,
};

/// Checks every value that parsing can't.
pub(super) fn check(scene: &Scene) -> Result<(), Fault> {
    if scene.name.is_empty() || scene.name.contains(['/', '\\']) {
        let cause = format!(
            "\"{}\" can't name a recording; use letters, digits and dashes",
            scene.name
        );
        return Err(Fault::new("name", cause));
    }
    positive("duration", scene.duration)?;
    finite("gravity", &scene.gravity)?;
    positive("solver.dt", scene.solver.dt)?;
    positive("solver.linear_tolerance", scene.solver.linear_tolerance)?;
    if scene.solver.linear_tolerance >= 1.0 {
        let cause = "must be below 1: at 1 nothing is solved; 1e-3 is coarse, 1e-6 fine";
        return Err(Fault::new("solver.linear_tolerance", cause));
    }
    positive("record.fps", scene.record.fps)?;
    positive("record.strain_range", scene.record.strain_range)?;
    positive("record.checkpoint", scene.record.checkpoint)?;
    if let Some(limit) = &scene.strain_limit {
        positive("strain_limit.max", limit.max)?;
    }
    if scene.cloth.is_empty() {
        return Err(Fault::new(
            "",
            "has no [[cloth]]: there is nothing to simulate",
        ));
    }
    for (i, cloth) in scene.cloth.iter().enumerate() {
        check_cloth(&format!("cloth.{i}"), cloth)?;
        unique(
            &format!("cloth.{i}.name"),
            &cloth.name,
            scene.cloth[..i].iter().map(|other| &other.name),
        )?;
    }
    for (i, pin) in scene.pin.iter().enumerate() {
        if !scene.cloth.iter().any(|cloth| cloth.name == pin.cloth) {
            let cause = format!(
                "there is no cloth \"{}\"; use the name of a [[cloth]]",
                pin.cloth
            );
            return Err(Fault::new(format!("pin.{i}.cloth"), cause));
        }
    }
    for (i, obstacle) in scene.obstacle.iter().enumerate() {
        check_obstacle(&format!("obstacle.{i}"), obstacle)?;
        unique(
            &format!("obstacle.{i}.name"),
            &obstacle.name,
            scene.obstacle[..i].iter().map(|other| &other.name),
        )?;
    }
    Ok(())
}

fn check_cloth(at: &str, cloth: &Cloth) -> Result<(), Fault> {
    finite(&format!("{at}.translate"), &cloth.translate)?;
    finite(&format!("{at}.rotate"), &cloth.rotate)?;
    check_shape(at, &cloth.shape)?;
    let material = &cloth.material;
    let (key, density, other) = match cloth.shape {
        Shape::Sheet(_) => (
            "area_density",
            material.area_density,
            material.linear_density.map(|_| "linear_density"),
        ),
        Shape::Chain(_) => (
            "linear_density",
            material.linear_density,
            material.area_density.map(|_| "area_density"),
        ),
    };
    if let Some(other) = other {
        return Err(Fault::new(
            format!("{at}.material.{other}"),
            format!("this shape's mass is given by {key}"),
        ));
    }
    let Some(density) = density else {
        return Err(Fault::new(
            format!("{at}.material"),
            format!("{key} is missing: the mass of this shape"),
        ));
    };
    positive(&format!("{at}.material.{key}"), density)?;
    positive(&format!("{at}.material.stretch"), material.stretch)?;
    let bends = cloth.springs.contains(&SpringKind::Bend);
    match material.bend {
        Some(bend) => not_negative(&format!("{at}.material.bend"), bend)?,
        None if bends => {
            let cause = "bend is missing: springs = [\"bend\"] need the plate rigidity (N·m), such as 1.0e-5";
            return Err(Fault::new(format!("{at}.material"), cause));
        }
        None => {}
    }
    if !cloth.springs.contains(&SpringKind::Structural) {
        return Err(Fault::new(
            format!("{at}.springs"),
            "must contain \"structural\": without them a cloth falls apart",
        ));
    }
    not_negative(&format!("{at}.damping.mass"), cloth.damping.mass)?;
    not_negative(&format!("{at}.damping.stiffness"), cloth.damping.stiffness)
}

fn check_shape(at: &str, shape: &Shape) -> Result<(), Fault> {
    match shape {
        Shape::Sheet(SheetShape {
            size,
            cells,
            opening,
            ..
        }) => {
            for side in size {
                positive(&format!("{at}.shape.sheet.size"), *side)?;
            }
            count(
                &format!("{at}.shape.sheet.cells"),
                u64::from(cells[0]) * u64::from(cells[1]),
            )?;
            if let Some(opening) = opening {
                finite(&format!("{at}.shape.sheet.opening.center"), &opening.center)?;
                positive(&format!("{at}.shape.sheet.opening.radius"), opening.radius)?;
            }
            Ok(())
        }
        Shape::Chain(ChainShape { length, links }) => {
            positive(&format!("{at}.shape.chain.length"), *length)?;
            count(&format!("{at}.shape.chain.links"), u64::from(*links))
        }
    }
}

fn check_obstacle(at: &str, obstacle: &Obstacle) -> Result<(), Fault> {
    let ObstacleShape::Obj(ObjShape { scale, .. }) = &obstacle.shape;
    positive(&format!("{at}.shape.obj.scale"), *scale)?;
    finite(&format!("{at}.translate"), &obstacle.translate)?;
    finite(&format!("{at}.rotate"), &obstacle.rotate)?;
    not_negative(&format!("{at}.friction"), obstacle.friction)?;
    positive(&format!("{at}.thickness"), obstacle.thickness)
}

fn positive(path: &str, value: f64) -> Result<(), Fault> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Fault::new(
        path,
        format!("is {value}; it must be a finite number above 0"),
    ))
}

fn not_negative(path: &str, value: f64) -> Result<(), Fault> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(Fault::new(
        path,
        format!("is {value}; it must be a finite number, 0 or more"),
    ))
}

fn finite(path: &str, values: &[f64]) -> Result<(), Fault> {
    if values.iter().all(|value| value.is_finite()) {
        return Ok(());
    }
    Err(Fault::new(
        path,
        format!("is {values:?}; every number must be finite"),
    ))
}

/// Twenty million cells take 10 GB; more is a slip of the pen.
const MOST_CELLS: u64 = 20_000_000;

fn count(path: &str, cells: u64) -> Result<(), Fault> {
    if cells == 0 {
        return Err(Fault::new(path, "must be at least 1"));
    }
    if cells > MOST_CELLS {
        return Err(Fault::new(
            path,
            format!("asks for {cells} cells; at most {MOST_CELLS} fit into memory"),
        ));
    }
    Ok(())
}

fn unique<'a>(
    path: &str,
    name: &str,
    mut others: impl Iterator<Item = &'a String>,
) -> Result<(), Fault> {
    if name.is_empty() {
        return Err(Fault::new(path, "is empty; give it a name"));
    }
    if others.any(|other| other == name) {
        return Err(Fault::new(
            path,
            format!("\"{name}\" is taken; names must differ"),
        ));
    }
    Ok(())
}
