//! A file read back by the specification, with none of the code that wrote it.

use super::*;
use crate::export::body::bodies;
use crate::export::sample::{self, Recording};
use crate::replay::{At, RecordedFrame};
use serde_json::Value;
use std::num::NonZeroU64;

/// A file taken apart.
struct File {
    json: Value,
    binary: Vec<u8>,
}

fn every(n: u64) -> Selection {
    Selection::Every(NonZeroU64::new(n).unwrap())
}

fn export(recording: &Recording, selection: Selection) -> File {
    let animation = Animation::survey(&recording.path, selection).unwrap();
    let mut bytes = Vec::new();
    animation.write(&mut bytes).unwrap();
    assert_eq!(bytes.len() as u64, animation.bytes());
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(&bytes[..4], b"glTF");
    assert_eq!((word(4), word(8)), (2, bytes.len()));
    assert_eq!(&bytes[16..20], b"JSON");
    let binary = 20 + word(12);
    assert!(binary.is_multiple_of(4));
    assert_eq!(&bytes[binary + 4..binary + 8], b"BIN\0");
    assert_eq!(word(binary), bytes.len() - binary - 8);
    File {
        json: serde_json::from_slice(&bytes[20..binary]).unwrap(),
        binary: bytes[binary + 8..].to_vec(),
    }
}

fn number(value: &Value) -> usize {
    value.as_u64().unwrap_or_else(|| panic!("{value}")) as usize
}

impl File {
    /// The four-byte words of an accessor, `width` an entry.
    fn words(&self, accessor: &Value) -> Vec<Vec<[u8; 4]>> {
        let accessor = &self.json["accessors"][number(accessor)];
        let view = &self.json["bufferViews"][number(&accessor["bufferView"])];
        let width = if accessor["type"] == "VEC3" { 3 } else { 1 };
        let bytes = 4 * width * number(&accessor["count"]);
        let offset = number(&accessor["byteOffset"]);
        assert!(offset + bytes <= number(&view["byteLength"]), "{accessor}");
        let at = number(&view["byteOffset"]) + offset;
        let (words, rest) = self.binary[at..at + bytes].as_chunks();
        assert!(rest.is_empty());
        words.chunks(width).map(<[_]>::to_vec).collect()
    }

    fn vectors(&self, accessor: &Value) -> Vec<[f32; 3]> {
        let words = self.words(accessor).into_iter();
        let vector = |words: Vec<[u8; 4]>| words.into_iter().map(f32::from_le_bytes).collect();
        words
            .map(|words| -> [f32; 3] {
                let vector: Vec<f32> = vector(words);
                vector.try_into().unwrap()
            })
            .collect()
    }

    fn floats(&self, accessor: &Value) -> Vec<f32> {
        let words = self.words(accessor).into_iter().flatten();
        words.map(f32::from_le_bytes).collect()
    }

    fn indices(&self, accessor: &Value) -> Vec<u32> {
        let words = self.words(accessor).into_iter().flatten();
        words.map(u32::from_le_bytes).collect()
    }

    /// Keys and values by which a property of a node is moved.
    fn keys(&self, node: usize, path: &str) -> Option<(Vec<f32>, Vec<f32>, String)> {
        let animation = &self.json["animations"][0];
        let channels = animation["channels"].as_array()?.iter();
        let mut own = channels
            .filter(|c| number(&c["target"]["node"]) == node && c["target"]["path"] == path);
        let sampler = &animation["samplers"][number(&own.next()?["sampler"])];
        assert!(own.next().is_none(), "two channels for one {path}");
        Some((
            self.floats(&sampler["input"]),
            self.floats(&sampler["output"]),
            sampler["interpolation"].as_str().unwrap().to_owned(),
        ))
    }

    /// The values of `width` numbers at a time, as the specification wants it.
    fn sample(&self, node: usize, path: &str, width: usize, time: f32) -> Option<Vec<f32>> {
        let (times, values, interpolation) = self.keys(node, path)?;
        assert!(times.is_sorted_by(|a, b| a < b), "{times:?}");
        assert_eq!(values.len(), times.len() * width);
        let value = |key: usize| values[key * width..][..width].to_vec();
        let after = times.iter().position(|&key| key > time);
        Some(match after {
            Some(0) => value(0),
            None => value(times.len() - 1),
            Some(key) if interpolation == "STEP" => value(key - 1),
            Some(key) => {
                let part = (time - times[key - 1]) / (times[key] - times[key - 1]);
                let pairs = value(key - 1).into_iter().zip(value(key));
                pairs.map(|(a, b)| a + part * (b - a)).collect()
            }
        })
    }

