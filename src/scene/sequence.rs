//! Reading a motion that is given as OBJ files.

use super::fault::{Fault, SceneError};
use super::load::LoadedScene;
use super::place::place;
use super::read_mesh::ReadMesh;
use super::schema::{ObjShape, Obstacle, ObstacleShape, SequenceMotion};
use super::texts::folder;
use crate::collision::Solid;
use crate::mesh::orient_outward;
use crate::motion::{Sequence, SequenceError};

/// Reads the frames of obstacle number `i`, whose own mesh is given.
pub(super) fn read_sequence(
    loaded: &LoadedScene,
    i: usize,
    obstacle: &Obstacle,
    asked: &SequenceMotion,
    shape: &Solid,
) -> Result<Sequence, SceneError> {
    let key = format!("obstacle.{i}.motion.sequence");
    let fault = |cause: String| loaded.error(&Fault::new(format!("{key}.dir"), cause));
    let files = files_of(loaded, &asked.dir).map_err(fault)?;
    let scale = match &obstacle.shape {
        ObstacleShape::Obj(shape) => shape.scale,
        ObstacleShape::Plane(_) | ObstacleShape::Sphere(_) => 1.0,
    };
    let mut frames = Vec::with_capacity(files.len());
    for file in &files {
        let frame = ObjShape {
            path: format!("{}/{file}", asked.dir),
            scale,
        };
        let mut read = ReadMesh::new(loaded, &key, &frame)?;
        orient_outward(&mut read.mesh);
        if let Solid::Mesh { mesh, .. } = shape
            && mesh.triangles != read.mesh.triangles
        {
            return Err(read.error(format!(
                "is no frame of obstacle {}: it has {} triangles of {} vertices, the obstacle's own mesh {} of {}, and all have to be the same; write all frames from one mesh",
                obstacle.name,
                read.mesh.triangles.len(),
                read.mesh.positions.len(),
                mesh.triangles.len(),
                mesh.positions.len(),
            )));
        }
        place(
            &mut read.mesh.positions,
            obstacle.rotate,
            obstacle.translate,
        );
        frames.push(read.mesh.positions);
    }
    Sequence::new(frames, asked.fps, asked.start).map_err(|error| {
        let file = match error {
            SequenceError::Vertices { frame, .. } | SequenceError::Jump { frame, .. } => {
                files.get(frame).map_or("", String::as_str)
            }
            _ => "",
        };
        fault(format!(
            "{file}: {error}; a frame may be missing or damaged, or the numbering of its vertices another: write the frames again, in closer steps if it really is that fast"
        ))
    })
}

/// The OBJ files of a folder in the order of their numbers.
pub(super) fn files_of(loaded: &LoadedScene, dir: &str) -> Result<Vec<String>, String> {
    let folder = folder(loaded).join(dir);
    let name = folder.display();
    let prefix = format!("{dir}/");
    let carried = loaded
        .meshes
        .keys()
        .filter_map(|path| path.strip_prefix(&prefix));
    let mut names: Vec<String> = carried.map(str::to_owned).collect();
    if names.is_empty() {
        let entries = std::fs::read_dir(&folder).map_err(|error| {
            format!("{name} can't be read: {error}; paths are relative to the scene's file")
        })?;
        names.extend(entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok()));
    }
    let mut numbered = Vec::new();
    for file in names
        .into_iter()
        .filter(|file| file.to_lowercase().ends_with(".obj"))
    {
        match number_of(&file) {
            Some(number) => numbered.push((number, file)),
            None => {
                return Err(format!(
                    "{name}/{file} has no number; name the frames like walk-0001.obj, or keep other files elsewhere"
                ));
            }
        }
    }
    numbered.sort();
    if numbered.is_empty() {
        return Err(format!(
            "{name} holds no OBJ files; name the frames like walk-0001.obj"
        ));
    }
    for pair in numbered.windows(2) {
        let [(before, first), (after, second)] = [&pair[0], &pair[1]];
        if after - before != 1 {
            let what = if after == before {
                format!("{first} and {second} have the same number")
            } else {
                format!(
                    "frame {} is missing between {first} and {second}",
                    before + 1
                )
            };
            return Err(format!("{name}: {what}; give one file for every number"));
        }
    }
    Ok(numbered.into_iter().map(|(_, file)| file).collect())
}

/// The number at the end of a file's name, before its suffix.
fn number_of(file: &str) -> Option<u64> {
    let stem = &file[..file.rfind('.')?];
    let digits = stem.len() - stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    stem[stem.len() - digits..].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_at_the_end() {
        assert_eq!(number_of("walk-0012.obj"), Some(12));
        assert_eq!(number_of("2walk7.OBJ"), Some(7));
        assert_eq!(number_of("0.obj"), Some(0));
        assert_eq!(number_of("walk.obj"), None);
    }
}
