//! The `f64` states in a recording.

use super::frames::seconds;
use super::{ReadError, for_each_chunk};
use crate::frame::{Checkpoint, ClothCheckpoint};
use crate::recorder::checkpoint::{Mark, hashes, luggage, marks, particles};
use crate::recorder::entity;
use std::collections::BTreeMap;
use std::path::Path;

/// Times of checkpoints are sums of steps, and round (s).
const ROUNDING: f64 = 1e-9;

/// Which checkpoint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum At {
    /// The last one.
    Last,
    /// The last one at or before this time (s).
    Time(f64),
}

/// Reads the first checkpoint of a recording.
///
/// # Errors
///
/// As [`read_checkpoint`].
pub fn read_first_checkpoint(path: &Path) -> Result<Checkpoint, ReadError> {
    let marks = complete_marks(path)?.into_iter();
    match marks.min_by(|a, b| a.time.total_cmp(&b.time).then(a.step.cmp(&b.step))) {
        Some(mark) => gather(path, &mark),
        None => Err(ReadError::NoCheckpoint {
            path: path.to_owned(),
        }),
    }
}

/// Reads a checkpoint of a recording, bit for bit as it was recorded.
///
/// The file is read twice, first to find the checkpoint, so that only one is in memory.
///
/// # Errors
///
/// When the file can't be read, is no recording, or has no such checkpoint.
pub fn read_checkpoint(path: &Path, at: At) -> Result<Checkpoint, ReadError> {
    let complete = complete_marks(path)?;
    let first = complete.iter().map(|mark| mark.time).reduce(f64::min);
    let wanted = complete.into_iter().filter(|mark| match at {
        At::Last => true,
        At::Time(time) => mark.time <= time + ROUNDING,
    });
    // Of two at one time the one with more steps.
    let latest = wanted.max_by(|a, b| a.time.total_cmp(&b.time).then(a.step.cmp(&b.step)));
    let path = path.to_owned();
    match (latest, first, at) {
        (Some(mark), ..) => gather(&path, &mark),
        (None, Some(first), At::Time(time)) => Err(ReadError::TooEarly { path, time, first }),
        (None, ..) => Err(ReadError::NoCheckpoint { path }),
    }
}

/// Times (s) of the checkpoints of which everything is there, in order.
///
/// # Errors
///
/// When the file can't be read or is no recording.
pub fn checkpoint_times(path: &Path) -> Result<Vec<f64>, ReadError> {
    let mut times: Vec<f64> = complete_marks(path)?.iter().map(|mark| mark.time).collect();
    times.sort_by(f64::total_cmp);
    Ok(times)
}

/// The hash of the state in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateHash {
    /// Simulated time of the frame (s).
    pub time: f64,
    /// See [`State::hash`](crate::state::State::hash).
    pub hash: u64,
}

/// The hashes of the states by the frames' numbers.
///
/// # Errors
///
/// When the file can't be read or is no recording.
pub fn state_hashes(path: &Path) -> Result<BTreeMap<u64, StateHash>, ReadError> {
    let entity = entity::path(&entity::STATE_HASH);
    let mut all = BTreeMap::new();
    for_each_chunk(path, |chunk| {
        if *chunk.entity_path() == entity {
            let rows = hashes(&chunk).into_iter();
            all.extend(rows.map(|(frame, time, hash)| {
                let time = seconds(time);
                (frame.cast_unsigned(), StateHash { time, hash })
            }));
        }
    })?;
    Ok(all)
}

/// The checkpoints of which everything is there.
fn complete_marks(path: &Path) -> Result<Vec<Mark>, ReadError> {
    let root = entity::path(&[entity::CHECKPOINT]);
    let mut told: Vec<Mark> = Vec::new();
    let mut present: Vec<(i64, String)> = Vec::new();
    for_each_chunk(path, |chunk| {
        let entity = chunk.entity_path();
        if *entity == root {
            told.extend(marks(&chunk));
        } else if entity.is_child_of(&root)
            && let Some(cloth) = entity.last()
        {
            let frames = chunk.iter_indices(&entity::FRAME.into());
            let cloth = cloth.unescaped_str();
            present.extend(frames.map(|(frame, _)| (frame.as_i64(), cloth.to_owned())));
        }
    })?;
    present.sort_unstable();
    told.retain(|mark| {
        let mut cloths = mark.cloths.iter();
        cloths.all(|cloth| present.binary_search(&(mark.frame, cloth.clone())).is_ok())
    });
    Ok(told)
}

