//! The file's first chunk: what is where, as JSON.

use super::survey::{Mesh, Run, Segment, Survey, Vertices};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// Buffer views: what the second chunk holds, in its order.
const INDICES: usize = 0;
const VERTICES: usize = 1;
const KEYS: usize = 2;

/// Numbers that glTF has from OpenGL.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const LINES: u32 = 1;
const TRIANGLES: u32 = 4;

/// Colours of the recording's unstrained cloth and of its obstacles, in linear light.
const LINEN: [f32; 4] = [0.807, 0.768, 0.694, 1.0];
const GREY: [f32; 4] = [0.254, 0.271, 0.305, 1.0];

/// Writes the head, and adds the keys of its animation to the survey.
pub(super) fn document(survey: &mut Survey) -> Value {
    let mut head = Head::default();
    for mesh in &survey.resting {
        head.mesh(mesh, &mesh.name, None);
    }
    // The survey's keys grow while its segments are read.
    let segments = std::mem::take(&mut survey.segments);
    for (number, segment) in segments.iter().enumerate() {
        head.segment(survey, segment, number, segments.len());
    }
    survey.segments = segments;
    head.finish(survey)
}

/// The lists of the document.
#[derive(Default)]
struct Head {
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    nodes: Vec<Value>,
    samplers: Vec<Value>,
    channels: Vec<Value>,
    /// Accessors of indices by their offset: the segments of a body share them.
    indices: BTreeMap<u64, usize>,
    /// Accessors of weights by the number of targets.
    weights: BTreeMap<usize, usize>,
}

impl Head {
    /// A row of morph targets: its meshes, their weights, and when they are seen.
    fn segment(&mut self, survey: &mut Survey, segment: &Segment, number: usize, all: usize) {
        let hidden = (number > 0).then_some([0.0; 3]);
        let first = self.nodes.len();
        for mesh in &segment.meshes {
            let name = match all {
                1 => mesh.name.clone(),
                _ => format!("{} {} of {all}", mesh.name, number + 1),
            };
            self.mesh(mesh, &name, hidden);
        }
        if segment.times.is_empty() {
            return;
        }
        let nodes = first..self.nodes.len();
        let times = self.times(survey, &segment.times);
        let weights = self.weights(survey, segment.times.len() - 1);
        self.channels(nodes.clone(), "weights", "LINEAR", [times, weights]);
        if all > 1 {
            let (times, scales) = visibility(segment, number, all);
            let times = self.times(survey, &times);
            let scales = survey.add_keys(scales.as_flattened(), 3);
            let scales = self.floats(scales, "VEC3");
            self.channels(nodes, "scale", "STEP", [times, scales]);
        }
    }

    /// Animates a property of nodes by keys at times.
    fn channels(
        &mut self,
        nodes: std::ops::Range<usize>,
        path: &str,
        interpolation: &str,
        [input, output]: [usize; 2],
    ) {
        let sampler = push(
            &mut self.samplers,
            json!({"input": input, "output": output, "interpolation": interpolation}),
        );
        for node in nodes {
            let target = json!({"node": node, "path": path});
            self.channels
                .push(json!({"sampler": sampler, "target": target}));
        }
    }

    /// A mesh and its node.
    fn mesh(&mut self, mesh: &Mesh, name: &str, scale: Option<[f32; 3]>) {
        let indices = match self.indices.get(&mesh.indices.offset) {
            Some(&known) => known,
            None => {
                let accessor = accessor(INDICES, UNSIGNED_INT, mesh.indices, "SCALAR");
                let new = push(&mut self.accessors, accessor);
                self.indices.insert(mesh.indices.offset, new);
                new
            }
        };
        let mut primitive = json!({
            "attributes": self.attributes(&mesh.base),
            "indices": indices,
            "material": self.material(mesh.is_cloth),
            "mode": if mesh.is_chain { LINES } else { TRIANGLES },
        });
        if !mesh.targets.is_empty() {
            let targets = mesh.targets.iter().map(|target| self.attributes(target));
            primitive["targets"] = targets.collect();
        }
        let mesh = json!({"name": name, "primitives": [primitive]});
        let mesh = push(&mut self.meshes, mesh);
        let mut node = json!({"name": name, "mesh": mesh});
        if let Some(scale) = scale {
            node["scale"] = json!(scale);
        }
        self.nodes.push(node);
    }

    /// The material of cloths or of obstacles; one that nothing has is none of the file.
    fn material(&mut self, is_cloth: bool) -> usize {
        let (name, color) = match is_cloth {
            true => ("cloth", LINEN),
            false => ("obstacle", GREY),
        };
        let known = self
            .materials
            .iter()
            .position(|known| known["name"] == name);
        known.unwrap_or_else(|| push(&mut self.materials, material(name, color)))
    }

