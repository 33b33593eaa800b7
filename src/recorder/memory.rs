//! Keeps frames in memory.

use super::{RecordError, Recorded, Recorder};
use crate::frame::{Frame, Header};

/// Keeps every frame of a run; for tests and for whoever reads frames directly.
#[derive(Clone, Debug, Default)]
pub struct MemoryRecorder {
    /// What stays the same in every frame.
    pub header: Header,
    /// The frames in the order of recording.
    pub frames: Vec<Frame>,
}

impl MemoryRecorder {
    /// An empty recording.
    pub fn new(header: Header) -> Self {
        Self {
            header,
            frames: Vec::new(),
        }
    }
}

impl Recorder for MemoryRecorder {
    fn record(&mut self, frame: &Frame) -> Result<(), RecordError> {
        self.frames.push(frame.clone());
        Ok(())
    }

    fn finish(&mut self) -> Result<Recorded, RecordError> {
        Ok(Recorded {
            frames: self.frames.len() as u64,
            dropped_live_frames: 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_come_back_in_order() {
        let mut recorder = MemoryRecorder::new(Header::default());
        for index in 0..3 {
            let frame = Frame {
                index,
                ..Frame::default()
            };
            recorder.record(&frame).unwrap();
        }
        let indices: Vec<u64> = recorder.frames.iter().map(|frame| frame.index).collect();
        assert_eq!(indices, [0, 1, 2]);
        assert_eq!(recorder.finish().unwrap().frames, 3);
    }
}
