//! Which particles a pin holds.

use super::schema::Select;
use crate::mesh::Lattice;
use glam::DVec3;

/// The vertices of a placed cloth that a pin selects; at least one.
pub(super) fn select(select: &Select, lattice: &Lattice) -> Result<Vec<u32>, String> {
    let positions = &lattice.mesh.positions;
    let vertices: Vec<u32> = match select {
        Select::Edge(name) => {
            let edge = lattice.edges.iter().find(|(known, _)| known == name);
            edge.map(|(_, vertices)| vertices.clone())
                .ok_or("this shape has no named edges; select a corner, vertices or a box")?
        }
        Select::Corner(names) => names
            .iter()
            .map(|name| corner(name, lattice))
            .collect::<Result<_, _>>()?,
        Select::Vertices(vertices) => vertices.clone(),
        Select::Box([low, high]) => {
            // A micrometre of grace: placing rounds, and boxes are drawn along rows of vertices.
            let (low, high) = (
                DVec3::from_array(*low) - 1e-6,
                DVec3::from_array(*high) + 1e-6,
            );
            let inside = |p: &DVec3| p.cmpge(low).all() && p.cmple(high).all();
            ((0..).take(positions.len()))
                .filter(|&i| inside(&positions[i as usize]))
                .collect()
        }
    };
    if let Some(beyond) = vertices
        .iter()
        .find(|&&vertex| vertex as usize >= positions.len())
    {
        return Err(format!(
            "there is no vertex {beyond}: the cloth has {}, counted from 0",
            positions.len()
        ));
    }
    if vertices.is_empty() {
        return Err(
            "selects no particle; name some, or make the box larger or move it (it is in world coordinates)"
                .to_owned(),
        );
    }
    Ok(vertices)
}

fn corner(name: &str, lattice: &Lattice) -> Result<u32, String> {
    let known = || {
        let names: Vec<&str> = lattice
            .corners
            .iter()
            .map(|(name, _)| name.as_str())
            .collect();
        if names.is_empty() {
            "none; select vertices or a box".to_owned()
        } else {
            names.join(", ")
        }
    };
    let found = lattice.corners.iter().find(|(corner, _)| corner == name);
    found
        .map(|(_, vertex)| *vertex)
        .ok_or_else(|| format!("there is no corner \"{name}\"; this shape has {}", known()))
}
