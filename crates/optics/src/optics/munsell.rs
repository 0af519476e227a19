//! Colours in Munsell notation, as used by soil charts: `10YR 4/3` is hue, value and chroma.
//!
//! Luminance follows from value by ASTM D1535: Y = 1.1914 V − 0.22533 V² + 0.23352 V³ − 0.020484 V⁴ + 0.00081939 V⁵, in
//! percent of a perfect white. `munsell.csv` lists chromaticities for whole values, even chromas and hues in steps of
//! 2.5 from 5R to 10Y (Newhall, Nickerson & Judd 1943); they are interpolated linearly. Chroma 0 is the white of
//! illuminant C.
//!
//! The conversion from illuminant C to D65 uses Bradford's transform, which maps white to white. The notation does
//! not include near infrared: NIR is red times the NIR/R ratio of the measured soil with the most similar colour.

use super::{bands, soil};
use furrow_base::math::{RoundTo, Spectrum, ToFloat};
use furrow_base::ron_file::{from_raw, parse_in, whole};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::fmt;
use std::sync::LazyLock;

/// Chromaticity of illuminant C.
const WHITE: [f64; 2] = [0.31006, 0.31616];
/// Bradford chromatic adaptation from illuminant C to D65. Source: Lindbloom, "Chromatic Adaptation".
const ADAPT: [[f64; 3]; 3] = [
    [0.990_447_6, -0.007_168_3, -0.011_615_6],
    [-0.012_371_2, 1.015_595_0, -0.002_928_2],
    [-0.003_563_5, 0.006_769_7, 0.918_156_9],
];
/// Position of the table's first hue, 5R, on the hue scale; then the hue step. 10R is at 10, 10YR at 20, 10Y at 30.
const FIRST_HUE: f64 = 5.0;
const STEP: f64 = 2.5;
const LAST_HUE: f64 = 30.0;
/// Help text of errors: the accepted notation.
const FORM: &str = "write hue, value and chroma as soil charts do, such as \"10YR 4/3\", or \"N 4\" for a grey; hues go from 5R to 10Y, \
                    values from 1 to 9, chroma to 8";

/// Chromaticities by hue step, value and half the chroma.
static TABLE: LazyLock<BTreeMap<(u32, u32, u32), [f64; 2]>> = LazyLock::new(|| {
    let mut table = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(&include_bytes!("munsell.csv")[..]);
    let rows = table.deserialize::<(String, u32, u32, f64, f64)>();
    rows.map(|row| {
        let (name, value, chroma, x, y) = row.expect("the embedded table is a hue and four numbers");
        let hue = hue(&name).expect("the embedded table writes hues in Munsell notation");
        ((((hue - FIRST_HUE) / STEP).trunc_to::<u32>(), value, chroma / 2), [x, y])
    })
    .collect()
});

/// Colour given in Munsell notation.
#[derive(Clone, Debug, PartialEq)]
pub struct Munsell {
    text: String,
    /// Chromaticity x, y under illuminant C, and luminance Y relative to a perfect white.
    xyy: [f64; 3],
}

impl Munsell {
    /// Parses a Munsell notation. The error message states that it is not valid, or that the table does not contain it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let no = || format!("`{text}` is not a Munsell notation of a soil");
        let (name, rest) = match text.trim().strip_prefix('N') {
            Some(value) => ("N", value.trim().trim_end_matches('/')),
            None => text.trim().split_once(char::is_whitespace).ok_or_else(no)?,
        };
        let (value, chroma) = if name == "N" { (rest, "0") } else { rest.split_once('/').ok_or_else(no)? };
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|n| n.is_finite()).ok_or_else(no);
        let (value, chroma) = (number(value)?, number(chroma)?);
        let hue = if name == "N" { FIRST_HUE } else { hue(name).ok_or_else(no)? };
        if !(1.0..=9.0).contains(&value) || !(0.0..=8.0).contains(&chroma) || !(FIRST_HUE..=LAST_HUE).contains(&hue) {
            return Err(no());
        }
        let xy = chromaticity(hue, value, chroma)
            .ok_or_else(|| format!("no surface is as colourful at value {value} as `{text}`"))?;
        Ok(Self { text: text.trim().to_owned(), xyy: [xy[0], xy[1], luminance(value)] })
    }

    /// Returns the chromaticity x, y under illuminant C and the luminance Y relative to a perfect white.
    pub fn xyy(&self) -> [f64; 3] {
        self.xyy
    }

    /// Returns the reflectance in R, G, B and NIR.
    pub fn reflectance(&self) -> Spectrum {
        let [x, y, luminance] = self.xyy;
        let under_c = [x, y, 1.0 - x - y].map(|part| part * luminance / y);
        let under_d65 = ADAPT.map(|row| row.iter().zip(under_c).map(|(a, b)| a * b).sum());
        let rgb = bands::rec709(under_d65).map(|band| band.clamp(0.0, 1.0).to_f32());
        soil::at(rgb, soil::most_similar(rgb))
    }
}

