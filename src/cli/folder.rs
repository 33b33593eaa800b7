//! Folders for results.

use super::Failure;
use anyhow::Context as _;
use std::path::Path;

/// Makes the folder if it isn't there, and tries to write into it; returns whether it was made.
pub(super) fn make_writable(out: &Path) -> Result<bool, Failure> {
    let unwritable = || {
        format!(
            "{} can't be written; choose another with --out",
            out.display()
        )
    };
    let made = !out.exists();
    let attempt = || {
        std::fs::create_dir_all(out)?;
        let probe = out.join(".muslin-probe");
        std::fs::write(&probe, "")?;
        std::fs::remove_file(probe)
    };
    attempt().with_context(unwritable).map_err(Failure::Input)?;
    Ok(made)
}

/// Writes a text into a file of a folder.
pub(super) fn write(out: &Path, name: &str, text: &str) -> Result<(), Failure> {
    let path = out.join(name);
    std::fs::write(&path, text)
        .with_context(|| format!("{} can't be written", path.display()))
        .map_err(Failure::Run)
}
