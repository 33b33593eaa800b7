//! What the audit of contact has found in a whole run.

use crate::collision::Findings;
use crate::state::Archive;

/// The worst of all recorded frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Audited {
    /// Frames that were looked at.
    pub frames: u64,
    /// Frames in which anything was wrong.
    pub bad_frames: u64,
    /// Depth of the deepest point of cloth in an obstacle (m).
    pub depth: f64,
    /// Most particles inside obstacles.
    pub inside: u32,
    /// Most crossings of cloth with obstacles.
    pub crossings: u32,
    /// Most crossings of cloth with cloth.
    pub cloth_crossings: u32,
}

impl Audited {
    /// Carries all of it over.
    pub(super) fn carry(&mut self, archive: &mut Archive) {
        archive.count(&mut self.frames);
        archive.count(&mut self.bad_frames);
        archive.real(&mut self.depth);
        for count in [
            &mut self.inside,
            &mut self.crossings,
            &mut self.cloth_crossings,
        ] {
            archive.small(count);
        }
    }

    /// Adds what was found in a frame.
    pub fn add(&mut self, findings: &Findings) {
        self.frames += 1;
        self.bad_frames += u64::from(!findings.marks.is_empty());
        self.depth = self.depth.max(findings.depth());
        self.inside = self.inside.max(findings.inside());
        self.crossings = self.crossings.max(findings.crossings());
        self.cloth_crossings = self.cloth_crossings.max(findings.cloth_crossings);
    }
}
