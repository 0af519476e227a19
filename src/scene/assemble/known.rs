//! What a builder tells of the field that it built.

use super::builder::Builder;
use super::models::{self, called};
use crate::ron_file::Step;
use crate::sampling::Purpose;
use crate::scatter::{Rows, WeedsRecord};
use crate::scene::record::{CropRecord, SpeciesRecord, WeedRecord};
use crate::scene::{PartKind, PlantRecord};
use crate::{Error, Result};

impl Builder<'_> {
    /// Every species that the scene file can draw: crops, weeds, plants, models, in the scene file's order and each once. The same for
    /// every index, also where a field has no plant of it.
    pub(super) fn species(&mut self) -> Result<Vec<SpeciesRecord>> {
        let (page, desc) = (self.page, self.desc);
        let crops = desc.crops.iter().map(|c| &c.species);
        let weeds = desc.weeds.iter().map(|w| &w.species);
        let plants = desc.plants.iter().map(|p| &p.species);
        let mut all: Vec<SpeciesRecord> = Vec::new();
        let mut add = |record| {
            if !all.contains(&record) {
                all.push(record);
            }
        };
        for path in crops.chain(weeds).chain(plants) {
            let desc = &self.library.species(page, path)?.desc;
            add(SpeciesRecord { name: desc.name.clone(), eppo: desc.eppo.clone(), class: desc.role.class() });
        }
        for desc in &desc.models {
            let model = self.library.model(page, desc)?;
            for class in models::classes(desc, &model) {
                add(SpeciesRecord { name: called(desc), eppo: String::new(), class });
            }
        }
        self.tell_apart(&all)?;
        Ok(all)
    }

    /// Refuses names of models that classes of datasets would take for a role or a species.
    fn tell_apart(&self, species: &[SpeciesRecord]) -> Result<()> {
        let grown =
            |name: &str| species.iter().any(|s| !s.eppo.is_empty() && [&s.name, &s.eppo].contains(&&name.to_owned()));
        let taken = |name: &str| ["soil", "crop", "weed"].contains(&name) || grown(name);
        for (k, desc) in self.desc.models.iter().enumerate() {
            if let Some(name) = desc.name.as_ref().filter(|name| taken(name)) {
                let at = [Step::Field("models"), Step::Item(k), Step::Field("name")];
                let fault = Error::input(format!("`{name}` is a role or a species, so no class could tell the model"));
                return Err(self.page.blame(&at, fault.help("give a name of its own such as \"robot\"")));
            }
        }
        Ok(())
    }

    /// The names that the scene file gives to models from disk, in its order and each once. The same for every index.
    pub(super) fn model_names(&self) -> Result<Vec<String>> {
        let mut all: Vec<String> = Vec::new();
        for (k, desc) in self.desc.models.iter().enumerate() {
            let Some(name) = desc.name.as_ref().filter(|name| !all.contains(name)) else { continue };
            if let Some(fault) = fault_of_name(name, all.len()) {
                let at = [Step::Field("models"), Step::Item(k), Step::Field("name")];
                let help = "give a short name such as \"robot\"; models that are one class may share it";
                return Err(self.page.blame(&at, Error::input(fault).help(help)));
            }
            all.push(name.clone());
        }
        Ok(all)
    }

    /// The crops as they were drawn.
    pub(super) fn crop_records(&mut self) -> Result<Vec<CropRecord>> {
        let mut all = Vec::new();
        for k in self.sown.clone() {
            let crop = &self.desc.crops[k];
            let species = self.library.species(self.page, &crop.species)?.desc.name.clone();
            let rows = Rows::draw(&crop.rows, &self.stream(Purpose::Scatter, k as u64)).record();
            all.push(CropRecord { species, rows });
        }
        Ok(all)
    }

    /// The weeds as they were drawn.
    pub(super) fn weed_records(&mut self) -> Result<Vec<WeedRecord>> {
        let mut all = Vec::new();
        for (k, weed) in self.desc.weeds.iter().enumerate() {
            let species = self.library.species(self.page, &weed.species)?.desc.name.clone();
            let spread = WeedsRecord::draw(&weed.spread, &self.stream(Purpose::Scatter, 1000 + k as u64));
            all.push(WeedRecord { species, spread });
        }
        Ok(all)
    }
}

/// What is wrong with a new name of a model where so many others are known.
fn fault_of_name(name: &str, known: usize) -> Option<&'static str> {
    if name.is_empty() || name.trim() != name || name.contains([',', ';', '=']) {
        return Some("no class can tell a model of such a name: it is empty, ends in spaces or holds `,`, `;` or `=`");
    }
    if name.contains(char::is_control) {
        return Some("the name of this model holds a character that ends lines or is not seen");
    }
    (known >= PartKind::MOST_NAMED).then_some("label maps have numbers for 100 names of models, and this is one more")
}

/// Gives every plant the number of its species in the table, from 1.
pub(super) fn number_kinds(plants: &mut [PlantRecord], table: &[SpeciesRecord]) {
    for plant in plants {
        let same = |s: &SpeciesRecord| s.name == plant.species && s.eppo == plant.eppo && s.class == plant.class;
        plant.kind = table.iter().position(same).map_or(0, |k| k as u16 + 1);
    }
}
