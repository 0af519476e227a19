//! Phenotypic traits: `plants.csv`, `leaves.csv`, `images.csv` with one row each, and leaves also as `leaves.parquet`.
//! Plants and images are in Parquet tables beside every dataset ([`crate::index`]).
//!
//! Areas, lengths and angles are those of [`furrow_field::traits`]: of the grown plants, visible or not. Plants and
//! leaves that are neither visible nor occluded in an image have no row. `visible_area_m2` is a leaf's area times the
//! visible fraction of its pixels, which is exact for a leaf with the same inclination everywhere.
//!
//! Cells of unknown values (models, imported images) are empty. The first row names the columns; the first columns
//! identify the image of a row (`index/origin.rs`).

use furrow_base::math::ToFloat;
use super::{Format, SetWriter};
use crate::index::leaves;
use crate::index::origin::Origin;
use crate::model::recipe::Recipe;
use crate::model::record::{PlantAttributes, Leaf, Plant, Record};
use crate::read::set::{Set, Stream};
use furrow_render::scene::tag::Class;
use furrow_base::{Error, Result};
use serde::Serialize;

pub(super) struct Writer;

const FOLDER: &str = "traits";

#[derive(Default, Serialize)]
struct PlantRow<'a> {
    plant: u32,
    id: Option<u32>,
    class: &'static str,
    species: Option<&'a str>,
    eppo: Option<&'a str>,
    bbch: Option<u32>,
    age_days: Option<f32>,
    x_m: Option<f32>,
    y_m: Option<f32>,
    z_m: Option<f32>,
    height_m: Option<f32>,
    radius_m: Option<f32>,
    leaves: Option<u16>,
    leaf_area_m2: Option<f32>,
    cover_m2: Option<f32>,
    top_m: Option<f32>,
    pixels: u32,
    unoccluded_pixels: Option<u32>,
    whole_pixels: Option<u32>,
}

#[derive(Default, Serialize)]
struct LeafRow<'a> {
    plant: u32,
    leaf: u16,
    id: Option<u32>,
    species: Option<&'a str>,
    area_m2: Option<f32>,
    visible_area_m2: Option<f32>,
    length_m: Option<f32>,
    width_m: Option<f32>,
    petiole_m: Option<f32>,
    inclination_deg: Option<f32>,
    azimuth_deg: Option<f32>,
    top_m: Option<f32>,
    pixels: u32,
    unoccluded_pixels: Option<u32>,
    whole_pixels: Option<u32>,
}

#[derive(Default, Serialize)]
struct ImageRow {
    ground_m2: Option<f32>,
    leaf_area_m2: Option<f32>,
    lai: Option<f32>,
    soil_pixels: u64,
    crop_pixels: u64,
    weed_pixels: u64,
}

impl Format for Writer {
    fn has_images(&self, _recipe: &Recipe) -> bool {
        false
    }

    fn needs_photograph(&self) -> bool {
        false
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        table::<PlantRow<'_>>(set, out, "plants.csv", |record, origin, table| {
            record.plants.iter().try_for_each(|plant| table.row(origin, PlantRow::of(plant)))
        })?;
        table::<LeafRow<'_>>(set, out, "leaves.csv", |record, origin, table| {
            let mut leaves = record.plants.iter().flat_map(|plant| plant.leaves.iter().map(move |leaf| (plant, leaf)));
            leaves.try_for_each(|(plant, leaf)| table.row(origin, LeafRow::of(plant, leaf)))
        })?;
        table::<ImageRow>(set, out, "images.csv", |record, origin, table| table.row(origin, ImageRow::of(record)))?;
        leaves::write(set, out, &format!("{FOLDER}/leaves.parquet"))
    }
}

/// A table that is being written.
struct Table<'s, 'f>(csv::Writer<&'s mut Stream<'f>>);

impl Table<'_, '_> {
    /// Adds a row about an image.
    fn row(&mut self, origin: &Origin<'_>, row: impl Serialize) -> Result<()> {
        self.0.serialize((origin, row)).map_err(failed)
    }
}

#[expect(clippy::needless_pass_by_value, reason = "`map_err` passes the error by value")]
fn failed(error: csv::Error) -> Error {
    Error::failed(format!("a table of {FOLDER} cannot be written: {error}"))
}

