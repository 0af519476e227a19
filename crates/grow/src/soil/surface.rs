//! Mesh of the ground.
//!
//! Where the ground is not in view, cells are merged: a block of them becomes a triangle fan around its central vertex.
//! The fan keeps the vertices along the block's sides, so that no crack opens to neighbouring cells or fans.

use super::grid::Grid;
use super::ground::up;
use super::{Ground, InView};
use furrow_base::geometry::Mesh;
use furrow_base::math::{ToFloat, ToInt, Vec3, vec2};
use std::f32::consts::FRAC_1_SQRT_2;

/// Number of cells along each side of a block; even, so that a vertex is at its centre.
const BLOCK: usize = 16;

/// Returns the number of triangles saved by merging `cells` cells.
pub(super) fn spared(cells: f64) -> f64 {
    cells * (2.0 - 4.0 / BLOCK.to_f64())
}

/// Blocks of the fine cells of a grid.
struct Blocks {
    /// Number of blocks along x.
    columns: usize,
    /// Whether the cells of each block are merged, row by row from the south.
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

    /// Returns `true` if a cell of the grid belongs to a merged block.
    fn hold(&self, grid: &Grid, i: usize, j: usize) -> bool {
        let (Some(i), Some(j)) = (i.checked_sub(grid.x.first), j.checked_sub(grid.y.first)) else { return false };
        let (i, j) = (i / BLOCK, j / BLOCK);
        i < self.columns && self.joined.get(j * self.columns + i).is_some_and(|joined| *joined)
    }

    /// Iterates over the triangles of the merged blocks.
    fn fans(&self, grid: &Grid) -> impl Iterator<Item = [u32; 3]> {
        let joined = self.joined.iter().enumerate().filter(|(_, joined)| **joined);
        joined.flat_map(move |(k, _)| {
            let (i, j) = (grid.x.first + k % self.columns * BLOCK, grid.y.first + k / self.columns * BLOCK);
            fan(grid.columns(), i, j)
        })
    }
}

/// Iterates over the triangles of the fan of the block with its south-west vertex at (i, j), counter-clockwise from
/// above. `columns` is the grid's number of vertices along x.
fn fan(columns: usize, i: usize, j: usize) -> impl Iterator<Item = [u32; 3]> {
    let vertex = move |i: usize, j: usize| (j * columns + i).to_u32();
    let around = move |k: usize| {
        let along = k % BLOCK;
        match k / BLOCK {
            1 => vertex(i + BLOCK, j + along),
            2 => vertex(i + BLOCK - along, j + BLOCK),
            3 => vertex(i, j + BLOCK - along),
            // The loop closes at its first vertex.
            _ => vertex(i + along, j),
        }
    };
    let middle = vertex(i + BLOCK / 2, j + BLOCK / 2);
    (0..4 * BLOCK).map(move |k| [middle, around(k), around(k + 1)])
}

impl Ground {
    /// Builds the displaced grid, with the texture coordinates of the baked maps. In view it has exactly the heights of
    /// [`Ground::height`]; cells out of view are merged.
    pub fn mesh(&self, seen: &InView) -> Mesh {
        let grid = &self.grid;
        let columns = grid.columns();
        let blocks = Blocks::of(grid, seen);
        let mut triangles = grid.triangles(|i, j| !blocks.hold(grid, i, j));
        triangles.extend(blocks.fans(grid));
        let mut used = vec![false; columns * grid.rows()];
        for vertex in triangles.iter().flatten() {
            used[vertex.to_usize()] = true;
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
                    places[vertex] = mesh.positions.len().to_u32();
                    mesh.positions.push(Vec3::new(*x, *y, self.heights[vertex]));
                    mesh.normals.push(up(self.slopes[vertex]));
                    mesh.uvs.push(self.uv(*x, *y));
                }
            }
        }
        if count < used.len() {
            mesh.triangles.iter_mut().for_each(|triangle| *triangle = triangle.map(|v| places[v.to_usize()]));
            mesh.triangles.shrink_to_fit();
        }
        mesh
    }
}
