//! A set of frame numbers.

/// Frame numbers, one bit each; a million frames take 125 kB.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameSet {
    /// Bit `n % 64` of word `n / 64` says whether frame `n` is in.
    words: Vec<u64>,
    /// How many are in.
    len: u64,
}

impl FrameSet {
    /// Adds a frame; a second time changes nothing.
    pub(super) fn insert(&mut self, frame: u64) {
        let Ok(word) = usize::try_from(frame / 64) else {
            return;
        };
        if word >= self.words.len() {
            self.words.resize(word + 1, 0);
        }
        let bit = 1 << (frame % 64);
        if self.words[word] & bit == 0 {
            self.words[word] |= bit;
            self.len += 1;
        }
    }

    /// Adds frames.
    pub(super) fn insert_all(&mut self, frames: impl IntoIterator<Item = u64>) {
        for frame in frames {
            self.insert(frame);
        }
    }

    /// How many frames are in.
    pub(super) fn len(&self) -> u64 {
        self.len
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_counts_once() {
        let mut set = FrameSet::default();
        set.insert_all([0, 63, 64, 1000, 63, 0]);
        assert_eq!(set.len(), 4);
    }
}
