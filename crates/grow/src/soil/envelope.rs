//! Bounds of a ground's heights, which are needed before it is built to determine the area that a camera sees.

use super::ground::slaked;
use super::relief::Relief;
use super::{Rect, SeedRows, Site, SoilDesc};
use furrow_base::math::Vec2;
use furrow_base::sampling::Stream;

/// Two parallel planes that enclose all of a ground except for 1–2 % of its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Envelope {
    /// Slope of both planes towards the east and the north.
    pub tilt: Vec2,
    /// Depth of the lower plane below the world's origin, metres.
    pub below_m: f32,
    /// Height of the upper plane above the world's origin, metres.
    pub above_m: f32,
}

impl Envelope {
    /// Envelope of the plane z = 0.
    pub const LEVEL: Self = Self { tilt: Vec2::ZERO, below_m: 0.0, above_m: 0.0 };

    /// Returns the envelope of the ground of `desc` and `stream`, sown in `rows`, without the bodies on it.
    pub fn of(desc: &SoilDesc, rows: Option<SeedRows>, stream: &Stream) -> Self {
        let site = Site {
            area: Rect::new(0.0, 0.0, 0.0, 0.0),
            grid_m: 0.0,
            margin_m: 0.0,
            growth: 2.0,
            level_m: f32::INFINITY,
            smallest_mm: 0.0,
            rows,
        };
        let relief = Relief::new(&desc.relief, slaked(desc, stream), site, stream);
        let (below, above) = relief.departs();
        let ends = desc.layers.iter().map(|layer| (layer.height_mm.0.f32(), layer.height_mm.1.f32()));
        let (low, high) = ends.fold((0.0_f32, 0.0_f32), |(low, high), (from, to)| (low.min(from), high.max(to)));
        // The extremes of relief and layers rarely coincide.
        Self { tilt: relief.tilt(), below_m: below.hypot(1e-3 * low), above_m: above.hypot(1e-3 * high) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::soil::{Ground, Plain};
    use furrow_base::math::{ToFloat, ToInt, vec2};
    use furrow_base::sampling::Purpose;

    /// Rationale: the area that a camera sees is determined before the ground's heights are known. Expected: 98 % of
    /// the points are between the planes, and some are beyond a fifth of the distance to each: on rough ground, on
    /// ridges, in tracks, sloping or level. Source: the heights of the ground once it is built.
    #[test]
    fn the_ground_lies_between_its_planes() {
        let rows = Some(SeedRows { spacing_m: 0.5, azimuth: 0.4, offset_m: 0.1 });
        for (k, relief) in [
            "rms_mm: 9, tilt_deg: 0",
            "rms_mm: 4, tilt_deg: 6, row: (depth_mm: 14, ridge_mm: 0)",
            "rms_mm: 5, tilt_deg: 2, row: (ridge_mm: 120)",
            "rms_mm: 3, tilt_deg: 3, wheels: [(depth_mm: 40)]",
        ]
        .into_iter()
        .enumerate()
        {
            let layers = r#"layers: [(albedo: "a", height: "b", size_m: 0.3, height_mm: (-3, 5))]"#;
            let text = format!("({layers}, relief: ({relief}), clods: (over_5mm_per_m2: 0))");
            let desc: SoilDesc = ron::from_str(&text).unwrap();
            let stream = Stream::of(6, k.to_u64(), Purpose::Soil, 0);
            let site = Site {
                area: Rect::new(-3.0, -3.0, 3.0, 3.0),
                grid_m: 0.02,
                margin_m: 0.0,
                growth: 1.3,
                level_m: f32::INFINITY,
                smallest_mm: 0.0,
                rows,
            };
            let maps = [Plain { albedo: [0.2; 3], height: 0.5 }];
            let ground = Ground::new(&desc, &[], &maps, &site, &stream).unwrap();
            let Envelope { tilt, below_m, above_m } = Envelope::of(&desc, rows, &stream);
            let places = (0..14_400).map(|k| vec2((k % 120).to_f32() - 59.5, (k / 120).to_f32() - 59.5) / 20.0);
            let departs: Vec<f32> = places.map(|p| ground.height(p.x, p.y) - tilt.dot(p)).collect();
            let outside = departs.iter().filter(|h| **h < -below_m || **h > above_m).count();
            assert!(outside * 50 < departs.len(), "{relief}: {outside} of {}", departs.len());
            let (low, high) = departs.iter().fold((0.0_f32, 0.0_f32), |(a, b), h| (a.min(*h), b.max(*h)));
            assert!(-low > 0.2 * below_m && high > 0.2 * above_m, "{relief}: {low} {below_m}, {high} {above_m}");
        }
    }
}
