//! The rasterizer, if the program was built with feature `raster`.

use furrow_base::Result;
use furrow_render::film::Film;
use furrow_render::render::LabelMap;
use furrow_render::scene::Scene;
use furrow_render::settings::Techniques;

/// Returns a note for the image metadata about effects that the rasterizer cannot render.
pub(super) fn left_out(scene: &Scene) -> Option<&'static str> {
    scene.camera.blurs().then_some("motion blur: left out, each row is rendered at the middle of its exposure")
}

/// An opened graphics card.
#[cfg(feature = "raster")]
pub(super) struct Card {
    rasterizer: furrow_render::raster::Rasterizer,
    techniques: Techniques,
}

/// Placeholder without values, for builds without the rasterizer.
#[cfg(not(feature = "raster"))]
pub(super) enum Card {}

#[cfg(feature = "raster")]
impl Card {
    /// Opens the fastest graphics card.
    pub(super) fn open(techniques: &Techniques) -> Result<Self> {
        Ok(Self { rasterizer: furrow_render::raster::Rasterizer::new()?, techniques: techniques.clone() })
    }

    /// Returns name and driver of the card.
    pub(super) fn name(&self) -> &str {
        self.rasterizer.adapter()
    }

    /// Renders the whole image and its labels.
    pub(super) fn draw(&self, scene: &Scene) -> Result<(Film, LabelMap)> {
        self.rasterizer.draw(scene, &self.techniques).map(|drawn| (drawn.film, drawn.labels))
    }
}

#[cfg(not(feature = "raster"))]
impl Card {
    /// Returns an error, because the rasterizer is not built in.
    pub(super) fn open(_: &Techniques) -> Result<Self> {
        Err(furrow_base::Error::missing("this program was built without the rasterizer")
            .help("cargo build --release --features raster"))
    }

    /// Never called, because no value exists.
    pub(super) fn name(&self) -> &str {
        match *self {}
    }

    /// Never called, because no value exists.
    pub(super) fn draw(&self, _: &Scene) -> Result<(Film, LabelMap)> {
        match *self {}
    }
}
