//! Advice: the fields of the scene file to change for a large distance, and the direction of each change.
//!
//! The table is in `rows`: a feature, one of its channels, and what to do if the synthetic set has more or less of it
//! than the real one. If the means agree and the distributions do not, the spread is wrong. Advice is ordered, because
//! earlier changes affect later distances; only one field should be changed at a time.

use super::feature::{Feature, Pool};
use super::sets::Gap;
use crate::Region;
use furrow_base::math::ToFloat;
use furrow_report::number;
use serde::Serialize;

/// A difference of means below this fraction of the distance is ignored: the spread is what differs.
const MEAN: f64 = 0.35;
/// Plants are considered as light as real ones if their difference is below this fraction of the soil's difference.
const ALIKE: f64 = 1.0 / 3.0;

/// Order of advice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Step {
    /// Ground area per pixel.
    PixelSize,
    /// Brightness of images.
    Exposure,
    /// White balance and saturation.
    Color,
    /// Colour of the soil.
    SoilColor,
    /// Colour of plants.
    PlantColor,
    /// Number and size of plants.
    Cover,
    /// Contrast and shadows.
    Light,
    /// Structure of the ground, blur, sharpening.
    Texture,
    /// Noise of the sensor.
    Noise,
    /// Outlines of labels.
    Outlines,
}

/// Direction of a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ChangeDirection {
    /// To larger values.
    Raise,
    /// To smaller values.
    Lower,
    /// To a wider distribution.
    Widen,
    /// To a narrower distribution.
    Narrow,
    /// To another choice.
    Change,
}

use ChangeDirection::{Change, Lower, Raise};

/// Field to change, and the direction.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FieldChange {
    /// Path of the field, as accepted by `trace explain`.
    pub field: String,
    /// Direction of the change.
    pub way: ChangeDirection,
}

/// Advice on one or several distances.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Advice {
    /// Position in the order of advice.
    pub step: Step,
    /// Sentence that states which quantity is too large or too small.
    pub words: String,
    /// Fields to change, the most likely first.
    pub turns: Vec<FieldChange>,
    /// Keys of the distances that it refers to.
    pub features: Vec<String>,
}

/// Row of the table.
struct Row {
    feature: Feature,
    /// Channel of a colour: L*, a*, b*; 0 for all other features.
    channel: usize,
    step: Step,
    more: Side,
    less: Side,
}

/// Advice if a feature is too large, or if it is too small.
struct Side {
    words: &'static str,
    turns: &'static [(&'static str, ChangeDirection)],
}

