//! Textures of one soil layer, read at full resolution or at a coarser level of detail.

use furrow_base::math::{Spectrum, Vec2};
use furrow_grow::soil::LayerMaps;
use furrow_optics::optics::soil;
use furrow_optics::texture::{Height, Texture};
use std::sync::Arc;

/// Colour and height textures of one soil layer; both tile.
pub(super) struct Layer {
    albedo: Arc<Texture>,
    /// Mip level for sampling the colour; 0 is the finest.
    lod: f32,
    height: Arc<Height>,
}

/// Compares by address: two layers read from the same path may differ, because the file may have changed in between.
impl PartialEq for Layer {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

impl Layer {
    /// Creates a layer from two tiling textures.
    pub(super) fn new(albedo: Texture, height: Height) -> Self {
        Self { albedo: Arc::new(albedo), lod: 0.0, height: Arc::new(height) }
    }

    /// Returns the layer for samples that are `extent` of a tile apart: each colour is averaged over about that distance.
    /// Heights are not filtered, because averaged heights would be flatter than the ground and shade less.
    pub(super) fn coarser(&self, extent: f32) -> Self {
        Self { albedo: self.albedo.clone(), lod: self.albedo.lod(extent), height: self.height.clone() }
    }

    /// Returns the mean reflectance of the dry soil in four bands.
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
    use furrow_base::math::{ToFloat, vec2};
    use furrow_optics::texture::{ColorSpace, Wrap};

    /// Rationale: a map with texels of one centimetre must not show single grains of half a millimetre, and its brightness must be their
    /// mean. Expected: the same mean colour within 0.5 %, a smaller spread, the same heights; fine sampling is unchanged.
    #[test]
    fn a_coarse_reader_sees_means_of_colour() {
        let albedo = Texture::load(
            concat!(env!("CARGO_MANIFEST_DIR"), "/../../textures/soil/dirt.png").as_ref(),
            ColorSpace::Srgb,
        )
        .unwrap()
        .wrapped(Wrap::Repeat);
        let height =
            Height::load(concat!(env!("CARGO_MANIFEST_DIR"), "/../../textures/soil/dirt.height.png").as_ref(), 1.0)
                .unwrap()
                .wrapped(Wrap::Repeat);
        let fine = Layer::new(albedo, height);
        let coarse = fine.coarser(0.02);
        let places = || (0..100 * 100).map(|k| vec2((k % 100).to_f32(), (k / 100).to_f32()) * 0.01 + 0.003);
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
