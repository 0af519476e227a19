//! Crops in rows: drilled seeds, some of which do not emerge.

use super::{Area, Disc, Spot, outside, within};
use furrow_base::math::{RoundTo, ToFloat, Vec2, vec2};
use furrow_base::ron_file::{Fraction, NonNegative, Positive, Signed, Vary};
use furrow_base::sampling::{Purpose, Stream};
use serde::{Deserialize, Serialize};

/// Drilled crop. The defaults are those of sugar beet: 45–50 cm by 18–22 cm in Europe, 65–92 % emergence.
///
/// ```
/// use furrow_grow::scatter::RowsDesc;
/// let beet: RowsDesc = ron::from_str(
///     "(spacing_m: Choice([0.45, 0.50]), in_row_m: Uniform(0.18, 0.22), azimuth_deg: Uniform(-5, 5), offset_m: Normal(mean: 0, sd: 0.03))",
/// ).unwrap();
/// assert!(ron::from_str::<RowsDesc>("(spacing: 0.5)").is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RowsDesc {
    /// Distance between rows: sugar beet 0.45 to 0.5, maize 0.75, cereals 0.12, carrot 0.25 to 0.45.
    pub spacing_m: Vary<Positive<100>>,
    /// Distance between seeds in the row: sugar beet 0.18 to 0.22, maize 0.13 to 0.17, cereals 0.02, carrot 0.02 to
    /// 0.04.
    pub in_row_m: Vary<Positive<100>>,
    /// Standard deviation of a seed's place along the row.
    pub jitter_along_m: Vary<NonNegative<10>>,
    /// Standard deviation of a seed's place across the row.
    pub jitter_across_m: Vary<NonNegative<10>>,
    /// Fraction of the seeds that emerge; the others leave gaps.
    pub emergence: Vary<Fraction>,
    /// Fraction of the places with two seeds.
    pub doubles: Vary<Fraction>,
    /// Direction of the rows, clockwise from north.
    pub azimuth_deg: Vary<Signed<360>>,
    /// Distance of row 0 from the world's origin, towards the rows' right-hand side.
    pub offset_m: Vary<Signed<1000>>,
}

impl Default for RowsDesc {
    fn default() -> Self {
        Self {
            spacing_m: Vary::uniform(0.45, 0.50),
            in_row_m: Vary::uniform(0.18, 0.22),
            jitter_along_m: Vary::uniform(0.01, 0.02),
            jitter_across_m: Vary::uniform(0.005, 0.01),
            emergence: Vary::uniform(0.65, 0.92),
            doubles: Vary::uniform(0.01, 0.03),
            azimuth_deg: Vary::fixed(0.0),
            offset_m: Vary::fixed(0.0),
        }
    }
}

/// Distance between the two plants of a double, metres.
const DOUBLE_M: f32 = 0.012;

/// Rows of one field, with all parameters drawn.
#[derive(Clone, Debug)]
pub struct Rows {
    /// Distance between rows, metres.
    pub spacing_m: f32,
    /// Direction, radians clockwise from north.
    pub azimuth: f32,
    /// Distance of row 0 from the origin, metres.
    pub offset_m: f32,
    /// Distance between seeds in a row, metres.
    pub in_row_m: f32,
    pub(super) jitter: Vec2,
    pub(super) emergence: f64,
    pub(super) doubles: f64,
    stream: Stream,
}

/// Estimates the number of seed places that [`rows`] visits in `area`.
pub fn rows_looked_at(desc: &RowsDesc, area: Area, stream: &Stream) -> f64 {
    let rows = Rows::draw(desc, stream);
    let size = f64::from((area[1] - area[0]).length());
    let across = (size + 10.0 * f64::from(rows.jitter.x)) / f64::from(rows.spacing_m);
    let along = (size + 10.0 * f64::from(rows.jitter.y)) / f64::from(rows.in_row_m);
    (across + 1.0) * (along + 1.0)
}

impl Rows {
    /// Draws a field's rows, including the parameters for the seed rows' relief.
    pub fn draw(desc: &RowsDesc, stream: &Stream) -> Self {
        let child = |k| stream.child(Purpose::Page, k);
        Self {
            spacing_m: desc.spacing_m.draw32(&mut child(0)),
            in_row_m: desc.in_row_m.draw32(&mut child(1)),
            jitter: vec2(desc.jitter_across_m.draw32(&mut child(2)), desc.jitter_along_m.draw32(&mut child(3))),
            emergence: desc.emergence.draw(&mut child(4)),
            doubles: desc.doubles.draw(&mut child(5)),
            azimuth: desc.azimuth_deg.draw32(&mut child(6)).to_radians(),
            offset_m: desc.offset_m.draw32(&mut child(7)),
            stream: stream.clone(),
        }
    }

