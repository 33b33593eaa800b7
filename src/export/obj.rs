//! A frame as an OBJ file.

use super::body::bodies;
use crate::replay::{Layout, RecordedFrame};
use std::io::{self, Write};

/// Writes a frame: an object for each cloth, then for each obstacle; a chain as lines.
///
/// Numbers have as few digits as give back the same `f32`.
///
/// # Errors
///
/// When `out` can't be written.
pub fn write_obj(layout: &Layout, frame: &RecordedFrame, out: &mut impl Write) -> io::Result<()> {
    let RecordedFrame { index, time, .. } = frame;
    writeln!(
        out,
        "# muslin: frame {index}, t = {time} s; lengths in m, y up"
    )?;
    let mut first = 1;
    for body in bodies(layout, frame) {
        let name = body.name.replace(char::is_control, "_");
        writeln!(out, "o {name}")?;
        for [x, y, z] in body.positions {
            writeln!(out, "v {x:?} {y:?} {z:?}")?;
        }
        for triangle in body.triangles {
            let [a, b, c] = triangle.map(|vertex| first + u64::from(vertex));
            writeln!(out, "f {a} {b} {c}")?;
        }
        for link in body.links() {
            let [a, b] = link.map(|vertex| first + u64::from(vertex));
            writeln!(out, "l {a} {b}")?;
        }
        first += body.positions.len() as u64;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::body::Body;
    use super::super::sample;
    use super::*;

    /// Objects by name: positions, triangles and lines, counted from the object's first vertex.
    type Object = (String, Vec<[f32; 3]>, Vec<[u32; 3]>, Vec<[u32; 2]>);

    fn parse(text: &str) -> Vec<Object> {
        let mut objects: Vec<Object> = Vec::new();
        let mut first = 1;
        for line in text.lines() {
            let (word, rest) = line.split_once(' ').unwrap();
            let numbers = || rest.split(' ').map(|n| n.parse::<u32>().unwrap() - first);
            let object = objects.last_mut();
            match word {
                "#" => assert!(line.contains("t = 0.3 s; lengths in m"), "{line}"),
                "o" => {
                    first += object.map_or(0, |o| o.1.len() as u32);
                    objects.push((rest.to_owned(), vec![], vec![], vec![]));
                }
                "v" => {
                    let position: Vec<f32> = rest.split(' ').map(|n| n.parse().unwrap()).collect();
                    object.unwrap().1.push(position.try_into().unwrap());
                }
                "f" => {
                    let triangle: Vec<u32> = numbers().collect();
                    object.unwrap().2.push(triangle.try_into().unwrap());
                }
                "l" => {
                    let link: Vec<u32> = numbers().collect();
                    object.unwrap().3.push(link.try_into().unwrap());
                }
                _ => panic!("{line}"),
            }
        }
        objects
    }

    #[test]
    fn a_frame_comes_back_bit_for_bit() {
        let recording = sample::recording("obj", 8);
        let (layout, frames) = recording.read();
        let mut text = Vec::new();
        write_obj(&layout, &frames[3], &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let of = |body: Body<'_>| {
            let links = body.links().collect();
            let positions = body.positions.to_vec();
            (
                body.name.to_owned(),
                positions,
                body.triangles.to_vec(),
                links,
            )
        };
        let expected: Vec<Object> = bodies(&layout, &frames[3]).map(of).collect();
        let found = parse(&text);
        assert_eq!(found, expected);
        let names: Vec<&str> = found.iter().map(|object| object.0.as_str()).collect();
        assert_eq!(names, sample::NAMES, "cloths come first");
        assert_eq!(found[1].3, [[0, 1], [1, 2]], "the chain's links");
        // The reader of other people's files takes it, too; it wants no lines.
        let (mesh, repairs) = crate::mesh::read_obj(&text, 1.0).unwrap();
        assert_eq!(mesh.triangles.len(), 2 + 1 + 1, "{repairs:?}");
    }
}
