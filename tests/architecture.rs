//! The rooms of `src/`: imports run one way, outside crates stay in their rooms.

use std::fs;
use std::path::{Path, PathBuf};

/// The rooms from left to right; a room may name only rooms to its left.
const ROOMS: &[&str] = &[
    "mesh",
    "linear",
    "state",
    "motion",
    "force",
    "strain_limit",
    "collision",
    "model",
    "energy",
    "scene",
    "integrator",
    "simulation",
    "frame",
    "recorder",
    "pipeline",
    "replay",
    "export",
    "picture",
    "lab",
    "study",
    "cli",
    "main",
];

/// Outside crates and the places (rooms or files) that may name them.
const OWNERS: &[(&str, &[&str])] = &[
    ("tobj", &["mesh/obj"]),
    ("parry3d_f64", &["mesh/distance"]),
    ("fast_surface_nets", &["mesh/implicit", "mesh/mannequin"]),
    ("rerun", &["recorder", "replay", "export"]),
    ("crossbeam_channel", &["pipeline"]),
    ("clap", &["cli"]),
    ("indicatif", &["cli"]),
    ("anyhow", &["cli"]),
    ("ctrlc", &["cli"]),
    ("serde_json", &["cli", "export"]),
    ("console", &["cli"]),
    ("toml", &["scene"]),
    ("faer", &["linear/cholesky", "linear/scalar_cholesky"]),
    ("plotters", &["picture"]),
    ("png", &["picture"]),
    ("dejavu", &["picture"]),
];

/// A source file: its path below `src` without the ending, and its code without comments.
struct Source {
    place: String,
    code: String,
}

impl Source {
    fn room(&self) -> &str {
        self.place.split('/').next().unwrap_or_default()
    }

    /// Whether the code names `word` followed by `::`, as a whole word and not inside a longer path.
    fn names(&self, word: &str) -> bool {
        let path = format!("{word}::");
        self.code.match_indices(&path).any(|(at, _)| {
            let before = self.code[..at].chars().next_back().unwrap_or(' ');
            !before.is_alphanumeric() && before != '_' && before != ':'
        })
    }
}

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    collect(&root, &mut files);
    let read = |path: PathBuf| {
        let place = path.strip_prefix(&root).unwrap().with_extension("");
        let text = fs::read_to_string(&path).unwrap();
        let code = text
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"));
        Source {
            place: place.to_string_lossy().into_owned(),
            code: code.collect::<Vec<_>>().join("\n"),
        }
    };
    files.into_iter().map(read).collect()
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            files.push(path);
        }
    }
    files.sort();
}

/// Rooms that a source names through `crate::`, also in a group `crate::{a, b::c}`.
fn named_rooms(source: &Source) -> Vec<String> {
    let mut rooms = Vec::new();
    for piece in source.code.split("crate::").skip(1) {
        let head = if piece.starts_with('{') {
            piece.split(';').next().unwrap_or_default()
        } else {
            piece
                .split(|c: char| !c.is_alphanumeric() && c != '_')
                .next()
                .unwrap_or_default()
        };
        let words = head.split(|c: char| !c.is_alphanumeric() && c != '_');
        rooms.extend(words.filter(|word| ROOMS.contains(word)).map(str::to_owned));
    }
    rooms
}

fn rank(room: &str) -> Option<usize> {
    ROOMS.iter().position(|known| *known == room)
}

#[test]
fn imports_run_from_left_to_right() {
    let sources = sources();
    assert!(
        sources.len() > 40,
        "only {} sources were found",
        sources.len()
    );
    let mut wrong = Vec::new();
    let mut seen = 0;
    for source in sources.iter().filter(|source| source.place != "lib") {
        let own = rank(source.room())
            .unwrap_or_else(|| panic!("src/{} is no room of the design", source.place));
        for room in named_rooms(source) {
            seen += 1;
            if rank(&room) > Some(own) {
                wrong.push(format!("{} names {room}", source.place));
            }
        }
    }
    assert!(
        seen > 60,
        "only {seen} imports were found: is the reading broken?"
    );
    assert!(wrong.is_empty(), "against the flow: {}", wrong.join("; "));
}

#[test]
fn outside_crates_stay_in_their_rooms() {
    let sources = sources();
    let mut wrong = Vec::new();
    for (name, owners) in OWNERS {
        let mut used = 0;
        for source in sources.iter().filter(|source| source.names(name)) {
            used += 1;
            let inside = |owner: &&str| {
                source.place == **owner || source.place.starts_with(&format!("{owner}/"))
            };
            if !owners.iter().any(inside) {
                wrong.push(format!("{} names {name}", source.place));
            }
        }
        assert!(used > 0, "nobody names {name}: is the reading broken?");
    }
    assert!(wrong.is_empty(), "out of their rooms: {}", wrong.join("; "));
}

#[test]
fn no_room_for_leftovers() {
    for source in sources() {
        for part in source.place.split('/') {
            assert!(
                !["utils", "common", "helpers", "types"].contains(&part),
                "src/{}",
                source.place
            );
        }
    }
}
