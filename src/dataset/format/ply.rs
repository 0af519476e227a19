//! Point clouds: `ply/SPLIT/NAME.ply`, a point for each pixel that shows a surface, with colour and labels.
//!
//! | property | type | is |
//! |---|---|---|
//! | `x y z` | float | the surface at the pixel's centre, world, metres |
//! | `nx ny nz` | float | unit normal on the side that the camera sees; normal maps are not in it |
//! | `red green blue nir` | uchar | the photograph |
//! | `class` | uchar | 0 soil, 1 crop, 2 weed |
//! | `part` | uchar | what it is, with the numbers of the format `parts` |
//! | `plant leaf` | ushort | numbers of `plants.png` and `leaves.png` |
//!
//! Binary, little endian. Points are in the order of the pixels; a second image of the same field adds to the same world.
//!
//! Source: Turk 1994, "The PLY Polygon File Format".

use super::{Format, parts};
use crate::dataset::keep::Kept;
use crate::dataset::recipe::Recipe;
use crate::dataset::sample::Sample;
use crate::dataset::File;
use crate::Result;

pub(super) struct Writer;

const FOLDER: &str = "ply";

/// Names and types of the properties, in the order in which they are written.
const PROPERTIES: [(&str, &str); 14] = [
    ("float", "x"),
    ("float", "y"),
    ("float", "z"),
    ("float", "nx"),
    ("float", "ny"),
    ("float", "nz"),
    ("uchar", "red"),
    ("uchar", "green"),
    ("uchar", "blue"),
    ("uchar", "nir"),
    ("uchar", "class"),
    ("uchar", "part"),
    ("ushort", "plant"),
    ("ushort", "leaf"),
];

/// Bytes of a point.
const POINT: usize = 6 * 4 + 6 + 2 * 2;

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let record = &sample.record;
        let parts = parts::numbers(FOLDER, sample)?;
        let rendered = sample.rendered(FOLDER)?;
        let (width, _) = sample.size();
        let camera = &rendered.camera;
        let axis = camera.pose().axes.z_axis;
        let mut points = Vec::with_capacity(sample.pixels() * POINT);
        let mut count = 0_u64;
        for (i, depth) in rendered.labels.depth.iter().enumerate().filter(|(_, depth)| depth.is_finite()) {
            let (origin, direction) = camera.centre_ray(i as u32 % width, i as u32 / width);
            // Depth is along the optical axis.
            let at = origin + direction * (depth / direction.dot(axis));
            let numbers = at.to_array().into_iter().chain(rendered.labels.normals[i].to_array());
            points.extend(numbers.flat_map(f32::to_le_bytes));
            points.extend(sample.rgb[i]);
            points.extend([sample.nir[i], sample.semantics[i], parts[i]]);
            points.extend(sample.plants[i].to_le_bytes());
            points.extend(sample.leaves[i].to_le_bytes());
            count += 1;
        }
        let mut bytes = header(count, &recipe.furrow).into_bytes();
        bytes.append(&mut points);
        Ok(vec![File { path: format!("{FOLDER}/{}/{}.ply", record.split.name(), record.name), bytes }])
    }

    fn needs_maps(&self) -> &'static [Kept] {
        &[Kept::Nir]
    }

    fn needs_film(&self) -> bool {
        true
    }
}

fn header(points: u64, version: &str) -> String {
    let properties = PROPERTIES.map(|(kind, name)| format!("property {kind} {name}\n")).concat();
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment furrow {version}; world coordinates, metres, z up\nelement vertex {points}\n{properties}end_header\n"
    )
}
