//! Reading a scene: built-in or from a file, with changes from the command line.

use super::fault::{Fault, SceneError};
use super::schema::Scene;
use super::{BUILTIN, builtin_scene, validate};
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// A scene and where it came from.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// The scene, checked.
    pub scene: Scene,
    /// Its TOML as it is run.
    pub text: String,
    /// What messages call it.
    pub file: String,
    /// Its file, to whose folder its paths are relative; `None` for a built-in scene.
    pub path: Option<PathBuf>,
    /// Whether keys were set, so that the text's lines are nobody's.
    pub changed: bool,
    /// Texts of the meshes that it names, by their paths in the scene, where they came with it: they are taken
    /// before what is on the disk.
    pub meshes: BTreeMap<String, String>,
}

/// Reads the scene `name`, a built-in name or a TOML file, and sets `changes` (`key=value`) in it; an
/// empty value removes its key.
///
/// # Errors
///
/// An unknown name, an unreadable file, a fault in the TOML or in what it asks for.
pub fn load(name: &str, changes: &[String]) -> Result<LoadedScene, SceneError> {
    let (text, path) = read(name)?;
    let loaded = LoadedScene::parsed(name, text, path, BTreeMap::new())?;
    if changes.is_empty() {
        loaded.checked()
    } else {
        loaded.changed(changes)?.checked()
    }
}

/// Takes a scene from its TOML, which messages call `name`, with the meshes that came with it. Others are looked
/// for as if the TOML were the file `path`.
///
/// # Errors
///
/// A fault in the TOML or in what it asks for.
pub fn load_text(
    name: &str,
    text: String,
    path: Option<PathBuf>,
    meshes: BTreeMap<String, String>,
) -> Result<LoadedScene, SceneError> {
    LoadedScene::parsed(name, text, path, meshes)?.checked()
}

impl LoadedScene {
    fn parsed(
        name: &str,
        text: String,
        path: Option<PathBuf>,
        meshes: BTreeMap<String, String>,
    ) -> Result<Self, SceneError> {
        Ok(Self {
            scene: parse(&text, name)?,
            text,
            file: name.to_owned(),
            path,
            changed: false,
            meshes,
        })
    }

    /// This scene with more `changes`, as [`load()`] makes them.
    ///
    /// # Errors
    ///
    /// A change that doesn't fit the scene, or a fault in what it then asks for.
    pub fn with(&self, changes: &[String]) -> Result<Self, SceneError> {
        if changes.is_empty() {
            return Ok(self.clone());
        }
        self.clone().changed(changes)?.checked()
    }

    /// This scene, if what it asks for makes sense.
    fn checked(self) -> Result<Self, SceneError> {
        match validate::check(&self.scene) {
            Ok(()) => Ok(self),
            Err(fault) => Err(self.error(&fault)),
        }
    }

    /// The error message for a key, such as `solver.dt`, that what is built shows to be wrong.
    pub fn error_at(&self, key: &str, cause: impl std::fmt::Display) -> SceneError {
        self.error(&Fault::new(key, cause.to_string()))
    }

    /// The error message of a fault, with the line of its key.
    pub(super) fn error(&self, fault: &Fault) -> SceneError {
        let cause = if fault.path.is_empty() {
            fault.cause.clone()
        } else {
            format!("{}: {}", fault.path, fault.cause)
        };
        SceneError {
            file: self.file.clone(),
            line: (!self.changed)
                .then(|| line_of(&self.text, &fault.path))
                .flatten(),
            cause,
        }
    }

    /// This scene with some keys set to other values.
    fn changed(self, changes: &[String]) -> Result<Self, SceneError> {
        let file = format!("{} with {}", self.file, changes.join(" "));
        let text = with_changes(&self.text, &self.file, changes)?;
        let scene = parse(&text, &file).map_err(|fault| SceneError {
            line: None,
            ..fault
        })?;
        Ok(Self {
            scene,
            text,
            file,
            changed: true,
            ..self
        })
    }
}

