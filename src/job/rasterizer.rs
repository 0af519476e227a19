//! The rasterizer, where this program was built with it.

use crate::Result;
use crate::film::Film;
use crate::render::LabelMap;
use crate::scene::Scene;
use crate::settings::Techniques;

/// What the files of a field say that the rasterizer cannot draw of it.
pub(super) fn left_out(scene: &Scene) -> Option<&'static str> {
    scene.camera.blurs().then_some("motion blur: left out, rows are drawn in the middle of their exposures")
}

/// A graphics card that is ready to draw.
#[cfg(feature = "raster")]
pub(super) struct Card {
    rasterizer: crate::raster::Rasterizer,
    techniques: Techniques,
}

/// There is none.
#[cfg(not(feature = "raster"))]
pub(super) enum Card {}

#[cfg(feature = "raster")]
impl Card {
    /// The fastest there is.
    pub(super) fn open(techniques: &Techniques) -> Result<Self> {
        Ok(Self { rasterizer: crate::raster::Rasterizer::new()?, techniques: techniques.clone() })
    }

    /// Its name and driver.
    pub(super) fn name(&self) -> &str {
        self.rasterizer.adapter()
    }

    /// The whole image and its labels.
    pub(super) fn draw(&self, scene: &Scene) -> Result<(Film, LabelMap)> {
        self.rasterizer.draw(scene, &self.techniques).map(|drawn| (drawn.film, drawn.labels))
    }
}

#[cfg(not(feature = "raster"))]
impl Card {
    /// An error: there is none.
    pub(super) fn open(_: &Techniques) -> Result<Self> {
        Err(crate::Error::missing("this program was built without the rasterizer")
            .help("cargo build --release --features raster"))
    }

    /// No name.
    pub(super) fn name(&self) -> &str {
        match *self {}
    }

    /// No image.
    pub(super) fn draw(&self, _: &Scene) -> Result<(Film, LabelMap)> {
        match *self {}
    }
}