/// Reads the cloths of a checkpoint.
fn gather(path: &Path, mark: &Mark) -> Result<Checkpoint, ReadError> {
    let names = mark.cloths.iter();
    let paths: Vec<_> = names.map(|cloth| entity::cloth_checkpoint(cloth)).collect();
    let root = entity::path(&[entity::CHECKPOINT]);
    let mut found: Vec<Option<Vec<[f64; 6]>>> = vec![None; paths.len()];
    let mut carried = None;
    for_each_chunk(path, |chunk| {
        let cloth = paths.iter().position(|path| path == chunk.entity_path());
        if let Some(cloth) = cloth
            && let Some(state) = particles(&chunk, mark.frame)
        {
            found[cloth] = Some(state);
        } else if *chunk.entity_path() == root {
            carried = carried.take().or_else(|| luggage(&chunk, mark.frame));
        }
    })?;
    let cloths = mark.cloths.iter().zip(found);
    let cloths: Option<Vec<ClothCheckpoint>> = cloths
        .map(|(name, particles)| {
            Some(ClothCheckpoint {
                name: name.clone(),
                particles: particles?,
            })
        })
        .collect();
    Ok(Checkpoint {
        step: mark.step,
        time: mark.time,
        cloths: cloths.ok_or_else(|| ReadError::NoCheckpoint {
            path: path.to_owned(),
        })?,
        luggage: carried.unwrap_or_default(),
    })
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::frame::{Frame, Header};
    use crate::recorder::{Recorder, RerunRecorder, Targets};
    use crate::replay::Layout;

    fn checkpoint(step: u64) -> Checkpoint {
        let third = step as f64 / 3.0;
        let awkward = [
            third,
            -0.0,
            f64::MIN_POSITIVE / 8.0,
            1e300,
            0.1 + 0.2,
            -third,
        ];
        let cloth = |name: &str, n: usize| ClothCheckpoint {
            name: name.to_owned(),
            particles: vec![awkward; n],
        };
        Checkpoint {
            step,
            time: step as f64 * 0.1,
            cloths: vec![cloth("zeta, front/1", 3), cloth("alpha", 2)],
            luggage: step.to_le_bytes().repeat(20),
        }
    }

    /// A recording with checkpoints in frames 2, 4 and 6, at 0.2, 0.4 and 0.6 s.
    fn recording(name: &str) -> PathBuf {
        let file = format!("muslin-replay-{}-{name}.rrd", std::process::id());
        let path = std::env::temp_dir().join(file);
        let header = Header {
            scene_toml: "name = \"a\"\n# b".to_owned(),
            ..Header::default()
        };
        let targets = Targets {
            save: Some(path.clone()),
            ..Targets::default()
        };
        let mut recorder = RerunRecorder::new(&header, &targets).unwrap();
        for index in 1..8 {
            let frame = Frame {
                index,
                time: index as f64 * 0.1,
                checkpoint: (index % 2 == 0).then(|| checkpoint(index)),
                ..Frame::default()
            };
            recorder.record(&frame).unwrap();
        }
        recorder.finish().unwrap();
        path
    }

    fn bits(checkpoint: &Checkpoint) -> Vec<u64> {
        let particles = checkpoint.cloths.iter().flat_map(|cloth| &cloth.particles);
        particles.flatten().map(|number| number.to_bits()).collect()
    }

    #[test]
    fn checkpoints_come_back_bit_for_bit() {
        let path = recording("bits");
        let ask = |at| read_checkpoint(&path, at);
        for (at, step) in [(At::Last, 6), (At::Time(0.4), 4), (At::Time(0.59), 4)] {
            let read = ask(at).unwrap();
            assert_eq!(read, checkpoint(step), "{at:?}");
            assert_eq!(bits(&read), bits(&checkpoint(step)), "{at:?}");
        }
        let error = ask(At::Time(0.1)).unwrap_err().to_string();
        assert!(error.contains("the first is at 0.2 s"), "{error}");
        assert_eq!(Layout::read(&path).unwrap().toml, "name = \"a\"\n# b");
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn a_cut_recording_gives_what_is_whole() {
        let path = recording("cut");
        let whole = std::fs::read(&path).unwrap();
        let mut lengths = 0;
        for length in (0..whole.len()).step_by(997) {
            std::fs::write(&path, &whole[..length]).unwrap();
            if let Ok(read) = read_checkpoint(&path, At::Last) {
                assert_eq!(read, checkpoint(read.step), "cut at {length}");
                lengths += 1;
            }
        }
        assert!(lengths > 0, "no cut left a checkpoint");
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn other_files_are_refused() {
        let file = format!("muslin-replay-{}-other.rrd", std::process::id());
        let path = std::env::temp_dir().join(file);
        let missing = read_checkpoint(&path, At::Last).unwrap_err();
        assert!(matches!(missing, ReadError::CannotRead { .. }), "{missing}");
        for content in ["", "cloth,particle\n", "RRF2"] {
            std::fs::write(&path, content).unwrap();
            let error = read_checkpoint(&path, At::Last).unwrap_err();
            let refused = matches!(error, ReadError::NotARecording { .. });
            assert!(refused, "{content:?}: {error}");
        }
        std::fs::remove_file(&path).unwrap();
    }
}
