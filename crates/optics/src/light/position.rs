//! Position of the sun, by NREL's algorithm (Reda & Andreas 2004, "Solar position algorithm for solar radiation
//! applications") in `solar-positioning`, and the only time format of scene files: `2016-05-27T14:30:00Z`.

use furrow_base::math::{RoundTo, ToInt};
use furrow_base::ron_file::{from_raw, parse_in, whole};
use furrow_base::{Error, Result};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use solar_positioning::time::JulianDate;
use solar_positioning::{Location, RefractionCorrection, SolarPositions, delta_t};
use std::fmt;

/// Help text of errors: the time format.
const FORM: &str = "write universal time (not local time) as \"2016-05-27T14:30:00Z\"";

/// Point in universal time with a resolution of one second, written `YYYY-MM-DDThh:mm:ssZ`.
///
/// ```
/// use furrow_optics::light::Utc;
/// let noon: Utc = ron::from_str("\"2016-05-27T12:00:00Z\"").unwrap();
/// assert_eq!(noon.to_string(), "2016-05-27T12:00:00Z");
/// assert!(ron::from_str::<Utc>("\"2016-02-30T12:00:00Z\"").is_err());
/// assert!(ron::from_str::<Utc>("\"2016-05-27 12:00\"").is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Utc {
    year: i32,
    month: u32,
    day: u32,
    hour: u32,
    minute: u32,
    second: u32,
}

impl Utc {
    /// Parses the only accepted format; the error states which part is wrong.
    pub fn parse(text: &str) -> Result<Self, String> {
        let form = || format!("`{text}` is not a time");
        let shape_holds = text.len() == 20
            && text.bytes().zip(b"0000-00-00T00:00:00Z".iter()).all(|(byte, &like)| match like {
                b'0' => byte.is_ascii_digit(),
                other => byte == other,
            });
        if !shape_holds {
            return Err(form());
        }
        let number = |from: usize, to: usize| text[from..to].parse::<u32>().map_err(|_| form());
        let time = Self {
            year: number(0, 4)?.to_i32(),
            month: number(5, 7)?,
            day: number(8, 10)?,
            hour: number(11, 13)?,
            minute: number(14, 16)?,
            second: number(17, 19)?,
        };
        let check = |name: &str, value: u32, lo: u32, hi: u32| {
            if (lo..=hi).contains(&value) {
                Ok(())
            } else {
                Err(format!("`{text}` is not a time: {name} {value} is not within {lo} to {hi}"))
            }
        };
        check("month", time.month, 1, 12)?;
        check("day", time.day, 1, days_in(time.year, time.month))?;
        check("hour", time.hour, 0, 23)?;
        check("minute", time.minute, 0, 59)?;
        check("second", time.second, 0, 59)?;
        Ok(time)
    }
}

impl Utc {
    /// Returns the time this number of hours later, rounded to seconds; the time itself if that is not between the
    /// years 0 and 9999.
    #[must_use]
    pub fn later(self, hours: f64) -> Self {
        let seconds = self.seconds() + (hours * 3600.0).round_to::<i64>();
        let (day, of_day) = (seconds.div_euclid(DAY_S), seconds.rem_euclid(DAY_S).to_u32());
        let Some((year, month, day)) = date(day) else { return self };
        Self { year, month, day, hour: of_day / 3600, minute: of_day / 60 % 60, second: of_day % 60 }
    }

    /// Reads the time of a record, which is JSON; scene files are RON and have errors with places.
    pub(super) fn of_record<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::parse(&text).map_err(serde::de::Error::custom)
    }

    /// Returns year, month and day.
    pub fn date(self) -> [u32; 3] {
        [self.year.unsigned_abs(), self.month, self.day]
    }

    /// Returns hour, minute and second.
    pub fn time(self) -> [u32; 3] {
        [self.hour, self.minute, self.second]
    }

    /// Returns the seconds since the start of the year 0.
    fn seconds(self) -> i64 {
        let years: i64 = (0..self.year).map(|year| days_of(year).to_i64()).sum();
        let months: u32 = (1..self.month).map(|month| days_in(self.year, month)).sum();
        let days = years + (months + self.day - 1).to_i64();
        days * DAY_S + (self.hour * 3600 + self.minute * 60 + self.second).to_i64()
    }
}

