//! How many plants are to be expected in a field's view, from its densities alone: nothing is grown or placed.

use super::builder::Builder;
use super::{Options, Source};
use crate::Result;
use crate::sampling::Purpose;
use crate::scatter::{Rows, WeedsRecord};
use std::sync::PoisonError;

impl Source {
    /// About how many plants stand in the view of field `options.index`: the mean over all that chance may place there, with the camera
    /// and the densities that this field has.
    pub fn expected_plants(&self, options: &Options) -> Result<f64> {
        let held = || self.library.lock().unwrap_or_else(PoisonError::into_inner);
        let library = held().clone();
        let mut builder = Builder::new(&self.page, &self.desc, options, library)?;
        let plants = builder.expected_plants()?;
        // Maps of light that were read are read once.
        *held() = builder.library;
        Ok(plants)
    }
}

impl Builder<'_> {
    fn expected_plants(&mut self) -> Result<f64> {
        let desc = self.desc;
        let placed = desc.plants.len() as f64;
        if self.sown.is_empty() && desc.weeds.is_empty() {
            return Ok(placed);
        }
        let crops = self.sown.clone().map(|k| {
            let rows = Rows::draw(&desc.crops[k].rows, &self.stream(Purpose::Scatter, k as u64)).record();
            rows.emergence * (1.0 + rows.doubles) / f64::from(rows.spacing_m * rows.in_row_m)
        });
        let weeds = desc
            .weeds
            .iter()
            .zip(1000..)
            .map(|(weed, k)| f64::from(WeedsRecord::draw(&weed.spread, &self.stream(Purpose::Scatter, k)).per_m2));
        let per_m2: f64 = crops.chain(weeds).sum();
        Ok(placed + per_m2 * f64::from(self.view()?.area.area()))
    }
}
