//! Sampling the distance from a surface.

use super::plan::{NEAR_BYTES, Plan};
use super::{BadGrid, Brick, CELLS, DistanceGrid, GridError, ROW, SAMPLES};
use crate::mesh::{Nearest, Surface};
use glam::{DVec3, Vec4};
use rayon::prelude::*;

/// Triangles at most at which the error is measured.
const MEASURED: usize = 4096;

impl DistanceGrid {
    /// Samples the distance from a surface with cells of `cell` (m), wherever it is at most `band`
    /// (m), on all threads.
    ///
    /// # Errors
    ///
    /// When a length isn't positive, or when the grid would take more than [`DistanceGrid::LIMIT`].
    pub fn new(surface: &Surface, cell: f64, band: f64) -> Result<Self, BadGrid> {
        for (name, value) in [("cell", cell), ("band", band)] {
            if !(value > 0.0 && value < f64::INFINITY) {
                return Err(BadGrid::Length { name, value });
            }
        }
        let plan = Plan::new(surface, cell, band);
        let mut bytes = plan.brick_bytes();
        if bytes > Self::LIMIT as f64 {
            return Err(plan.too_fine(plan.bytes()));
        }
        let mut grid = plan.empty();
        let near = grid.find_near(surface, band);
        bytes += near as f64 * NEAR_BYTES;
        if bytes > Self::LIMIT as f64 {
            return Err(plan.too_fine(bytes));
        }
        grid.sample(surface, near);
        grid.error = grid.measure(surface);
        Ok(grid)
    }

    /// Measures the distance of every brick, and numbers those that the band may reach into.
    pub(super) fn find_near(&mut self, surface: &Surface, band: f64) -> usize {
        let length = self.cell * CELLS as f64;
        let half = 0.5 * length;
        let [width, height, _] = self.size;
        let middle = self.origin + half;
        let rows = self.bricks.par_chunks_mut(width).enumerate();
        rows.for_each(|(row, bricks)| {
            let start = middle + length * place([0, row % height, row / height]);
            let mut reach = f64::MAX;
            for (i, brick) in bricks.iter_mut().enumerate() {
                let p = start + length * place([i, 0, 0]);
                let nearest = surface.nearest(p, reach * (1.0 + 1e-6));
                brick.distance = nearest.map_or(f32::INFINITY, |nearest| single(nearest.distance));
                reach = f64::from(brick.distance.abs()) + length;
            }
        });
        let near = band + half * 3.0_f64.sqrt() + 1e-6 * length;
        let all = self.bricks.iter_mut();
        let near = all.filter(|brick| f64::from(brick.distance.abs()) <= near);
        // So many bricks as fit have fewer than 2³² samples.
        near.zip((0..).step_by(SAMPLES))
            .map(|(brick, first)| brick.first = first)
            .count()
    }

    /// Fills the bricks that are near.
    fn sample(&mut self, surface: &Surface, near: usize) {
        self.samples = vec![Vec4::ZERO; near * SAMPLES];
        let [width, height, _] = self.size;
        let all = (0..).zip(&self.bricks);
        let near = all
            .filter(|(_, brick)| brick.first != Brick::FAR)
            .map(|(n, _)| n);
        let near: Vec<usize> = near.collect();
        let length = self.cell * CELLS as f64;
        let (origin, cell) = (self.origin, self.cell);
        // No cell that reaches into the band has a corner farther than that.
        let far = self.band + 3.0_f64.sqrt() * cell;
        let bricks = self.samples.par_chunks_mut(SAMPLES).zip(&near);
        bricks.for_each(|(samples, &n)| {
            let first =
                origin + length * place([n % width, n / width % height, n / width / height]);
            samples[0] = surface.nearest(first, f64::MAX).map_or(Vec4::W, sample);
            for n in 1..SAMPLES {
                let at = [n % ROW, n / ROW % ROW, n / ROW / ROW];
                let beside = match at {
                    [0, 0, _] => n - ROW * ROW,
                    [0, ..] => n - ROW,
                    _ => n - 1,
                };
                let known = f64::from(samples[beside].w);
                let reach = far.min(known.abs() + cell) * (1.0 + 1e-6);
                let found = surface.nearest(first + cell * place(at), reach);
                // One that is farther is on the side of that beside it.
                let there = || Vec4::W * single(far.copysign(known));
                samples[n] = found.map_or_else(there, sample);
            }
        });
    }

    /// Compares with the surface.
    fn measure(&self, surface: &Surface) -> GridError {
        let mesh = surface.mesh();
        let every = mesh.triangles.len().div_ceil(MEASURED);
        let chosen: Vec<[u32; 3]> = mesh.triangles.iter().copied().step_by(every).collect();
        let worst_and_sum = |&triangle: &[u32; 3]| {
            let corners = mesh.corners(triangle);
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let (mut largest, mut sum, mut count) = (0.0_f64, 0.0, 0.0);
            for start in [a, (a + b + c) / 3.0] {
                for cells in [-1.0, 0.0, 1.0] {
                    let p = start + normal * (cells * self.cell);
                    let answers = (self.nearest(p, f64::MAX), surface.nearest(p, f64::MAX));
                    if let (Some(ours), Some(exact)) = answers {
                        let error = (ours.distance - exact.distance).abs();
                        largest = largest.max(error);
                        sum += error * error;
                        count += 1.0;
                    }
                }
            }
            (largest, sum, count)
        };
        let all: Vec<(f64, f64, f64)> = chosen.par_iter().map(worst_and_sum).collect();
        let (mut largest, mut sum, mut count) = (0.0_f64, 0.0, 0.0_f64);
        for one in all {
            largest = largest.max(one.0);
            sum += one.1;
            count += one.2;
        }
        GridError {
            largest,
            root_mean_square: (sum / count.max(1.0)).sqrt(),
        }
    }
}

/// Place of a brick or a sample, counted from the first.
fn place(at: [usize; 3]) -> DVec3 {
    DVec3::from_array(at.map(|i| i as f64))
}

/// What is kept of an answer.
fn sample(nearest: Nearest) -> Vec4 {
    nearest.normal.as_vec3().extend(single(nearest.distance))
}

#[expect(clippy::cast_possible_truncation, reason = "a distance needs no more")]
fn single(x: f64) -> f32 {
    x as f32
}