/// Returns the names of the columns of a row `T`, separated by commas.
fn columns<T: Serialize + Default>() -> Result<Vec<u8>> {
    let mut names = csv::Writer::from_writer(Vec::new());
    names.serialize(T::default()).map_err(failed)?;
    let mut names = names.into_inner().map_err(|e| failed(e.into_error().into()))?;
    names.truncate(names.iter().position(|byte| *byte == b'\n').unwrap_or(names.len()));
    Ok(names)
}

/// Writes a table of rows `T`: the names of its columns, then the rows of all records.
fn table<T: Serialize + Default>(
    set: &Set,
    out: &mut SetWriter<'_>,
    name: &str,
    rows: impl Fn(&Record, &Origin<'_>, &mut Table<'_, '_>) -> Result<()>,
) -> Result<()> {
    // The writer would add names only with a first row, but a table without rows needs them too.
    let names = [columns::<Origin<'_>>()?, columns::<T>()?].join(&b',');
    out.file(&format!("{FOLDER}/{name}"), |stream| {
        stream.put(names)?;
        stream.put("\n")?;
        let mut table = Table(csv::WriterBuilder::new().has_headers(false).from_writer(stream));
        for record in set.all() {
            let record = record?;
            rows(&record, &Origin::of(&set.recipe, &record), &mut table)?;
        }
        table.0.flush().map_err(|e| failed(e.into()))
    })
}

impl<'a> PlantRow<'a> {
    fn of(plant: &'a Plant) -> Self {
        let grown = plant.grown.as_ref();
        let place = |axis: usize| grown.map(|grown| grown.position_m[axis]);
        // Models have neither an EPPO code nor an age.
        let aged = grown.filter(|grown| !grown.eppo.is_empty());
        let traits = grown.and_then(|grown| grown.traits);
        Self {
            plant: plant.number,
            id: plant.id,
            class: plant.class.name(),
            species: grown.map(|grown| grown.species.as_str()),
            eppo: aged.map(|grown| grown.eppo.as_str()),
            bbch: aged.map(|grown| grown.bbch),
            age_days: aged.map(|grown| grown.age_days),
            x_m: place(0),
            y_m: place(1),
            z_m: place(2),
            height_m: grown.map(|grown| grown.height_m),
            radius_m: grown.map(|grown| grown.radius_m),
            leaves: grown.map(|grown| grown.leaves),
            leaf_area_m2: traits.map(|traits| traits.leaf_area_m2),
            cover_m2: traits.map(|traits| traits.cover_m2),
            top_m: traits.map(|traits| traits.top_m),
            pixels: plant.seen.pixels,
            unoccluded_pixels: plant.seen.unoccluded,
            whole_pixels: plant.seen.whole,
        }
    }
}

impl<'a> LeafRow<'a> {
    fn of(plant: &'a Plant, leaf: &Leaf) -> Self {
        let traits = leaf.traits;
        let species = plant.grown.as_ref().map(|PlantAttributes { species, .. }| species.as_str());
        Self {
            plant: plant.number,
            leaf: leaf.number,
            id: leaf.id,
            species,
            area_m2: traits.map(|traits| traits.area_m2),
            visible_area_m2: traits.map(|traits| traits.area_m2 * leaf.seen.shown_fraction().to_f32()),
            length_m: traits.map(|traits| traits.length_m),
            width_m: traits.map(|traits| traits.width_m),
            petiole_m: traits.map(|traits| traits.petiole_m),
            inclination_deg: traits.map(|traits| traits.inclination_deg),
            azimuth_deg: traits.map(|traits| traits.azimuth_deg),
            top_m: traits.map(|traits| traits.top_m),
            pixels: leaf.seen.pixels,
            unoccluded_pixels: leaf.seen.unoccluded,
            whole_pixels: leaf.seen.whole,
        }
    }
}

impl ImageRow {
    fn of(record: &Record) -> Self {
        let canopy = record.canopy;
        let pixels = |class: Class| record.classes.iter().filter(|share| share.class == class).map(|share| share.pixels).sum();
        Self {
            ground_m2: canopy.map(|canopy| canopy.ground_m2),
            leaf_area_m2: canopy.and_then(|canopy| canopy.leaf_area_m2),
            lai: canopy.and_then(|canopy| canopy.lai),
            soil_pixels: pixels(Class::Soil),
            crop_pixels: pixels(Class::Crop),
            weed_pixels: pixels(Class::Weed),
        }
    }
}
