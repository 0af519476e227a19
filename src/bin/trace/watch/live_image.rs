//! The displayed image: pixels of the four views, and inspection of single pixels.

use furrow_base::math::{RoundTo, ToInt};
use furrow_base::{Error, Result};
use furrow_grow::plant::OrganKind;
use furrow_job::{PreparedField, Renderer, View};
use furrow_optics::sensor::{Camera, Photograph};
use furrow_output::ImageData as Png;
use furrow_render::film::Film;
use furrow_render::render::LabelMap;
use furrow_render::render::label::NONE;
use furrow_render::scene::tag::Class;
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Duration;

/// Returns the width in pixels that a camera has in its scene file.
pub(super) fn own_width(camera: &Camera) -> u32 {
    (f64::from(camera.width()) / f64::from(camera.scale())).round_to()
}

/// How an image was rendered.
#[derive(Clone, Copy, Default)]
pub(super) struct RenderInfo {
    /// Number of the request that it answers.
    pub(super) asked: u64,
    /// Time from the start of reading the file to the first image of this field.
    pub(super) first: Duration,
    /// Samples per pixel.
    pub(super) spp: u32,
}

/// A field and its image so far.
pub(super) struct LiveImage {
    field: Arc<PreparedField>,
    labels: Arc<LabelMap>,
    photograph: Photograph,
    made: RenderInfo,
}

impl LiveImage {
    /// Develops the film into an image.
    pub(super) fn new(field: &Arc<PreparedField>, film: &Film, labels: &Arc<LabelMap>, made: RenderInfo) -> Self {
        let photograph = field.edit().photograph(field.grown(), film);
        Self { field: field.clone(), labels: labels.clone(), photograph, made }
    }

    /// Number of the request that it answers.
    pub(super) fn asked(&self) -> u64 {
        self.made.asked
    }

    /// Warnings of its field.
    pub(super) fn warnings(&self) -> &Vec<String> {
        &self.field.grown().warnings
    }

    /// Width of the scene's own camera, pixels.
    pub(super) fn own_width(&self) -> u32 {
        own_width(&self.field.grown().scene.camera)
    }

    /// Description for the page.
    pub(super) fn about(&self) -> Value {
        let grown = self.field.grown();
        let (grow, build) = self.field.times();
        let camera = &grown.scene.camera;
        let (near, far) = self.reach();
        json!({
            "asked": self.made.asked,
            "spp": self.made.spp,
            "width": self.photograph.width,
            "height": self.photograph.height,
            "scale": camera.scale(),
            "seed": grown.seed,
            "index": grown.index,
            "hash": grown.hash,
            "plants": grown.plants.len(),
            "triangles": grown.scene.triangles(),
            "near_m": near,
            "far_m": far,
            "grow_s": grow.as_secs_f64(),
            "build_s": build.as_secs_f64(),
            "first_s": self.made.first.as_secs_f64(),
        })
    }

    /// Depths of the nearest and the farthest surface, metres.
    fn reach(&self) -> (f32, f32) {
        let depths = self.labels.depth.iter().copied().filter(|depth| depth.is_finite());
        let (near, far) = depths.fold((f32::INFINITY, 0.0_f32), |(near, far), d| (near.min(d), far.max(d)));
        if near <= far { (near, far) } else { (0.0, 0.0) }
    }

    /// Encodes one of its views as PNG; `None` for an unknown name.
    pub(super) fn png(&self, view: &str) -> Option<Result<Vec<u8>>> {
        let Photograph { width, height, rgb, nir, .. } = &self.photograph;
        let encode = |pixels: &Png<'_>| furrow_output::encode_png(*width, *height, pixels, "");
        Some(match view {
            "rgb" => encode(&Png::Rgb(rgb.as_chunks::<3>().0)),
            "nir" => encode(&Png::Gray(nir)),
            "labels" => {
                let classes: Vec<u8> = self.labels.tags.iter().map(|tag| tag.class as u8).collect();
                encode(&Png::Indexed(&classes, &Class::ALL.map(Class::color)))
            }
            "depth" => {
                let (near, far) = self.reach();
                // Near is bright; no surface is black.
                let gray = |d: &f32| {
                    let share = if d.is_finite() { (far - d) / (far - near).max(1e-9) } else { 0.0 };
                    (share * 255.0 + 0.5).trunc_to::<u8>()
                };
                let depths: Vec<u8> = self.labels.depth.iter().map(gray).collect();
                encode(&Png::Gray(&depths))
            }
            _ => return None,
        })
    }

    /// Describes the centre of a pixel: class, plant and leaf, species, organ and depth.
    pub(super) fn at(&self, (x, y): (u32, u32)) -> Result<Value> {
        self.check((x, y))?;
        let i = (y * self.photograph.width + x).to_usize();
        let grown = self.field.grown();
        let (tag, part, depth) = (self.labels.tags[i], self.labels.parts[i], self.labels.depth[i]);
        let organ = grown.kinds.get(part.to_usize()).and_then(|kind| kind.organ());
        let plant = grown.plants.iter().find(|plant| plant.number == tag.plant);
        Ok(json!({
            "x": x,
            "y": y,
            "class": tag.class.name(),
            "plant": tag.plant,
            "leaf": tag.leaf,
            "organ": organ.map(OrganKind::name),
            "species": plant.map(|plant| plant.species.as_str()),
            // A model from disk has neither EPPO code nor age.
            "bbch": plant.filter(|plant| !plant.eppo.is_empty()).map(|plant| plant.bbch),
            "age_days": plant.filter(|plant| !plant.eppo.is_empty()).map(|plant| plant.age_days),
            "depth_m": (part != NONE).then_some(depth),
        }))
    }

    /// Describes a pixel as `--pixel` does.
    pub(super) fn explain(&self, renderer: &Renderer, at: (u32, u32)) -> Result<String> {
        self.check(at)?;
        renderer.explain(&self.field, View::Path, at)
    }

    fn check(&self, (x, y): (u32, u32)) -> Result<()> {
        let Photograph { width, height, .. } = self.photograph;
        let inside = x < width && y < height;
        if inside { Ok(()) } else { Err(Error::misuse(format!("pixel {x},{y} is outside {width} × {height}"))) }
    }
}
