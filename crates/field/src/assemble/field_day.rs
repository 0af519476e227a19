//! Day of a field: the age of each plant on that day, and the random streams of daily values.
//!
//! The scene file's growth gives a plant's age on day w. On another day the age is greater by (day − w) · p, where p is the plant's own
//! pace. A plant that emerges on day e has an age of (day − e) · p. A plant with a negative age has not emerged.

use super::season::growths;
use crate::desc::{FieldDesc, Growth};
use crate::library::Library;
use furrow_base::math::{RoundTo, ToFloat};
use furrow_base::ron_file::{Factor, RonFile, Step, Vary};
use furrow_base::sampling::{Purpose, Stream};
use furrow_base::{Error, Result};
use furrow_grow::plant::{self, Stage};
use std::ops::Range;

/// Address of the plant's random stream for its pace.
const PACE: u64 = (1 << 21) + 1;
/// First address of the daily random streams, as children of the field's streams.
const DAYS: u64 = 1 << 32;
/// Size of a plant that has just emerged, relative to its size at the first stage of its species.
const EMERGING: f32 = 0.4;

/// Day of a field.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FieldDay {
    /// Days after the emergence of its first crop.
    pub(super) day: u32,
    /// Degree of soil crusting: fraction of the final share, 0 to 1.
    pub(super) crust: f32,
    /// Day that the scene file's growths refer to.
    written: f32,
    /// Days of growth that a plant makes in one day.
    pace: Vary<Factor>,
}

impl FieldDay {
    /// Returns day `asked`, or else the first day of the scene file; `None` if there is neither. A plant with `EmergesOn` is an error if
    /// there is no day.
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
                    let error = Error::input("a plant emerges on a day, but there are no days")
                        .help("add days: (from: 8, to: 40, every: 4), or give --day");
                    Err(page.blame(&[Step::Field(list), Step::Item(k), Step::Field("growth")], error))
                }
            };
        };
        let crops = sown.map(|k| (&desc.crops[k].species, &desc.crops[k].growth));
        let plants = desc.plants.iter().map(|p| (&p.species, &p.growth));
        let weeds = desc.weeds.iter().map(|w| (&w.species, &w.growth));
        let middle = |(lo, hi): (f64, f64)| (0.5 * (lo + hi)).to_f32();
        let written = match crops.chain(plants).chain(weeds).next().map(|(path, growth)| (path, growth.at(season))) {
            Some((_, Growth::AgeDays(days))) => middle(days.usual()),
            Some((path, Growth::Bbch(code))) => {
                let species = library.species(page, path)?;
                plant::age_days(&species.desc.plant, Stage::Bbch(middle(code.usual()).round_to::<u32>()))
            }
            // The first entry uses `EmergesOn`: ages and stages of the others then refer to the first day.
            _ => first.unwrap_or(0).to_f32(),
        };
        let days = desc.days.clone().unwrap_or_default();
        Ok(Some(Self { day, crust: days.crust(day), written, pace: days.pace }))
    }

    /// Returns the stage that a plant has reached; `None` before it emerges. Growth is drawn from `stream`, pace from the plant's `shape`.
    pub(super) fn stage(
        &self,
        (growth, season): (&Growth, usize),
        desc: &plant::PlantDesc,
        stream: &mut Stream,
        shape: &Stream,
    ) -> Option<Stage> {
        let pace = self.pace.draw32(&mut shape.child(Purpose::Plant, PACE));
        let day = self.day.to_f32();
        let age = match growth.at(season) {
            Growth::EmergesOn(emerges) => (day - emerges.draw32(stream)) * pace,
            growth => plant::age_days(desc, growth.draw(season, stream)) + (day - self.written) * pace,
        };
        (age >= 0.0).then_some(Stage::Age(age))
    }

    /// Returns the day's child of a field stream, for values that are drawn anew each day, such as light and moisture.
    pub(super) fn stream(&self, field: &Stream) -> Stream {
        field.child(Purpose::Page, DAYS + u64::from(self.day))
    }
}

/// Returns the size factor of a plant at an age of `days`: below 1 before the first stage of its species, 1 afterwards.
pub(super) fn emerging(desc: &plant::PlantDesc, days: f32) -> f32 {
    let first = desc.stages.first().map_or(0.0, |stage| stage.days.f32());
    if days < first { EMERGING + (1.0 - EMERGING) * days / first } else { 1.0 }
}
