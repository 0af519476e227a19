//! The rasterized engine, where this program was built with it.

use crate::technique::TechniqueArgs;
use furrow::Result;
use furrow::film::Film;
use furrow::render::LabelMap;
use furrow::scene::Scene;

/// What the files of a field say that cannot be drawn of it.
pub(crate) fn left_out(scene: &Scene) -> Option<&'static str> {
    scene.camera.blurs().then_some("motion blur: left out, rows are drawn in the middle of their exposures")
}

/// A card that draws, and what it leaves out.
#[cfg(feature = "raster")]
pub(crate) struct Card {
    rasterizer: furrow::raster::Rasterizer,
    settings: furrow::raster::Settings,
}

/// There is none.
#[cfg(not(feature = "raster"))]
pub(crate) enum Card {}

#[cfg(feature = "raster")]
impl Card {
    /// The fastest there is.
    pub(crate) fn open(technique: &TechniqueArgs) -> Result<Self> {
        let named = |name: &String| furrow::raster::Effect::named(name);
        let settings = furrow::raster::Settings { without: technique.without().iter().filter_map(named).collect() };
        Ok(Self { rasterizer: furrow::raster::Rasterizer::new()?, settings })
    }

    /// Its name and driver.
    pub(crate) fn name(&self) -> &str {
        self.rasterizer.adapter()
    }

    /// The whole picture and its labels.
    pub(crate) fn draw(&self, scene: &Scene) -> Result<(Film, LabelMap)> {
        self.rasterizer.draw(scene, &self.settings).map(|drawn| (drawn.film, drawn.labels))
    }
}

#[cfg(not(feature = "raster"))]
impl Card {
    /// An error: there is none.
    pub(crate) fn open(_: &TechniqueArgs) -> Result<Self> {
        Err(furrow::Error::Raster(
            "this program was built without the rasterized engine\n help: cargo build --release --features raster"
                .into(),
        ))
    }

    /// No name.
    pub(crate) fn name(&self) -> &str {
        match *self {}
    }

    /// No picture.
    pub(crate) fn draw(&self, _: &Scene) -> Result<(Film, LabelMap)> {
        match *self {}
    }
}
