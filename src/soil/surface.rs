//! The ground as a mesh.
//!
//! Where nothing of it is in view, cells are joined: a block of them is a fan about the vertex in its middle. It keeps the vertices along its
//! sides, so that no crack opens to the cells or to the fan beside it.

use super::grid::Grid;
use super::ground::up;
use super::{Ground, InView};
use crate::geometry::Mesh;
use crate::math::{Vec3, vec2};
use std::f32::consts::FRAC_1_SQRT_2;

/// Cells along each side of a block; even, so that a vertex lies in its middle.
const BLOCK: usize = 16;

/// Triangles that so many cells have less where they are joined.
pub(super) fn spared(cells: f64) -> f64 {
    cells * (2.0 - 4.0 / BLOCK as f64)
}

/// The blocks of the fine cells of a grid.
struct Blocks {
    /// Along x.
    columns: usize,
    /// Whether the cells of each are joined, row by row from the south.
    joined: Vec<bool>,
}

impl Blocks {
    fn of(grid: &Grid, seen: &InView) -> Self {
        let (columns, rows) = (grid.x.steps / BLOCK, grid.y.steps / BLOCK);
        let joined = |k: usize| {
            let [i, j] = [grid.x.first, grid.y.first].map(|first| first + BLOCK / 2);
            let (i, j) = (i + k % columns * BLOCK, j + k / columns * BLOCK);
            let middle = vec2(grid.x.at[i], grid.y.at[j]);
            let side = grid.x.at[i + BLOCK / 2] - grid.x.at[i - BLOCK / 2];
            !seen.holds(middle, FRAC_1_SQRT_2 * side)
        };
        Self { columns, joined: (0..columns * rows).map(joined).collect() }
    }

    /// Whether a cell of a grid is one of those that are joined.
    fn hold(&self, grid: &Grid, i: usize, j: usize) -> bool {
        let (Some(i), Some(j)) = (i.checked_sub(grid.x.first), j.checked_sub(grid.y.first)) else { return false };
        let (i, j) = (i / BLOCK, j / BLOCK);
        i < self.columns && self.joined.get(j * self.columns + i).is_some_and(|joined| *joined)
    }

    /// Triangles of the blocks that are joined.
    fn fans(&self, grid: &Grid) -> impl Iterator<Item = [u32; 3]> {
        let joined = self.joined.iter().enumerate().filter(|(_, joined)| **joined);
        joined.flat_map(move |(k, _)| {
            let (i, j) = (grid.x.first + k % self.columns * BLOCK, grid.y.first + k / self.columns * BLOCK);
            fan(grid.columns(), i, j)
        })
    }
}

/// The fan of the block whose south-west vertex is (i, j) of a grid with so many columns: counter-clockwise from above.
fn fan(columns: usize, i: usize, j: usize) -> impl Iterator<Item = [u32; 3]> {
    let vertex = move |i: usize, j: usize| (j * columns + i) as u32;
    let around = move |k: usize| {
        let along = k % BLOCK;
        match k / BLOCK {
            1 => vertex(i + BLOCK, j + along),
            2 => vertex(i + BLOCK - along, j + BLOCK),
            3 => vertex(i, j + BLOCK - along),
            // The way round ends where it began.
            _ => vertex(i + along, j),
        }
    };
    let middle = vertex(i + BLOCK / 2, j + BLOCK / 2);
    (0..4 * BLOCK).map(move |k| [middle, around(k), around(k + 1)])
}

impl Ground {
    /// The displaced grid, with the texture coordinates of the baked maps. In view it is exactly as high as [`Ground::height`] says; cells that
    /// are not are joined.
    pub fn mesh(&self, seen: &InView) -> Mesh {
        let grid = &self.grid;
        let columns = grid.columns();
        let blocks = Blocks::of(grid, seen);
        let mut triangles = grid.triangles(|i, j| !blocks.hold(grid, i, j));
        triangles.extend(blocks.fans(grid));
        let mut used = vec![false; columns * grid.rows()];
        for vertex in triangles.iter().flatten() {
            used[*vertex as usize] = true;
        }
        let count = used.iter().filter(|used| **used).count();
        let mut mesh = Mesh {
            positions: Vec::with_capacity(count),
            normals: Vec::with_capacity(count),
            uvs: Vec::with_capacity(count),
            triangles,
            weights: Vec::new(),
        };
        let mut places = vec![0_u32; used.len()];
        for (j, y) in grid.y.at.iter().enumerate() {
            for (i, x) in grid.x.at.iter().enumerate() {
                let vertex = j * columns + i;
                if used[vertex] {
                    places[vertex] = mesh.positions.len() as u32;
                    mesh.positions.push(Vec3::new(*x, *y, self.heights[vertex]));
                    mesh.normals.push(up(self.slopes[vertex]));
                    mesh.uvs.push(self.uv(*x, *y));
                }
            }
        }
        if count < used.len() {
            mesh.triangles.iter_mut().for_each(|triangle| *triangle = triangle.map(|v| places[v as usize]));
            mesh.triangles.shrink_to_fit();
        }
        mesh
    }
}