    /// Returns the plants in `area` that are in none of the discs.
    pub fn spots(&self, area: Area, discs: &[Disc]) -> Vec<Spot> {
        let (sin, cos) = self.azimuth.sin_cos();
        let (along, across) = (vec2(sin, cos), vec2(cos, -sin));
        let corners = [area[0], vec2(area[1].x, area[0].y), area[1], vec2(area[0].x, area[1].y)];
        // Jitter may move a plant from outside into the area, by up to five standard deviations.
        let reach = |axis: Vec2, slack: f32| {
            let d = corners.map(|c| c.dot(axis));
            (d.into_iter().fold(f32::MAX, f32::min) - slack, d.into_iter().fold(f32::MIN, f32::max) + slack)
        };
        let (left, right) = reach(across, 5.0 * self.jitter.x + DOUBLE_M);
        let (back, front) = reach(along, 5.0 * self.jitter.y + DOUBLE_M);
        let index = |x: f32, step: f32| (x / step).round().clamp(-1e6, 1e6).trunc_to::<i32>();
        let mut spots = Vec::new();
        for row in index(left - self.offset_m, self.spacing_m)..=index(right - self.offset_m, self.spacing_m) {
            let row_stream = self.stream.child(Purpose::Scatter, u64::from(row.cast_unsigned()));
            // Each row has its own phase.
            let phase = row_stream.child(Purpose::Page, 0).uniform32() * self.in_row_m;
            for slot in index(back - phase, self.in_row_m)..=index(front - phase, self.in_row_m) {
                let mut s = row_stream.child(Purpose::Scatter, u64::from(slot.cast_unsigned()));
                let double = s.chance(self.doubles);
                for twin in 0..=u64::from(double) {
                    let mut s = s.child(Purpose::Scatter, twin);
                    let emerged = s.chance(self.emergence);
                    let jitter =
                        vec2(s.normal().to_f32(), s.normal().to_f32()).clamp(Vec2::splat(-5.0), Vec2::splat(5.0));
                    let apart = if double { DOUBLE_M * (twin.to_f32() - 0.5) } else { 0.0 };
                    let x = self.offset_m + row.to_f32() * self.spacing_m + self.jitter.x * jitter.x;
                    let y = phase + slot.to_f32() * self.in_row_m + self.jitter.y * jitter.y + apart;
                    let at = across * x + along * y;
                    if emerged && within(area, at) {
                        let key = (u64::from(row.cast_unsigned()) << 32)
                            | (u64::from(slot.cast_unsigned()) & 0x7fff_ffff) << 1
                            | twin;
                        spots.push(Spot { at, key });
                    }
                }
            }
        }
        outside(spots, discs)
    }
}

/// Returns the plants of a drilled crop in `area`, none of them in `discs`.
pub fn rows(desc: &RowsDesc, area: Area, discs: &[Disc], stream: &Stream) -> Vec<Spot> {
    Rows::draw(desc, stream).spots(area, discs)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn desc() -> RowsDesc {
        RowsDesc {
            spacing_m: Vary::fixed(0.45),
            in_row_m: Vary::fixed(0.20),
            jitter_along_m: Vary::fixed(0.015),
            jitter_across_m: Vary::fixed(0.008),
            emergence: Vary::fixed(0.8),
            doubles: Vary::fixed(0.0),
            azimuth_deg: Vary::fixed(20.0),
            offset_m: Vary::fixed(0.1),
        }
    }

    fn stream() -> Stream {
        Stream::of(11, 0, Purpose::Test, 0)
    }

    #[test]
    fn rows_have_the_spacing_jitter_and_emergence_asked_for() {
        let area = [vec2(-15.0, -15.0), vec2(15.0, 15.0)];
        let all = rows(&desc(), area, &[], &stream());
        let expected = 900.0 / (0.45 * 0.20) * 0.8;
        assert!(
            (all.len().to_f32() - expected).abs() < 4.0 * (expected * 0.2).sqrt() + 0.01 * expected,
            "{}",
            all.len()
        );
        let (sin, cos) = 20f32.to_radians().sin_cos();
        let off: Vec<f32> = all
            .iter()
            .map(|s| {
                let d = (s.at.dot(vec2(cos, -sin)) - 0.1) / 0.45;
                (d - d.round()) * 0.45
            })
            .collect();
        let n = off.len().to_f32();
        let mean = off.iter().sum::<f32>() / n;
        let sd = (off.iter().map(|d| (d - mean).powi(2)).sum::<f32>() / n).sqrt();
        assert!(mean.abs() < 0.0005 && (sd - 0.008).abs() < 0.0004, "{mean} {sd}");
    }

    #[test]
    fn a_larger_area_holds_the_same_plants() {
        let small = [vec2(-0.4, -0.3), vec2(0.5, 0.6)];
        let few = rows(&desc(), small, &[], &stream());
        let mut many = rows(&desc(), [vec2(-3.0, -2.0), vec2(2.0, 4.0)], &[], &stream());
        many.retain(|s| within(small, s.at));
        assert!(!few.is_empty());
        assert_eq!(few, many);
    }

    #[test]
    fn doubles_stand_close_together() {
        let page = RowsDesc { doubles: Vary::fixed(1.0), emergence: Vary::fixed(1.0), ..desc() };
        let area = [vec2(0.0, 0.0), vec2(5.0, 5.0)];
        let (one, two) = (
            rows(&RowsDesc { emergence: Vary::fixed(1.0), ..desc() }, area, &[], &stream()).len().to_f32(),
            rows(&page, area, &[], &stream()).len().to_f32(),
        );
        assert!((two / one - 2.0).abs() < 0.1, "{one} {two}");
        let keys: std::collections::BTreeSet<u64> = rows(&page, area, &[], &stream()).iter().map(|s| s.key).collect();
        assert_eq!(keys.len().to_f32(), two);
    }
}
