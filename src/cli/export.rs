//! `muslin export`: a recording in the formats of other programs.

use super::Failure;
use super::args::ExportArgs;
use super::output::same_file;
use crate::export::{
    Animation, ExportError, MeshFormat, Selection, Span, check_file, check_folder, write_csv,
    write_sequence, write_whole,
};
use crate::replay::{At, read_checkpoint};
use anyhow::anyhow;
use std::num::NonZeroU64;
use std::path::Path;

/// A file of so many bytes is worth a warning.
const LARGE: u64 = 500_000_000;

pub(super) fn run(args: &ExportArgs) -> Result<(), Failure> {
    let at = args.at.as_deref().map(parse_at).transpose()?;
    let selection = match at {
        Some(at) => Selection::At(at),
        None => Selection::Every(args.every.unwrap_or(NonZeroU64::MIN)),
    };
    let sequences = [
        ("--obj", MeshFormat::Obj, args.obj.as_deref()),
        ("--ply", MeshFormat::Ply, args.ply.as_deref()),
    ];
    check(args, &sequences)?;
    if let Some(path) = &args.csv {
        export_csv(&args.recording, path, at.unwrap_or(At::Last))?;
    }
    for (_, format, folder) in sequences {
        if let Some(folder) = folder {
            let span = write_sequence(&args.recording, folder, format, selection);
            println!("{}: {}", folder.display(), said(span.map_err(failure)?));
        }
    }
    if let Some(path) = &args.glb {
        export_glb(&args.recording, path, selection, args.every)?;
    }
    Ok(())
}

/// `last`, or seconds.
fn parse_at(text: &str) -> Result<At, Failure> {
    if text == "last" {
        return Ok(At::Last);
    }
    match text.parse::<f64>() {
        Ok(time) if time.is_finite() => Ok(At::Time(time)),
        _ => Err(Failure::Input(anyhow!(
            "--at {text}: write `last` or seconds"
        ))),
    }
}

/// Refuses outputs that would destroy something or can't be, before anything is written.
fn check(
    args: &ExportArgs,
    sequences: &[(&str, MeshFormat, Option<&Path>)],
) -> Result<(), Failure> {
    let meshes = sequences.iter().any(|(.., folder)| folder.is_some());
    if args.every.is_some() && !meshes && args.glb.is_none() {
        return Err(Failure::Input(anyhow!(
            "--every: a table holds one state; choose it with --at"
        )));
    }
    let files = [
        ("--csv", args.csv.as_deref()),
        ("--glb", args.glb.as_deref()),
    ];
    let mut used = vec![args.recording.as_path()];
    for (flag, path) in files {
        let Some(path) = path else { continue };
        if used.iter().any(|other| same_file(path, other)) {
            let path = path.display();
            return Err(Failure::Input(anyhow!(
                "{flag} {path}: that is the recording or another output; choose another"
            )));
        }
        check_file(path, args.force).map_err(|error| named(flag, &error))?;
        used.push(path);
    }
    for &(flag, format, folder) in sequences {
        if let Some(folder) = folder {
            check_folder(folder, format, args.force).map_err(|error| named(flag, &error))?;
        }
    }
    Ok(())
}

fn named(flag: &str, error: &ExportError) -> Failure {
    Failure::Input(anyhow!("{flag} {error}"))
}

fn export_csv(recording: &Path, path: &Path, at: At) -> Result<(), Failure> {
    let checkpoint = read_checkpoint(recording, at).map_err(Failure::input)?;
    write_whole(path, |out| Ok(write_csv(&checkpoint, out)?)).map_err(failure)?;
    let particles = checkpoint.cloths.iter().map(|cloth| cloth.particles.len());
    let (rows, time) = (particles.sum::<usize>(), checkpoint.time);
    println!("{}: {rows} particles at t = {time} s", path.display());
    Ok(())
}

fn export_glb(
    recording: &Path,
    path: &Path,
    selection: Selection,
    every: Option<NonZeroU64>,
) -> Result<(), Failure> {
    let animation = Animation::survey(recording, selection).map_err(failure)?;
    let (bytes, span) = (animation.bytes(), animation.span());
    let (file, size) = (path.display(), megabytes(bytes));
    if bytes > LARGE && span.frames > 1 {
        let twice = 2 * every.map_or(1, NonZeroU64::get);
        eprintln!("warning: {file} becomes {size}; --every {twice} makes it half of that");
    }
    write_whole(path, |out| animation.write(out)).map_err(failure)?;
    println!("{file}: {}, {size}", said(span));
    Ok(())
}

fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 * 1e-6)
}

fn said(span: Span) -> String {
    match span.frames {
        1 => format!("1 frame at t = {} s", span.first),
        frames => format!(
            "{frames} frames from t = {} s to {} s",
            span.first, span.last
        ),
    }
}

/// What went wrong while a file was written is no fault of the input.
#[expect(clippy::needless_pass_by_value, reason = "for map_err")]
fn failure(error: ExportError) -> Failure {
    match error {
        ExportError::CannotWrite { .. } | ExportError::Output(_) | ExportError::Changed { .. } => {
            Failure::run(error)
        }
        other => Failure::input(other),
    }
}
