//! Variation of leaf outlines: no two leaves of a plant have the same teeth and lobes.
//!
//! All leaves of a kind share one texture, whose alpha channel cuts their margins. This module stretches the flat sheet
//! below the texture by a smooth noise field, independently for the two margins: across by up to 0.45 of the
//! half-width, and along the midrib, so that teeth and lobes differ in place and size. Half of the leaves, chosen at
//! random, use the mirrored texture. Colour and labels use the same mesh.

use super::blade::BladeGrid;
use furrow_base::math::{ToFloat, vec2};
use furrow_base::sampling::Stream;
use furrow_optics::texture::noise::Perlin;
use std::f32::consts::PI;

/// Number of noise periods along a blade.
const PERIODS: f64 = 2.3;
/// Standard deviation of the noise along the rows that are sampled.
const NOISE_SD: f32 = 0.45;
/// Displacement of the margin along the midrib, in blade lengths, per half-width of displacement across it.
const ALONG: f32 = 0.25;
/// Largest displacement of a margin across the midrib, as a fraction of the half-width.
const MOST: f32 = 0.45;

/// Variation of one leaf's outline.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeafOutline {
    /// Standard deviation of the displacement across the midrib, as a fraction of the half-width.
    sd: f32,
    /// Whether the texture is mirrored.
    mirrored: bool,
    seed: u32,
}

impl LeafOutline {
    /// Draws a variation; `sd` is the standard deviation of the displacement across the midrib, as a fraction of the
    /// half-width.
    pub(super) fn draw(sd: f32, stream: &mut Stream) -> Self {
        Self { sd, mirrored: stream.chance(0.5), seed: stream.seed32() }
    }

    /// Deforms a flat sheet of `length` metres. The midrib does not move.
    pub(super) fn apply(&self, sheet: &mut BladeGrid, length: f32) {
        if self.mirrored {
            sheet.rest.uvs.iter_mut().for_each(|uv| *uv = vec2(1.0 - uv.x, uv.y));
        }
        if self.sd == 0.0 {
            return;
        }
        let noise = Perlin::new(self.seed);
        let stride = sheet.columns + 1;
        let middle = sheet.columns / 2;
        for (i, t) in sheet.t.iter().enumerate() {
            let t = t.clamp(0.0, 1.0);
            let free = (PI * t).sin().max(0.0).sqrt();
            for (j, p) in sheet.rest.positions[i * stride..(i + 1) * stride].iter_mut().enumerate() {
                let out = (j.abs_diff(middle)).to_f32() / middle.to_f32();
                let row = if j < middle { 3.7 } else { 11.3 };
                let along = PERIODS * f64::from(t);
                let [wider, ahead] = [row, row + 5.9].map(|y| self.sd / NOISE_SD * noise.at2(along, y).to_f32());
                p.x *= 1.0 + wider.clamp(-MOST, MOST) * free;
                p.y += ALONG * length * ahead.clamp(-MOST, MOST) * free * free * out * out;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::blade;
    use super::super::skeleton::{Measures, Skeleton};
    use super::*;
    use furrow_base::geometry::Mesh;
    use furrow_base::geometry::outline::Outline;
    use furrow_base::math::ToInt;
    use furrow_base::sampling::Purpose;

    fn sheet() -> BladeGrid {
        let skeleton = Skeleton::new(&Measures {
            stalk: 0.0,
            stalk_joints: 1,
            length: 0.08,
            veins: vec![0.3, 0.6],
            secondaries: None,
        });
        blade::sheet(Outline::Power { a: 0.55, b: 1.0 }, 0.05, 24, 8, &skeleton)
    }

    /// Rationale: repeated teeth and lobes reveal that plants are synthetic. Expected over 200 leaves: no triangle
    /// flips and the midrib stays in place; the area is within a third of the kind's for each leaf and within a
    /// fiftieth on average; the standard deviation of the margins' displacement is as requested within a quarter; about
    /// half of the leaves are mirrored (false alarm below 1e-6).
    #[test]
    fn leaves_differ_in_outline_and_none_is_torn() {
        let plain = sheet();
        let area =
            |s: &BladeGrid| Mesh::smooth(s.rest.positions.clone(), s.rest.uvs.clone(), s.rest.triangles.clone()).area();
        let (mut mirrored, mut areas, mut squares, mut count) = (0, 0.0, 0.0, 0);
        for seed in 0..200 {
            let outline = LeafOutline::draw(0.08, &mut Stream::of(seed, 0, Purpose::Leaf, 0));
            mirrored += i32::from(outline.mirrored);
            let mut one = sheet();
            outline.apply(&mut one, 0.08);
            for [a, b, c] in &one.rest.triangles {
                let [a, b, c] = [a, b, c].map(|i| one.rest.positions[i.to_usize()].truncate());
                assert!((b - a).perp_dot(c - a) > 0.0, "seed {seed}");
            }
            for (i, (p, q)) in one.rest.positions.iter().zip(&plain.rest.positions).enumerate() {
                if i % 9 == 4 {
                    assert_eq!((p.x, p.y), (q.x, q.y));
                } else if i % 9 == 8 && (0.2..0.8).contains(&(q.y / 0.08)) {
                    let free = (PI * q.y / 0.08).sin().sqrt();
                    squares += ((p.x / q.x - 1.0) / free).powi(2);
                    count += 1;
                }
            }
            let share = area(&one) / area(&plain);
            assert!((0.67..1.34).contains(&share), "seed {seed}: {share}");
            areas += share / 200.0;
        }
        let sd = (squares / count.to_f32()).sqrt();
        assert!((sd / 0.08 - 1.0).abs() < 0.25, "{sd}");
        assert!((areas - 1.0).abs() < 0.02, "{areas}");
        assert!((65..=135).contains(&mirrored), "{mirrored}");
    }
}
