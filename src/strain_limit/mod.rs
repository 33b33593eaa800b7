//! Strain limiting: a step of its own after integration that shortens what is stretched too far.

mod provot;

pub use provot::{Held, Hold, Limited, StrainLimit, Wall};
