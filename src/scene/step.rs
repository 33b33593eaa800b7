//! The length of a step as a scene gives it.

use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// How long a step is: what `solver.dt` says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// `"auto"`: the program chooses, by scheme and forecast.
    Auto,
    /// A number (s).
    Seconds(f64),
}

const AUTO: &str = "auto";

impl FromStr for Step {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == AUTO {
            return Ok(Self::Auto);
        }
        let seconds = text.parse().map(Self::Seconds).ok();
        seconds.ok_or_else(|| format!("\"{text}\" is no step: use a number of seconds or \"auto\""))
    }
}

impl Serialize for Step {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Auto => serializer.serialize_str(AUTO),
            Self::Seconds(dt) => serializer.serialize_f64(*dt),
        }
    }
}

impl<'de> Deserialize<'de> for Step {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(StepVisitor)
    }
}

struct StepVisitor;

impl Visitor<'_> for StepVisitor {
    type Value = Step;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a number of seconds or \"{AUTO}\"")
    }

    fn visit_f64<E: Error>(self, dt: f64) -> Result<Step, E> {
        Ok(Step::Seconds(dt))
    }

    #[expect(clippy::cast_precision_loss, reason = "no step is 2⁵³ s long")]
    fn visit_i64<E: Error>(self, dt: i64) -> Result<Step, E> {
        Ok(Step::Seconds(dt as f64))
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Step, E> {
        // A quoted number is a slip, as everywhere else.
        if text == AUTO {
            Ok(Step::Auto)
        } else {
            Err(E::invalid_type(serde::de::Unexpected::Str(text), &self))
        }
    }
}
