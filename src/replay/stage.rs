//! The loop of a replay: what is due is sent, keys are heard.

use super::overlay::Cast;
use super::survey::Survey;
use super::track::Track;
use super::{Command, Console, Pace, ReplayError, ReplayPlan, ReplayProgress};
use super::{Viewers, Window, seconds};
use crate::recorder::blueprint;
use rerun::log::LogMsg;
use std::path::PathBuf;
use std::time::Duration;

/// Longest time between two looks at the keys: a stroke is answered at once.
const LOOK: Duration = Duration::from_millis(50);
/// Shortest time between two deliveries: no viewer shows more than 125 pictures a second.
const TICK: Duration = Duration::from_millis(8);
/// How long a viewer that takes nothing is waited for; after that it is taken to be stopped, and misses frames.
const PATIENCE: Duration = Duration::from_secs(2);
/// A key makes it so much faster or slower.
const FASTER: f64 = 2.0;

/// A replay that is on.
pub(super) struct Stage<'a> {
    tracks: Vec<Track>,
    cast: Cast,
    viewers: &'a mut dyn Viewers,
    console: &'a mut dyn Console,
    pace: Pace,
    plan: &'a ReplayPlan,
    /// Time of the last rows sent (s).
    time: f64,
    /// Do the viewers take what they get?
    patient: bool,
}

/// How a pass through the recordings ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Reached,
    Quit,
}

impl<'a> Stage<'a> {
    /// Opens the recordings for a replay.
    pub(super) fn set(
        recordings: Vec<(PathBuf, Survey)>,
        plan: &'a ReplayPlan,
        viewers: &'a mut dyn Viewers,
        console: &'a mut dyn Console,
    ) -> Result<Self, ReplayError> {
        let cast = Cast::of(&recordings)?;
        let window = Window::of(plan);
        let recordings = recordings.into_iter();
        let tracks = recordings.map(|(path, survey)| Track::open(path, survey, window));
        Ok(Self {
            tracks: tracks.collect::<Result<_, _>>()?,
            cast,
            viewers,
            pace: Pace::new(plan.from, plan.speed, console.now()),
            console,
            plan,
            time: plan.from,
            patient: true,
        })
    }

    /// Replays until the end, or until the console says to quit.
    pub(super) fn run(mut self) -> Result<(), ReplayError> {
        let greeting = self.greeting()?;
        let blueprint = greeting.iter().find_map(|message| match message {
            LogMsg::BlueprintActivationCommand(command) => Some(command.blueprint_id.clone()),
            _ => None,
        });
        for message in greeting {
            self.viewers.send(message);
        }
        let greeted = self.viewers.greeted();
        self.pace.set_time(self.plan.from, self.console.now());
        if self.pass()? == End::Quit || !self.plan.looped {
            return Ok(());
        }
        // The viewer has everything, and can loop by itself: sent again, the rows would only fill its memory.
        if let Some(id) = blueprint {
            for message in blueprint::looping(&id, self.pace.speed())? {
                self.viewers.send(message);
            }
        }
        self.stay(greeted)
    }

    /// Keeps whoever comes now supplied, until told to quit.
    fn stay(&mut self, mut greeted: u64) -> Result<(), ReplayError> {
        loop {
            self.show(true);
            if self.console.wait(LOOK) == Some(Command::Quit) {
                return Ok(());
            }
            let now = self.viewers.greeted();
            if now > greeted {
                greeted = now;
                for track in &mut self.tracks {
                    track.rewind()?;
                }
                let wall = self.console.now();
                self.pace = Pace::new(self.plan.to, self.plan.speed, wall);
                if self.pass()? == End::Quit {
                    return Ok(());
                }
            }
        }
    }

    /// What comes before the first rows.
    fn greeting(&self) -> Result<Vec<LogMsg>, ReplayError> {
        let mut all = self.cast.opening()?;
        for (role, track) in self.tracks.iter().enumerate() {
            let sticky = track.sticky().iter();
            all.extend(sticky.filter_map(|message| self.cast.message(role, message)));
        }
        // Statics first: a viewer that gets the rows of a mesh before its triangles says so.
        all.extend(self.cast.layout()?);
        Ok(all)
    }

    /// Sends what is recorded once, at its pace.
    fn pass(&mut self) -> Result<End, ReplayError> {
        for role in 0..self.tracks.len() {
            for chunk in self.tracks[role].opening()? {
                self.send(role, &chunk);
            }
        }
        while let Some(next) = self.next()? {
            let wall = self.console.now();
            let due = self.pace.time(wall) >= seconds(next);
            let wait = match (due, self.pace.until(seconds(next), wall)) {
                (true, _) => Duration::ZERO,
                (false, left) => left.unwrap_or(LOOK).clamp(TICK, LOOK),
            };
            if due {
                self.deliver(next, self.pace.time(wall));
            }
            if let Some(command) = self.console.wait(wait)
                && self.obey(command)? == End::Quit
            {
                return Ok(End::Quit);
            }
            self.show(false);
        }
        Ok(End::Reached)
    }

    /// Time (ns) of the next rows.
    fn next(&mut self) -> Result<Option<i64>, ReplayError> {
        let mut first = None;
        for track in &mut self.tracks {
            first = [first, track.next()?].into_iter().flatten().min();
        }
        Ok(first)
    }

    /// Sends the rows from `next` (ns) to `time` (s), as far as they are read.
    fn deliver(&mut self, next: i64, time: f64) {
        let tracks = self.tracks.iter();
        let complete = tracks.map(|track| track.complete_before() - 1).min();
        #[expect(clippy::cast_possible_truncation, reason = "`as` ends at i64's ends")]
        let until = ((time * 1e9) as i64)
            .min(complete.unwrap_or(next))
            .max(next);
        for role in 0..self.tracks.len() {
            for chunk in self.tracks[role].take(until) {
                self.send(role, &chunk);
            }
        }
        self.time = seconds(until).min(self.plan.to);
        let patience = if self.patient {
            PATIENCE
        } else {
            Duration::ZERO
        };
        self.patient = self.viewers.wait_for_room(patience);
    }

    fn send(&mut self, role: usize, chunk: &rerun::log::Chunk) {
        match self.cast.rows(role, chunk).transpose() {
            Ok(Some(message)) => self.viewers.send(message),
            Ok(None) => {}
            // A chunk that was read can be written.
            Err(error) => tracing::error!("rows of {} are left out: {error}", chunk.entity_path()),
        }
    }

    fn obey(&mut self, command: Command) -> Result<End, ReplayError> {
        let wall = self.console.now();
        match command {
            Command::Quit => return Ok(End::Quit),
            Command::Pause => self.pace.set_paused(!self.pace.paused(), wall),
            Command::Faster => self.pace.set_speed(self.pace.speed() * FASTER, wall),
            Command::Slower => self.pace.set_speed(self.pace.speed() / FASTER, wall),
            Command::Step => {
                self.pace.set_paused(true, wall);
                if let Some(next) = self.next()? {
                    self.pace.set_time(seconds(next), wall);
                }
            }
        }
        Ok(End::Reached)
    }

    fn show(&mut self, done: bool) {
        self.console.show(ReplayProgress {
            time: self.time,
            speed: self.pace.speed(),
            paused: self.pace.paused(),
            done,
            dropped: self.viewers.dropped(),
        });
    }
}

#[cfg(test)]
mod tests;
