//! A poncho for the mannequin: a bell around trunk and arms, hung from the shoulders.
//!
//! Ellipses around the neck's axis, whose half axes grow downwards, make up the surface. Rings lie at equal
//! shares of the way from neck to hem; each has as many vertices as its length asks for, and triangles fill
//! the strips between them, so that all are about as long as wide.

use super::TriMesh;
use glam::DVec3;
use std::f64::consts::TAU;

/// Length of an edge (m): gives about 5,500 triangles.
const EDGE: f64 = 0.025;

/// Heights (m) and half widths to the sides and to front and back (m), from the neck opening to the hem,
/// which is half-way down the thighs. The arms, which hang 22° from the vertical, are inside.
#[rustfmt::skip]
const OUTLINE: [[f64; 3]; 11] = [
    [1.512, 0.095, 0.085], [1.495, 0.130, 0.096], [1.475, 0.170, 0.110], [1.450, 0.215, 0.125],
    [1.420, 0.245, 0.135], [1.360, 0.270, 0.150], [1.300, 0.292, 0.160], [1.100, 0.365, 0.180],
    [0.900, 0.435, 0.205], [0.800, 0.468, 0.220], [0.660, 0.515, 0.240],
];

/// Heights over which the outline is smoothed (m), up and down.
const SMOOTHED: f64 = 0.02;

/// Steps along a line from neck to hem, and around a ring, in which lengths are measured.
const DOWN: u32 = 600;
const AROUND: u32 = 720;

/// The poncho, as it is put on the standing mannequin: open at neck and hem, triangles counter-clockwise seen
/// from outside.
///
/// The same bits every time.
pub fn poncho() -> TriMesh {
    let lines: Vec<Vec<DVec3>> = (0..AROUND)
        .map(|k| line(TAU * f64::from(k) / f64::from(AROUND)))
        .collect();
    let rows = whole(
        lines.iter().map(|line| length(line)).sum::<f64>() / f64::from(AROUND),
        EDGE * 0.866,
    );
    let mut mesh = TriMesh::default();
    let mut above = Vec::new();
    for row in 0..=rows {
        let share = f64::from(row) / f64::from(rows);
        let mut ring: Vec<DVec3> = lines.iter().map(|line| along(line, share)).collect();
        ring.push(ring[0]);
        let count = whole(length(&ring), EDGE);
        let first = mesh.positions.len();
        for k in 0..count {
            // Every other ring begins half an edge further.
            let shift = if row % 2 == 1 { 0.5 } else { 0.0 };
            let point = along(&ring, (f64::from(k) + shift) / f64::from(count));
            mesh.positions.push(point);
        }
        let below: Vec<usize> = (first..mesh.positions.len()).collect();
        strip(&mut mesh, &above, &below);
        above = below;
    }
    mesh
}

/// The nearest whole number of pieces (m) in a length (m).
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "some hundred at most, and positive"
)]
fn whole(length: f64, piece: f64) -> u32 {
    (length / piece).round() as u32
}

/// Half axes at a height (m).
fn half_axes(height: f64) -> [f64; 2] {
    let at = |height: f64| {
        let last = OUTLINE.len() - 2;
        let below = OUTLINE[1..].iter().position(|row| row[0] <= height);
        let [from, to] = [0, 1].map(|k| OUTLINE[below.unwrap_or(last) + k]);
        let share = (height - from[0]) / (to[0] - from[0]);
        [1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]))
    };
    let [low, mid, high] = [-SMOOTHED, 0.0, SMOOTHED].map(|by| at(height + by));
    [0, 1].map(|axis| 0.25 * (low[axis] + high[axis]) + 0.5 * mid[axis])
}

/// The line from neck to hem at an angle from the front (rad).
fn line(angle: f64) -> Vec<DVec3> {
    let [top, hem] = [OUTLINE[0][0], OUTLINE[OUTLINE.len() - 1][0]];
    let point = |k: u32| {
        let height = top + (hem - top) * f64::from(k) / f64::from(DOWN);
        let [wide, deep] = half_axes(height);
        DVec3::new(wide * angle.sin(), height, deep * angle.cos())
    };
    (0..=DOWN).map(point).collect()
}

