//! Table of edits. Tests iterate over it, so they cover new entries automatically.

use super::{Change, Edit, growth, labels, light, picture};
use crate::assemble::SceneEdit;
use furrow_base::ron_file::choose;
use furrow_base::{Error, Result};
use furrow_render::material::Feature;
use furrow_render::settings::{Engine, Quality, RenderOptions};

/// The unchanged field: the baseline of all edits.
pub static FULL: Edit =
    Edit { name: "full", about: "the field of the scene file", keeps_labels: true, change: Change::Nothing };

impl Edit {
    /// Returns the edit with this name. The error lists all names.
    pub fn named(name: &str) -> Result<&'static Self> {
        EDITS.iter().find(|edit| edit.name == name).ok_or_else(|| {
            let known: Vec<&str> = EDITS.iter().map(|edit| edit.name).collect();
            let help = choose("edits", &known, name);
            Error::misuse(format!("there is no edit `{name}`")).help(help)
        })
    }
}

/// Defines an edit of the render options.
macro_rules! rendered {
    ($name:literal, $about:literal, $($field:ident).+ = $value:expr) => {
        Edit {
            name: $name,
            about: $about,
            keeps_labels: true,
            change: Change::Rendering(|options| options.$($field).+ = $value),
        }
    };
}

/// Switches to the rasterizer: one sample per pixel, no noise, no paths. Techniques that are already left out stay left out.
fn rasterized(options: &mut RenderOptions) {
    options.engine = Engine::Raster;
    options.quality = Quality::spp(1);
    options.techniques.max_depth = None;
    options.preset = None;
}

/// Defines an edit of the materials.
macro_rules! without {
    ($name:literal, $about:literal, $feature:ident) => {
        Edit { name: $name, about: $about, keeps_labels: true, change: Change::Materials(Feature::$feature) }
    };
}

/// Defines an edit of the plants' shapes.
macro_rules! grown {
    ($name:literal, $about:literal, $change:path) => {
        Edit {
            name: $name,
            about: $about,
            keeps_labels: false,
            change: Change::Growth(SceneEdit { page: None, species: Some($change) }),
        }
    };
}

/// All edits.
pub static EDITS: &[Edit] = &[
    Edit {
        name: "raster",
        about: "rasterized with the methods of a 2017 game engine: shadow maps, no indirect light; labels from an ID render target",
        // Labels differ in a few pixels per million, where a pixel centre is on an edge.
        keeps_labels: false,
        change: Change::Rendering(rasterized),
    },
    // Light transport.
    rendered!("direct-light", "direct light only, no bounces", techniques.max_depth = Some(1)),
    rendered!("one-bounce", "direct light and one bounce", techniques.max_depth = Some(2)),
    // Light.
    Edit {
        name: "no-sky",
        about: "sun and lamps only; a sky stays if it is the only light",
        keeps_labels: true,
        change: Change::Lights(light::no_sky),
    },
    Edit {
        name: "hard-ambient",
        about: "constant radiance instead of the sky, with the same irradiance on level ground",
        keeps_labels: true,
        change: Change::Lights(light::hard_ambient),
    },
    Edit {
        name: "point-light",
        about: "sun and lamps as points of the same power: shadows have hard edges",
        keeps_labels: true,
        change: Change::Lights(light::points),
    },
    // Surfaces.
    without!("no-transmission", "no light passes through leaves", Transmission),
    without!("no-coat", "leaves without wax layer: no gloss, the same reflectance", Coat),
    without!("lambert-soil", "soil, stones and straw are Lambertian, wet or dry", Facets),
    without!("no-normal-maps", "no relief finer than the meshes", Relief),
    without!(
        "plain-leaves",
        "leaves in the uniform colour of their pigments, without the colours of their images; outlines stay",
        Texture
    ),
    // Geometry.
    Edit {
        name: "flat-soil",
        about: "the ground is a plane with the same texture, without clods; stones, straw and plants are moved down to it",
        keeps_labels: false,
        change: Change::Growth(SceneEdit { page: Some(growth::flat_soil), species: None }),
    },
    grown!("flat-leaves", "blades are flat sheets from base to tip", growth::flat_leaves),
    grown!("low-poly", "blades of 16 triangles", growth::few_triangles),
    grown!("one-mesh", "one mesh for all plants of a species in a field, one individual in all fields", growth::alike),
    // Camera.
    Edit {
        name: "no-lens-blur",
        about: "a pinhole camera in perfect focus: neither blur nor depth of field",
        keeps_labels: true,
        change: Change::Lens(picture::sharp),
    },
    Edit {
        name: "no-motion-blur",
        about: "zero exposure time: images of a driving robot are as sharp as its labels",
        keeps_labels: true,
        change: Change::Lens(picture::frozen),
    },
    Edit {
        name: "no-psf",
        about: "optics without a point spread function on the sensor; the pixel filter stays",
        keeps_labels: true,
        change: Change::Sensor(picture::no_spread),
    },
    Edit {
        name: "no-mosaic-and-matrix",
        about: "every pixel measures all colours, without colour correction of the filters",
        keeps_labels: true,
        change: Change::Sensor(picture::all_colors),
    },
    Edit {
        name: "no-sensor-noise",
        about: "a sensor without noise: neither shot noise nor read noise",
        keeps_labels: true,
        change: Change::Sensor(|sensor| sensor.noise.on = false),
    },
    Edit {
        name: "no-nir",
        about: "nir.png has the grey of rgb.png: near infrared adds no information",
        keeps_labels: true,
        change: Change::Photograph(picture::gray_nir),
    },
    // Labels.
    Edit {
        name: "smooth-labels",
        about: "labels from anti-aliased colours: each pixel's blend of class colours, mapped to the nearest class",
        keeps_labels: false,
        change: Change::Labels(labels::smooth),
    },
    // Samples.
    rendered!("spp-4", "4 samples per pixel", quality.spp = 4),
    rendered!("spp-16", "16 samples per pixel", quality.spp = 16),
    rendered!("spp-64", "64 samples per pixel", quality.spp = 64),
    rendered!("spp-256", "256 samples per pixel", quality.spp = 256),
    rendered!("denoised", "images without Monte Carlo noise; needs Open Image Denoise", quality.denoise = true),
];
