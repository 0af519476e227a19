//! Table with a row for each visible or occluded leaf of an image: phenotypic traits and pixel counts.

use super::origin::Origin;
use super::table::{Row, Table};
use crate::model::record::{Leaf, Plant, Record, Seen};
use crate::read::set::{Set, SetWriter};
use furrow_base::Result;
use furrow_base::math::ToFloat;
use furrow_render::scene::tag::Class;

/// Writes the table of a dataset whose images are complete to `path`.
pub(crate) fn write(set: &Set, out: &mut SetWriter<'_>, path: &str) -> Result<()> {
    out.file(path, |out| {
        let seen = Seen::default;
        let leaf = Leaf { number: 0, id: None, seen: seen(), base: None, tip: None, traits: None };
        let plant = Plant {
            number: 0,
            id: None,
            class: Class::Soil,
            kind: 0,
            seen: seen(),
            stem: None,
            grown: None,
            leaves: Vec::new(),
        };
        let mut table = Table::begin(out, &row(&Origin::default(), &plant, &leaf))?;
        for record in set.all() {
            let record: Record = record?;
            let origin = Origin::of(&set.recipe, &record);
            for plant in &record.plants {
                for leaf in &plant.leaves {
                    table.add(row(&origin, plant, leaf))?;
                }
            }
        }
        table.end()
    })
}

fn row(origin: &Origin<'_>, plant: &Plant, leaf: &Leaf) -> Row {
    let grown = plant.grown.as_ref();
    let aged = grown.filter(|grown| !grown.eppo.is_empty());
    let (seen, traits) = (&leaf.seen, leaf.traits);
    let mut row = origin.cells();
    row.extend([
        ("plant", plant.number.cast_signed().into()),
        ("leaf", leaf.number.into()),
        ("id", leaf.id.into()),
        ("class", plant.class.name().into()),
        ("species", aged.map(|grown| grown.eppo.as_str()).into()),
        ("name", grown.map(|grown| grown.species.as_str()).into()),
        ("area_m2", traits.map(|traits| traits.area_m2).into()),
        ("visible_area_m2", traits.map(|traits| traits.area_m2 * seen.shown_fraction().to_f32()).into()),
        ("length_m", traits.map(|traits| traits.length_m).into()),
        ("width_m", traits.map(|traits| traits.width_m).into()),
        ("petiole_m", traits.map(|traits| traits.petiole_m).into()),
        ("inclination_deg", traits.map(|traits| traits.inclination_deg).into()),
        ("azimuth_deg", traits.map(|traits| traits.azimuth_deg).into()),
        ("top_m", traits.map(|traits| traits.top_m).into()),
        ("visible_px", seen.pixels.into()),
        ("unoccluded_px", seen.unoccluded.into()),
        ("whole_px", seen.whole.into()),
    ]);
    row
}
