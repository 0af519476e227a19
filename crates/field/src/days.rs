//! Days on which a field is imaged. A scene file with days describes one field that grows.
//!
//! Days count from the emergence of the field's first crop. A scene file without days describes its field on one day; on another day, the
//! same field is younger or older by the difference.

use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::ron_file::{Count, Factor, Num, Positive, Vary};
use furrow_base::{Error, Result};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

/// Maximum day.
const LATEST: u32 = 1000;

/// Days on which the images of a field are taken: all images of the first day, then all of the next.
///
/// ```
/// use furrow_field::days::DaysDesc;
/// let weekly: DaysDesc = ron::from_str("(from: 8, to: 40, every: 16)").unwrap();
/// assert_eq!(weekly.list().unwrap(), [8, 24, 40]);
/// let some: DaysDesc = ron::from_str("(on: [8, 9, 30], pace: Normal(mean: 1, sd: 0.1))").unwrap();
/// assert_eq!(some.list().unwrap(), [8, 9, 30]);
/// assert!(ron::from_str::<DaysDesc>("(from: 40, to: 8)").unwrap().list().is_err());
/// assert!(ron::from_str::<DaysDesc>("(on: [])").is_err() && ron::from_str::<DaysDesc>("(pace: 11)").is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default, rename = "Days")]
pub struct DaysDesc {
    /// First day, counted from the emergence of the field's first crop; no day may be later than 1000.
    #[schemars(extend("x-example" = "8"))]
    pub from: Num<Count>,
    /// Last day.
    #[schemars(extend("x-example" = "40"))]
    pub to: Num<Count>,
    /// Step from one day to the next, days.
    #[schemars(extend("x-example" = "4"))]
    pub every: Num<Count>,
    /// List of days, instead of `from`, `to` and `every`.
    #[serde(skip_serializing_if = "Vec::is_empty", deserialize_with = "some_days")]
    #[schemars(extend("x-example" = "[8, 9, 30]"))]
    pub on: Vec<Num<Count>>,
    /// Days of growth per day, drawn for each plant: faster plants get further ahead from day to day.
    pub pace: Vary<Factor>,
    /// Time constant of soil crusting by rain, days: after this time, crusts have 63 % of their final share. Crusts form on soil layers
    /// with `clods` below 0.5, from sowing on, ten days before emergence.
    pub crust_days: Num<Positive<1000>>,
}

impl Default for DaysDesc {
    fn default() -> Self {
        let pace = Vary::Drawn(furrow_base::ron_file::Distribution::Normal { mean: 1.0, sd: 0.06, min: 0.7, max: 1.3 });
        let none = Num::new(0.0);
        Self { from: none, to: none, every: Num::new(1.0), on: Vec::new(), pace, crust_days: Num::new(15.0) }
    }
}

impl DaysDesc {
    /// Returns the days in ascending order.
    pub fn list(&self) -> Result<Vec<u32>> {
        let Self { from, to, every, on, .. } = self;
        let whole = |of: &Num<Count>| of.get().trunc_to::<u32>();
        if on.is_empty() {
            return spaced(whole(from), whole(to), whole(every));
        }
        if [from, to].iter().any(|of| !of.is_zero()) {
            return Err(
                Error::input("days are given twice: by `on`, and by `from` and `to`").help("remove one of the two")
            );
        }
        ordered(on.iter().map(whole).collect())
    }

    /// Parses days from a command line: `8..40/4` for every fourth day from 8 to 40, or a list such as `8,12,20`.
    pub fn read(text: &str) -> Result<Vec<u32>> {
        let number = |text: &str| {
            text.trim().parse::<u32>().map_err(|_| {
                Error::misuse(format!("`{text}` is not a day"))
                    .help("write 8..40/4 for every fourth day from 8 to 40, or 8,12,20")
            })
        };
        match text.split_once("..") {
            None => ordered(text.split(',').map(number).collect::<Result<_>>()?),
            Some((from, rest)) => {
                let (to, every) = rest.split_once('/').unwrap_or((rest, "1"));
                spaced(number(from)?, number(to)?, number(every)?)
            }
        }
    }

    /// Returns the degree of crusting on a day, as a fraction of the final share; it approaches 1.
    pub(super) fn crust(&self, day: u32) -> f32 {
        const SOWN_BEFORE: f32 = 10.0;
        -(-(day.to_f32() + SOWN_BEFORE) / self.crust_days.f32()).exp_m1()
    }
}

/// Deserialises a list of days; an empty list is an error.
fn some_days<'de, D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Vec<Num<Count>>, D::Error> {
    let days = Vec::<Num<Count>>::deserialize(deserializer)?;
    if days.is_empty() {
        Err(D::Error::custom("`on` is empty: write at least one day, or leave it out"))
    } else {
        Ok(days)
    }
}

fn spaced(from: u32, to: u32, every: u32) -> Result<Vec<u32>> {
    if every == 0 || to < from {
        let words = format!("there are no days between {from} and {to} in steps of {every}");
        return Err(
            Error::input(words).help("write the first day, a last day that is not earlier, and a step of 1 or more")
        );
    }
    if to > LATEST {
        return too_late(to);
    }
    Ok((from..=to).step_by(every.to_usize()).collect())
}

fn ordered(days: Vec<u32>) -> Result<Vec<u32>> {
    if days.windows(2).any(|pair| pair[1] <= pair[0]) {
        return Err(
            Error::input("days must be in order, without repetition").help("write the earliest first: 8, 12, 20")
        );
    }
    match days.last() {
        Some(last) if *last > LATEST => too_late(*last),
        _ => Ok(days),
    }
}

fn too_late<T>(day: u32) -> Result<T> {
    Err(Error::input(format!("day {day} is later than {LATEST}"))
        .help("days count from the emergence of the first crop"))
}
