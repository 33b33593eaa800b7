//! Where a run goes: what is refused before anything is touched, and the recorder.

use super::Failure;
use super::args::OutputArgs;
use crate::frame::Header;
use crate::recorder::{DiscardRecorder, Recorder};
use crate::scene::LoadedScene;
use anyhow::{Context as _, anyhow};
use std::path::{Path, PathBuf};

#[cfg(feature = "rerun")]
pub(super) fn recorder(
    args: &OutputArgs,
    save: Option<&Path>,
    header: &Header,
) -> Result<Box<dyn Recorder + Send>, Failure> {
    use crate::recorder::{RerunRecorder, Targets};
    let targets = Targets {
        save: save.map(Path::to_owned),
        force: args.force,
        connect: args.connect.clone(),
        serve: args.serve,
        spawn: args.spawn,
    };
    if targets == Targets::default() {
        return Ok(Box::new(DiscardRecorder));
    }
    let recorder = RerunRecorder::new(header, &targets).map_err(Failure::input)?;
    Ok(Box::new(recorder))
}

#[cfg(not(feature = "rerun"))]
pub(super) fn recorder(
    args: &OutputArgs,
    save: Option<&Path>,
    _header: &Header,
) -> Result<Box<dyn Recorder + Send>, Failure> {
    let live = args.connect.is_some() || args.serve.is_some() || args.spawn;
    if live || save.is_some() {
        return Err(Failure::Input(anyhow!(
            "this muslin was built without Rerun: use --no-save, or build with default features"
        )));
    }
    Ok(Box::new(DiscardRecorder))
}

/// The recording to write, if any; without a name given, one that isn't there yet or may be replaced.
fn save_path(args: &OutputArgs, scene: &str) -> Option<PathBuf> {
    if args.no_save || args.save.is_some() {
        return args.save.clone();
    }
    let first = std::iter::once(format!("{scene}.rrd"));
    let names = first.chain((2..).map(|n| format!("{scene}-{n}.rrd")));
    names
        .map(PathBuf::from)
        .find(|path| args.force || !path.exists())
}

/// Refuses outputs that can't be written or would destroy an input or each other, before anything
/// is touched. Returns the recording to write, if any.
pub(super) fn check_outputs(
    args: &OutputArgs,
    loaded: &LoadedScene,
    inputs: &[PathBuf],
) -> Result<Option<PathBuf>, Failure> {
    let save = save_path(args, &loaded.scene.name);
    let report = args.report.as_deref();
    let inputs = inputs.iter().map(PathBuf::as_path);
    let mut used: Vec<&Path> = loaded.path.as_deref().into_iter().chain(inputs).collect();
    for (flag, path) in [("--save", save.as_deref()), ("--report", report)] {
        let Some(path) = path else { continue };
        if used.iter().any(|other| same_file(path, other)) {
            return Err(Failure::Input(anyhow!(
                "{flag} {}: that file is used already; choose another",
                path.display()
            )));
        }
        used.push(path);
    }
    report.map_or(Ok(()), check_writable)?;
    Ok(save)
}

/// Whether two paths lead to one file, now or when both are written.
pub(super) fn same_file(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| path.canonicalize().or_else(|_| std::path::absolute(path));
    matches!((real(a), real(b)), (Ok(a), Ok(b)) if a == b)
}

/// Can a file be written? Leaves what is in it, and nothing where nothing was.
fn check_writable(path: &Path) -> Result<(), Failure> {
    let existed = path.exists();
    let opened = std::fs::OpenOptions::new()
        .append(true)
        .create(true)
        .open(path);
    let opened = opened.with_context(|| {
        format!(
            "{} can't be written; choose another with --report",
            path.display()
        )
    });
    opened.map_err(Failure::Input)?;
    if !existed {
        std::fs::remove_file(path).map_err(Failure::run)?;
    }
    Ok(())
}
