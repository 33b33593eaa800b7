//! A frame as a PLY file.

use super::body::{Body, bodies};
use crate::replay::{Layout, RecordedFrame};
use std::io::{self, Write};

/// Writes a frame as binary PLY: the vertices of all bodies with the colour of their strain and the
/// number of their body, whose names the head lists; their triangles, and the links of chains as edges.
///
/// # Errors
///
/// When `out` can't be written.
pub fn write_ply(layout: &Layout, frame: &RecordedFrame, out: &mut impl Write) -> io::Result<()> {
    let bodies: Vec<Body<'_>> = bodies(layout, frame).collect();
    write_head(frame, &bodies, out)?;
    for (number, body) in (0_u16..).zip(&bodies) {
        for (vertex, position) in body.positions.iter().enumerate() {
            for x in position {
                out.write_all(&x.to_le_bytes())?;
            }
            out.write_all(&body.color(vertex))?;
            out.write_all(&number.to_le_bytes())?;
        }
    }
    for (first, body) in offsets(&bodies) {
        for triangle in body.triangles {
            out.write_all(&[3])?;
            for vertex in triangle {
                out.write_all(&(first + vertex).to_le_bytes())?;
            }
        }
    }
    for (first, body) in offsets(&bodies) {
        for vertex in body.links().flatten() {
            out.write_all(&(first + vertex).to_le_bytes())?;
        }
    }
    Ok(())
}

fn write_head(frame: &RecordedFrame, bodies: &[Body<'_>], out: &mut impl Write) -> io::Result<()> {
    let RecordedFrame { index, time, .. } = frame;
    let vertices: usize = bodies.iter().map(|body| body.positions.len()).sum();
    let triangles: usize = bodies.iter().map(|body| body.triangles.len()).sum();
    let links: usize = bodies.iter().map(|body| body.links().count()).sum();
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    writeln!(
        out,
        "comment muslin: frame {index}, t = {time} s; lengths in m, y up; colour by strain"
    )?;
    for (number, body) in bodies.iter().enumerate() {
        let name = body.name.replace(char::is_control, "_");
        writeln!(out, "comment body {number} is {name}")?;
    }
    writeln!(out, "element vertex {vertices}")?;
    for property in ["float x", "float y", "float z"] {
        writeln!(out, "property {property}")?;
    }
    for property in ["uchar red", "uchar green", "uchar blue", "ushort body"] {
        writeln!(out, "property {property}")?;
    }
    writeln!(out, "element face {triangles}")?;
    writeln!(out, "property list uchar uint vertex_indices")?;
    if links > 0 {
        writeln!(out, "element edge {links}")?;
        writeln!(out, "property uint vertex1\nproperty uint vertex2")?;
    }
    writeln!(out, "end_header")
}

/// Each body with the number of its first vertex.
fn offsets<'a, 'b>(bodies: &'a [Body<'b>]) -> impl Iterator<Item = (u32, &'a Body<'b>)> {
    bodies.iter().scan(0, |next, body| {
        let first = *next;
        // A recording with 2³² vertices a frame doesn't fit into the machine's memory.
        *next += u32::try_from(body.positions.len()).unwrap_or(u32::MAX);
        Some((first, body))
    })
}

#[cfg(test)]
mod tests {
    use super::super::sample;
    use super::*;

    /// The head's lines, and what follows.
    fn split(file: &[u8]) -> (Vec<String>, &[u8]) {
        let end = b"end_header\n";
        let at = file.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        let head = std::str::from_utf8(&file[..at]).unwrap();
        (head.lines().map(str::to_owned).collect(), &file[at..])
    }

    /// Takes `N` bytes from the front.
    fn take<const N: usize>(bytes: &mut &[u8]) -> [u8; N] {
        let (front, rest) = bytes.split_first_chunk().unwrap();
        *bytes = rest;
        *front
    }

    fn count(head: &[String], element: &str) -> usize {
        let prefix = format!("element {element} ");
        let line = head.iter().find_map(|line| line.strip_prefix(&prefix));
        line.unwrap().parse().unwrap()
    }

    #[test]
    fn a_frame_comes_back_bit_for_bit() {
        let recording = sample::recording("ply", 8);
        let (layout, frames) = recording.read();
        let mut file = Vec::new();
        write_ply(&layout, &frames[3], &mut file).unwrap();
        let (head, mut bytes) = split(&file);
        assert_eq!(&head[..2], ["ply", "format binary_little_endian 1.0"]);
        for (number, name) in sample::NAMES.iter().enumerate() {
            let line = format!("comment body {number} is {name}");
            assert!(head.contains(&line), "no {line:?} in {head:?}");
        }
        let bodies: Vec<Body<'_>> = bodies(&layout, &frames[3]).collect();
        let mut vertices = 0;
        for (number, body) in (0_u16..).zip(&bodies) {
            for (v, position) in body.positions.iter().enumerate() {
                let found = [(); 3].map(|()| f32::from_le_bytes(take(&mut bytes)));
                assert_eq!(found, *position, "vertex {v} of {}", body.name);
                assert_eq!(
                    take(&mut bytes),
                    body.color(v),
                    "vertex {v} of {}",
                    body.name
                );
                assert_eq!(u16::from_le_bytes(take(&mut bytes)), number);
                vertices += 1;
            }
        }
        assert_eq!(vertices, count(&head, "vertex"));
        assert_eq!(bodies[0].color(1), [178, 24, 43], "stretched is red");
        for (first, body) in [(0, 0), (4, 1), (7, 2), (10, 3)] {
            for triangle in bodies[body].triangles {
                assert_eq!(take(&mut bytes), [3_u8]);
                let found = [(); 3].map(|()| u32::from_le_bytes(take(&mut bytes)));
                assert_eq!(found, triangle.map(|vertex| vertex + first));
            }
        }
        assert_eq!(count(&head, "face"), 4);
        for link in [[4_u32, 5], [5, 6]] {
            let found = [(); 2].map(|()| u32::from_le_bytes(take(&mut bytes)));
            assert_eq!(found, link);
        }
        assert_eq!(count(&head, "edge"), 2);
        assert!(bytes.is_empty(), "{} bytes too many", bytes.len());
    }
}
