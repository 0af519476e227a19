//! Senescence of leaves: old leaves yellow, dry, droop and fall.
//!
//! Order of events: chlorophyll degrades before carotenoids, from tip and margin towards base and veins, so the leaf
//! turns yellow; then membranes fail, the tissue loses its water, browns and shrivels; an abscission layer lets it fall
//! or it stays on the plant dead. A leaf hardly gets shorter: it narrows by shrivelling and rolling, and droops as it loses
//! turgor.
//!
//! A leaf whose length is zero from a stage on (`blade_mm: 0`) has fallen by then. Until then it keeps the size of the
//! stage before. It falls at an age that is drawn between the two stages, and starts to yellow [`SenescenceDesc::days`]
//! earlier. The progress s of senescence is 0 in a green leaf, and in a falling leaf 1 when it falls:
//!
//! ```text
//! s = 1 − (fall − age) / days
//! limp = S(0.1 → 0.75; s),  dry = S(0.5 → 1; s)        S: smoothstep
//! ```
//!
//! The oldest true leaves of a plant also yellow and droop at an age of their own where the species file says so
//! (`oldest`), and stay on the plant: in maize the lower leaves die from about 500 °C d before silking on.
//!
//! Sources:
//! - yellow as chlorophyll is lost and carotenoids partly remain, brown with the oxidation of phenolics in dead cells:
//!   Matile 2000, "Biochemistry of Indian summer", Experimental Gerontology 35, 145–158 (abstract);
//! - from tip to base, water and chlorophyll lost one after the other: abstract of "Senescence of maize plants: evolution
//!   of flowering to harvest", Botany 87 (2009), 1036–1053, doi 10.1139/B09-066;
//! - lower leaves of maize: Borrás, Maddonni & Otegui 2003, Field Crops Research 82, 13–26 (abstract);
//! - durations and angles: estimates.

use super::organ::OrganKind;
use super::stage::{StageDesc, born};
use furrow_base::math::{RoundTo, ToFloat, lerp};
use furrow_base::ron_file::{Fraction, Num, Positive, Vary};
use furrow_base::sampling::{Purpose, Stream};
use serde::{Deserialize, Serialize};

/// Ratio of the duration of a true leaf's senescence to that of a cotyledon's.
const SLOWER: f32 = 1.5;
/// Earliest position of the fall between the last stage with the leaf and the first without it.
const EARLIEST: f32 = 0.7;
/// Largest progress of a leaf that stays on the plant.
const STAYS: f32 = 0.98;
/// First address of the leaf's random streams for senescence.
pub(super) const ADDRESS: u64 = 110;

/// Senescence of the leaves of a species.
///
/// ```
/// let slow: furrow_grow::plant::SenescenceDesc = ron::from_str("(days: Uniform(14, 20))").unwrap();
/// assert!(ron::from_str::<furrow_grow::plant::SenescenceDesc>("(days: 0)").is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default, rename = "Senescence")]
pub struct SenescenceDesc {
    /// Days from the first yellow of a cotyledon to its fall; true leaves take 1.5 times as long. A leaf falls before
    /// the first stage at which its `blade_mm` is 0.
    pub days: Vary<Positive<1000>>,
    /// Fraction of the layers of true leaves, from the oldest, whose leaves also yellow and droop while the stages keep
    /// them; 0 for none. All layers of the last stage count.
    pub oldest: Num<Fraction>,
    /// Age at which a leaf of these layers starts to yellow, days since it could first be seen.
    pub oldest_days: Vary<Positive<1000>>,
    /// Progress of senescence at which they remain: 0.4 is yellow, 0.7 brown except for the base, 1 dead.
    pub oldest_to: Vary<Fraction>,
}

impl Default for SenescenceDesc {
    fn default() -> Self {
        Self {
            days: Vary::uniform(9.0, 13.0),
            oldest: Num::new(0.0),
            oldest_days: Vary::uniform(35.0, 50.0),
            oldest_to: Vary::uniform(0.35, 0.8),
        }
    }
}

impl SenescenceDesc {
    /// Returns `true` if all fields have their default values.
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Draws the duration of one leaf's senescence, days.
    fn duration(&self, organ: OrganKind, stream: &Stream) -> f32 {
        let slower = if organ == OrganKind::Cotyledon { 1.0 } else { SLOWER };
        self.days.draw32(&mut stream.child(Purpose::Leaf, ADDRESS)) * slower
    }

    /// Returns the progress of senescence of a leaf at an age of the plant in days: 0 while it is green, 1 or more once it
    /// has fallen. `end` is that of the leaf's layer; `stream` is the leaf's.
    pub(super) fn progress(&self, end: &End<'_>, organ: OrganKind, age: f32, stream: &Stream) -> f32 {
        let falling = end.fall.map_or(0.0, |fall| {
            let at = stream.child(Purpose::Leaf, ADDRESS + 1).range32(EARLIEST, 1.0);
            let day = lerp(fall.with.days.f32(), fall.without.days.f32(), at);
            1.0 - (day - age) / self.duration(organ, stream)
        });
        let staying = end.old_from.map_or(0.0, |born| {
            let from = born + self.oldest_days.draw32(&mut stream.child(Purpose::Leaf, ADDRESS + 3));
            let to = self.oldest_to.draw32(&mut stream.child(Purpose::Leaf, ADDRESS + 4));
            ((age - from) / self.duration(organ, stream)).min(to.min(STAYS))
        });
        falling.max(staying).max(0.0)
    }
}

/// How the leaves of one layer end.
#[derive(Clone, Copy, Debug)]
pub(super) struct End<'a> {
    fall: Option<Fall<'a>>,
    /// Age of the plant at which they could first be seen, days, if they are of the oldest.
    old_from: Option<f32>,
}

impl<'a> End<'a> {
    /// Returns the end of a layer's leaves. `is_blade` says whether the leaves of a kind are blades, not cotyledons.
    pub(super) fn of(
        desc: &SenescenceDesc,
        stages: &'a [StageDesc],
        is_blade: impl Fn(&str) -> bool,
        layer: usize,
    ) -> Self {
        let fall = Fall::of(stages, layer);
        let oldest = desc.oldest.f32();
        if oldest == 0.0 {
            return Self { fall, old_from: None };
        }
        let layers = stages.last().map_or(&[][..], |stage| &stage.layers);
        let blade = |k: &usize| is_blade(&layers[*k].kind);
        let count = (0..layers.len()).filter(blade).count();
        let rank = (0..layer.min(layers.len())).filter(blade).count();
        let old = layer < layers.len() && blade(&layer) && rank < (oldest * count.to_f32()).round_to::<usize>();
        Self { fall, old_from: born(stages, layer).filter(|_| old) }
    }

    /// Returns `true` if `stage` is the first without the leaves.
    pub(super) fn before(&self, stage: &StageDesc) -> bool {
        self.fall.is_some_and(|fall| std::ptr::eq(fall.without, stage))
    }
}

/// Two neighbouring stages between which the leaves of a layer fall.
#[derive(Clone, Copy, Debug)]
struct Fall<'a> {
    with: &'a StageDesc,
    without: &'a StageDesc,
}

impl<'a> Fall<'a> {
    /// Returns the stages between which the leaves of a layer fall; `None` if they stay.
    fn of(stages: &'a [StageDesc], layer: usize) -> Option<Self> {
        let there = |stage: &StageDesc| stage.layers.get(layer).is_some_and(|l| l.blade_mm.largest() > 0.0);
        let pair = stages.windows(2).find(|pair| there(&pair[0]) && !there(&pair[1]))?;
        Some(Self { with: &pair[0], without: &pair[1] })
    }
}