/// Seconds of a day.
const DAY_S: i64 = 86_400;

/// Returns year, month and day of a number of days since the start of the year 0; `None` outside the years 0 to 9999.
fn date(days: i64) -> Option<(i32, u32, u32)> {
    let mut left = u32::try_from(days).ok()?;
    let mut year = 0;
    while left >= days_of(year) {
        left -= days_of(year);
        year += 1;
    }
    let mut month = 1;
    while left >= days_in(year, month) {
        left -= days_in(year, month);
        month += 1;
    }
    (year <= 9999).then_some((year, month, left + 1))
}

fn days_of(year: i32) -> u32 {
    337 + days_in(year, 2)
}

fn days_in(year: i32, month: u32) -> u32 {
    match month {
        2 if year % 4 == 0 && (year % 100 != 0 || year % 400 == 0) => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

impl fmt::Display for Utc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { year, month, day, hour, minute, second } = self;
        write!(f, "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
    }
}

impl<'de> Deserialize<'de> for Utc {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        from_raw(deserializer, |raw| {
            let text: String = parse_in(raw)?;
            Self::parse(&text).map_err(|message| whole(raw, message, FORM))
        })
    }
}

impl schemars::JsonSchema for Utc {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Utc".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", "x-range": "a time such as \"2016-05-02T10:00:00Z\"" })
    }
}

impl Serialize for Utc {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Position of the sun in the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunPosition {
    /// Elevation, degrees above the horizon.
    pub elevation_deg: f64,
    /// Azimuth, degrees clockwise from north.
    pub azimuth_deg: f64,
}

/// Returns the sun's position `later_h` hours after `utc` at sea level, as it appears through the standard atmosphere
/// if `refracted` is set. Within 0.001° of NREL's own values.
pub fn sun_position(
    utc: Utc,
    later_h: f64,
    latitude_deg: f64,
    longitude_deg: f64,
    refracted: bool,
) -> Result<SunPosition> {
    let refused = |e: solar_positioning::Error| Error::input(format!("no sun position at {utc}: {e}"));
    let delta_t = delta_t::estimate_from_date(utc.year, utc.month).map_err(refused)?;
    let Utc { year, month, day, hour, minute, second } = utc;
    let start = JulianDate::from_utc(year, month, day, hour, minute, f64::from(second), delta_t)
        .map_err(refused)?
        .julian_date();
    let time = JulianDate::new(start + later_h / 24.0, delta_t).map_err(refused)?;
    let place = Location { latitude: latitude_deg, longitude: longitude_deg };
    let refraction = refracted.then(RefractionCorrection::standard);
    let position = SolarPositions::new().at_from_julian(time, place, 0.0, refraction).map_err(refused)?;
    Ok(SunPosition { elevation_deg: position.elevation_angle(), azimuth_deg: position.azimuth() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: times across the ends of hours, days, months, leap years and centuries, by a calendar; a time beyond the
    /// year 9999 stays.
    #[test]
    fn hours_later_is_a_time_of_the_calendar() {
        for (from, hours, to) in [
            ("2016-05-27T11:30:00Z", 0.0, "2016-05-27T11:30:00Z"),
            ("2016-05-27T11:30:00Z", 1.5, "2016-05-27T13:00:00Z"),
            ("2016-05-27T11:30:00Z", -0.5 / 3600.0 * 2.0, "2016-05-27T11:29:59Z"),
            ("2016-02-28T20:00:00Z", 6.0, "2016-02-29T02:00:00Z"),
            ("2100-02-28T20:00:00Z", 6.0, "2100-03-01T02:00:00Z"),
            ("1999-12-31T23:59:59Z", 1.0 / 3600.0, "2000-01-01T00:00:00Z"),
            ("2016-01-01T00:00:00Z", -48.0, "2015-12-30T00:00:00Z"),
            ("9999-12-31T23:00:00Z", 2.0, "9999-12-31T23:00:00Z"),
        ] {
            assert_eq!(Utc::parse(from).unwrap().later(hours).to_string(), to, "{from} and {hours} h");
        }
    }
}
