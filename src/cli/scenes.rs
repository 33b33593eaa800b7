//! `muslin scenes`: the gallery.

use super::Failure;
use crate::scene::{BUILTIN, builtin_scene};
use std::io::Write as _;

pub(super) fn run(name: Option<&str>) -> Result<(), Failure> {
    let text = match name {
        None => BUILTIN
            .iter()
            .map(|(name, text)| format!("{name:20}{}\n", about(text)))
            .collect(),
        Some(name) => builtin_scene(name).ok_or_else(|| unknown(name))?.to_owned(),
    };
    // Whoever pipes this into `head` has seen enough: a closed pipe is no failure.
    let _ = std::io::stdout().write_all(text.as_bytes());
    Ok(())
}

fn unknown(name: &str) -> Failure {
    let known: Vec<&str> = BUILTIN.iter().map(|(name, _)| *name).collect();
    Failure::input(format!(
        "there is no built-in scene \"{name}\"; there are {}",
        known.join(", ")
    ))
}

/// What a scene shows: the first sentence of its first comment.
fn about(text: &str) -> String {
    let lines = text.lines().map_while(|line| line.strip_prefix("# "));
    let comment = lines.collect::<Vec<_>>().join(" ");
    let end = comment.find(". ").map_or(comment.len(), |end| end + 1);
    comment[..end].to_owned()
}
