//! States read back from a recording, and tables of them.
//!
//! Works on the recording of a run that was killed, too: what is whole is read.

use std::io::{self, Write};

use crate::frame::Checkpoint;

#[cfg(feature = "rerun")]
pub use reading::{At, ExportError, read_checkpoint, read_scene_toml};

/// Writes one row a particle: `cloth,particle,x,y,z,vx,vy,vz` (m and m/s).
///
/// Numbers have as few digits as give back the same `f64`. A name with a comma, a quote or a line
/// break is put in quotes, as RFC 4180 says.
///
/// # Errors
///
/// When `out` can't be written.
pub fn write_csv(checkpoint: &Checkpoint, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "cloth,particle,x,y,z,vx,vy,vz")?;
    for cloth in &checkpoint.cloths {
        let name = quoted(&cloth.name);
        for (particle, [x, y, z, vx, vy, vz]) in cloth.particles.iter().enumerate() {
            writeln!(
                out,
                "{name},{particle},{x:?},{y:?},{z:?},{vx:?},{vy:?},{vz:?}"
            )?;
        }
    }
    Ok(())
}

fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}

#[cfg(feature = "rerun")]
mod reading {
    use std::fs::File;
    use std::io::{self, BufReader};
    use std::path::{Path, PathBuf};

    use rerun::external::re_log_encoding::DecoderApp;
    use rerun::log::{Chunk, LogMsg};

    use crate::frame::{Checkpoint, ClothCheckpoint};
    use crate::recorder::checkpoint::{Mark, marks, particles};
    use crate::recorder::{entity, scene_toml};

