//! Does what a scene asks for make sense? The first fault, with its key.

use super::fault::Fault;
use super::schema::{
    BendingName, BlockShape, ChainShape, Cloth, DistanceName, Keyframe, ObjShape, Obstacle,
    ObstacleMotion, ObstacleShape, Pin, PlaneShape, Scene, Shape, SheetShape, Solver, SphereShape,
    SpringKind,
};
use super::step::Step;
use glam::DVec3;

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
    check_solver(&scene.solver)?;
    positive("record.fps", scene.record.fps)?;
    positive("record.strain_range", scene.record.strain_range)?;
    positive("record.checkpoint", scene.record.checkpoint)?;
    check_share("record.error", scene.record.error)?;
    for corner in scene.record.view.iter().flatten() {
        finite("record.view", corner)?;
    }
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
        check_pin(&format!("pin.{i}"), pin)?;
    }
    if let Some(layers) = &scene.self_collision {
        positive("self_collision.thickness", layers.thickness)?;
        not_negative("self_collision.friction", layers.friction)?;
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

fn check_solver(solver: &Solver) -> Result<(), Fault> {
    if let Step::Seconds(dt) = solver.dt {
        positive("solver.dt", dt)?;
    }
    positive("solver.linear_tolerance", solver.linear_tolerance)?;
    positive("solver.residual", solver.residual)?;
    positive("solver.tolerance", solver.tolerance)?;
    for (key, value) in [
        ("solver.linear_tolerance", solver.linear_tolerance),
        ("solver.residual", solver.residual),
    ] {
        if value >= 1.0 {
            let cause = "must be below 1: at 1 nothing is solved; 1e-3 is coarse, 1e-6 fine";
            return Err(Fault::new(key, cause));
        }
    }
    if solver.iterations == Some(0) {
        let cause = "must be at least 1: without an iteration nothing holds the cloth together";
        return Err(Fault::new("solver.iterations", cause));
    }
    Ok(())
}

fn check_cloth(at: &str, cloth: &Cloth) -> Result<(), Fault> {
    finite(&format!("{at}.translate"), &cloth.translate)?;
    finite(&format!("{at}.rotate"), &cloth.rotate)?;
    finite(&format!("{at}.start.velocity"), &cloth.start.velocity)?;
    finite(&format!("{at}.start.spin"), &cloth.start.spin)?;
    for factor in cloth.start.stretch {
        positive(&format!("{at}.start.stretch"), factor)?;
        if !(1e-3..=1e3).contains(&factor) {
            let cause = format!(
                "is {factor}; cloth starts between a thousandth and a thousandfold of its size"
            );
            return Err(Fault::new(format!("{at}.start.stretch"), cause));
        }
    }
    check_shape(at, &cloth.shape)?;
    check_density(at, cloth)?;
    check_stiffness(at, cloth)?;
    check_structure(at, cloth)?;
    not_negative(&format!("{at}.damping.mass"), cloth.damping.mass)?;
    not_negative(&format!("{at}.damping.stiffness"), cloth.damping.stiffness)
}

/// Each shape's mass is given by one key.
fn check_density(at: &str, cloth: &Cloth) -> Result<(), Fault> {
    let material = &cloth.material;
    let known = [
        ("area_density", material.area_density),
        ("linear_density", material.linear_density),
        ("density", material.density),
    ];
    let key = match cloth.shape {
        Shape::Sheet(_) | Shape::Obj(_) => "area_density",
        Shape::Chain(_) => "linear_density",
        Shape::Block(_) => "density",
    };
    let mut density = None;
    for (other, value) in known {
        if other == key {
            density = value;
        } else if value.is_some() {
            let cause = format!("this shape's mass is given by {key}");
            return Err(Fault::new(format!("{at}.material.{other}"), cause));
        }
    }
    let Some(density) = density else {
        let cause = format!("{key} is missing: the mass of this shape");
        return Err(Fault::new(format!("{at}.material"), cause));
    };
    positive(&format!("{at}.material.{key}"), density)
}

/// A modulus, or one constant for all springs; a rigidity where something bends.
fn check_stiffness(at: &str, cloth: &Cloth) -> Result<(), Fault> {
    let material = &cloth.material;
    match (material.stretch, material.spring_constant) {
        (Some(stretch), None) => {
            let key = format!("{at}.material.stretch");
            positive(&key, stretch)?;
            let block = matches!(cloth.shape, Shape::Block(_));
            at_most(&key, stretch, if block { MOST_YOUNG } else { MOST_STRETCH })?;
        }
        (None, Some(constant)) => {
            let key = format!("{at}.material.spring_constant");
            positive(&key, constant)?;
            at_most(&key, constant, MOST_STRETCH)?;
        }
        (Some(_), Some(_)) => {
            let cause = "stands for the same as stretch, which is given too; remove one of them";
            return Err(Fault::new(format!("{at}.material.spring_constant"), cause));
        }
        (None, None) => {
            let cause = "stretch is missing: the modulus, by which springs of any length are the same material";
            return Err(Fault::new(format!("{at}.material"), cause));
        }
    }
    let has = |kind| cloth.springs.contains(&kind);
    let asks = if cloth.bending != BendingName::None {
        Some("bending needs")
    } else if has(SpringKind::Bend) && material.spring_constant.is_none() {
        Some("springs = [\"bend\"] need")
    } else {
        None
    };
    match (material.bend, asks) {
        (Some(bend), _) => {
            let key = format!("{at}.material.bend");
            not_negative(&key, bend)?;
            at_most(&key, bend, MOST_BEND)
        }
        (None, Some(asks)) => {
            let cause = format!("bend is missing: {asks} the plate rigidity (N·m), such as 1.0e-5");
            Err(Fault::new(format!("{at}.material"), cause))
        }
        (None, None) => Ok(()),
    }
}

/// Which springs and hinges go with which shape, and with each other.
fn check_structure(at: &str, cloth: &Cloth) -> Result<(), Fault> {
    let has = |kind| cloth.springs.contains(&kind);
    let springs = |cause: &str| Err(Fault::new(format!("{at}.springs"), cause));
    match (has(SpringKind::Structural), has(SpringKind::ZeroLength)) {
        (true, true) => {
            return springs(
                "\"zero-length\" springs take the place of \"structural\" ones; remove one of them",
            );
        }
        (false, false) => {
            return springs(
                "must contain \"structural\" (or \"zero-length\"): without them a cloth falls apart",
            );
        }
        (false, true) if cloth.material.spring_constant.is_none() => {
            let cause = "\"zero-length\" springs have no strain that a modulus could apply to; give material.spring_constant instead of stretch";
            return springs(cause);
        }
        _ => {}
    }
    let (bends, hinged) = (has(SpringKind::Bend), cloth.bending != BendingName::None);
    match cloth.shape {
        Shape::Obj(_) if bends => springs(
            "a mesh has no second neighbours for \"bend\" springs; it bends by hinges: bending = \"edge-spring\" or \"discrete-shell\"",
        ),
        Shape::Block(_) if bends => {
            springs("a block needs no \"bend\" springs; its diagonals resist bending")
        }
        Shape::Block(_) | Shape::Chain(_) if hinged => {
            let cause = "this shape has no inner triangles for hinges; use \"none\"";
            Err(Fault::new(format!("{at}.bending"), cause))
        }
        _ => Ok(()),
    }
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
            count(&format!("{at}.shape.sheet.cells"), cells)?;
            if let Some(opening) = opening {
                finite(&format!("{at}.shape.sheet.opening.center"), &opening.center)?;
                positive(&format!("{at}.shape.sheet.opening.radius"), opening.radius)?;
            }
            Ok(())
        }
        Shape::Chain(ChainShape { length, links }) => {
            positive(&format!("{at}.shape.chain.length"), *length)?;
            count(&format!("{at}.shape.chain.links"), &[*links])
        }
        Shape::Block(BlockShape { size, cells }) => {
            for side in size {
                positive(&format!("{at}.shape.block.size"), *side)?;
            }
            count(&format!("{at}.shape.block.cells"), cells)
        }
        Shape::Obj(ObjShape { scale, .. }) => positive(&format!("{at}.shape.obj.scale"), *scale),
    }
}

