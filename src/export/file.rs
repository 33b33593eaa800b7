//! Files that are there whole or not at all.

use super::ExportError;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Refuses a file that is there already, unless it may be replaced, and a place that can't hold one.
///
/// # Errors
///
/// As said. A device or a pipe is no file that could be lost.
pub fn check_file(path: &Path, force: bool) -> Result<(), ExportError> {
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => Err(exists(path, "is a folder", false)),
        Ok(there) if there.is_file() && !force => Err(exists(path, "exists already", true)),
        Ok(_) => Ok(()),
        Err(_) => check_parent(path),
    }
}

/// Refuses a place whose folder isn't there.
pub(super) fn check_parent(path: &Path) -> Result<(), ExportError> {
    let parent = match path.parent() {
        Some(parent) if parent.as_os_str().is_empty() => Path::new("."),
        Some(parent) => parent,
        None => path,
    };
    let found = fs::metadata(parent).and_then(|found| match found.is_dir() {
        true => Ok(()),
        false => Err(io::ErrorKind::NotADirectory.into()),
    });
    found.map_err(|source| ExportError::CannotCreate {
        path: path.to_owned(),
        source,
    })
}

fn exists(path: &Path, what: &str, replaceable: bool) -> ExportError {
    let path = path.to_owned();
    match replaceable {
        true => ExportError::Exists {
            path,
            what: what.to_owned(),
        },
        false => ExportError::CannotCreate {
            path,
            source: io::ErrorKind::IsADirectory.into(),
        },
    }
}

/// Writes a file under a temporary name beside its place and moves it there when it is whole, in place
/// of what was there. What is no file, such as a pipe, is written to as it is.
///
/// # Errors
///
/// What `write` returns; or the file can't be made or written. Nothing is left then.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), ExportError>,
) -> Result<(), ExportError> {
    let cannot_create = |source| ExportError::CannotCreate {
        path: path.to_owned(),
        source,
    };
    // What a link leads to is replaced, not the link.
    let place = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    if fs::metadata(&place).is_ok_and(|there| !there.is_file()) {
        let file = OpenOptions::new().write(true).open(&place);
        return fill(path, file.map_err(cannot_create)?, write);
    }
    let part = part_of(&place);
    let file = File::create_new(&part).map_err(cannot_create)?;
    let done = fill(path, file, write).and_then(|()| {
        fs::rename(&part, &place).map_err(|source| ExportError::CannotWrite {
            path: path.to_owned(),
            source,
        })
    });
    if done.is_err() {
        // The first fault is the one to tell.
        let _ = fs::remove_file(&part);
    }
    done
}

/// The temporary name: another one for each process.
fn part_of(place: &Path) -> PathBuf {
    let mut name = place.as_os_str().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    PathBuf::from(name)
}

fn fill(
    path: &Path,
    file: File,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), ExportError>,
) -> Result<(), ExportError> {
    let mut out = BufWriter::with_capacity(1 << 18, file);
    let done = write(&mut out).and_then(|()| Ok(out.flush()?));
    // What is left in the buffer of a failed file is not tried again.
    let _ = out.into_parts();
    done.map_err(|error| match error {
        ExportError::Output(source) => ExportError::CannotWrite {
            path: path.to_owned(),
            source,
        },
        other => other,
    })
}

#[cfg(test)]
mod tests {
    use super::super::sample::folder;
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let name = |entry: io::Result<fs::DirEntry>| entry.unwrap().file_name();
        let mut names: Vec<String> = entries
            .map(|entry| name(entry).to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_failure_leaves_what_was_there() {
        let folder = folder("whole");
        let path = folder.join("a");
        let fail = |out: &mut BufWriter<File>| {
            out.write_all(b"half")?;
            Err(io::Error::from(io::ErrorKind::StorageFull).into())
        };
        let error = write_whole(&path, fail).unwrap_err().to_string();
        assert!(error.contains("make room"), "{error}");
        assert!(names(&folder).is_empty());
        write_whole(&path, |out| Ok(out.write_all(b"whole")?)).unwrap();
        write_whole(&path, fail).unwrap_err();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!(names(&folder), ["a"]);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn what_is_there_is_spared() {
        let folder = folder("spared");
        let path = folder.join("a");
        check_file(&path, false).unwrap();
        fs::write(&path, "x").unwrap();
        let error = check_file(&path, false).unwrap_err().to_string();
        assert!(error.contains("exists already") && error.contains("--force"));
        check_file(&path, true).unwrap();
        for bad in [folder.clone(), folder.join("missing/a"), path.join("a")] {
            let error = check_file(&bad, true).unwrap_err();
            assert!(matches!(error, ExportError::CannotCreate { .. }), "{error}");
        }
        check_file(Path::new("/dev/null"), false).unwrap();
        write_whole(Path::new("/dev/null"), |out| Ok(out.write_all(b"x")?)).unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
        fs::remove_dir_all(&folder).unwrap();
    }
}