const fn side(words: &'static str, turns: &'static [(&'static str, ChangeDirection)]) -> Side {
    Side { words, turns }
}

/// Returns the table. `PLANTS` in a path is replaced by `crops` or `weeds`. If a field has several variants, each
/// variant has its own path.
#[rustfmt::skip]
fn rows() -> Vec<Row> {
    use Region::{All, Crop, Soil, Vegetation, Weed};
    let row = |feature, channel, step, more, less| Row { feature, channel, step, more, less };
    let mut rows = vec![
        row(Feature::Exposure, 0, Step::Exposure,
            side("images are too bright", &[("sensor.exposure.Auto.level", Lower), ("sensor.exposure.White.level", Lower)]),
            side("images are too dark", &[("sensor.exposure.Auto.level", Raise), ("sensor.exposure.White.level", Raise)])),
        row(Feature::Color(All), 0, Step::Exposure,
            side("images are too bright", &[("sensor.exposure.Auto.level", Lower), ("sensor.exposure.White.level", Lower)]),
            side("images are too dark", &[("sensor.exposure.Auto.level", Raise), ("sensor.exposure.White.level", Raise)])),
        row(Feature::Ndvi(All), 0, Step::Exposure,
            side("near infrared is too bright relative to red", &[("sensor.nir_exposure.Auto.level", Lower)]),
            side("near infrared is too dark relative to red", &[("sensor.nir_exposure.Auto.level", Raise)])),
        row(Feature::Ndvi(Soil), 0, Step::Exposure,
            side("near infrared is too bright relative to red", &[("sensor.nir_exposure.Auto.level", Lower)]),
            side("near infrared is too dark relative to red", &[("sensor.nir_exposure.Auto.level", Raise)])),
        row(Feature::Color(All), 1, Step::Color,
            side("images are too red", &[("sensor.white_balance.Fixed.red", Lower), ("sensor.white_balance", Change)]),
            side("images are too green", &[("sensor.white_balance.Fixed.green", Lower), ("sensor.white_balance", Change)])),
        row(Feature::Color(All), 2, Step::Color,
            side("images are too yellow", &[("sensor.white_balance.GreyWorld.strength", Raise), ("sensor.white_balance.Fixed.blue", Raise)]),
            side("images are too blue", &[("sensor.white_balance.GreyWorld.strength", Lower), ("sensor.white_balance.Fixed.blue", Lower)])),
        row(Feature::Color(Soil), 0, Step::SoilColor,
            side("soil is too light", &[("soil.moisture.mean", Raise), ("soil.colors", Change)]),
            side("soil is too dark", &[("soil.moisture.mean", Lower), ("soil.colors", Change)])),
        row(Feature::Color(Soil), 1, Step::SoilColor,
            side("soil is too red", &[("soil.colors", Change)]),
            side("soil is not red enough", &[("soil.colors", Change)])),
        row(Feature::Color(Soil), 2, Step::SoilColor,
            side("soil is too yellow", &[("soil.colors", Change)]),
            side("soil is too grey", &[("soil.colors", Change), ("soil.litter.straw_cover", Raise)])),
        row(Feature::Cover(Vegetation), 0, Step::Cover,
            side("plants cover too much", &[("crops.growth.AgeDays", Lower), ("weeds.spread.per_m2", Lower)]),
            side("plants cover too little", &[("crops.growth.AgeDays", Raise), ("weeds.spread.per_m2", Raise)])),
        row(Feature::Cover(Crop), 0, Step::Cover,
            side("the crop covers too much", &[("crops.growth.AgeDays", Lower), ("crops.vigour", Lower), ("crops.rows.in_row_m", Raise)]),
            side("the crop covers too little", &[("crops.growth.AgeDays", Raise), ("crops.vigour", Raise), ("crops.rows.emergence", Raise)])),
        row(Feature::Cover(Weed), 0, Step::Cover,
            side("weeds cover too much", &[("weeds.spread.per_m2", Lower), ("weeds.growth.AgeDays", Lower)]),
            side("weeds cover too little", &[("weeds.spread.per_m2", Raise), ("weeds.growth.AgeDays", Raise)])),
        row(Feature::BlobCount(Crop), 0, Step::Cover,
            side("there are too many crop plants, or they touch too rarely", &[("crops.rows.in_row_m", Raise), ("crops.rows.emergence", Lower)]),
            side("there are too few crop plants, or they touch too often", &[("crops.rows.in_row_m", Lower), ("crops.rows.emergence", Raise)])),
        row(Feature::BlobCount(Weed), 0, Step::Cover,
            side("there are too many weeds", &[("weeds.spread.per_m2", Lower)]),
            side("there are too few weeds", &[("weeds.spread.per_m2", Raise)])),
        row(Feature::Gradient, 0, Step::Texture,
            side("neighbouring pixels differ too much", &[("sensor.sharpen.amount", Lower), ("sensor.psf.color_px", Raise), ("soil.clods.over_5mm_per_m2", Lower)]),
            side("neighbouring pixels differ too little", &[("sensor.psf.color_px", Lower), ("sensor.sharpen.amount", Raise), ("soil.clods.over_5mm_per_m2", Raise)])),
        row(Feature::Spectrum, 0, Step::Texture,
            side("fine structure is too strong", &[("sensor.psf.color_px", Raise), ("sensor.sharpen.amount", Lower), ("soil.crumbs.amount", Lower)]),
            side("fine structure is too weak", &[("sensor.psf.color_px", Lower), ("sensor.sharpen.amount", Raise), ("soil.crumbs.amount", Raise)])),
        // Slopes are negative: a larger one is less steep, so more fine structure remains.
        row(Feature::Slope, 0, Step::Texture,
            side("fine structure is too strong", &[("sensor.psf.color_px", Raise), ("sensor.sharpen.amount", Lower), ("soil.crumbs.amount", Lower)]),
            side("fine structure is too weak", &[("sensor.psf.color_px", Lower), ("sensor.sharpen.amount", Raise), ("soil.crumbs.amount", Raise)])),
        row(Feature::Noise, 0, Step::Noise,
            side("there is too much noise", &[("sensor.noise.full_well", Raise), ("sensor.noise.read", Lower)]),
            side("there is too little noise", &[("sensor.noise.full_well", Lower), ("sensor.noise.read", Raise)])),
        row(Feature::Outline, 0, Step::Outlines,
            side("labels are wider than real ones: no field of the scene; `train` narrows them with --set DIR@all-1px", &[]),
            side("real labels are wider than leaves: no field of the scene; `train` widens rendered ones with --set DIR@all+1px", &[])),
    ];
    for of in [Crop, Weed] {
        rows.extend([
            row(Feature::Color(of), 0, Step::PlantColor,
                side("PLANTS are too light", &[("species.materials.pigments.chlorophyll", Raise), ("PLANTS.condition.chlorosis", Lower), ("PLANTS.condition.dust", Lower)]),
                side("PLANTS are too dark", &[("species.materials.pigments.chlorophyll", Lower), ("PLANTS.condition.chlorosis", Raise)])),
            row(Feature::Color(of), 1, Step::PlantColor,
                side("PLANTS are not green enough", &[("species.materials.pigments.anthocyanin", Lower), ("PLANTS.condition.reddening", Lower), ("PLANTS.condition.dust", Lower)]),
                side("PLANTS are too green", &[("PLANTS.condition.dust", Raise), ("species.materials.pigments.anthocyanin", Raise)])),
            row(Feature::Color(of), 2, Step::PlantColor,
                side("PLANTS are too yellow", &[("species.materials.pigments.chlorophyll", Raise), ("PLANTS.condition.chlorosis", Lower)]),
                side("PLANTS are too bluish", &[("species.materials.pigments.chlorophyll", Lower), ("PLANTS.condition.chlorosis", Raise), ("species.materials.bloom", Lower)])),
            row(Feature::Ndvi(of), 0, Step::PlantColor,
                side("PLANTS reflect too much near infrared relative to red", &[("species.materials.pigments.chlorophyll", Lower), ("PLANTS.condition.dust", Raise)]),
                side("PLANTS reflect too little near infrared relative to red", &[("species.materials.pigments.chlorophyll", Raise), ("PLANTS.condition.dust", Lower)])),
            row(Feature::BlobSize(of), 0, Step::Cover,
                side("PLANTS are too large", &[("PLANTS.growth.AgeDays", Lower), ("PLANTS.vigour", Lower)]),
                side("PLANTS are too small", &[("PLANTS.growth.AgeDays", Raise), ("PLANTS.vigour", Raise)])),
            row(Feature::Lightness(of), 0, Step::Light,
                side("PLANTS are too light relative to the surrounding soil", &[("soil.moisture.mean", Lower), ("species.materials.pigments.chlorophyll", Raise)]),
                side("PLANTS are too dark relative to the surrounding soil", &[("soil.moisture.mean", Raise), ("species.materials.pigments.chlorophyll", Lower)])),
            row(Feature::Chroma(of), 0, Step::Light,
                side("PLANTS differ too much in colour from the surrounding soil", &[("sensor.matrix.Saturation", Lower), ("PLANTS.condition.dust", Raise)]),
                side("PLANTS differ too little in colour from the surrounding soil", &[("sensor.matrix.Saturation", Raise), ("PLANTS.condition.dust", Lower)])),
        ]);
    }
    rows
}

/// Advice if light and shadow have the right mean, but the contrast between them is too high, or too low.
const SHADOWS: [Side; 2] = [
    side(
        "the contrast of light and dark pixels is too high: shadows are too hard",
        &[("lights.Daylight.cloud", Raise), ("soil.moisture.spread", Lower)],
    ),
    side(
        "the contrast of light and dark pixels is too low: shadows are too soft",
        &[("lights.Daylight.cloud", Lower), ("soil.moisture.spread", Raise)],
    ),
];

/// Advice if a pixel covers more ground than a real one, or less.
const PIXEL: [Side; 2] = [
    side(
        "a pixel covers more ground than a real one, so networks see smaller plants",
        &[("camera.Pinhole.size", Raise), ("camera.Pinhole.pose.Nadir.height_m", Lower)],
    ),
    side(
        "a pixel covers less ground than a real one, so networks see larger plants",
        &[("camera.Pinhole.size", Lower), ("camera.Pinhole.pose.Nadir.height_m", Raise)],
    ),
];

/// Returns all field paths that advice can contain.
pub fn fields() -> Vec<String> {
    let of = |feature: Feature, sides: [&Side; 2]| -> Vec<String> {
        sides.iter().flat_map(|side| side.turns).map(|(field, _)| named(field, feature)).collect()
    };
    let mut all: Vec<String> = rows().iter().flat_map(|row| of(row.feature, [&row.more, &row.less])).collect();
    for [more, less] in [&SHADOWS, &PIXEL] {
        all.extend(of(Feature::Exposure, [more, less]));
    }
    all.sort();
    all.dedup();
    all
}

impl Gap {
    /// Returns the fields of the scene file to change for the large distances, with directions, in the recommended order.
    pub fn advice(&self) -> Vec<Advice> {
        all(self)
    }
}

/// Returns the advice in its order; distances with the same remedy are merged.
fn all(of: &Gap) -> Vec<Advice> {
    let mut all: Vec<Advice> = pixel_size(of).into_iter().collect();
    let soil_alone = soil_alone(of);
    for distance in of.distances.iter().filter(|distance| distance.is_large()) {
        let feature = distance.feature;
        let (Some(real), Some(made)) = (of.real.pools.get(&feature), of.synthetic.pools.get(&feature)) else {
            continue;
        };
        let Some(one) = about(feature, real, made, distance.distance) else { continue };
        if soil_alone && one.step == Step::Exposure && matches!(feature, Feature::Exposure | Feature::Color(_)) {
            continue;
        }
        match all.iter_mut().find(|other| other.step == one.step && other.turns == one.turns) {
            Some(same) => same.features.extend(one.features),
            None => all.push(one),
        }
    }
    all.sort_by_key(|advice| advice.step);
    agreed(all)
}

/// Drops changes that contradict earlier advice, because following the earlier advice changes the later distance too.
fn agreed(all: Vec<Advice>) -> Vec<Advice> {
    let mut asked: Vec<FieldChange> = Vec::new();
    let keep = |mut advice: Advice| {
        let other =
            |turn: &FieldChange| asked.iter().any(|before| before.field == turn.field && before.way != turn.way);
        let before = advice.turns.len();
        advice.turns.retain(|turn| !other(turn));
        asked.extend(advice.turns.iter().cloned());
        (before == 0 || !advice.turns.is_empty()).then_some(advice)
    };
    all.into_iter().filter_map(keep).collect()
}

/// Returns `true` if only the soil's lightness differs, so that the exposure is correct.
fn soil_alone(of: &Gap) -> bool {
    let differs = |region| {
        let lightness = |pool: &Pool| pool.means()[0];
        let feature = Feature::Color(region);
        Some(lightness(of.synthetic.pools.get(&feature)?) - lightness(of.real.pools.get(&feature)?))
    };
    let (soil, crop) = (differs(Region::Soil), differs(Region::Crop));
    soil.zip(crop).is_some_and(|(soil, crop)| crop.abs() < ALIKE * soil.abs())
}

fn pixel_size(of: &Gap) -> Option<Advice> {
    let (real, made) = (of.pixels.real_mm?, of.pixels.synthetic_mm?);
    let side = &PIXEL[usize::from(made < real)];
    let words = format!(
        "{}: {} mm instead of {} mm; --width renders more or fewer pixels",
        side.words,
        number(made),
        number(real)
    );
    (of.pixels.factors() != [1.0; 2]).then(|| given(Step::PixelSize, &words, side, Feature::Exposure, Vec::new()))
}

/// Returns the advice on one feature.
fn about(feature: Feature, real: &Pool, made: &Pool, distance: f64) -> Option<Advice> {
    let differences = differences(real, made);
    let (channel, difference) =
        differences.iter().copied().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    let row = rows().into_iter().find(|row| row.feature == feature && row.channel == channel)?;
    let side = if difference > 0.0 { &row.more } else { &row.less };
    let unit = if let Feature::Color(_) = feature { ["L*", "a*", "b*"][channel] } else { feature.unit() };
    let keys = vec![feature.key()];
    // The distance of a colour is the mean over its channels.
    let moved = difference.abs() / differences.len().to_f64();
    if moved > MEAN * distance || matches!(made, Pool::Power(_)) {
        let by = number(difference.abs());
        let words = format!("{}, by {by}{}{unit}", side.words, if unit.is_empty() { "" } else { " " });
        return Some(given(row.step, &words, side, feature, keys));
    }
    let spreads = (made.spreads()[channel], real.spreads()[channel]);
    let wide = spreads.0 > spreads.1;
    if let Feature::Color(Region::All | Region::Soil) = feature {
        let side = &SHADOWS[usize::from(!wide)];
        return Some(given(Step::Light, side.words, side, feature, keys));
    }
    let (way, word) = if wide { (ChangeDirection::Narrow, "more") } else { (ChangeDirection::Widen, "less") };
    let first = side.turns.first().map(|(field, _)| FieldChange { field: named(field, feature), way });
    let words = format!("{} has the right mean, but varies {word} than it should", feature.name());
    Some(Advice { step: row.step, words, turns: first.into_iter().collect(), features: keys })
}

/// Returns the synthetic minus the real mean per channel; for a spectrum, how much its fine half exceeds its coarse
/// half.
fn differences(real: &Pool, made: &Pool) -> Vec<f64> {
    let all: Vec<f64> = made.means().iter().zip(real.means()).map(|(made, real)| made - real).collect();
    match made {
        Pool::Power(_) => {
            let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len().max(1).to_f64();
            let (coarse, fine) = all.split_at(all.len() / 2);
            vec![mean(fine) - mean(coarse)]
        }
        _ => all,
    }
}

fn given(step: Step, words: &str, side: &Side, feature: Feature, features: Vec<String>) -> Advice {
    let turn = |(field, way): &(&str, ChangeDirection)| FieldChange { field: named(field, feature), way: *way };
    let words = words.replace("PLANTS", plants(feature));
    Advice { step, words, turns: side.turns.iter().map(turn).collect(), features }
}

fn named(field: &str, feature: Feature) -> String {
    field.replace("PLANTS", plants(feature))
}

fn plants(feature: Feature) -> &'static str {
    if feature.region() == Some(Region::Weed) { "weeds" } else { "crops" }
}

impl ChangeDirection {
    /// Returns the direction as a verb.
    pub fn name(self) -> &'static str {
        match self {
            Raise => "raise",
            Lower => "lower",
            Self::Widen => "widen",
            Self::Narrow => "narrow",
            Change => "change",
        }
    }
}

impl FieldChange {
    /// Returns the change as text, such as `raise sensor.exposure.Auto.level`.
    pub fn words(&self) -> String {
        format!("{} {}", self.way.name(), self.field)
    }
}