/// Keyframes in order, and a time to let go.
fn check_pin(at: &str, pin: &Pin) -> Result<(), Fault> {
    if let Some(release) = pin.release {
        positive(&format!("{at}.release"), release)?;
    }
    match &pin.motion {
        Some(motion) => check_keyframes(&format!("{at}.motion.keyframes"), &motion.keyframes),
        None => Ok(()),
    }
}

fn check_keyframes(at: &str, keyframes: &[Keyframe]) -> Result<(), Fault> {
    if keyframes.is_empty() {
        let cause = "is empty; give at least one { t, translate, rotate }, or remove motion";
        return Err(Fault::new(at, cause));
    }
    let mut last = None;
    for (k, key) in keyframes.iter().enumerate() {
        not_negative(&format!("{at}.{k}.t"), key.t)?;
        finite(&format!("{at}.{k}.translate"), &key.translate)?;
        finite(&format!("{at}.{k}.rotate"), &key.rotate)?;
        if let Some(before) = last.filter(|&before| key.t <= before) {
            let cause = format!(
                "is {}, not after the keyframe before it at {before}; put the keyframes in the order of time, each time once",
                key.t
            );
            return Err(Fault::new(format!("{at}.{k}.t"), cause));
        }
        last = Some(key.t);
    }
    Ok(())
}

