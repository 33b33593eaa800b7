//! `muslin replay`: recordings shown again, at their pace.

use super::Failure;
use super::args::ReplayArgs;
use super::job::stop_on_interrupt;
use super::keys::Keys;
use crate::recorder::Targets;
use crate::replay::{Command, Console, Replay, ReplayError, ReplayPlan, ReplayProgress};
use anyhow::anyhow;
use console::Key;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

pub(super) fn run(args: &ReplayArgs) -> Result<(), Failure> {
    let targets = Targets {
        save: None,
        force: false,
        connect: args.connect.clone(),
        serve: args.serve,
        spawn: args.spawn,
    };
    check(args, &targets)?;
    let stop = stop_on_interrupt()?;
    let replay = Replay::open(&args.recordings).map_err(Failure::input)?;
    let (first, last) = replay.span();
    let plan = ReplayPlan {
        speed: args.speed,
        from: args.from.unwrap_or(first),
        to: args.to.unwrap_or(last),
        looped: args.looped,
    };
    let mut seat = Seat::new(&plan, args.quiet, stop);
    let dropped = replay.play(&plan, &targets, &mut seat);
    seat.leave();
    let dropped = dropped.map_err(|error| match error {
        ReplayError::Rerun(_) => Failure::run(error),
        _ => Failure::input(error),
    })?;
    if dropped > 0 && !args.quiet {
        println!(
            "{dropped} frames did not reach a viewer: none was there, or it was too slow; replay again with a viewer \
             open, or with a smaller --speed"
        );
    }
    Ok(())
}

/// Refuses what can't be meant, before anything is read.
fn check(args: &ReplayArgs, targets: &Targets) -> Result<(), Failure> {
    let refuse = |why: String| Err(Failure::Input(anyhow!(why)));
    if *targets == Targets::default() {
        return refuse(
            "no viewer to replay to: use --spawn to start one, --connect [URL] for one that listens, or --serve [PORT] \
             for those that come"
                .to_owned(),
        );
    }
    if !(args.speed.is_finite() && args.speed > 0.0) {
        return refuse(format!(
            "--speed {}: must be more than 0; 1 is real time, 0.1 slow motion",
            args.speed
        ));
    }
    for (flag, time) in [("--from", args.from), ("--to", args.to)] {
        if time.is_some_and(|time| !time.is_finite()) {
            return refuse(format!("{flag}: write seconds, such as {flag} 1.5"));
        }
    }
    match (args.from, args.to) {
        (Some(from), Some(to)) if from > to => refuse(format!(
            "--from {from} is after --to {to}: nothing lies between; swap them"
        )),
        _ => Ok(()),
    }
}

/// Where the person sits who watches: keys before, a line of progress above.
struct Seat {
    start: Instant,
    keys: Keys,
    stop: Arc<AtomicBool>,
    from: f64,
    to: f64,
    said: Said,
}

/// How progress is told.
enum Said {
    Nothing,
    /// Plain lines; the tenth of the replay that was told last.
    Lines(f64),
    Bar(ProgressBar),
}

impl Seat {
    fn new(plan: &ReplayPlan, quiet: bool, stop: Arc<AtomicBool>) -> Self {
        let keys = Keys::listen();
        let said = if quiet {
            Said::Nothing
        } else if std::io::stderr().is_terminal() {
            let bar = ProgressBar::new_spinner();
            let style = ProgressStyle::with_template("{msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
            Said::Bar(bar)
        } else {
            Said::Lines(0.0)
        };
        if keys.heard() && !quiet {
            eprintln!("space: pause; right or .: a frame on; + and -: speed; q: quit");
        }
        Self {
            start: Instant::now(),
            keys,
            stop,
            from: plan.from,
            to: plan.to,
            said,
        }
    }

    /// Takes the line of progress away.
    fn leave(&self) {
        if let Said::Bar(bar) = &self.said {
            bar.finish_and_clear();
        }
    }
}

impl Console for Seat {
    fn now(&self) -> Duration {
        self.start.elapsed()
    }

    fn wait(&mut self, at_most: Duration) -> Option<Command> {
        let key = self.keys.wait(at_most);
        if self.stop.load(Ordering::Relaxed) {
            return Some(Command::Quit);
        }
        key.and_then(|key| command(&key))
    }

    fn show(&mut self, progress: ReplayProgress) {
        match &mut self.said {
            Said::Nothing => {}
            Said::Bar(bar) => bar.set_message(line(progress, self.to)),
            Said::Lines(told) => {
                let length = (self.to - self.from).max(f64::MIN_POSITIVE);
                let tenth = (10.0 * (progress.time - self.from) / length).floor();
                // After the last tenth there may be an eleventh: everything is sent, and the viewer loops.
                let tenth = if progress.done { 11.0 } else { tenth };
                if tenth > *told {
                    *told = tenth;
                    eprintln!("{}", line(progress, self.to));
                }
            }
        }
    }
}

/// What a key asks for.
fn command(key: &Key) -> Option<Command> {
    Some(match key {
        Key::Char(' ') => Command::Pause,
        Key::ArrowRight | Key::Char('.') => Command::Step,
        Key::Char('+' | '=') => Command::Faster,
        Key::Char('-') => Command::Slower,
        Key::Char('q' | 'Q') | Key::Escape => Command::Quit,
        _ => return None,
    })
}

/// Where a replay stands, for people.
fn line(progress: ReplayProgress, end: f64) -> String {
    let ReplayProgress {
        time,
        speed,
        paused,
        done,
        dropped,
    } = progress;
    let mut line = match done {
        true => format!("all of it is sent up to {end:.2} s: the viewer loops by itself"),
        false => format!("{time:.2} of {end:.2} s, speed {speed}"),
    };
    if paused {
        line += ", paused";
    }
    if dropped > 0 {
        line += &format!(", {dropped} frames dropped");
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_says_what_matters() {
        let mut progress = ReplayProgress {
            time: 1.5,
            speed: 0.5,
            paused: false,
            done: false,
            dropped: 0,
        };
        assert_eq!(line(progress, 4.0), "1.50 of 4.00 s, speed 0.5");
        (progress.paused, progress.dropped) = (true, 7);
        assert_eq!(
            line(progress, 4.0),
            "1.50 of 4.00 s, speed 0.5, paused, 7 frames dropped"
        );
    }
}
