//! Buffer of a GLB file: vertices, indices and images, each kind in a separate span.

use crate::skinning::tidy;
use furrow_base::geometry::JointWeights;
use furrow_base::math::{DMat4, ToFloat, ToInt, Vec2, Vec3};
use furrow_grow::model::document::{
    ARRAY_BUFFER, Accessor, Buffer, BufferView, Document, ELEMENT_ARRAY_BUFFER, FLOAT, UNSIGNED_INT, UNSIGNED_SHORT,
};

/// Buffer spans under construction, and their accessors.
#[derive(Default)]
pub(super) struct Pack {
    /// Positions and normals, 12 bytes each.
    triples: Vec<u8>,
    /// Texture coordinates, 8 bytes each.
    pairs: Vec<u8>,
    indices: Vec<u8>,
    /// Joint indices, 8 bytes per vertex.
    joints: Vec<u8>,
    /// Joint weights, 16 bytes per vertex.
    weights: Vec<u8>,
    /// Inverse bind matrices, 64 bytes each.
    matrices: Vec<u8>,
    images: Vec<Vec<u8>>,
    accessors: Vec<Accessor>,
}

/// Indices of the buffer views.
const TRIPLES: usize = 0;
const PAIRS: usize = 1;
const INDICES: usize = 2;
/// Only in files with skins.
const JOINTS: usize = 3;
const WEIGHTS: usize = 4;
const MATRICES: usize = 5;

impl Pack {
    fn accessor(&mut self, view: usize, byte_offset: usize, count: usize, kind: &str) -> &mut Accessor {
        self.accessors.push(Accessor {
            buffer_view: Some(view),
            byte_offset,
            component_type: match view {
                INDICES => UNSIGNED_INT,
                JOINTS => UNSIGNED_SHORT,
                _ => FLOAT,
            },
            count,
            kind: kind.into(),
            ..Accessor::default()
        });
        let last = self.accessors.len() - 1;
        &mut self.accessors[last]
    }

    fn triples(&mut self, of: &[Vec3]) -> &mut Accessor {
        let at = self.triples.len();
        self.triples.extend(of.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes));
        self.accessor(TRIPLES, at, of.len(), "VEC3")
    }

    /// Adds positions and returns the index of their accessor.
    pub(super) fn positions(&mut self, of: &[Vec3]) -> usize {
        let lo = of.iter().copied().reduce(Vec3::min).unwrap_or_default();
        let hi = of.iter().copied().reduce(Vec3::max).unwrap_or_default();
        let accessor = self.triples(of);
        accessor.min = Some(lo.to_array().into());
        accessor.max = Some(hi.to_array().into());
        self.accessors.len() - 1
    }

    /// Adds normals and returns the index of their accessor.
    pub(super) fn normals(&mut self, of: &[Vec3]) -> usize {
        self.triples(of);
        self.accessors.len() - 1
    }

    /// Adds texture coordinates and returns the index of their accessor.
    pub(super) fn uvs(&mut self, of: &[Vec2]) -> usize {
        let at = self.pairs.len();
        self.pairs.extend(of.iter().flat_map(Vec2::to_array).flat_map(f32::to_le_bytes));
        self.accessor(PAIRS, at, of.len(), "VEC2");
        self.accessors.len() - 1
    }

    /// Adds triangle indices of a mesh with so many vertices and returns the index of their accessor. They take two bytes each
    /// if the largest is below 65535, which some programs reserve.
    pub(super) fn indices(&mut self, of: &[[u32; 3]], vertices: usize) -> usize {
        let at = self.indices.len();
        let all = of.as_flattened().iter();
        let is_short = u16::try_from(vertices).is_ok();
        if is_short {
            self.indices.extend(all.flat_map(|i| i.to_u16().to_le_bytes()));
            self.indices.resize(self.indices.len().next_multiple_of(4), 0);
        } else {
            self.indices.extend(all.flat_map(|i| i.to_le_bytes()));
        }
        let accessor = self.accessor(INDICES, at, of.len() * 3, "SCALAR");
        accessor.component_type = if is_short { UNSIGNED_SHORT } else { UNSIGNED_INT };
        self.accessors.len() - 1
    }

    /// Adds joints and weights and returns the indices of their accessors. Each joint of a vertex is listed once;
    /// unused ones are 0.
    pub(super) fn weights(&mut self, of: &[JointWeights]) -> [usize; 2] {
        let (joints, weights) = (self.joints.len(), self.weights.len());
        for corner in of {
            let (numbers, shares) = tidy(corner);
            self.joints.extend(numbers.into_iter().flat_map(u16::to_le_bytes));
            self.weights.extend(shares.into_iter().flat_map(f32::to_le_bytes));
        }
        self.accessor(JOINTS, joints, of.len(), "VEC4");
        self.accessor(WEIGHTS, weights, of.len(), "VEC4");
        [self.accessors.len() - 2, self.accessors.len() - 1]
    }

    /// Adds matrices and returns the index of their accessor.
    pub(super) fn matrices(&mut self, of: &[DMat4]) -> usize {
        let at = self.matrices.len();
        let numbers = of.iter().flat_map(DMat4::to_cols_array).map(ToFloat::to_f32);
        self.matrices.extend(numbers.flat_map(f32::to_le_bytes));
        self.accessor(MATRICES, at, of.len(), "MAT4");
        self.accessors.len() - 1
    }

    /// Adds an image and returns the index of its buffer view. After the first image, only images may be added.
    pub(super) fn picture(&mut self, bytes: Vec<u8>) -> usize {
        self.images.push(bytes);
        let first = if self.matrices.is_empty() { JOINTS } else { MATRICES + 1 };
        first + self.images.len() - 1
    }

    /// Adds the buffer views and accessors to the document, and returns the buffer.
    pub(super) fn finish(self, document: &mut Document) -> Vec<u8> {
        let mut buffer = Vec::with_capacity(self.triples.len() + self.pairs.len() + self.indices.len());
        let vertices = |stride| (Some(stride), Some(ARRAY_BUFFER));
        let spans = [
            (self.triples, vertices(12)),
            (self.pairs, vertices(8)),
            (self.indices, (None, Some(ELEMENT_ARRAY_BUFFER))),
        ];
        let skinned = !self.matrices.is_empty();
        let skins = [(self.joints, vertices(8)), (self.weights, vertices(16)), (self.matrices, (None, None))];
        let skins = skins.into_iter().filter(|_| skinned);
        let images = self.images.into_iter().map(|p| (p, (None, None)));
        for (bytes, (byte_stride, target)) in spans.into_iter().chain(skins).chain(images) {
            document.buffer_views.push(BufferView {
                buffer: 0,
                byte_offset: buffer.len(),
                byte_length: bytes.len(),
                byte_stride,
                target,
            });
            buffer.extend_from_slice(&bytes);
            buffer.resize(buffer.len().next_multiple_of(4), 0);
        }
        document.accessors = self.accessors;
        document.buffers = vec![Buffer { byte_length: buffer.len(), uri: None }];
        buffer
    }
}
