//! The `f64` state in a recording, bit for bit.
//!
//! `/checkpoint/<cloth>` has one tensor `[particles, 6]` a checkpoint; `/checkpoint` says for the
//! same frame which step and time it is and which cloths belong to it, in their order. A
//! checkpoint of which something is missing, as at the end of a killed run, can thus be told.

use std::sync::Arc;

use rerun::datatypes::{TensorBuffer, TensorData};
use rerun::external::arrow::array::{Float64Array, StringArray, UInt8Array, UInt64Array};
use rerun::log::Chunk;
use rerun::{AnyValues, RecordingStream, RecordingStreamResult, Tensor};

use super::entity;
use crate::frame::Checkpoint;

const STEP: &str = "step";
const TIME: &str = "time";
const CLOTHS: &str = "cloths";
const LUGGAGE: &str = "luggage";
const HASH: &str = "hash";
/// Numbers a particle: x, y, z (m), vx, vy, vz (m/s).
const COLUMNS: usize = 6;

/// Records a checkpoint at the stream's present time.
pub(super) fn log(stream: &RecordingStream, checkpoint: &Checkpoint) -> RecordingStreamResult<()> {
    for cloth in &checkpoint.cloths {
        let tensor = Tensor::new(tensor_of(&cloth.particles));
        stream.log(entity::cloth_checkpoint(&cloth.name), &tensor)?;
    }
    let names = checkpoint.cloths.iter().map(|cloth| cloth.name.as_str());
    let names = StringArray::from_iter_values(names);
    let mark = AnyValues::default()
        .with_component_from_data(STEP, Arc::new(UInt64Array::from(vec![checkpoint.step])))
        .with_component_from_data(TIME, Arc::new(Float64Array::from(vec![checkpoint.time])))
        .with_component_from_data(CLOTHS, Arc::new(names))
        .with_component_from_data(
            LUGGAGE,
            Arc::new(UInt8Array::from(checkpoint.luggage.clone())),
        );
    stream.log(entity::CHECKPOINT, &mark)
}

/// Records what a branch started with: positions and velocities.
pub(super) fn log_start(stream: &RecordingStream, start: &Checkpoint) -> RecordingStreamResult<()> {
    for cloth in &start.cloths {
        let tensor = Tensor::new(tensor_of(&cloth.particles));
        stream.log_static(entity::cloth_start(&cloth.name), &tensor)?;
    }
    let time = Arc::new(Float64Array::from(vec![start.time]));
    let time = AnyValues::default().with_component_from_data(TIME, time);
    stream.log_static(entity::START, &time)
}

/// The time (s) that a chunk of `/start` has.
pub(crate) fn start_time(chunk: &Chunk) -> Option<f64> {
    chunk
        .iter_slices::<f64>(TIME.into())
        .next()?
        .first()
        .copied()
}

/// The particles that a chunk of `/start/<cloth>` has.
pub(crate) fn start_particles(chunk: &Chunk) -> Option<Vec<[f64; COLUMNS]>> {
    let data = Tensor::descriptor_data().component;
    let tensor = chunk
        .iter_component::<rerun::components::TensorData>(data)
        .next()?;
    rows_of(&tensor.as_slice().first()?.0.buffer)
}

fn rows_of(buffer: &TensorBuffer) -> Option<Vec<[f64; COLUMNS]>> {
    let TensorBuffer::F64(numbers) = buffer else {
        return None;
    };
    let (particles, rest) = numbers.as_chunks::<COLUMNS>();
    rest.is_empty().then(|| particles.to_vec())
}

/// One row a particle.
fn tensor_of(particles: &[[f64; COLUMNS]]) -> TensorData {
    let shape = vec![particles.len() as u64, COLUMNS as u64];
    TensorData::new(
        shape,
        TensorBuffer::F64(particles.as_flattened().to_vec().into()),
    )
    .with_dim_names(["particle", "x y z vx vy vz"])
}

/// What `/checkpoint` says of one checkpoint.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mark {
    /// Number of its frame.
    pub(crate) frame: i64,
    /// Steps done.
    pub(crate) step: u64,
    /// Simulated time (s).
    pub(crate) time: f64,
    /// Names of its cloths, in order.
    pub(crate) cloths: Vec<String>,
}

/// The checkpoints that a chunk of `/checkpoint` tells of.
pub(crate) fn marks(chunk: &Chunk) -> Vec<Mark> {
    let frames = chunk.iter_component_indices(entity::FRAME.into(), STEP.into());
    let steps = chunk.iter_slices::<u64>(STEP.into());
    let times = chunk.iter_slices::<f64>(TIME.into());
    let cloths = chunk.iter_slices::<String>(CLOTHS.into());
    let rows = frames.zip(steps).zip(times.zip(cloths));
    rows.filter_map(|(((frame, _), step), (time, cloths))| {
        Some(Mark {
            frame: frame.as_i64(),
            step: *step.first()?,
            time: *time.first()?,
            cloths: cloths.iter().map(|name| name.as_str().to_owned()).collect(),
        })
    })
    .collect()
}

/// What a chunk of `/checkpoint` has for `frame` that is carried over besides the state.
pub(crate) fn luggage(chunk: &Chunk, frame: i64) -> Option<Vec<u8>> {
    let frames = chunk.iter_component_indices(entity::FRAME.into(), LUGGAGE.into());
    let mut rows = frames.zip(chunk.iter_slices::<u8>(LUGGAGE.into()));
    let (_, bytes) = rows.find(|((at, _), _)| at.as_i64() == frame)?;
    Some(bytes.to_vec())
}

/// Number, time (ns) and hash of the state of each frame that a chunk of `/solver/state_hash` has.
pub(crate) fn hashes(chunk: &Chunk) -> Vec<(i64, i64, u64)> {
    let frames = chunk.iter_component_indices(entity::FRAME.into(), HASH.into());
    let times = chunk.iter_component_indices(entity::SIM_TIME.into(), HASH.into());
    let hashes = chunk.iter_slices::<u64>(HASH.into());
    let rows = frames.zip(times).zip(hashes);
    rows.filter_map(|(((frame, _), (time, _)), hash)| {
        Some((frame.as_i64(), time.as_i64(), *hash.first()?))
    })
    .collect()
}

/// Records a state's hash at the stream's present time.
pub(super) fn log_hash(stream: &RecordingStream, hash: u64) -> RecordingStreamResult<()> {
    let value = Arc::new(UInt64Array::from(vec![hash]));
    let values = AnyValues::default().with_component_from_data(HASH, value);
    stream.log(entity::path(&entity::STATE_HASH), &values)
}

/// The particles that a chunk of `/checkpoint/<cloth>` has for `frame`.
pub(crate) fn particles(chunk: &Chunk, frame: i64) -> Option<Vec<[f64; COLUMNS]>> {
    let data = Tensor::descriptor_data().component;
    let frames = chunk.iter_component_indices(entity::FRAME.into(), data);
    let tensors = chunk.iter_component::<rerun::components::TensorData>(data);
    let mut rows = frames.zip(tensors);
    let (_, tensor) = rows.find(|((at, _), _)| at.as_i64() == frame)?;
    rows_of(&tensor.as_slice().first()?.0.buffer)
}