    /// A morphed attribute of a mesh with weights of its targets.
    fn morphed(&self, primitive: &Value, attribute: &str, weights: &[f32]) -> Vec<[f32; 3]> {
        let mut sum = self.vectors(&primitive["attributes"][attribute]);
        for (&weight, target) in weights.iter().zip(primitive["targets"].as_array().unwrap()) {
            for (sum, moved) in sum.iter_mut().zip(self.vectors(&target[attribute])) {
                for axis in 0..3 {
                    sum[axis] += weight * moved[axis];
                }
            }
        }
        sum
    }

    /// Name, positions, normals and indices of each mesh that is seen at a time.
    fn seen(&self, time: f32) -> Vec<Seen> {
        let mut all = Vec::new();
        for (n, node) in self.json["nodes"].as_array().unwrap().iter().enumerate() {
            if self
                .sample(n, "scale", 3, time)
                .is_some_and(|s| s == [0.0; 3])
            {
                continue;
            }
            let mesh = &self.json["meshes"][number(&node["mesh"])];
            let primitive = &mesh["primitives"][0];
            let targets = primitive["targets"].as_array().map_or(0, Vec::len);
            let weights = self.sample(n, "weights", targets, time);
            assert_eq!(weights.is_some(), targets > 0, "{node}");
            let weights = weights.unwrap_or_default();
            let of = |attribute| match primitive["targets"].is_null() {
                true => self.vectors(&primitive["attributes"][attribute]),
                false => self.morphed(primitive, attribute, &weights),
            };
            let has_normals = !primitive["attributes"]["NORMAL"].is_null();
            all.push(Seen {
                name: node["name"].as_str().unwrap().to_owned(),
                positions: of("POSITION"),
                normals: has_normals.then(|| of("NORMAL")),
                indices: self.indices(&primitive["indices"]),
                mode: number(&primitive["mode"]),
            });
        }
        all
    }
}

/// A mesh at a time.
struct Seen {
    name: String,
    positions: Vec<[f32; 3]>,
    normals: Option<Vec<[f32; 3]>>,
    indices: Vec<u32>,
    mode: usize,
}

