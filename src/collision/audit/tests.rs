//! The audit against states whose crossings are known.

use super::*;
use crate::mesh::{Surface, TriMesh, ball};

/// A body at rest.
fn body(mesh: TriMesh) -> Obstacle {
    let surface = Surface::new(&mesh).unwrap();
    Obstacle {
        name: "body".to_owned(),
        shape: Solid::Mesh {
            mesh,
            surface,
            grid: None,
        },
        motion: None,
        friction: 0.0,
        thickness: 0.003,
        continuous: true,
    }
}

const EDGES: [[u32; 2]; 3] = [[0, 1], [1, 2], [0, 2]];

fn look(obstacle: Obstacle, corners: [DVec3; 3]) -> Findings {
    let obstacles = [obstacle];
    let bodies = Bodies::new(&obstacles, 0.0);
    let mut audit = Audit::new(vec![[0, 1, 2]], EDGES.to_vec(), &obstacles, false);
    audit.look(&obstacles, &bodies, &corners)
}

#[test]
fn a_corner_in_a_ball_is_as_deep_as_it_is() {
    let corners = |depth: f64| {
        let low = DVec3::new(0.0, 1.0 - depth, 0.0);
        [low, DVec3::new(-0.5, 2.0, 0.0), DVec3::new(0.5, 2.0, 0.1)]
    };
    let sphere = Obstacle {
        shape: Solid::Sphere {
            center: DVec3::ZERO,
            radius: 1.0,
        },
        ..body(ball(DVec3::ZERO, 1.0))
    };
    for (obstacle, tolerance) in [(body(ball(DVec3::ZERO, 1.0)), 2e-3), (sphere, 1e-15)] {
        let free = look(obstacle.clone(), corners(-0.01));
        assert_eq!(
            free,
            Findings {
                bodies: vec![Penetration::default()],
                ..Findings::default()
            }
        );
        let deep = look(obstacle, corners(0.05));
        let found = deep.bodies[0];
        assert!((found.depth - 0.05).abs() < tolerance, "{found:?}");
        // Both edges at the corner go through the skin.
        assert!(found.inside == 1 && found.crossings >= 2, "{found:?}");
        assert!(deep.marks.len() >= 3);
    }
}

/// No corner inside and no edge of the cloth through the body, but its face on a spike.
#[test]
fn a_spike_through_a_face_is_seen() {
    let corners = [
        DVec3::new(-1.0, 0.5, -1.0),
        DVec3::new(1.0, 0.5, -1.0),
        DVec3::new(0.0, 0.5, 1.0),
    ];
    let mut spike = ball(DVec3::ZERO, 0.1);
    spike.positions[0].y = 0.6;
    let found = look(body(spike.clone()), corners).bodies[0];
    assert!(found.inside == 0 && found.crossings > 10, "{found:?}");
    spike.positions[0].y = 0.5;
    assert_eq!(look(body(spike), corners).bodies[0], Penetration::default());
}

#[test]
fn below_a_plane_and_through_cloth() {
    let ground = Obstacle {
        shape: Solid::Plane {
            point: DVec3::ZERO,
            normal: DVec3::Y,
        },
        ..body(ball(DVec3::ZERO, 1.0))
    };
    let corners = [DVec3::new(0.0, -0.25, 0.0), DVec3::X, DVec3::Z];
    let found = look(ground, corners).bodies[0];
    assert_eq!((found.inside, found.depth), (1, 0.25));
    // Two triangles, one edge of each through the other.
    let other = [
        DVec3::new(0.2, -1.0, 0.2),
        DVec3::new(0.2, 1.0, 0.2),
        DVec3::new(0.9, 0.0, 0.9),
    ];
    let positions: Vec<DVec3> = corners.into_iter().chain(other).collect();
    let edges = EDGES
        .into_iter()
        .chain(EDGES.map(|edge| edge.map(|i| i + 3)));
    let mut audit = Audit::new(vec![[0, 1, 2], [3, 4, 5]], edges.collect(), &[], true);
    let found = audit.look(&[], &Bodies::default(), &positions);
    assert_eq!(found.cloth_crossings, 2, "{found:?}");
}