/// Length of a line (m).
fn length(line: &[DVec3]) -> f64 {
    line.windows(2).map(|ends| ends[0].distance(ends[1])).sum()
}

/// The point of a line at a share of its length.
fn along(line: &[DVec3], share: f64) -> DVec3 {
    let mut left = share * length(line);
    for ends in line.windows(2) {
        let piece = ends[0].distance(ends[1]);
        if left <= piece {
            return ends[0].lerp(ends[1], left / piece);
        }
        left -= piece;
    }
    line[line.len() - 1]
}

/// Triangles between two rings of vertices, each time on the shorter of both diagonals.
fn strip(mesh: &mut TriMesh, above: &[usize], below: &[usize]) {
    let (mut a, mut b) = (0, 0);
    let at = |ring: &[usize], k: usize| ring[k % ring.len()];
    while !above.is_empty() && a + b < above.len() + below.len() {
        let [here, there] = [at(above, a), at(below, b)];
        let [next_above, next_below] = [at(above, a + 1), at(below, b + 1)];
        let distance = |i: usize, j: usize| mesh.positions[i].distance(mesh.positions[j]);
        let go_above = b == below.len()
            || (a < above.len() && distance(next_above, there) < distance(here, next_below));
        let apex = if go_above { next_above } else { next_below };
        let triangle = [here, there, apex].map(|v| u32::try_from(v).unwrap_or(u32::MAX));
        mesh.triangles.push(triangle);
        if go_above {
            a += 1;
        } else {
            b += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Surface, edge_uses, mannequin};

    #[test]
    fn hangs_free_of_the_standing_mannequin() {
        let (body, poncho) = (Surface::new(&mannequin()).unwrap(), poncho());
        let gap = |p: DVec3| body.nearest(p, 1.0).unwrap().distance;
        let mut least = (f64::INFINITY, DVec3::ZERO);
        for &t in &poncho.triangles {
            let [a, b, c] = poncho.corners(t);
            for p in [a, 0.5 * (a + b), (a + b + c) / 3.0] {
                if gap(p) < least.0 {
                    least = (gap(p), p);
                }
            }
        }
        assert!(least.0 > 0.006, "{least:?}");
    }

    #[test]
    fn triangles_are_well_shaped_and_face_outwards() {
        let mesh = poncho();
        assert!((4000..6000).contains(&mesh.triangles.len()));
        let mut least = f64::INFINITY;
        for &t in &mesh.triangles {
            let p = mesh.corners(t);
            for i in 0..3 {
                let to = |j: usize| p[(i + j) % 3] - p[i];
                least = to(1).angle_between(to(2)).to_degrees().min(least);
            }
            let outwards = (p[0] + p[1] + p[2]) / 3.0 - DVec3::Y * 1.0;
            let normal = (p[1] - p[0]).cross(p[2] - p[0]);
            assert!(normal.dot(outwards) > 0.0);
        }
        assert!(least > 30.0, "{least}°");
    }

    /// One piece with two borders: V − E + F = 0, every edge used at most once each way.
    #[test]
    fn is_open_at_neck_and_hem_and_whole_between() {
        let mesh = poncho();
        let uses = edge_uses(&mesh.triangles);
        assert!(uses.values().all(|[there, back]| *there <= 1 && *back <= 1));
        assert_eq!(mesh.positions.len() + mesh.triangles.len(), uses.len());
        let open = uses.iter().filter(|(_, [there, back])| there != back);
        for ([a, b], _) in open {
            let heights = [a, b].map(|v| mesh.positions[*v as usize].y);
            let both = |at: f64| heights.iter().all(|y| (y - at).abs() < 1e-12);
            assert!(both(1.512) || both(0.66), "an open edge at {heights:?} m");
        }
    }
}
