//! The day on which a field is grown: how old each of its plants is, and what is drawn for that day.
//!
//! A plant's age is (day − w) · p days more than the scene file writes it, where w is the day that the scene file describes and p the
//! plant's own pace; a plant that emerges on day e is (day − e) · p days old. Where that is below 0 it is not there yet.

use super::season::growths;
use crate::plant::{self, Stage};
use crate::ron_file::{Factor, RonFile, Step, Vary};
use crate::sampling::{Purpose, Stream};
use crate::scene::desc::{FieldDesc, Growth};
use crate::scene::library::Library;
use crate::{Error, Result};
use std::ops::Range;

/// Which of a plant's streams its pace is drawn from.
const PACE: u64 = (1 << 21) + 1;
/// Address of the first of the streams of days, below those of what is drawn daily.
const DAYS: u64 = 1 << 32;
/// Size of a plant that has just emerged, over that which it has at its species' first stage.
const EMERGING: f32 = 0.4;

/// A field's day.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Today {
    /// Days after the emergence of its first crop.
    pub(super) day: u32,
    /// How much of their final share crusts have.
    pub(super) crust: f32,
    /// The day that the scene file describes.
    written: f32,
    /// How many days' growth a plant makes in one.
    pace: Vary<Factor>,
}

impl Today {
    /// Day `asked`, or else the scene file's first; none where neither is. Refuses plants that emerge on a day where there is none.
    pub(super) fn of(
        (page, desc): (&RonFile, &FieldDesc),
        library: &mut Library,
        asked: Option<u32>,
        (sown, season): (Range<usize>, usize),
    ) -> Result<Option<Self>> {
        let first = match &desc.days {
            Some(days) => days.list().map_err(|e| page.blame(&[Step::Field("days")], e))?.first().copied(),
            None => None,
        };
        let Some(day) = asked.or(first) else {
            return match growths(desc).find(|(.., growth)| growth.emerges()) {
                None => Ok(None),
                Some((list, k, _)) => {
                    let error = Error::input("a plant emerges on a day, and there are no days")
                        .help("add days: (from: 8, to: 40, every: 4), or give --day");
                    Err(page.blame(&[Step::Field(list), Step::Item(k), Step::Field("growth")], error))
                }
            };
        };
        let crops = sown.map(|k| (&desc.crops[k].species, &desc.crops[k].growth));
        let plants = desc.plants.iter().map(|p| (&p.species, &p.growth));
        let weeds = desc.weeds.iter().map(|w| (&w.species, &w.growth));
        let middle = |(lo, hi): (f64, f64)| (0.5 * (lo + hi)) as f32;
        let written = match crops.chain(plants).chain(weeds).next().map(|(path, growth)| (path, growth.at(season))) {
            Some((_, Growth::AgeDays(days))) => middle(days.usual()),
            Some((path, Growth::Bbch(code))) => {
                let species = library.species(page, path)?;
                plant::age_days(&species.desc.plant, Stage::Bbch(middle(code.usual()).round() as u32))
            }
            // Its crop is told by days alone: what is told by ages has them on the first day.
            _ => first.unwrap_or(0) as f32,
        };
        let days = desc.days.clone().unwrap_or_default();
        Ok(Some(Self { day, crust: days.crust(day), written, pace: days.pace }))
    }

    /// The stage that a plant has reached; none before it emerges. `stream` is what its growth is drawn from, `shape` its own.
    pub(super) fn stage(
        &self,
        (growth, season): (&Growth, usize),
        desc: &plant::PlantDesc,
        stream: &mut Stream,
        shape: &Stream,
    ) -> Option<Stage> {
        let pace = self.pace.draw32(&mut shape.child(Purpose::Plant, PACE));
        let day = self.day as f32;
        let age = match growth.at(season) {
            Growth::EmergesOn(emerges) => (day - emerges.draw32(stream)) * pace,
            growth => plant::age_days(desc, growth.draw(season, stream)) + (day - self.written) * pace,
        };
        (age >= 0.0).then_some(Stage::Age(age))
    }

    /// The stream of what the weather draws anew every day, below that of what the field draws once.
    pub(super) fn stream(&self, field: &Stream) -> Stream {
        field.child(Purpose::Page, DAYS + u64::from(self.day))
    }
}

/// Factor on the sizes of a plant of `days` that has not reached its species' first stage, 1 from there on.
pub(super) fn emerging(desc: &plant::PlantDesc, days: f32) -> f32 {
    let first = desc.stages.first().map_or(0.0, |stage| stage.days.f32());
    if days < first { EMERGING + (1.0 - EMERGING) * days / first } else { 1.0 }
}
