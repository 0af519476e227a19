//! What is wrong with leaves: `damage/SPLIT/MAP/NAME.png`, 8 bits of grey, exact at each pixel's centre.
//!
//! | map | holds, of 255 |
//! |---|---|
//! | `chlorosis` | degree to which living tissue has lost its green, times its share |
//! | `necrosis` | share of dead tissue and of the rims of spots; with chlorosis at most 255 |
//! | `dust` | share under dust or splashed soil, on the side that is seen |
//! | `edges` | 255 within the rim, 0.35 mm wide, of a hole, a bite or a tear |
//!
//! All are 0 where nothing of this is, and on what is no leaf.

use super::{Format, picture};
use furrow_base::Result;
use crate::File;
use crate::model::recipe::Recipe;
use crate::model::sample::Sample;
use furrow_render::material::Damage;
use furrow_output::Picture;

pub(super) struct Writer;

const FOLDER: &str = "damage";

/// What a map holds of a place, from 0 to 1.
type Share = fn(&Damage) -> f32;

/// The maps: their names, and what they hold of a place.
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
            let values: Vec<u8> = damage.iter().map(|at| (share(at).clamp(0.0, 1.0) * 255.0).round() as u8).collect();
            let path = format!("{FOLDER}/{}/{map}/{}.png", record.split.name(), record.name);
            picture::file(sample, path, &Picture::Gray(&values))
        };
        MAPS.into_iter().map(map).collect()
    }

    fn needs_film(&self) -> bool {
        true
    }

    fn needs_photograph(&self) -> bool {
        false
    }

    fn needs_damage(&self) -> bool {
        true
    }
}
