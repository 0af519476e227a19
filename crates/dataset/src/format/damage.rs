//! Damage of leaves: `damage/SPLIT/MAP/NAME.png`, 8-bit grey, exact at each pixel's centre.
//!
//! | map | contents, of 255 |
//! |---|---|
//! | `chlorosis` | degree of chlorophyll loss in living tissue, times the fraction of living tissue |
//! | `necrosis` | fraction of dead tissue and of the rims of spots; the sum with chlorosis is at most 255 |
//! | `dust` | fraction covered by dust or splashed soil, on the visible side |
//! | `edges` | 255 within the rim, 0.35 mm wide, of a hole, a bite or a tear |
//!
//! All are 0 without damage, and outside leaves.

use furrow_base::math::RoundTo;
use super::{Format, image_file};
use furrow_base::Result;
use crate::File;
use crate::model::recipe::Recipe;
use crate::model::sample::Sample;
use furrow_render::material::Damage;
use furrow_output::ImageData;

pub(super) struct Writer;

const FOLDER: &str = "damage";

/// Value of a map at a point, from 0 to 1.
type Share = fn(&Damage) -> f32;

/// Names of the maps, and their values at a point.
const MAPS: [(&str, Share); 4] = [
    ("chlorosis", |damage| damage.chlorosis),
    ("necrosis", |damage| damage.necrosis),
    ("dust", |damage| damage.soil),
    ("edges", |damage| if damage.edge { 1.0 } else { 0.0 }),
];

impl Format for Writer {
    fn image(&self, _recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let record = &sample.record;
        let damage = &sample.rendered(FOLDER)?.damage;
        let map = |(map, share): (&str, Share)| {
            let values: Vec<u8> = damage.iter().map(|at| (share(at).clamp(0.0, 1.0) * 255.0).round_to::<u8>()).collect();
            let path = format!("{FOLDER}/{}/{map}/{}.png", record.split.name(), record.name);
            image_file::file(sample, path, &ImageData::Gray(&values))
        };
        MAPS.into_iter().map(map).collect()
    }

    fn needs_photograph(&self) -> bool {
        false
    }

    fn needs_damage(&self) -> bool {
        true
    }
}
