//! Whether a body was modelled in another unit than the metre.

use super::TriMesh;

/// A body that is too large for metres.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "it is {extent:.4} m large, as a body in {unit} would be; write scale = {scale}, which makes it \
     {:.4} m",
    extent * scale
)]
pub struct Misscaled {
    /// Largest extent along an axis (m).
    pub extent: f64,
    /// The unit it was probably modelled in.
    pub unit: &'static str,
    /// That unit in metres.
    pub scale: f64,
}

/// Extent (m) from which on a body is taken for one in centimetres: people are smaller, in
/// centimetres they are 175.
const LARGEST: f64 = 10.0;

/// Extent (m) from which on it is taken for one in millimetres: between people in centimetres and in
/// millimetres, 175 and 1750, in the same ratio to both.
const MILLIMETRES: f64 = 550.0;

/// The unit that a body of more than 10 m was probably modelled in; `None` for smaller ones.
///
/// A guess for bodies as large as people: a ball of 20 cm in millimetres is taken for one of 2 m in
/// centimetres.
pub fn misscaled(mesh: &TriMesh) -> Option<Misscaled> {
    let (low, high) = mesh.bounds()?;
    let extent = (high - low).max_element();
    let (unit, scale) = if extent > MILLIMETRES {
        ("millimetres", 0.001)
    } else {
        ("centimetres", 0.01)
    };
    (extent > LARGEST).then_some(Misscaled {
        extent,
        unit,
        scale,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn people_in_other_units_are_recognised_and_made_as_large_as_people() {
        let person = |metre: f64| TriMesh {
            positions: vec![DVec3::ZERO, DVec3::new(0.9, 1.75, 0.3) * metre],
            triangles: Vec::new(),
        };
        assert_eq!(misscaled(&person(1.0)), None);
        assert_eq!(misscaled(&TriMesh::default()), None);
        for (metre, unit) in [(100.0, "centimetres"), (1000.0, "millimetres")] {
            let found = misscaled(&person(metre)).unwrap();
            assert_eq!((found.unit, found.scale), (unit, 1.0 / metre));
            let said = found.to_string();
            assert!(
                said.contains(&format!("{unit} would be; write scale = {}", 1.0 / metre)),
                "{said}"
            );
            assert!(said.ends_with("which makes it 1.7500 m"), "{said}");
        }
    }
}
