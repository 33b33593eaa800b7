//! Which simulated time belongs to which wall time.

use std::time::Duration;

/// How far a replay is: a clock that runs at some speed, or stands still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Simulated seconds in a second.
    speed: f64,
    /// It stood at `time` (s) when the wall clock was at `wall`.
    time: f64,
    wall: Duration,
    paused: bool,
}

impl Pace {
    /// A clock that starts at `time` (s).
    pub fn new(time: f64, speed: f64, wall: Duration) -> Self {
        Self {
            speed,
            time,
            wall,
            paused: false,
        }
    }

    /// Simulated time (s).
    pub fn time(&self, wall: Duration) -> f64 {
        if self.paused {
            return self.time;
        }
        self.time + self.speed * wall.saturating_sub(self.wall).as_secs_f64()
    }

    /// Wall time until it is `time` (s); `None` when it stands still, or for longer than anyone waits.
    pub fn until(&self, time: f64, wall: Duration) -> Option<Duration> {
        let left = (time - self.time(wall)) / self.speed;
        (!self.paused).then(|| Duration::try_from_secs_f64(left.max(0.0)).ok())?
    }

    /// Simulated seconds in a second.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Does it stand still?
    pub fn paused(&self) -> bool {
        self.paused
    }

    /// Goes on at another speed.
    pub fn set_speed(&mut self, speed: f64, wall: Duration) {
        self.set_time(self.time(wall), wall);
        self.speed = speed;
    }

    /// Stands still, or goes on.
    pub fn set_paused(&mut self, paused: bool, wall: Duration) {
        self.set_time(self.time(wall), wall);
        self.paused = paused;
    }

    /// Goes to a time (s).
    pub fn set_time(&mut self, time: f64, wall: Duration) {
        (self.time, self.wall) = (time, wall);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall(seconds: f64) -> Duration {
        Duration::from_secs_f64(seconds)
    }

    #[test]
    fn time_runs_at_its_speed_and_never_jumps_by_a_change_of_it() {
        let mut pace = Pace::new(10.0, 0.5, wall(3.0));
        assert_eq!(pace.time(wall(3.0)), 10.0);
        assert_eq!(pace.time(wall(5.0)), 11.0);
        assert_eq!(pace.time(wall(1.0)), 10.0, "before it began");
        assert_eq!(pace.until(12.0, wall(5.0)), Some(wall(2.0)));
        assert_eq!(pace.until(7.0, wall(5.0)), Some(wall(0.0)));
        pace.set_speed(4.0, wall(5.0));
        assert_eq!(pace.time(wall(5.0)), 11.0);
        assert_eq!(pace.time(wall(6.0)), 15.0);
    }

    #[test]
    fn a_pause_takes_no_time() {
        let mut pace = Pace::new(0.0, 2.0, wall(0.0));
        pace.set_paused(true, wall(1.0));
        assert_eq!(pace.time(wall(100.0)), 2.0);
        assert_eq!(pace.until(3.0, wall(50.0)), None);
        pace.set_time(2.5, wall(60.0));
        pace.set_speed(1.0, wall(61.0));
        pace.set_paused(false, wall(100.0));
        assert_eq!(pace.time(wall(100.0)), 2.5);
        assert_eq!(pace.time(wall(101.0)), 3.5);
    }

    #[test]
    fn speeds_beyond_measure_are_no_trouble() {
        let fast = Pace::new(0.0, 1e300, wall(0.0));
        assert_eq!(fast.until(1.0, wall(0.0)), Some(Duration::ZERO));
        assert!(fast.time(wall(1e9)) >= 1e300);
        let slow = Pace::new(0.0, 1e-300, wall(0.0));
        assert_eq!(slow.until(1.0, wall(0.0)), None);
        assert!(slow.time(wall(1e9)) < 1e-200);
    }
}