    fn attributes(&mut self, vertices: &Vertices) -> Value {
        let mut positions = accessor(VERTICES, FLOAT, vertices.positions, "VEC3");
        positions["min"] = json!(vertices.least);
        positions["max"] = json!(vertices.greatest);
        let mut attributes = Map::new();
        let positions = push(&mut self.accessors, positions);
        attributes.insert("POSITION".to_owned(), json!(positions));
        if let Some(normals) = vertices.normals {
            let normals = accessor(VERTICES, FLOAT, normals, "VEC3");
            let normals = push(&mut self.accessors, normals);
            attributes.insert("NORMAL".to_owned(), json!(normals));
        }
        attributes.into()
    }

    fn times(&mut self, survey: &mut Survey, times: &[f32]) -> usize {
        let run = survey.add_keys(times, 1);
        let mut accessor = accessor(KEYS, FLOAT, run, "SCALAR");
        accessor["min"] = json!(times.first().as_slice());
        accessor["max"] = json!(times.last().as_slice());
        push(&mut self.accessors, accessor)
    }

    fn floats(&mut self, run: Run, kind: &str) -> usize {
        push(&mut self.accessors, accessor(KEYS, FLOAT, run, kind))
    }

    /// Weights of so many targets at one time more: none is up at first, then one after the other.
    fn weights(&mut self, survey: &mut Survey, targets: usize) -> usize {
        if let Some(&known) = self.weights.get(&targets) {
            return known;
        }
        let mut weights = vec![0.0; (targets + 1) * targets];
        for target in 0..targets {
            weights[(target + 1) * targets + target] = 1.0;
        }
        let run = survey.add_keys(&weights, 1);
        let new = self.floats(run, "SCALAR");
        self.weights.insert(targets, new);
        new
    }

    fn finish(self, survey: &Survey) -> Value {
        let lengths = [
            4 * survey.indices.len() as u64,
            survey.vertex_bytes,
            4 * survey.keys.len() as u64,
        ];
        let mut views = Vec::new();
        let mut offset = 0;
        for length in lengths.into_iter().filter(|length| *length > 0) {
            views.push(json!({"buffer": 0, "byteOffset": offset, "byteLength": length}));
            offset += length;
        }
        views[INDICES]["target"] = json!(ELEMENT_ARRAY_BUFFER);
        views[VERTICES]["target"] = json!(ARRAY_BUFFER);
        views[VERTICES]["byteStride"] = json!(size_of::<[f32; 3]>());
        let nodes: Vec<usize> = (0..self.nodes.len()).collect();
        let mut document = json!({
            "asset": {
                "version": "2.0",
                "generator": concat!("muslin ", env!("CARGO_PKG_VERSION")),
                "extras": {"first_s": survey.span.first, "last_s": survey.span.last},
            },
            "scene": 0,
            "scenes": [{"nodes": nodes}],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": views,
            "buffers": [{"byteLength": offset}],
        });
        if !self.channels.is_empty() {
            let animation = json!({
                "name": "recording", "channels": self.channels, "samplers": self.samplers
            });
            document["animations"] = json!([animation]);
        }
        document
    }
}

/// Times and scales by which a segment is there from its first time to its last: the first and the last
/// segment before and after it, too.
fn visibility(segment: &Segment, number: usize, all: usize) -> (Vec<f32>, Vec<[f32; 3]>) {
    let (mut times, mut scales) = (vec![0.0], vec![[1.0; 3]]);
    if number > 0 {
        times.extend(segment.times.first());
        scales.insert(0, [0.0; 3]);
    }
    if number + 1 < all {
        times.extend(segment.times.last());
        scales.push([0.0; 3]);
    }
    (times, scales)
}

/// A dull one, seen from both sides.
fn material(name: &str, color: [f32; 4]) -> Value {
    json!({
        "name": name,
        "doubleSided": true,
        "pbrMetallicRoughness": {
            "baseColorFactor": color, "metallicFactor": 0.0, "roughnessFactor": 0.9
        },
    })
}

fn accessor(view: usize, component: u32, run: Run, kind: &str) -> Value {
    json!({
        "bufferView": view,
        "byteOffset": run.offset,
        "componentType": component,
        "count": run.count,
        "type": kind,
    })
}

/// Adds an entry and says its number.
fn push(list: &mut Vec<Value>, entry: Value) -> usize {
    list.push(entry);
    list.len() - 1
}
