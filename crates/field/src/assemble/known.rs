//! Records of a built field: species table, model names, drawn crops and weeds.

use super::drawn::Drawn;
use super::model_spots;
use super::models::{self, called};
use super::record::{CropRecord, SpeciesRecord, WeedRecord};
use crate::PlantRecord;
use crate::desc::ModelDesc;
use crate::library::Library;
use furrow_base::math::ToInt;
use furrow_base::ron_file::Step;
use furrow_base::sampling::Purpose;
use furrow_base::{Error, Result};
use furrow_grow::scatter::{Rows, WeedsRecord};
use furrow_render::scene::tag::Class;

/// Returns every species that the scene file can place (crops, weeds, plants, models), in the scene file's order, each once. The
/// list is the same for every index, even if a field has no plant of a species. The lists of crops and weeds decide on the class, for
/// single plants the species file.
pub(super) fn species(drawn: &Drawn<'_>, library: &mut Library) -> Result<Vec<SpeciesRecord>> {
    let (page, desc) = (drawn.page, drawn.desc);
    let crops = desc.crops.iter().map(|c| (&c.species, Some(Class::Crop)));
    let weeds = desc.weeds.iter().map(|w| (&w.species, Some(Class::Weed)));
    let plants = desc.plants.iter().map(|p| (&p.species, None));
    let mut all: Vec<SpeciesRecord> = Vec::new();
    let mut add = |record| {
        if !all.contains(&record) {
            all.push(record);
        }
    };
    for (path, class) in crops.chain(weeds).chain(plants) {
        let desc = &library.species(page, path)?.desc;
        let class = class.unwrap_or(desc.role.class());
        add(SpeciesRecord { name: desc.name.clone(), eppo: desc.eppo.clone(), class });
    }
    for desc in &desc.models {
        let model = library.model(page, desc)?;
        for class in models::classes(desc, &model) {
            add(SpeciesRecord { name: called(desc), eppo: String::new(), class });
        }
    }
    tell_apart(drawn, &all)?;
    Ok(all)
}

/// Returns an error if a model has the name of a role or of a species: dataset classes could not distinguish them.
fn tell_apart(drawn: &Drawn<'_>, species: &[SpeciesRecord]) -> Result<()> {
    let grown =
        |name: &str| species.iter().any(|s| !s.eppo.is_empty() && [&s.name, &s.eppo].contains(&&name.to_owned()));
    let taken = |name: &str| ["soil", "crop", "weed"].contains(&name) || grown(name);
    for (k, desc) in drawn.desc.models.iter().enumerate() {
        if let Some(name) = desc.name.as_ref().filter(|name| taken(name)) {
            let at = [Step::Field("models"), Step::Item(k), Step::Field("name")];
            let fault = Error::input(format!("`{name}` is a role or a species, so no class can mean the model"));
            return Err(drawn.page.blame(&at, fault.help("give the model a name of its own such as \"robot\"")));
        }
    }
    Ok(())
}

/// Returns the records of the crops that this field has and of models in rows, with their drawn values.
pub(super) fn crop_records(drawn: &Drawn<'_>, library: &mut Library) -> Result<Vec<CropRecord>> {
    let mut all = Vec::new();
    for k in drawn.sown.clone() {
        let crop = &drawn.desc.crops[k];
        let species = library.species(drawn.page, &crop.species)?.desc.name.clone();
        let rows = Rows::draw(&crop.rows, &drawn.stream(Purpose::Scatter, k.to_u64())).record();
        all.push(CropRecord { species, rows });
    }
    for (k, desc) in sown_plants(drawn) {
        let rows = model_spots::rows(drawn, k).map(|rows| rows.record());
        all.extend(rows.map(|rows| CropRecord { species: called(desc), rows }));
    }
    Ok(all)
}

/// Returns the records of the weeds and of models sown by density, with their drawn values.
pub(super) fn weed_records(drawn: &Drawn<'_>, library: &mut Library) -> Result<Vec<WeedRecord>> {
    let mut all = Vec::new();
    for (k, weed) in drawn.desc.weeds.iter().enumerate() {
        let species = library.species(drawn.page, &weed.species)?.desc.name.clone();
        let spread = WeedsRecord::draw(&weed.spread, &drawn.stream(Purpose::Scatter, 1000 + k.to_u64()));
        all.push(WeedRecord { species, spread });
    }
    for (k, desc) in sown_plants(drawn) {
        let spread = model_spots::spread(drawn, k);
        all.extend(spread.map(|spread| WeedRecord { species: called(desc), spread }));
    }
    Ok(all)
}

/// Returns the models that are plants, with their indices; those that are sown have rows or a spread.
fn sown_plants<'a>(drawn: &Drawn<'a>) -> impl Iterator<Item = (usize, &'a ModelDesc)> {
    drawn.desc.models.iter().enumerate().filter(|(_, desc)| desc.class != Some(Class::Soil))
}

/// Sets each plant's `kind` to the number of its species in the table, from 1.
pub(super) fn number_kinds(plants: &mut [PlantRecord], table: &[SpeciesRecord]) {
    for plant in plants {
        let same = |s: &SpeciesRecord| s.name == plant.species && s.eppo == plant.eppo && s.class == plant.class;
        plant.kind = table.iter().position(same).map_or(0, |k| k.to_u16() + 1);
    }
}
