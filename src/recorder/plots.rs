//! The curves of a frame, its histogram and what it has to say.

use rerun::datatypes::TensorData;
use rerun::{BarChart, Color, EntityPath, RecordingStream, RecordingStreamResult};
use rerun::{Scalars, TextLog, TextLogLevel};

use super::entity;
use crate::frame::{Event, Frame, Header, Histogram, Level};

/// Colour of the histogram's bars.
const BARS: [u8; 3] = [86, 156, 230];

/// Plots one frame after another.
#[derive(Debug)]
pub(super) struct Plots {
    /// Where each series goes.
    series: Vec<EntityPath>,
}

impl Plots {
    /// Nothing plotted yet.
    pub(super) fn new(header: &Header) -> Self {
        let series = header.series.iter();
        Self {
            series: series.map(|series| entity::series(&series.path)).collect(),
        }
    }

    /// Plots a frame at the stream's present time.
    ///
    /// A value that isn't finite leaves a gap: no NaN is ever recorded.
    pub(super) fn log(&self, stream: &RecordingStream, frame: &Frame) -> RecordingStreamResult<()> {
        for (path, &value) in self.series.iter().zip(&frame.values) {
            if value.is_finite() {
                stream.log(path.clone(), &Scalars::single(value))?;
            }
        }
        if !frame.histogram.counts.is_empty() {
            stream.log(entity::HISTOGRAM, &bars(&frame.histogram))?;
        }
        for event in &frame.events {
            stream.log(entity::LOG, &line(event))?;
        }
        Ok(())
    }
}

/// Number of springs over strain in percent.
fn bars(histogram: &Histogram) -> BarChart {
    let percent = |n: usize| 100.0 * (histogram.first + n as f32 * histogram.width);
    let middles: Vec<f32> = (0..histogram.counts.len()).map(percent).collect();
    let width = 100.0 * histogram.width;
    BarChart::new(TensorData::from(histogram.counts.as_slice()))
        .with_abscissa(TensorData::from(middles))
        .with_widths(vec![width; histogram.counts.len()])
        .with_color(Color::from(BARS))
}

fn line(event: &Event) -> TextLog {
    let level = match event.level {
        Level::Info => TextLogLevel::INFO,
        Level::Warning => TextLogLevel::WARN,
        Level::Error => TextLogLevel::ERROR,
    };
    TextLog::new(event.text.as_str()).with_level(level)
}
