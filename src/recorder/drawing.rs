//! The shapes of a frame: meshes, springs, pins and contacts.

use rerun::{Color, EntityPath, LineStrip3D, LineStrips3D, Mesh3D, Points3D, RecordingStream};
use rerun::{RecordingStreamResult, Vec3D};

use super::entity::{self, ClothPaths};
use super::{color, normals, springs};
use crate::frame::{ClothFrame, ClothHeader, ContactMark, Frame, Header, SpringDetail};

/// Draws one frame after another.
#[derive(Debug)]
pub(super) struct Drawing {
    /// Where each cloth goes.
    cloths: Vec<ClothPaths>,
    contacts: EntityPath,
    /// Did the last frame have contacts? Then an empty list must follow them.
    had_contacts: bool,
    /// Where each obstacle goes.
    obstacles: Vec<EntityPath>,
    penetrations: EntityPath,
    had_penetrations: bool,
}

impl Drawing {
    /// Nothing drawn yet.
    pub(super) fn new(header: &Header) -> Self {
        Self {
            cloths: header.cloths.iter().map(ClothPaths::new).collect(),
            contacts: entity::body(entity::CONTACTS),
            had_contacts: false,
            obstacles: header
                .obstacles
                .iter()
                .map(|o| entity::body(&o.name))
                .collect(),
            penetrations: entity::body(entity::PENETRATIONS),
            had_penetrations: false,
        }
    }

    /// Draws a frame at the stream's present time.
    pub(super) fn log(
        &mut self,
        stream: &RecordingStream,
        header: &Header,
        frame: &Frame,
    ) -> RecordingStreamResult<()> {
        let shown = springs::choose(header, frame);
        let states = header.cloths.iter().zip(&frame.cloths);
        for ((paths, (cloth, state)), shown) in self.cloths.iter().zip(states).zip(&shown) {
            if cloth.triangles.is_empty() {
                log_particles(stream, &paths.mesh, state, header.strain_range)?;
            } else {
                log_mesh(stream, &paths.mesh, cloth, state, header)?;
            }
            for (f, (path, shown)) in paths.springs.iter().zip(shown).enumerate() {
                if draws(header.spring_detail, cloth, f) {
                    let lines = spring_lines(cloth, state, f, shown, header.strain_range);
                    stream.log(path.clone(), &lines)?;
                }
            }
            if !cloth.pins.is_empty() {
                log_pins(stream, &paths.pins, cloth, state)?;
            }
        }
        let bodies = self.obstacles.iter().zip(&header.obstacles);
        for ((path, body), positions) in bodies.zip(&frame.obstacles) {
            if let Some(positions) = positions {
                let mut mesh = Mesh3D::update_fields().with_vertex_positions(positions);
                if !header.flat {
                    mesh = mesh.with_vertex_normals(normals::smooth(positions, &body.triangles));
                }
                stream.log(path.clone(), &mesh)?;
            }
        }
        self.log_penetrations(stream, &frame.penetrations)?;
        self.log_contacts(stream, &frame.contacts)
    }

    fn log_penetrations(
        &mut self,
        stream: &RecordingStream,
        places: &[[f32; 3]],
    ) -> RecordingStreamResult<()> {
        let has = !places.is_empty();
        if has || self.had_penetrations {
            let points = Points3D::update_fields().with_positions(places);
            stream.log(self.penetrations.clone(), &points)?;
        }
        self.had_penetrations = has;
        Ok(())
    }

    fn log_contacts(
        &mut self,
        stream: &RecordingStream,
        contacts: &[ContactMark],
    ) -> RecordingStreamResult<()> {
        let has = !contacts.is_empty();
        if has || self.had_contacts {
            let colors = contacts.iter().map(|contact| match contact.depth > 0.0 {
                true => color::PENETRATING,
                false => color::TOUCHING,
            });
            let points = Points3D::update_fields()
                .with_positions(contacts.iter().map(|contact| contact.position))
                .with_colors(colors);
            stream.log(self.contacts.clone(), &points)?;
        }
        self.had_contacts = has;
        Ok(())
    }
}

/// Has this family of springs an entity at all?
pub(super) fn draws(detail: SpringDetail, cloth: &ClothHeader, family: usize) -> bool {
    let family = cloth.springs.get(family);
    let links = family.is_some_and(|f| matches!(f.name, "structural" | "zero-length"));
    detail != SpringDetail::Off || (cloth.triangles.is_empty() && links)
}

/// Positions, normals and colours; the triangles are static.
fn log_mesh(
    stream: &RecordingStream,
    path: &EntityPath,
    cloth: &ClothHeader,
    state: &ClothFrame,
    header: &Header,
) -> RecordingStreamResult<()> {
    let strains = state.strain.iter();
    let colors = strains.map(|&s| color::of_strain(s, header.strain_range));
    let mut mesh = Mesh3D::update_fields()
        .with_vertex_positions(&state.positions)
        .with_vertex_colors(colors);
    if !header.flat {
        mesh = mesh.with_vertex_normals(normals::smooth(&state.positions, &cloth.triangles));
    }
    stream.log(path.clone(), &mesh)
}

/// The particles of a chain: with few of them they are the masses that one looks at.
fn log_particles(
    stream: &RecordingStream,
    path: &EntityPath,
    state: &ClothFrame,
    range: f32,
) -> RecordingStreamResult<()> {
    let colors = state.strain.iter().map(|&s| color::of_strain(s, range));
    let points = Points3D::update_fields()
        .with_positions(&state.positions)
        .with_colors(colors);
    stream.log(path.clone(), &points)
}

/// The shown springs of a family, one line each.
fn spring_lines(
    cloth: &ClothHeader,
    state: &ClothFrame,
    family: usize,
    shown: &[usize],
    range: f32,
) -> LineStrips3D {
    let pairs = cloth.springs.get(family).map(|f| f.pairs.as_slice());
    let strains = state.spring_strain.get(family).map(Vec::as_slice);
    let (pairs, strains) = (pairs.unwrap_or_default(), strains.unwrap_or_default());
    let mut strips: Vec<LineStrip3D> = Vec::with_capacity(shown.len());
    let mut colors: Vec<Color> = Vec::with_capacity(shown.len());
    for &spring in shown {
        let Some(ends) = pairs.get(spring).and_then(|pair| ends(pair, state)) else {
            continue;
        };
        let strain = strains.get(spring).copied().unwrap_or(0.0);
        strips.push(LineStrip3D(ends.to_vec()));
        colors.push(color::of_strain(strain, range));
    }
    LineStrips3D::update_fields()
        .with_strips(strips)
        .with_colors(colors)
}

/// Both ends of a spring (m).
fn ends(pair: &[u32; 2], state: &ClothFrame) -> Option<[Vec3D; 2]> {
    let [a, b] = pair.map(|particle| state.positions.get(particle as usize).copied());
    Some([Vec3D(a?), Vec3D(b?)])
}

/// The pins where they are; an empty list, when all are released, takes them away.
fn log_pins(
    stream: &RecordingStream,
    path: &EntityPath,
    cloth: &ClothHeader,
    state: &ClothFrame,
) -> RecordingStreamResult<()> {
    let positions = state.pin_positions(cloth);
    stream.log(
        path.clone(),
        &Points3D::update_fields().with_positions(positions),
    )
}
