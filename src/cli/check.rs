//! `muslin check`: what a scene models, how long its steps may be, what it costs.

use super::Failure;
use super::args::SceneArgs;
use super::job::threads;
use super::run::{Prepared, prepare};
use crate::scene::LoadedScene;
use crate::scene::model_list;
use crate::simulation::{Simulation, tunnelling};
use crate::study::ablate::{fingerprint, parts, table, words};
use std::path::Path;
use std::time::Instant;

/// Steps that are tried to estimate the cost.
const TRIED_STEPS: u32 = 20;

pub(super) fn run(args: &SceneArgs) -> Result<(), Failure> {
    let Prepared {
        loaded,
        mut simulation,
        foresight,
        notes,
    } = prepare(args, &[])?;
    let threads = threads(args.changes.threads)?;
    notes.iter().for_each(|note| println!("{note}"));
    println!(
        "{} models\n{}",
        loaded.file,
        model_list(&loaded.scene, simulation.model())
    );
    needs(&args.scene, &loaded, &simulation)
        .iter()
        .for_each(|line| println!("{line}"));
    let said = foresight.list(&simulation);
    said.iter().for_each(|line| println!("{line}"));
    if let Some(line) = passes_through(&simulation, loaded.scene.duration) {
        println!("{line}");
    }
    if let Some(warning) = foresight.remedy(&simulation) {
        println!("{warning}");
        return Ok(());
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(Failure::run)?;
    let start = Instant::now();
    pool.install(|| (0..TRIED_STEPS).try_for_each(|_| simulation.step().map(drop)))
        .map_err(Failure::run)?;
    let step = start.elapsed().as_secs_f64() / f64::from(TRIED_STEPS);
    println!(
        "about {:.1} s for {} s simulated: {:.2} ms a step on {threads} thread(s), from its first {TRIED_STEPS} steps",
        step * loaded.scene.duration / simulation.dt(),
        loaded.scene.duration,
        1000.0 * step
    );
    Ok(())
}

/// Whether steps are short enough for contact.
fn passes_through(run: &Simulation, duration: f64) -> Option<String> {
    let found = tunnelling(run, duration)?;
    let seen = format!(
        "contact: at most {:.3} m/s of cloth and {:.3} m/s of obstacles expected, {:.1} mm a step of {:e} s against a thickness of {:.1} mm",
        found.cloth,
        found.obstacle,
        1000.0 * found.way,
        run.dt(),
        1000.0 * found.thickness
    );
    let verdict = if found.way <= found.thickness {
        "; nothing can be passed through".to_owned()
    } else if found.continuous {
        format!(
            "; continuous detection keeps all apart (without it --dt {:.1e} would be needed)",
            found.needed_dt
        )
    } else {
        format!(
            ". WARNING: edges and corners can pass through; use ccd = true or --dt {:.1e}",
            found.needed_dt
        )
    };
    Some(seen + &verdict)
}

/// Which parts the scene needs: as `muslin study --ablate` measured it, if its table lies in its usual
/// place and is of this scene.
fn needs(file: &str, loaded: &LoadedScene, simulation: &Simulation) -> Vec<String> {
    let (scene, model) = (&loaded.scene, simulation.model());
    if parts(scene, model).is_empty() {
        return Vec::new();
    }
    let folder = format!("{}-study", scene.name);
    let path = Path::new(&folder).join("ablate.csv");
    let command = format!("`muslin study {file} --ablate` measures that");
    let Ok(text) = std::fs::read_to_string(&path) else {
        return vec![format!(
            "which of these parts it needs: not measured; {command}\n"
        )];
    };
    let own = fingerprint(scene, model, simulation.state());
    let cited = table::read(&text).map(|table| words::citation(&table, own));
    let path = path.display();
    match cited {
        Some(Some(mut lines)) => {
            lines.insert(0, format!("which of these parts it needs, by {path}:"));
            lines.push(String::new());
            lines
        }
        Some(None) => vec![format!(
            "which of these parts it needs: {path} is of another version of this scene; {command}\n"
        )],
        None => vec![format!(
            "which of these parts it needs: {path} is no whole table; {command}\n"
        )],
    }
}
