//! Small models and pictures for tests.

use super::{Model, Up, glb};
use furrow_base::Result;
use furrow_base::math::ToInt;
use serde_json::Value;

/// Writes files into a new folder and loads the first one.
pub(super) fn load(files: &[(&str, &[u8])], up: Up) -> Result<Model> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    Model::load(&folder.path().join(files[0].0), up)
}

/// Encodes a PNG file of rows of R, G, B, A.
pub(super) fn png(width: u32, rgba: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, rgba.len().to_u32() / width);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(rgba.as_flattened()).unwrap();
    bytes
}

/// Buffer of a GLB file that is filled piece by piece.
#[derive(Default)]
pub(super) struct Bytes {
    pub(super) data: Vec<u8>,
    pub(super) views: Vec<Value>,
}

impl Bytes {
    /// Adds bytes, and returns the index of their buffer view.
    pub(super) fn view(&mut self, bytes: &[u8]) -> usize {
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        self.views.push(serde_json::json!({ "buffer": 0, "byteOffset": self.data.len(), "byteLength": bytes.len() }));
        self.data.extend(bytes);
        self.views.len() - 1
    }

    /// Adds numbers, and returns the index of their buffer view.
    pub(super) fn floats(&mut self, values: &[f32]) -> usize {
        self.view(&values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
    }

    /// Returns a GLB file of a document whose only buffer this is.
    pub(super) fn glb(self, mut document: Value) -> Vec<u8> {
        document["bufferViews"] = Value::Array(self.views);
        document["buffers"] = serde_json::json!([{ "byteLength": self.data.len() }]);
        glb::join(document.to_string().into_bytes(), self.data).unwrap()
    }
}