fn check_obstacle(at: &str, obstacle: &Obstacle) -> Result<(), Fault> {
    match &obstacle.shape {
        ObstacleShape::Obj(ObjShape { scale, .. }) => {
            positive(&format!("{at}.shape.obj.scale"), *scale)?;
        }
        ObstacleShape::Plane(PlaneShape { point, normal }) => {
            finite(&format!("{at}.shape.plane.point"), point)?;
            finite(&format!("{at}.shape.plane.normal"), normal)?;
            if DVec3::from_array(*normal).try_normalize().is_none() {
                let cause =
                    "has no direction; give the side that the cloth is on, such as [0, 1, 0]";
                return Err(Fault::new(format!("{at}.shape.plane.normal"), cause));
            }
        }
        ObstacleShape::Sphere(SphereShape { center, radius }) => {
            finite(&format!("{at}.shape.sphere.center"), center)?;
            positive(&format!("{at}.shape.sphere.radius"), *radius)?;
        }
    }
    if let DistanceName::Grid(cell) = obstacle.distance {
        let at = format!("{at}.distance");
        positive(&format!("{at}.grid"), cell)?;
        if !obstacle.takes_grid() {
            let cause = "needs an obj that keeps its shape; use distance = \"exact\"";
            return Err(Fault::new(at, cause));
        }
    }
    match &obstacle.motion {
        Some(ObstacleMotion::Keyframes(keys)) => {
            check_keyframes(&format!("{at}.motion.keyframes"), keys)?;
        }
        Some(ObstacleMotion::Walk(walk)) => {
            let at = format!("{at}.motion.walk");
            if !matches!(
                &obstacle.shape,
                ObstacleShape::Obj(ObjShape { scale: 1.0, .. })
            ) {
                let cause = "needs an obstacle whose shape is the obj mannequin.obj with scale = 1";
                return Err(Fault::new(at, cause));
            }
            positive(&format!("{at}.speed"), walk.speed)?;
            not_negative(&format!("{at}.start"), walk.start)?;
        }
        Some(ObstacleMotion::Sequence(sequence)) => {
            let at = format!("{at}.motion.sequence");
            if !matches!(obstacle.shape, ObstacleShape::Obj(_)) {
                let cause =
                    "needs an obstacle whose shape is an obj; give that, or move by keyframes";
                return Err(Fault::new(at, cause));
            }
            positive(&format!("{at}.fps"), sequence.fps)?;
            not_negative(&format!("{at}.start"), sequence.start)?;
        }
        None => {}
    }
    finite(&format!("{at}.translate"), &obstacle.translate)?;
    finite(&format!("{at}.rotate"), &obstacle.rotate)?;
    not_negative(&format!("{at}.friction"), obstacle.friction)?;
    positive(&format!("{at}.thickness"), obstacle.thickness)
}

pub(super) fn positive(path: &str, value: f64) -> Result<(), Fault> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Fault::new(
        path,
        format!("is {value}; it must be a finite number above 0"),
    ))
}

/// A millimetre of steel has 2e8 N/m, 2e11 Pa and 20 N·m. Far beyond, a cell's stiffness times its
/// rounding exceeds its weight, and the results are noise.
const MOST_STRETCH: f64 = 1e9;
const MOST_YOUNG: f64 = 1e12;
const MOST_BEND: f64 = 1e4;

fn at_most(path: &str, value: f64, most: f64) -> Result<(), Fault> {
    if value <= most {
        return Ok(());
    }
    Err(Fault::new(
        path,
        format!("is {value:e}, stiffer than steel; at most {most:e}: is the unit right?"),
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

/// Half of a run at most: beyond, the windows in which its error is estimated would meet.
fn check_share(path: &str, value: f64) -> Result<(), Fault> {
    if (0.0..=0.5).contains(&value) {
        return Ok(());
    }
    Err(Fault::new(
        path,
        format!(
            "is {value}; it is the share of the time spent on the estimate: 0 for none, at most 0.5"
        ),
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

fn count(path: &str, cells: &[u32]) -> Result<(), Fault> {
    let cells = cells
        .iter()
        .fold(1_u64, |product, &n| product.saturating_mul(u64::from(n)));
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
