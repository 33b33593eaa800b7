//! Turns each scheme's step until its error, or its cost, is where it should be.

use super::dial::{dial_of, longest, setting, start, usual_order, usual_price};
use super::{Measured, SPENT};
use crate::integrator::Integrator;
use crate::study::error::StudyError;
use crate::study::reference::cost;
use crate::study::{Distance, Outcome, Reference, Setting, Subject, digits};
use std::ops::RangeInclusive;
use std::time::Instant;

/// Share of a tolerance that an error may be at the most, beside the yardstick's own.
const MOST: f64 = 0.9;

/// Share of a tolerance below which a longer step is tried.
const LEAST: f64 = 0.4;

/// Share of the most that is aimed at.
const AIM: f64 = 0.72;

/// Share of a budget at which it counts as spent.
pub(super) const SATED: RangeInclusive<f64> = 0.8..=0.97;

/// Runs of a scheme at the most.
const RUNS: u32 = 6;

/// A step is turned by at most this at once: slopes change.
const TURN: RangeInclusive<f64> = 1.0 / 16.0..=4.0;

/// A run that is forecast to cost this many times as much as the best isn't begun.
const HOPELESS: f64 = 1.5;

/// The schemes' steps against the reference.
pub(super) struct Search<'s, 'a> {
    subject: &'s mut Subject<'a>,
    reference: &'s Reference,
    deadline: Instant,
    say: &'s mut dyn FnMut(String),
    /// What was run to its end.
    pub(super) measured: Vec<Measured>,
    /// What was begun.
    begun: Vec<Setting>,
}

/// How a run went.
enum Ran {
    Through(Measured),
    Diverged,
    /// And what a simulated second took until it was given up (s).
    TooSlow(f64),
}

impl<'s, 'a> Search<'s, 'a> {
    pub(super) fn new(
        subject: &'s mut Subject<'a>,
        reference: &'s Reference,
        deadline: Instant,
        say: &'s mut dyn FnMut(String),
    ) -> Self {
        Self {
            subject,
            reference,
            deadline,
            say,
            measured: Vec::new(),
            begun: Vec::new(),
        }
    }

    /// The cheapest setting whose error is at most a tolerance (m RMS): the reference's own at the worst.
    pub(super) fn within_tolerance(
        &mut self,
        schemes: &[Integrator],
        tolerance: f64,
    ) -> Result<Measured, StudyError> {
        if schemes.contains(&self.reference.setting.integrator) {
            self.measured.push(Measured {
                setting: self.reference.setting,
                error: super::worst(self.reference),
                seconds_per_second: self.reference.seconds_per_second,
            });
        }
        for (scheme, price) in self.by_cost(schemes)? {
            self.turn_to_tolerance(scheme, tolerance, price)?;
        }
        self.cheapest(self.most(tolerance)).ok_or_else(|| {
            StudyError::Ask(format!(
                "--tolerance {} mm: {}; choose another --integrator, or set --dt",
                digits(1000.0 * tolerance),
                self.least(|row| row.error)
            ))
        })
    }

    /// The most exact setting that a budget (wall time per simulated second) pays for.
    pub(super) fn within_budget(
        &mut self,
        schemes: &[Integrator],
        budget: f64,
    ) -> Result<Measured, StudyError> {
        for (scheme, price) in self.by_cost(schemes)? {
            self.turn_to_budget(scheme, budget, price)?;
        }
        let affordable = |row: &&Measured| row.seconds_per_second <= budget;
        let best = self.measured.iter().filter(affordable);
        let best = best.min_by(|a, b| a.error.total_cmp(&b.error)).copied();
        best.ok_or_else(|| {
            let ms = 1000.0 * budget / super::FRAMES;
            StudyError::Ask(format!(
                "--budget {} ms: no setting is as fast; {}; use larger cells, or a larger budget",
                digits(ms),
                self.least(|row| row.seconds_per_second)
            ))
        })
    }

    /// The largest error against the reference (m RMS) that is surely within a tolerance.
    fn most(&self, tolerance: f64) -> f64 {
        (MOST * tolerance).min(tolerance - super::worst(self.reference))
    }

    /// The cheapest row of at most an error (m RMS).
    fn cheapest(&self, error: f64) -> Option<Measured> {
        let rows = self.measured.iter().filter(|row| row.error <= error);
        let cost = |row: &&Measured| row.seconds_per_second;
        rows.min_by(|a, b| cost(a).total_cmp(&cost(b))).copied()
    }

    /// In words, the row that has least of something.
    fn least(&self, of: fn(&Measured) -> f64) -> String {
        let best = self.measured.iter().min_by(|a, b| of(a).total_cmp(&of(b)));
        best.map_or_else(
            || "no run came to its end in time".to_owned(),
            |row| {
                format!(
                    "the nearest is {} at {}, {} mm at {} ms a frame",
                    row.setting.series(),
                    row.setting.dial(),
                    digits(1000.0 * row.error),
                    digits(row.ms_per_frame())
                )
            },
        )
    }

