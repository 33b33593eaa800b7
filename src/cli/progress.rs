//! How far a run is: a bar in a terminal, plain lines elsewhere.

use crate::pipeline::Progress;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal as _;

/// Shows how far a run is.
pub(super) struct Display {
    duration: f64,
    kind: Kind,
}

enum Kind {
    Quiet,
    /// The tenth of the run that was said last.
    Lines(u64),
    Bar(ProgressBar),
}

impl Display {
    pub(super) fn new(duration: f64, quiet: bool) -> Self {
        let kind = if quiet {
            Kind::Quiet
        } else if std::io::stderr().is_terminal() {
            let bar = ProgressBar::new(TICKS);
            let style = ProgressStyle::with_template("{bar:30} {msg}, {eta} left");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            Kind::Bar(bar)
        } else {
            Kind::Lines(0)
        };
        Self { duration, kind }
    }

    pub(super) fn show(&mut self, progress: Progress) {
        let share = (progress.time / self.duration).clamp(0.0, 1.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 0 and TICKS"
        )]
        let ticks = |parts: u64| (share * parts as f64) as u64;
        match &mut self.kind {
            Kind::Quiet => {}
            Kind::Bar(bar) => {
                bar.set_position(ticks(TICKS));
                bar.set_message(line(progress, self.duration));
            }
            Kind::Lines(said) => {
                let tenth = ticks(10);
                if tenth > *said {
                    *said = tenth;
                    eprintln!("{}", line(progress, self.duration));
                }
            }
        }
    }

    pub(super) fn finish(&self) {
        if let Kind::Bar(bar) = &self.kind {
            bar.finish_and_clear();
        }
    }
}

/// Resolution of the bar.
const TICKS: u64 = 1000;

fn line(progress: Progress, duration: f64) -> String {
    let Progress {
        time,
        ms_per_frame,
        strain_ever,
        depth_ever,
        dropped_live_frames,
    } = progress;
    let mut line = format!(
        "{time:.2} of {duration:.2} s, {ms_per_frame:.1} ms a frame, strain at most {:.2} %, penetration at most {:.3} mm",
        100.0 * strain_ever,
        1000.0 * depth_ever
    );
    if dropped_live_frames > 0 {
        line += &format!(", {dropped_live_frames} live frames dropped");
    }
    line
}
