//! Hedges and trees beyond the field, and the haze before them: description and drawn values.

use furrow_base::math::ToFloat;
use furrow_base::ron_file::{Bound, Fraction, Num, Positive, RonFile, Step, Vary};
use furrow_base::sampling::{Purpose, Stream};
use furrow_base::{Error, Result};
use furrow_render::scene::Haze;
use serde::{Deserialize, Serialize};
use std::f32::consts::SQRT_2;

/// Relative variation of the distance of hedge and woods around the field.
pub(crate) const BAY_DEPTH: f32 = 0.2;

/// Allowed distance of a hedge, metres: beyond the nearest plants, and within the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Away;

impl Bound for Away {
    const MIN: f64 = 20.0;
    const MAX: f64 = 600.0;
    const WORDS: &'static str = "between 20 and 600";
}

/// Allowed meteorological optical range, kilometres: fog begins below 1, and clean air has 300.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range;

impl Bound for Range {
    const MIN: f64 = 0.05;
    const MAX: f64 = 300.0;
    const WORDS: &'static str = "between 0.05 and 300";
}

/// The horizon: a hedge with trees around the field, woods behind it, and haze. All are seen only by cameras that look beyond the field;
/// hedges and trees cast no shadow on it. They are labelled soil, like everything that is not a plant of the field.
///
/// ```
/// use furrow_field::horizon::HorizonDesc;
/// let horizon: HorizonDesc = ron::from_str("(distance_m: 250, cover: 0.5, visibility_km: 12)").unwrap();
/// assert_eq!(horizon.cover.f32(), 0.5);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default, rename = "Horizon")]
pub struct HorizonDesc {
    /// Mean distance of the hedge from the world's origin, metres; it varies by a fifth around the field. It must be more than 1.8
    /// times `reach_m`, so that no shrub stands among the plants.
    #[schemars(extend("x-example" = "Uniform(120, 300)"))]
    pub distance_m: Vary<Away>,
    /// Height of each shrub of the hedge, metres.
    pub hedge_m: Vary<Positive<60>>,
    /// Height of each tree, metres.
    pub tree_m: Vary<Positive<60>>,
    /// Fraction of the horizon with trees in the hedge, in groups.
    pub cover: Num<Fraction>,
    /// Meteorological optical range, kilometres: the distance at which the contrast of a dark object is 5 %. 5 is hazy, 20 clear.
    pub visibility_km: Vary<Range>,
}

impl Default for HorizonDesc {
    fn default() -> Self {
        Self {
            distance_m: Vary::uniform(150.0, 350.0),
            hedge_m: Vary::uniform(2.0, 4.5),
            tree_m: Vary::uniform(6.0, 15.0),
            cover: Num::new(0.6),
            visibility_km: Vary::uniform(8.0, 25.0),
        }
    }
}

/// Drawn values of a horizon.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HorizonRecord {
    /// Mean distance of the hedge, metres.
    pub distance_m: f64,
    /// Meteorological optical range, kilometres.
    pub visibility_km: f64,
}

impl HorizonDesc {
    /// Returns an error if the hedge may stand within the field, which is planted up to `reach_m` metres in four directions.
    pub(crate) fn check(&self, page: &RonFile, reach_m: f32) -> Result<()> {
        let nearest = (1.0 - BAY_DEPTH) * self.distance_m.usual().0.to_f32();
        let planted = SQRT_2 * reach_m;
        if nearest > planted {
            return Ok(());
        }
        let error = Error::input(format!("the hedge may be {nearest:.0} m away, within the planted field"))
            .help(format!("write distance_m above {:.0}, or a smaller reach_m", (planted / (1.0 - BAY_DEPTH)).ceil()));
        Err(page.blame(&[Step::Field("horizon"), Step::Field("distance_m")], error))
    }

    /// Draws distance and haze of a field from the stream of its horizon.
    pub fn draw(&self, stream: &Stream) -> HorizonRecord {
        HorizonRecord {
            distance_m: self.distance_m.draw(&mut stream.child(Purpose::Horizon, 0)),
            visibility_km: self.visibility_km.draw(&mut stream.child(Purpose::Horizon, 1)),
        }
    }
}

impl HorizonRecord {
    /// Returns the haze of the air.
    pub fn haze(&self) -> Haze {
        Haze::of_range((1e3 * self.visibility_km).to_f32())
    }
}
