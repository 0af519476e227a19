//! Point clouds: `ply/SPLIT/NAME.ply`, one point for each pixel that shows a surface, with colour and labels.
//!
//! | property | type | contents |
//! |---|---|---|
//! | `x y z` | float | the surface at the pixel's centre, world space, metres |
//! | `nx ny nz` | float | unit normal on the visible side, without normal maps |
//! | `red green blue nir` | uchar | the rendered image |
//! | `class` | uchar | 0 soil, 1 crop, 2 weed |
//! | `part` | uchar | number of the part, as in the format `parts` |
//! | `plant` | int | number in `plants.png` |
//! | `leaf` | int | number in `leaves.png` |
//!
//! Binary, little endian. Points are in the order of the pixels; all images of a field share one world space.
//!
//! Source: Turk 1994, "The PLY Polygon File Format".

use furrow_base::math::ToInt;
use super::{Format, parts};
use crate::model::optional_maps::OptionalMap;
use crate::model::recipe::Recipe;
use crate::model::sample::Sample;
use crate::File;
use furrow_base::Result;
use furrow_output::cloud::{Cloud, Point};

pub(super) struct Writer;

const FOLDER: &str = "ply";

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let record = &sample.record;
        let parts = parts::numbers(FOLDER, sample)?;
        let rendered = sample.rendered(FOLDER)?;
        let (width, _) = sample.size();
        let camera = &rendered.camera;
        let axis = camera.pose().axes.z_axis;
        let mut cloud = Cloud::default();
        for (i, depth) in rendered.labels.depth.iter().enumerate().filter(|(_, depth)| depth.is_finite()) {
            let (origin, direction) = camera.centre_ray(i.to_u32() % width, i.to_u32() / width);
            // Depth is along the optical axis.
            let at = origin + direction * (depth / direction.dot(axis));
            cloud.add(&Point {
                at: at.to_array(),
                normal: rendered.labels.normals[i].to_array(),
                rgb: sample.rgb[i],
                nir: sample.nir[i],
                kind: [sample.semantics[i], parts[i]],
                plant: sample.plants[i],
                leaf: sample.leaves[i],
            });
        }
        let path = format!("{FOLDER}/{}/{}.ply", record.split.name(), record.name);
        Ok(vec![File { path, bytes: cloud.file(&recipe.furrow) }])
    }

    fn needs_maps(&self) -> &'static [OptionalMap] {
        &[OptionalMap::Nir]
    }

    fn needs_film(&self) -> bool {
        true
    }
}
