//! The table of edits. The tests find what is new here unasked.

use super::{Change, Edit, growth, labels, light, picture};
use crate::material::Feature;
use crate::ron_file::choose;
use crate::scene::assemble::Growing;
use crate::settings::{Engine, Quality, RenderOptions};
use crate::{Error, Result};

/// No edit: what all others are compared with.
pub static FULL: Edit =
    Edit { name: "full", about: "the field as its scene file says", keeps_labels: true, change: Change::Nothing };

impl Edit {
    /// The edit of this name; the error lists all names.
    pub fn named(name: &str) -> Result<&'static Self> {
        EDITS.iter().find(|edit| edit.name == name).ok_or_else(|| {
            let known: Vec<&str> = EDITS.iter().map(|edit| edit.name).collect();
            let help = choose("edits", &known, name);
            Error::misuse(format!("there is no edit `{name}`")).help(help)
        })
    }
}

/// An edit of how the field is rendered.
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

/// By the rasterizer: each pixel once, without noise, without paths. What is left out of it stays left out.
fn rasterized(options: &mut RenderOptions) {
    options.engine = Engine::Raster;
    options.quality = Quality::spp(1);
    options.techniques.max_depth = None;
}

/// An edit of what parts are made of.
macro_rules! without {
    ($name:literal, $about:literal, $feature:ident) => {
        Edit { name: $name, about: $about, keeps_labels: true, change: Change::Materials(Feature::$feature) }
    };
}

/// An edit of how plants grow.
macro_rules! grown {
    ($name:literal, $about:literal, $change:path) => {
        Edit {
            name: $name,
            about: $about,
            keeps_labels: false,
            change: Change::Growth(Growing { page: None, species: Some($change) }),
        }
    };
}

/// All edits.
pub static EDITS: &[Edit] = &[
    Edit {
        name: "raster",
        about: "drawn as a game engine of 2017 does: shadow maps, no bounces; labels of its own target of ids",
        // But for a few pixels in a million, whose centre lies on an edge.
        keeps_labels: false,
        change: Change::Rendering(rasterized),
    },
    // Light transport.
    rendered!("direct-light", "no light that came by another surface", techniques.max_depth = Some(1)),
    rendered!("one-bounce", "light that came by one other surface at most", techniques.max_depth = Some(2)),
    // Light.
    Edit {
        name: "no-sky",
        about: "sun and lamps alone; a sky stays where nothing else shines",
        keeps_labels: true,
        change: Change::Lights(light::no_sky),
    },
    Edit {
        name: "hard-ambient",
        about: "instead of the sky the same light from everywhere, as much of it on level ground",
        keeps_labels: true,
        change: Change::Lights(light::hard_ambient),
    },
    Edit {
        name: "point-light",
        about: "sun and lamps are points of the same power: shadows have hard edges",
        keeps_labels: true,
        change: Change::Lights(light::points),
    },
    // Surfaces.
    without!("no-transmission", "no light passes through leaves", Transmission),
    without!("no-coat", "leaves without wax: no gloss, the same reflectance", Coat),
    without!("lambert-soil", "soil, stones and straw are Lambert's, wet or dry", Facets),
    without!("no-normal-maps", "no relief finer than the meshes", Relief),
    without!(
        "plain-leaves",
        "leaves in the one colour of their pigments, without their pictures' colours; outlines stay",
        Picture
    ),
    // Geometry.
    Edit {
        name: "flat-soil",
        about: "the ground is a plane under the same texture, without clods; stones, straw and plants come down with it",
        keeps_labels: false,
        change: Change::Growth(Growing { page: Some(growth::flat_soil), species: None }),
    },
    grown!("flat-leaves", "blades are flat sheets from base to tip", growth::flat_leaves),
    grown!("low-poly", "blades of 16 triangles", growth::few_triangles),
    grown!("one-mesh", "all plants of a species in a field are one mesh, in all fields one individual", growth::alike),
    // Camera.
    Edit {
        name: "no-lens-blur",
        about: "a pinhole in perfect focus: neither blur nor depth of field",
        keeps_labels: true,
        change: Change::Lens(picture::sharp),
    },
    Edit {
        name: "no-motion-blur",
        about: "a shutter that opens for no time: a driving robot's pictures are as sharp as its labels",
        keeps_labels: true,
        change: Change::Lens(picture::frozen),
    },
    Edit {
        name: "no-psf",
        about: "optics that blur nothing on the sensor; a pixel's filter stays",
        keeps_labels: true,
        change: Change::Sensor(picture::no_spread),
    },
    Edit {
        name: "no-mosaic-and-matrix",
        about: "every pixel sees all colours, and shows them as the filters have them",
        keeps_labels: true,
        change: Change::Sensor(picture::all_colors),
    },
    Edit {
        name: "no-sensor-noise",
        about: "a sensor that counts every photon once and reads without error",
        keeps_labels: true,
        change: Change::Sensor(|sensor| sensor.noise.on = false),
    },
    Edit {
        name: "no-nir",
        about: "nir.png holds the grey of rgb.png: near infrared tells nothing more",
        keeps_labels: true,
        change: Change::Photograph(picture::gray_nir),
    },
    // Labels.
    Edit {
        name: "smooth-labels",
        about: "labels as anti-aliased colours have them: each pixel's blend of class colours, read as the nearest class",
        keeps_labels: false,
        change: Change::Labels(labels::smooth),
    },
    // Samples.
    rendered!("spp-4", "4 samples a pixel", quality.spp = 4),
    rendered!("spp-16", "16 samples a pixel", quality.spp = 16),
    rendered!("spp-64", "64 samples a pixel", quality.spp = 64),
    rendered!("spp-256", "256 samples a pixel", quality.spp = 256),
    rendered!(
        "denoised",
        "photographs without the noise of few samples; needs Open Image Denoise",
        quality.denoise = true
    ),
];