/// TOML with some keys set to other values.
pub(super) fn with_changes(
    text: &str,
    file: &str,
    changes: &[String],
) -> Result<String, SceneError> {
    let error = |cause: String| SceneError {
        file: file.to_owned(),
        line: None,
        cause,
    };
    let mut value: toml::Value =
        toml::from_str(text).map_err(|fault| error(fault.message().to_owned()))?;
    for change in changes {
        let (key, new) = change.split_once('=').ok_or_else(|| {
            error(format!(
                "\"{change}\" sets nothing: write --set KEY=VALUE, such as --set solver.dt=0.002"
            ))
        })?;
        let (key, new) = (key.trim(), new.trim());
        let changed = if new.is_empty() {
            remove(&mut value, key)
        } else {
            set(&mut value, key, literal(new))
        };
        changed.map_err(error)?;
    }
    toml::to_string(&value).map_err(|fault| error(fault.to_string()))
}

/// The TOML of a scene, and its file.
fn read(name: &str) -> Result<(String, Option<PathBuf>), SceneError> {
    if let Some(text) = builtin_scene(name) {
        return Ok((text.to_owned(), None));
    }
    let error = |cause: String| SceneError {
        file: name.to_owned(),
        line: None,
        cause,
    };
    let path = Path::new(name);
    if !path.exists() && path.extension().is_none() {
        let known: Vec<&str> = BUILTIN.iter().map(|(name, _)| *name).collect();
        return Err(error(format!(
            "there is no such scene; built in are {}, anything else is the path of a .toml file",
            known.join(", ")
        )));
    }
    let text = read_file(path, "; `muslin scenes` lists the built-in scenes")?;
    Ok((text, Some(path.to_path_buf())))
}

/// The text of a file; what can be done about one that can't be read is said after the cause.
pub(super) fn read_file(path: &Path, remedy: &str) -> Result<String, SceneError> {
    std::fs::read_to_string(path).map_err(|fault| SceneError {
        file: path.display().to_string(),
        line: None,
        cause: format!("can't be read: {fault}{remedy}"),
    })
}

pub(super) fn parse<T: DeserializeOwned>(text: &str, file: &str) -> Result<T, SceneError> {
    toml::from_str(text).map_err(|fault| SceneError {
        file: file.to_owned(),
        line: fault.span().map(|span| line_at(text, span.start)),
        cause: fault.message().to_owned(),
    })
}

/// The line of a byte, from 1.
fn line_at(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|&b| b == b'\n').count()
}

/// The line of the deepest part of a key path that the text has.
fn line_of(text: &str, path: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let mut line = None;
    let mut value: Option<&DeValue<'_>> = None;
    for part in path.split('.') {
        let found = match value {
            None => document.get_ref().get(part),
            Some(DeValue::Table(table)) => table.get(part),
            Some(DeValue::Array(array)) => part.parse::<usize>().ok().and_then(|i| array.get(i)),
            Some(_) => None,
        };
        let Some(found) = found else { break };
        line = Some(line_at(text, found.span().start));
        value = Some(found.get_ref());
    }
    line
}

/// A value as TOML would read it; what isn't TOML is a string, so that names need no quotes.
fn literal(text: &str) -> toml::Value {
    toml::from_str::<toml::Table>(&format!("x = {text}"))
        .ok()
        .and_then(|mut table| table.remove("x"))
        .unwrap_or_else(|| toml::Value::String(text.to_owned()))
}

/// Sets a dotted key; entries of arrays go by number or by their `name`.
fn set(value: &mut toml::Value, key: &str, new: toml::Value) -> Result<(), String> {
    let (first, rest) = key
        .split_once('.')
        .map_or((key, None), |(first, rest)| (first, Some(rest)));
    let place = match value {
        toml::Value::Table(table) => table
            .entry(first)
            .or_insert_with(|| toml::Value::Table(toml::Table::new())),
        toml::Value::Array(array) => {
            let index = index(array, first)?;
            &mut array[index]
        }
        _ => {
            return Err(format!(
                "--set: \"{first}\" can't be set inside a plain value"
            ));
        }
    };
    match rest {
        Some(rest) => set(place, rest, new),
        None => {
            *place = new;
            Ok(())
        }
    }
}

