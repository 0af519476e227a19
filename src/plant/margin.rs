//! What sets one leaf's outline apart from its kind's: no two leaves of a plant have the same teeth and lobes.
//!
//! All leaves of a kind share a picture, whose opacity cuts their margins. Here the flat sheet below the picture is stretched by a
//! smooth field, each margin by its own: across by up to some tenths of the half-width, and along the midrib, so that teeth and
//! lobes stand elsewhere and are of other sizes. Every second leaf is the picture's mirror image. Colour and label see one mesh.

use super::blade::Sheet;
use crate::math::vec2;
use crate::sampling::Stream;
use crate::texture::noise::Perlin;
use std::f32::consts::PI;

/// Periods of the stretch to a blade's length.
const PERIODS: f64 = 2.3;
/// Standard deviation of the noise along the two rows that are read.
const NOISE_SD: f32 = 0.45;
/// How far the margin is moved along the midrib, lengths, for each half-width that it is moved across.
const ALONG: f32 = 0.25;
/// Most that a margin is moved across, of the half-width.
const MOST: f32 = 0.45;

/// The outline of one leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeafOutline {
    /// One standard deviation of the stretch across, of the half-width.
    sd: f32,
    /// Whether it is the picture's mirror image.
    mirrored: bool,
    seed: u32,
}

impl LeafOutline {
    /// Draws it; `sd` is one standard deviation of the stretch across, of the half-width.
    pub(super) fn draw(sd: f32, stream: &mut Stream) -> Self {
        Self { sd, mirrored: stream.chance(0.5), seed: stream.seed32() }
    }

    /// Stretches a flat sheet of `length` metres. The midrib stays where it is.
    pub(super) fn apply(&self, sheet: &mut Sheet, length: f32) {
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
                let out = (j.abs_diff(middle)) as f32 / middle as f32;
                let row = if j < middle { 3.7 } else { 11.3 };
                let along = PERIODS * f64::from(t);
                let [wider, ahead] = [row, row + 5.9].map(|y| self.sd / NOISE_SD * noise.at2(along, y) as f32);
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
    use crate::geometry::Mesh;
    use crate::geometry::outline::Outline;
    use crate::sampling::Purpose;

    fn sheet() -> Sheet {
        let skeleton = Skeleton::new(&Measures {
            stalk: 0.0,
            stalk_joints: 1,
            length: 0.08,
            veins: vec![0.3, 0.6],
            secondaries: None,
        });
        blade::sheet(Outline::Power { a: 0.55, b: 1.0 }, 0.05, 24, 8, &skeleton)
    }

    /// Rationale: teeth and lobes that repeat give drawn plants away. Expected over 200 leaves: no triangle turns over, the midrib stays, the
    /// area is that of the kind within a third and on average within a fiftieth, margins move by the standard deviation that is asked for within a
    /// quarter, and about half of the leaves are mirror images (false alarm below 1e-6).
    #[test]
    fn leaves_differ_in_outline_and_none_is_torn() {
        let plain = sheet();
        let area =
            |s: &Sheet| Mesh::smooth(s.rest.positions.clone(), s.rest.uvs.clone(), s.rest.triangles.clone()).area();
        let (mut mirrored, mut areas, mut squares, mut count) = (0, 0.0, 0.0, 0);
        for seed in 0..200 {
            let outline = LeafOutline::draw(0.08, &mut Stream::of(seed, 0, Purpose::Leaf, 0));
            mirrored += i32::from(outline.mirrored);
            let mut one = sheet();
            outline.apply(&mut one, 0.08);
            for [a, b, c] in &one.rest.triangles {
                let [a, b, c] = [a, b, c].map(|i| one.rest.positions[*i as usize].truncate());
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
        let sd = (squares / count as f32).sqrt();
        assert!((sd / 0.08 - 1.0).abs() < 0.25, "{sd}");
        assert!((areas - 1.0).abs() < 0.02, "{areas}");
        assert!((65..=135).contains(&mirrored), "{mirrored}");
    }
}
