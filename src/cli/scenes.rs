//! `muslin scenes`: the gallery.

use super::Failure;
use crate::scene::{BUILTIN, builtin_scene};

pub(super) fn run(name: Option<&str>) -> Result<(), Failure> {
    let Some(name) = name else {
        for (name, text) in BUILTIN {
            // A scene's first comment lines say what it shows.
            let about = text
                .lines()
                .next()
                .unwrap_or_default()
                .trim_start_matches("# ");
            println!("{name:16}{about}");
        }
        return Ok(());
    };
    let text = builtin_scene(name).ok_or_else(|| {
        let known: Vec<&str> = BUILTIN.iter().map(|(name, _)| *name).collect();
        Failure::Input(anyhow::anyhow!(
            "there is no built-in scene \"{name}\"; there are {}",
            known.join(", ")
        ))
    })?;
    print!("{text}");
    Ok(())
}