/// Removes a dotted key; entries of arrays go by number or by their `name`.
fn remove(value: &mut toml::Value, key: &str) -> Result<(), String> {
    let (first, rest) = key
        .split_once('.')
        .map_or((key, None), |(first, rest)| (first, Some(rest)));
    let missing = || format!("--set {key}=: there is no \"{first}\" to be removed");
    match (value, rest) {
        (toml::Value::Table(table), None) => table.remove(first).map(drop).ok_or_else(missing),
        (toml::Value::Table(table), Some(rest)) => {
            remove(table.get_mut(first).ok_or_else(missing)?, rest)
        }
        (toml::Value::Array(array), rest) => {
            let index = index(array, first)?;
            match rest {
                Some(rest) => remove(&mut array[index], rest),
                None => {
                    array.remove(index);
                    Ok(())
                }
            }
        }
        _ => Err(missing()),
    }
}

/// Where an entry of an array is, by its number or its `name`.
fn index(array: &[toml::Value], entry: &str) -> Result<usize, String> {
    let named =
        |value: &toml::Value| value.get("name").and_then(toml::Value::as_str) == Some(entry);
    let index = entry.parse().ok().or_else(|| array.iter().position(named));
    index.filter(|index| *index < array.len()).ok_or_else(|| {
        format!("--set: there is no entry \"{entry}\"; use its number from 0 or its name")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_reach_entries_by_number_and_by_name() {
        let changes = [
            "cloth.0.material.stretch=5",
            "cloth.sheet.shape.sheet.cells=[8, 9]",
            "name=other",
        ];
        let loaded = load("hanging-cloth", &changes.map(String::from)).unwrap();
        assert_eq!(loaded.scene.cloth[0].material.stretch, Some(5.0));
        assert_eq!(loaded.scene.name, "other");
        assert!(loaded.text.contains("cells = [8, 9]"), "{}", loaded.text);
        let error = load("hanging-cloth", &["cloth.skirt.name=x".to_owned()]).unwrap_err();
        assert!(error.to_string().contains("no entry \"skirt\""), "{error}");
    }

    #[test]
    fn an_empty_value_removes_its_key() {
        let changes = ["strain_limit=", "obstacle.mannequin=", "solver.dt="].map(String::from);
        let loaded = load("drape", &changes).unwrap();
        assert!(loaded.scene.strain_limit.is_none() && loaded.scene.obstacle.is_empty());
        assert_eq!(loaded.scene.solver.dt, super::super::Step::Seconds(0.004));
        for (change, words) in [
            ("obstacle.table=", "no entry \"table\""),
            ("strain_limit.min=", "no \"min\" to be removed"),
            ("cloth.0.name.x=", "no \"x\" to be removed"),
            ("cloth.0.name=", "name"),
        ] {
            let error = load("drape", &[change.to_owned()]).unwrap_err();
            assert!(error.to_string().contains(words), "{change}: {error}");
        }
    }

    #[test]
    fn every_builtin_scene_loads() {
        for (name, _) in BUILTIN {
            let loaded = load(name, &[]).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(&loaded.scene.name, name);
        }
    }

    #[test]
    fn lines_of_keys() {
        let text = "a = 1\n[[b]]\nc = 2\n[[b]]\nc = 3\n[b.d]\ne = 4\n";
        assert_eq!(line_of(text, "b.1.c"), Some(5));
        assert_eq!(line_of(text, "b.1.d.e"), Some(7));
        assert_eq!(line_of(text, "missing"), None);
    }
}