    /// Which checkpoint.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum At {
        /// The last one.
        Last,
        /// The last one at or before this time (s).
        Time(f64),
    }

    /// Why nothing can be read from a recording.
    #[derive(Debug, thiserror::Error)]
    #[non_exhaustive]
    pub enum ExportError {
        /// The file can't be read.
        #[error("cannot read {}: {source}; give the path of an .rrd file", .path.display())]
        CannotRead {
            /// The file.
            path: PathBuf,
            /// What the system says.
            source: io::Error,
        },
        /// The file is no recording.
        #[error(
            "{} is not a Rerun recording that this version reads: {reason}; \
             give an .rrd file that muslin saved", .path.display()
        )]
        NotARecording {
            /// The file.
            path: PathBuf,
            /// What Rerun says.
            reason: String,
        },
        /// The recording has no complete checkpoint.
        #[error(
            "{} holds no checkpoint; give a recording that muslin saved with --save, \
             of a run that came far enough to record one", .path.display()
        )]
        NoCheckpoint {
            /// The file.
            path: PathBuf,
        },
        /// There are checkpoints, but later ones.
        #[error(
            "{} has no checkpoint at or before {time} s: the first is at {first} s; \
             ask for that or a later time", .path.display()
        )]
        TooEarly {
            /// The file.
            path: PathBuf,
            /// The time asked for (s).
            time: f64,
            /// Time of the first checkpoint (s).
            first: f64,
        },
        /// The recording has no scene.
        #[error("{} holds no scene; give a recording that muslin saved", .path.display())]
        NoScene {
            /// The file.
            path: PathBuf,
        },
    }

    /// Reads a checkpoint of a recording, bit for bit as it was recorded.
    ///
    /// The file is read twice, first to find the checkpoint, so that only one is in memory.
    ///
    /// # Errors
    ///
    /// When the file can't be read, is no recording, or has no such checkpoint.
    pub fn read_checkpoint(path: &Path, at: At) -> Result<Checkpoint, ExportError> {
        let complete = complete_marks(path)?;
        let first = complete.iter().map(|mark| mark.time).reduce(f64::min);
        let wanted = complete.into_iter().filter(|mark| match at {
            At::Last => true,
            At::Time(time) => mark.time <= time,
        });
        // Of two at one time the one with more steps.
        let latest = wanted.max_by(|a, b| a.time.total_cmp(&b.time).then(a.step.cmp(&b.step)));
        let path = path.to_owned();
        match (latest, first, at) {
            (Some(mark), ..) => gather(&path, &mark),
            (None, Some(first), At::Time(time)) => Err(ExportError::TooEarly { path, time, first }),
            (None, ..) => Err(ExportError::NoCheckpoint { path }),
        }
    }

    /// Reads the scene's TOML as it was run.
    ///
    /// # Errors
    ///
    /// When the file can't be read, is no recording, or has no scene.
    pub fn read_scene_toml(path: &Path) -> Result<String, ExportError> {
        let scene = entity::path(&[entity::SCENE]);
        let mut toml = None;
        for_each_chunk(path, |chunk| {
            if *chunk.entity_path() == scene {
                toml = toml.take().or_else(|| scene_toml(chunk));
            }
        })?;
        toml.ok_or_else(|| ExportError::NoScene {
            path: path.to_owned(),
        })
    }

    /// The checkpoints of which everything is there.
    fn complete_marks(path: &Path) -> Result<Vec<Mark>, ExportError> {
        let root = entity::path(&[entity::CHECKPOINT]);
        let mut told: Vec<Mark> = Vec::new();
        let mut present: Vec<(i64, String)> = Vec::new();
        for_each_chunk(path, |chunk| {
            let entity = chunk.entity_path();
            if *entity == root {
                told.extend(marks(chunk));
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
    fn gather(path: &Path, mark: &Mark) -> Result<Checkpoint, ExportError> {
        let names = mark.cloths.iter();
        let paths: Vec<_> = names.map(|cloth| entity::cloth_checkpoint(cloth)).collect();
        let mut found: Vec<Option<Vec<[f64; 6]>>> = vec![None; paths.len()];
        for_each_chunk(path, |chunk| {
            let cloth = paths.iter().position(|path| path == chunk.entity_path());
            if let Some(cloth) = cloth
                && let Some(state) = particles(chunk, mark.frame)
            {
                found[cloth] = Some(state);
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
            cloths: cloths.ok_or_else(|| ExportError::NoCheckpoint {
                path: path.to_owned(),
            })?,
        })
    }

    /// Calls `visit` for each chunk of the recording.
    ///
    /// A recording that ends in the middle of a message is read up to there.
    fn for_each_chunk(path: &Path, mut visit: impl FnMut(&Chunk)) -> Result<(), ExportError> {
        let not_a_recording = |reason: String| ExportError::NotARecording {
            path: path.to_owned(),
            reason,
        };
        let file = File::open(path).map_err(|source| ExportError::CannotRead {
            path: path.to_owned(),
            source,
        })?;
        let messages = DecoderApp::decode_eager(BufReader::new(file))
            .map_err(|error| not_a_recording(error.to_string()))?;
        let mut any = false;
        for message in messages {
            let message = message.map_err(|error| not_a_recording(error.to_string()))?;
            any = true;
            if let LogMsg::ArrowMsg(store, rows) = message
                && store.is_recording()
            {
                let chunk = Chunk::from_arrow_msg(&rows)
                    .map_err(|error| not_a_recording(error.to_string()))?;
                visit(&chunk);
            }
        }
        match any {
            true => Ok(()),
            false => Err(not_a_recording("it is empty".to_owned())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::ClothCheckpoint;

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
        }
    }

    #[test]
    fn csv_numbers_parse_to_the_same_bits() {
        let checkpoint = checkpoint(7);
        let mut text = Vec::new();
        write_csv(&checkpoint, &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("cloth,particle,x,y,z,vx,vy,vz"));
        assert!(text.contains("\"zeta, front/1\",2,"), "{text}");
        let row = text
            .lines()
            .find(|line| line.starts_with("alpha,1,"))
            .unwrap();
        let numbers: Vec<u64> = row
            .split(',')
            .skip(2)
            .map(|number| number.parse::<f64>().unwrap().to_bits())
            .collect();
        let expected = checkpoint.cloths[1].particles[1].map(f64::to_bits);
        assert_eq!(numbers, expected);
    }

    #[cfg(feature = "rerun")]
    mod recorded {
        use std::path::PathBuf;

        use super::*;
        use crate::frame::{Frame, Header};
        use crate::recorder::{Recorder, RerunRecorder, Targets};

        /// A recording with checkpoints in frames 2, 4 and 6, at 0.2, 0.4 and 0.6 s.
        fn recording(name: &str) -> PathBuf {
            let file = format!("muslin-export-{}-{name}.rrd", std::process::id());
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
            assert_eq!(read_scene_toml(&path).unwrap(), "name = \"a\"\n# b");
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
            let file = format!("muslin-export-{}-other.rrd", std::process::id());
            let path = std::env::temp_dir().join(file);
            let missing = read_checkpoint(&path, At::Last).unwrap_err();
            assert!(
                matches!(missing, ExportError::CannotRead { .. }),
                "{missing}"
            );
            for content in ["", "cloth,particle\n", "RRF2"] {
                std::fs::write(&path, content).unwrap();
                let error = read_checkpoint(&path, At::Last).unwrap_err();
                let refused = matches!(error, ExportError::NotARecording { .. });
                assert!(refused, "{content:?}: {error}");
            }
            std::fs::remove_file(&path).unwrap();
        }
    }
}
