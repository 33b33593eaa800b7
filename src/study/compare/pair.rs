//! Two recordings whose particles are found in each other.

use super::CompareError;
use crate::replay::Layout;
use crate::scene;
use crate::study::mesh::{Stencil, stencils};
use glam::DVec3;
use std::path::{Path, PathBuf};

/// Two recordings.
#[derive(Debug)]
pub(super) struct Pair {
    pub(super) paths: [PathBuf; 2],
    pub(super) layouts: [Layout; 2],
    particles: usize,
    /// Particles of each cloth of the second one.
    pub(super) counts_of_second: Vec<usize>,
    /// Which of both has the finer mesh, and where on it the other's particles are; `None` when both have one mesh.
    finer: Option<(usize, Vec<Stencil>)>,
}

impl Pair {
    /// Reads what stays the same in two recordings.
    pub(super) fn read(paths: [&Path; 2]) -> Result<Self, CompareError> {
        let layouts = [Layout::read(paths[0])?, Layout::read(paths[1])?];
        let load = |k: usize| layouts[k].scene(&paths[k].display().to_string());
        let loaded = [load(0)?, load(1)?];
        let models = [
            scene::build(&loaded[0])?.model,
            scene::build(&loaded[1])?.model,
        ];
        let counts = [0, 1].map(|k| models[k].cloth_particles());
        let shapes = [0, 1].map(|k| {
            let cloths = models[k].cloths.iter();
            cloths
                .map(|cloth| (&cloth.particles, &cloth.triangles))
                .collect::<Vec<_>>()
        });
        let differ = |why: String| {
            let [a, b] = paths.map(|path| path.display().to_string());
            CompareError::Differ(format!("{a} and {b} can't be compared: {why}"))
        };
        let finer = if shapes[0] == shapes[1] {
            None
        } else {
            let numbers = [0, 1].map(|k| models[k].cloths.len());
            if numbers[0] != numbers[1] {
                return Err(differ(format!(
                    "they have {} and {} cloths",
                    numbers[0], numbers[1]
                )));
            }
            let finer = usize::from(counts[1] >= counts[0]);
            let coarser = 1 - finer;
            let found = stencils(&loaded[coarser].scene, &models[coarser], &models[finer]);
            let found = found
                .map_err(|error| differ(format!("their meshes share no material ({error})")))?;
            if found.len() != counts[coarser] {
                return Err(differ("a mesh from a file has other particles".to_owned()));
            }
            Some((finer, found))
        };
        Ok(Self {
            particles: counts[0].min(counts[1]),
            counts_of_second: models[1]
                .cloths
                .iter()
                .map(|cloth| cloth.particles.len())
                .collect(),
            paths: paths.map(Path::to_owned),
            layouts,
            finer,
        })
    }

    /// Particles that are compared.
    pub(super) fn particles(&self) -> usize {
        self.particles
    }

    /// Whether both have the same mesh.
    pub(super) fn is_one_mesh(&self) -> bool {
        self.finer.is_none()
    }

    /// The compared particles of both (m), from all particles of each.
    pub(super) fn places(&self, all: [&[DVec3]; 2]) -> [Vec<DVec3>; 2] {
        let mut places = all.map(<[_]>::to_vec);
        if let Some((finer, stencils)) = &self.finer {
            let fine = all[*finer];
            places[*finer] = stencils.iter().map(|stencil| stencil.of(fine)).collect();
        }
        places
    }
}
