//! The program as tests run it.

use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// No command of the tests takes half as long; one that hangs is ended.
const PATIENCE: Duration = Duration::from_secs(60);

/// How a command ended.
#[derive(Debug)]
pub(crate) struct Ended {
    /// Its exit code; none when it was ended by a signal.
    pub(crate) code: Option<i32>,
    /// What it printed.
    pub(crate) out: String,
    /// What it printed as messages.
    pub(crate) err: String,
}

/// Runs `muslin` in a folder with arguments that are parted by blanks.
pub(crate) fn muslin(folder: &Path, args: &str) -> Ended {
    let output = assert_cmd::cargo::cargo_bin_cmd!("muslin")
        .args(args.split_whitespace())
        .current_dir(folder)
        .timeout(PATIENCE)
        .output()
        .expect("muslin starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Ended {
        code: output.status.code(),
        out: text(&output.stdout),
        err: text(&output.stderr),
    }
}

/// The same for a command that must succeed.
pub(crate) fn muslin_succeeds(folder: &Path, args: &str) -> Ended {
    let ended = muslin(folder, args);
    assert_eq!(ended.code, Some(0), "muslin {args}: {ended:#?}");
    ended
}

pub(crate) fn write(folder: &Path, file: &str, text: &str) {
    let path = folder.join(file);
    let parent = path.parent().expect("a file in a folder");
    fs::create_dir_all(parent).expect("a folder can be made");
    fs::write(path, text).expect("a test file can be written");
}

pub(crate) fn read(folder: &Path, file: &str) -> String {
    fs::read_to_string(folder.join(file)).unwrap_or_else(|fault| panic!("{file}: {fault}"))
}

pub(crate) fn report(folder: &Path, file: &str) -> Value {
    serde_json::from_str(&read(folder, file)).unwrap_or_else(|fault| panic!("{file}: {fault}"))
}

/// Every file below a folder with what is in it.
pub(crate) fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files.extend(contents(&path));
        } else {
            let bytes = fs::read(&path).expect("a file");
            files.insert(path, bytes);
        }
    }
    files
}

pub(crate) fn says(ended: &Ended, words: &[&str]) {
    for word in words {
        assert!(ended.err.contains(word), "no {word:?} in {}", ended.err);
    }
}

/// Runs a command that must be refused: exit code 2, one message with all `words`, and every file
/// of the folder as it was.
pub(crate) fn refused(folder: &Path, args: &str, words: &[&str]) {
    let before = contents(folder);
    let ended = muslin(folder, args);
    assert_eq!(ended.code, Some(2), "muslin {args}: {ended:#?}");
    let errors = ended.err.lines().filter(|line| line.starts_with("error:"));
    assert_eq!(errors.count(), 1, "{}", ended.err);
    says(&ended, words);
    let after = contents(folder);
    let names = |files: &BTreeMap<PathBuf, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&before), names(&after), "muslin {args} left files");
    assert!(before == after, "muslin {args} changed a file");
}