    /// Schemes that can run here, and what a simulated second costs where their search begins by their
    /// first steps, the cheapest first: a good one early ends the runs of dearer ones.
    fn by_cost(&self, schemes: &[Integrator]) -> Result<Vec<(Integrator, f64)>, StudyError> {
        let mut all = Vec::new();
        for &scheme in schemes {
            if longest(self.subject, scheme) > 0.0 {
                let setting = setting(self.subject, scheme, start(self.subject, scheme));
                all.push((scheme, cost(self.subject, setting)? / self.subject.duration));
            }
        }
        all.sort_by(|a, b| a.1.total_cmp(&b.1));
        Ok(all)
    }

    fn turn_to_tolerance(
        &mut self,
        scheme: Integrator,
        tolerance: f64,
        price: f64,
    ) -> Result<(), StudyError> {
        let longest = longest(self.subject, scheme);
        let mut dial = self.competitive(scheme, price, tolerance);
        let (mut order, mut last) = (usual_order(scheme), None);
        for _ in 0..RUNS {
            let setting = setting(self.subject, scheme, dial);
            if self.begun.contains(&setting) || Instant::now() > self.deadline {
                break;
            }
            let best = self.cheapest(self.most(tolerance));
            let row = match self.run(setting, best.map(|row| row.seconds_per_second))? {
                Ran::Through(row) => row,
                Ran::Diverged => {
                    dial *= 0.5;
                    continue;
                }
                Ran::TooSlow(_) => break,
            };
            let at = dial_of(setting);
            let error = row.error.max(f64::MIN_POSITIVE);
            let may_grow = error < LEAST * tolerance && at < 0.8 * longest;
            if error <= self.most(tolerance) && !may_grow {
                break;
            }
            if let Some((other, its)) = last {
                order = slope((at, error), (other, its)).clamp(0.5, 4.0);
            }
            last = Some((at, error));
            let turn = (AIM * self.most(tolerance) / error).powf(1.0 / order);
            dial = (at * turn.clamp(*TURN.start(), *TURN.end())).min(longest);
            let price = row.seconds_per_second * (at / dial).powf(usual_price(scheme));
            if best.is_some_and(|best| price > HOPELESS * best.seconds_per_second) {
                break;
            }
        }
        Ok(())
    }

    /// Where a scheme's search begins: at a step that costs less than the best setting so far.
    fn competitive(&self, scheme: Integrator, price: f64, tolerance: f64) -> f64 {
        let start = start(self.subject, scheme);
        let Some(best) = self.cheapest(self.most(tolerance)) else {
            return start;
        };
        let lengthen = price / (SPENT * best.seconds_per_second);
        let dial = start * lengthen.powf(1.0 / usual_price(scheme)).max(1.0);
        dial.min(longest(self.subject, scheme))
    }

    fn turn_to_budget(
        &mut self,
        scheme: Integrator,
        budget: f64,
        price: f64,
    ) -> Result<(), StudyError> {
        let longest = longest(self.subject, scheme);
        let mut cost = price;
        let mut dial = start(self.subject, scheme);
        let (mut order, mut last) = (usual_price(scheme), None);
        for _ in 0..RUNS {
            dial = (dial * (cost / (SPENT * budget)).powf(1.0 / order)).min(longest);
            let setting = setting(self.subject, scheme, dial);
            if self.begun.contains(&setting) || Instant::now() > self.deadline {
                break;
            }
            match self.run(setting, Some(1.5 * budget))? {
                Ran::Through(row) => cost = row.seconds_per_second,
                Ran::TooSlow(so_far) => cost = so_far,
                Ran::Diverged => break,
            }
            dial = dial_of(setting);
            if SATED.contains(&(cost / budget)) || (cost <= budget && dial > 0.99 * longest) {
                break;
            }
            if let Some((other, its)) = last {
                order = (-slope((dial, cost), (other, its))).clamp(0.2, 1.2);
            }
            last = Some((dial, cost));
        }
        Ok(())
    }

    /// Runs a setting, for at most `limit` of wall time per simulated second.
    fn run(&mut self, setting: Setting, limit: Option<f64>) -> Result<Ran, StudyError> {
        let left = self.deadline.saturating_duration_since(Instant::now());
        let limit = limit.map_or(f64::INFINITY, |limit| limit * self.subject.duration);
        self.subject.patience = limit.min(left.as_secs_f64());
        self.begun.push(setting);
        let trial = self.subject.run(setting, &mut |_| {})?;
        let ran = match trial.outcome {
            Outcome::Stopped => return Err(StudyError::Stopped),
            Outcome::Diverged(_) => Ran::Diverged,
            Outcome::TooSlow => Ran::TooSlow(trial.seconds_per_second),
            Outcome::Completed => {
                let row = Measured {
                    setting,
                    error: Distance::worst(&trial.states, &self.reference.states).rms,
                    seconds_per_second: trial.seconds_per_second,
                };
                self.measured.push(row);
                Ran::Through(row)
            }
        };
        let result = match &ran {
            Ran::Through(row) => format!(
                "{} mm, {} ms a frame",
                digits(1000.0 * row.error),
                digits(row.ms_per_frame())
            ),
            Ran::Diverged => "diverged".to_owned(),
            Ran::TooSlow(_) => "too slow".to_owned(),
        };
        (self.say)(format!(
            "{} at {}: {result}",
            setting.series(),
            setting.dial()
        ));
        Ok(ran)
    }
}

/// Slope between two points in logarithms.
fn slope(a: (f64, f64), b: (f64, f64)) -> f64 {
    (a.1 / b.1).ln() / (a.0 / b.0).ln()
}
