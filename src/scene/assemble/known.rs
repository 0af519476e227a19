//! What a builder tells of the field that it built.

use super::builder::Builder;
use super::models::{self, model_name};
use crate::Result;
use crate::sampling::Purpose;
use crate::scatter::{Rows, WeedsRecord};
use crate::scene::PlantRecord;
use crate::scene::record::{CropRecord, SpeciesRecord, WeedRecord};

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
                add(SpeciesRecord { name: model_name(&desc.file), eppo: String::new(), class });
            }
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

/// Gives every plant the number of its species in the table, from 1.
pub(super) fn number_kinds(plants: &mut [PlantRecord], table: &[SpeciesRecord]) {
    for plant in plants {
        let same = |s: &SpeciesRecord| s.name == plant.species && s.eppo == plant.eppo && s.class == plant.class;
        plant.kind = table.iter().position(same).map_or(0, |k| k as u16 + 1);
    }
}