/// Largest difference of a coordinate.
fn apart(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    assert_eq!(a.len(), b.len());
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// What is seen at a frame's time is what was recorded, to the rounding of one difference and one sum.
fn shows(file: &File, time: f32, layout: &Layout, frame: &RecordedFrame) {
    let seen = file.seen(time);
    assert_eq!(seen.len(), sample::NAMES.len(), "at {time} s");
    for body in bodies(layout, frame) {
        let own = |seen: &&Seen| seen.name.starts_with(body.name);
        let seen = seen.iter().find(own).unwrap();
        let size = body
            .positions
            .as_flattened()
            .iter()
            .fold(0.0, |m: f32, x| m.max(x.abs()));
        // The size of the difference is at most twice that of the first frame here.
        let off = apart(&seen.positions, body.positions);
        let allowed = 4.0 * f32::EPSILON * size.max(1.0);
        assert!(off <= allowed, "{} is {off} m off at {time} s", body.name);
        let links: Vec<u32> = body.links().flatten().collect();
        if links.is_empty() {
            let normals = smooth(body.positions, body.triangles);
            let off = apart(seen.normals.as_ref().unwrap(), &normals);
            assert!(off < 1e-6, "normals of {} are {off} off", body.name);
            assert_eq!(seen.indices, body.triangles.as_flattened());
            assert_eq!(seen.mode, 4);
        } else {
            assert_eq!((&seen.indices, seen.mode), (&links, 1));
            assert!(seen.normals.is_none());
        }
    }
}

#[test]
fn each_frame_comes_back_at_its_time() {
    let recording = sample::recording("glb", 8);
    let (layout, frames) = recording.read();
    for step in [1, 3] {
        let file = export(&recording, every(step));
        for frame in frames.iter().step_by(step as usize) {
            shows(&file, frame.time as f32, &layout, frame);
        }
        shows(
            &file,
            99.0,
            &layout,
            frames.iter().step_by(step as usize).next_back().unwrap(),
        );
    }
}

#[test]
fn between_two_frames_is_the_line_between_them() {
    let recording = sample::recording("glb-between", 4);
    let (layout, frames) = recording.read();
    let file = export(&recording, every(1));
    let seen = file.seen(0.125);
    let of = |frame| bodies(&layout, frame).next().unwrap().positions.to_vec();
    let (a, b) = (of(&frames[1]), of(&frames[2]));
    let quarter = a.iter().zip(&b);
    let quarter: Vec<[f32; 3]> = quarter
        .map(|(a, b)| std::array::from_fn(|axis| 0.75 * a[axis] + 0.25 * b[axis]))
        .collect();
    let sheet = seen
        .iter()
        .find(|seen| seen.name == sample::NAMES[0])
        .unwrap();
    let off = apart(&sheet.positions, &quarter);
    assert!(off < 1e-6, "{off} m off");
}

#[test]
fn a_long_recording_is_several_meshes_of_few_targets() {
    let count = 2 * TARGETS as u16;
    // The last frame is the last target of a mesh, the only one of another, or the second.
    for frames in [count + 1, count + 2, count + 3] {
        let recording = sample::recording(&format!("glb-long-{frames}"), frames);
        let (layout, recorded) = recording.read();
        let file = export(&recording, every(1));
        let meshes = file.json["meshes"].as_array().unwrap();
        let targets = |mesh: &Value| {
            mesh["primitives"][0]["targets"]
                .as_array()
                .map_or(0, Vec::len)
        };
        assert!(meshes.iter().all(|mesh| targets(mesh) <= TARGETS));
        let segments = usize::from(frames - 1).div_ceil(TARGETS);
        assert_eq!(meshes.len(), 1 + 3 * segments, "{frames} frames");
        for k in (0..usize::from(frames))
            .step_by(50)
            .chain([199, 200, 201, 399, 400])
        {
            shows(&file, recorded[k].time as f32, &layout, &recorded[k]);
        }
        let last = recorded.last().unwrap();
        shows(&file, last.time as f32, &layout, last);
    }
}

#[test]
fn one_frame_stands_still() {
    let recording = sample::recording("glb-one", 8);
    let (layout, frames) = recording.read();
    let file = export(&recording, Selection::At(At::Time(0.35)));
    assert!(file.json["animations"].is_null());
    shows(&file, 0.0, &layout, &frames[3]);
}

/// Bounds are those of the values, and each byte belongs to one accessor.
#[test]
fn accessors_say_what_is_there() {
    let recording = sample::recording("glb-accessors", 8);
    let file = export(&recording, every(1));
    let accessors = file.json["accessors"].as_array().unwrap();
    let (mut bytes, mut bounded) = (0, 0);
    for (a, accessor) in accessors.iter().enumerate() {
        let words = file.words(&a.into());
        bytes += words.as_flattened_len();
        if accessor["componentType"] != 5126 || accessor["min"].is_null() {
            continue;
        }
        bounded += 1;
        for axis in 0..words[0].len() {
            let values = words.iter().map(|words| f32::from_le_bytes(words[axis]));
            let (least, greatest) = values.fold((f32::MAX, f32::MIN), |(least, greatest), x| {
                (least.min(x), greatest.max(x))
            });
            // serde_json reads the last bit of an f64 wrongly, which an f32 doesn't notice.
            let said = |bound: &str| accessor[bound][axis].as_f64().unwrap() as f32;
            assert_eq!(said("min"), least, "{accessor}");
            assert_eq!(said("max"), greatest, "{accessor}");
        }
    }
    assert_eq!(bytes, file.binary.len(), "bytes without a use");
    // Four bodies of which three have seven targets, and the times.
    assert_eq!(bounded, 4 + 3 * 7 + 1);
    let views = file.json["bufferViews"].as_array().unwrap();
    let lengths = views.iter().map(|view| number(&view["byteLength"]));
    assert_eq!(lengths.sum::<usize>(), file.binary.len());
}

/// Bytes of the words.
trait Length {
    fn as_flattened_len(&self) -> usize;
}

impl Length for Vec<Vec<[u8; 4]>> {
    fn as_flattened_len(&self) -> usize {
        self.iter().map(|words| size_of_val(words.as_slice())).sum()
    }
}

#[test]
fn a_recording_that_lost_frames_in_between_is_refused() {
    let recording = sample::recording("glb-changed", 8);
    let animation = Animation::survey(&recording.path, every(1)).unwrap();
    let shorter = sample::recording("glb-shorter", 7);
    std::fs::copy(&shorter.path, &recording.path).unwrap();
    let error = animation.write(&mut Vec::new()).unwrap_err();
    assert!(matches!(error, ExportError::Changed { .. }), "{error}");
    // One that went on gives the frames that it had.
    let longer = sample::recording("glb-longer", 9);
    std::fs::copy(&longer.path, &recording.path).unwrap();
    animation.write(&mut Vec::new()).unwrap();
}
