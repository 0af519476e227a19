//! The one buffer of a GLB file: vertices, indices, pictures, each kind in a span of its own.

use crate::math::{Vec2, Vec3};
use crate::model::document::{
    ARRAY_BUFFER, Accessor, Buffer, BufferView, Document, ELEMENT_ARRAY_BUFFER, FLOAT, UNSIGNED_INT,
};

/// Spans of the buffer while they grow, and who reads them.
#[derive(Default)]
pub(super) struct Pack {
    /// Positions and normals, 12 bytes each.
    triples: Vec<u8>,
    /// Texture coordinates, 8 bytes each.
    pairs: Vec<u8>,
    indices: Vec<u8>,
    pictures: Vec<Vec<u8>>,
    accessors: Vec<Accessor>,
}

/// Numbers of the spans' views.
const TRIPLES: usize = 0;
const PAIRS: usize = 1;
const INDICES: usize = 2;
const PICTURES: usize = 3;

impl Pack {
    fn accessor(&mut self, view: usize, byte_offset: usize, count: usize, kind: &str) -> &mut Accessor {
        self.accessors.push(Accessor {
            buffer_view: Some(view),
            byte_offset,
            component_type: if view == INDICES { UNSIGNED_INT } else { FLOAT },
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

    /// Number of the accessor that reads these.
    pub(super) fn positions(&mut self, of: &[Vec3]) -> usize {
        let lo = of.iter().copied().reduce(Vec3::min).unwrap_or_default();
        let hi = of.iter().copied().reduce(Vec3::max).unwrap_or_default();
        let accessor = self.triples(of);
        accessor.min = Some(lo.to_array().into());
        accessor.max = Some(hi.to_array().into());
        self.accessors.len() - 1
    }

    /// Likewise.
    pub(super) fn normals(&mut self, of: &[Vec3]) -> usize {
        self.triples(of);
        self.accessors.len() - 1
    }

    /// Likewise.
    pub(super) fn uvs(&mut self, of: &[Vec2]) -> usize {
        let at = self.pairs.len();
        self.pairs.extend(of.iter().flat_map(Vec2::to_array).flat_map(f32::to_le_bytes));
        self.accessor(PAIRS, at, of.len(), "VEC2");
        self.accessors.len() - 1
    }

    /// Likewise.
    pub(super) fn indices(&mut self, of: &[[u32; 3]]) -> usize {
        let at = self.indices.len();
        self.indices.extend(of.as_flattened().iter().flat_map(|i| i.to_le_bytes()));
        self.accessor(INDICES, at, of.len() * 3, "SCALAR");
        self.accessors.len() - 1
    }

    /// Number of the view that holds these bytes of a picture.
    pub(super) fn picture(&mut self, bytes: Vec<u8>) -> usize {
        self.pictures.push(bytes);
        PICTURES + self.pictures.len() - 1
    }

    /// Tells the document where everything lies, and returns the buffer.
    pub(super) fn finish(self, document: &mut Document) -> Vec<u8> {
        let mut buffer = Vec::with_capacity(self.triples.len() + self.pairs.len() + self.indices.len());
        let vertices = |stride| (Some(stride), Some(ARRAY_BUFFER));
        let spans = [
            (self.triples, vertices(12)),
            (self.pairs, vertices(8)),
            (self.indices, (None, Some(ELEMENT_ARRAY_BUFFER))),
        ];
        let pictures = self.pictures.into_iter().map(|p| (p, (None, None)));
        for (bytes, (byte_stride, target)) in spans.into_iter().chain(pictures) {
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