/// Returns the position of a hue such as `2.5YR` on the hue scale.
fn hue(name: &str) -> Option<f64> {
    let letters = name.find(char::is_alphabetic)?;
    let begin = match &name[letters..] {
        "R" => 0.0,
        "YR" => 10.0,
        "Y" => 20.0,
        _ => return None,
    };
    let number: f64 = name[..letters].parse().ok()?;
    (number > 0.0 && number <= 10.0).then_some(begin + number)
}

/// Returns the luminance of Munsell value `v` relative to a perfect white.
fn luminance(v: f64) -> f64 {
    0.01 * v * (1.1914 + v * (-0.22533 + v * (0.23352 + v * (-0.020484 + v * 0.00081939))))
}

/// Interpolates linearly between the eight surrounding colours of the table. Returns `None` if one with non-zero weight
/// is missing.
fn chromaticity(hue: f64, value: f64, chroma: f64) -> Option<[f64; 2]> {
    let ends = |at: f64| [(at.floor(), 1.0 - at.fract()), (at.floor() + 1.0, at.fract())];
    let mut sum = [0.0; 2];
    for (h, of_hue) in ends((hue - FIRST_HUE) / STEP) {
        for (v, of_value) in ends(value) {
            for (c, of_chroma) in ends(chroma / 2.0) {
                let weight = of_hue * of_value * of_chroma;
                if weight > 0.0 {
                    let xy = if c == 0.0 {
                        WHITE
                    } else {
                        *TABLE.get(&(h.trunc_to::<u32>(), v.trunc_to::<u32>(), c.trunc_to::<u32>()))?
                    };
                    sum.iter_mut().zip(xy).for_each(|(sum, part)| *sum += weight * part);
                }
            }
        }
    }
    Some(sum)
}

impl fmt::Display for Munsell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl<'de> Deserialize<'de> for Munsell {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        from_raw(deserializer, |raw| {
            let text: String = parse_in(raw)?;
            Self::parse(&text).map_err(|message| whole(raw, message, FORM))
        })
    }
}

impl Serialize for Munsell {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl schemars::JsonSchema for Munsell {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Munsell".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", "x-range": "Munsell notation such as \"10YR 4/3\"" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: soil charts are read by many programs, which must agree. Expected: the table's own colours; for 4.2YR
    /// 8.1/5.3, which is between them, x 0.38737, y 0.35752, Y 0.59362, up to the error of linear interpolation on
    /// curved lines of constant hue. Source: the documentation of colour-science 0.4.7, `munsell_colour_to_xyY`; ASTM
    /// D1535.
    #[test]
    fn published_colours_are_met() {
        for (text, expected, by) in [
            ("10YR 4/2", [0.3660, 0.3590, 0.1170], 5e-4),
            ("4.2YR 8.1/5.3", [0.387_369, 0.357_517, 0.593_62], 2e-3),
            ("N8.9", [0.31006, 0.31616, 0.746_13], 2e-4),
        ] {
            let xyy = Munsell::parse(text).unwrap().xyy();
            assert!(xyy.iter().zip(expected).all(|(a, b)| (a - b).abs() < by), "{text}: {xyy:?}");
        }
    }

    /// Expected: a grey of value 5 reflects 19.27 % in each visible band (ASTM D1535); loam given by its chart colour
    /// is close to measured loam.
    #[test]
    fn reflectances_are_those_of_soils() {
        let [r, g, b, _] = Munsell::parse("N 5/").unwrap().reflectance().to_array();
        assert!([r, g, b].iter().all(|band| (band - 0.1927).abs() < 5e-4), "{r} {g} {b}");
        let soil = Munsell::parse("10YR 5/3").unwrap().reflectance().to_array();
        assert!(soil[0] > soil[1] && soil[1] > soil[2] && soil[3] > soil[0], "{soil:?}");
    }

    #[test]
    fn what_is_no_soil_colour_is_refused() {
        for text in
            ["", "10YR", "10YR 4", "10YR 4/x", "5B 4/3", "12YR 4/3", "10YR 0/3", "10YR 4/9", "2.5R 4/3", "10YR 1/6"]
        {
            assert!(Munsell::parse(text).is_err(), "{text}");
        }
        assert!(Munsell::parse(" 2.5Y 6/2 ").is_ok());
    }
}
