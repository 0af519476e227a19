//! The textures of one soil layer, as fine as they are or as coarse as their readers.

use crate::math::{Spectrum, Vec2};
use crate::optics::soil;
use crate::soil::LayerMaps;
use crate::texture::{Height, Texture};
use std::sync::Arc;

/// Colour and height of one soil layer; both repeat.
pub(super) struct Layer {
    albedo: Arc<Texture>,
    /// The colour's level of detail, 0 for the finest.
    lod: f32,
    height: Arc<Height>,
}

/// One is equal to itself alone: its files may have changed.
impl PartialEq for Layer {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

impl Layer {
    /// From textures that repeat.
    pub(super) fn new(albedo: Texture, height: Height) -> Self {
        Self { albedo: Arc::new(albedo), lod: 0.0, height: Arc::new(height) }
    }

    /// The same for readers whose samples stand `extent` of a tile apart: each colour is the mean of about as much. Heights stay as they are: means of
    /// them would be flatter than the ground, and shade less.
    pub(super) fn coarser(&self, extent: f32) -> Self {
        Self { albedo: self.albedo.clone(), lod: self.albedo.lod(extent), height: self.height.clone() }
    }

    /// Mean colour of the dry soil, in four bands.
    pub(super) fn mean(&self) -> Spectrum {
        let [r, g, b, _] = self.albedo.sample(Vec2::splat(0.5), 32.0);
        soil::at([r, g, b], soil::LOESS)
    }
}

impl LayerMaps for Layer {
    fn height(&self, uv: Vec2) -> f32 {
        self.height.at(uv)
    }

    fn albedo(&self, uv: Vec2) -> [f32; 3] {
        let [r, g, b, _] = self.albedo.sample(uv, self.lod);
        [r, g, b]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec2;
    use crate::texture::{ColorSpace, Wrap};

    /// Rationale: a map whose texels are a centimetre must not show single grains of half a millimetre, and must be as bright as they are on
    /// the mean. Expected: the same mean colour within 0.5 %, a smaller spread, the same heights; what is read finely is unchanged.
    #[test]
    fn a_coarse_reader_sees_means_of_colour() {
        let albedo = Texture::load("textures/soil/dirt.png".as_ref(), ColorSpace::Srgb).unwrap().wrapped(Wrap::Repeat);
        let height = Height::load("textures/soil/dirt.height.png".as_ref(), 1.0).unwrap().wrapped(Wrap::Repeat);
        let fine = Layer::new(albedo, height);
        let coarse = fine.coarser(0.02);
        let places = || (0..100 * 100).map(|k| vec2((k % 100) as f32, (k / 100) as f32) * 0.01 + 0.003);
        let of = |layer: &Layer| {
            let mean = places().map(|p| layer.albedo(p)[1]).sum::<f32>() / 1e4;
            let spread = places().map(|p| (layer.albedo(p)[1] - mean).powi(2)).sum::<f32>() / 1e4;
            (mean, spread.sqrt())
        };
        let (a, b) = (of(&fine), of(&coarse));
        assert!((a.0 / b.0 - 1.0).abs() < 0.005 && b.1 < 0.95 * a.1, "{a:?} {b:?}");
        assert!(places().all(|p| coarse.height(p) == fine.height(p)));
        assert_eq!(fine.coarser(1e-5).albedo(vec2(0.3, 0.7)), fine.albedo(vec2(0.3, 0.7)));
    }
}
