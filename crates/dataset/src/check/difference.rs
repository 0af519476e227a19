//! How far apart two renderings of one image are.
//!
//! Another version of Embree, or of the C library's sines beside it, may move a hit in its last bits. A ray that meets the very edge of a leaf
//! then goes another way, so a few label pixels and a few paths differ; the images are still of one field. The files' bytes differ in any case,
//! since label maps name the kernels that made them.

use crate::model::sample::Sample;
use std::fmt;

/// The difference of two images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Share of the pixels whose class, species, plant, leaf or distance is another.
    pub labels: f64,
    /// Mean absolute difference of the photographs' values, of 255.
    pub color: f64,
}

impl Difference {
    /// None at all.
    pub const NONE: Self = Self { labels: 0.0, color: 0.0 };
    /// The most that is put down to other kernels. Between Embree 3.13.5 and 4.4.0 nothing was measured, to 4.3.3 on another system 0.023 in
    /// colour and no label; `docs/results/tests-and-build.md` has the table.
    pub const ALLOWED: Self = Self { labels: 1e-3, color: 0.5 };
    /// Distances that differ by less, relative to themselves, count as the same.
    const SAME_DEPTH: f32 = 1e-3;

    /// Between two images; all of it where they are not of one size.
    pub fn between(a: &Sample, b: &Sample) -> Self {
        if a.size() != b.size() || a.nir.len() != b.nir.len() || a.depth.len() != b.depth.len() {
            return Self { labels: 1.0, color: 255.0 };
        }
        let label = |s: &Sample, i: usize| (s.semantics[i], s.species.get(i).copied(), s.plants[i], s.leaves[i]);
        let near = |i: usize| match (a.depth.get(i), b.depth.get(i)) {
            // Where nothing is hit, both are infinite.
            (Some(a), Some(b)) => a == b || (a - b).abs() <= Self::SAME_DEPTH * a.abs(),
            _ => true,
        };
        let pixels = a.semantics.len();
        let other = (0..pixels).filter(|i| label(a, *i) != label(b, *i) || !near(*i)).count();
        let values = |s: &Sample| s.rgb.as_flattened().iter().chain(&s.nir).copied().collect::<Vec<u8>>();
        let (a, b) = (values(a), values(b));
        let apart: u64 = a.iter().zip(&b).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        Self { labels: other as f64 / pixels.max(1) as f64, color: apart as f64 / a.len().max(1) as f64 }
    }

    /// The larger of each.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self { labels: self.labels.max(other.labels), color: self.color.max(other.color) }
    }

    /// Whether neither number is above the other's.
    pub fn within(self, most: Self) -> bool {
        self.labels <= most.labels && self.color <= most.color
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { labels, color } = self;
        write!(f, "{:.3} % of the label pixels, {color:.3} of 255 in mean colour", labels * 100.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::record::Record;
    use crate::model::split::Split;

    fn sample(width: u32, height: u32) -> Sample {
        let n = (width * height) as usize;
        Sample {
            record: Record {
                index: 0,
                name: "000000".into(),
                source: None,
                split: Split::Train,
                capture: None,
                sampling: None,
                width,
                height,
                classes: Vec::new(),
                ignored: 0,
                plants: Vec::new(),
                conditions: None,
                canopy: None,
                exposure: None,
                warnings: Vec::new(),
            },
            rgb: vec![[100; 3]; n],
            nir: vec![100; n],
            semantics: vec![1; n],
            species: vec![1; n],
            parts: Vec::new(),
            plants: vec![7; n],
            leaves: vec![2; n],
            coverage: Vec::new(),
            depth: vec![1.0; n],
            normals: Vec::new(),
            jpeg: None,
            film: None,
        }
    }

    /// Rationale: the bounds decide whether a dataset is what it says. Expected: a pixel counts once, whatever of its label is another;
    /// colour is the mean over all values; an image of another size is another image. Source: counted by hand.
    #[test]
    fn labels_are_counted_by_pixel_and_colours_by_value() {
        let a = sample(50, 40);
        assert_eq!(Difference::between(&a, &sample(50, 40)), Difference::NONE);
        let mut b = sample(50, 40);
        (b.plants[3], b.leaves[3], b.semantics[4], b.species[5], b.leaves[6]) = (8, 1, 2, 2, 0);
        // A finger's breadth, and a hair's.
        (b.depth[7], b.depth[8]) = (1.01, 1.0001);
        b.rgb[0] = [120, 100, 90];
        b.nir[9] = 150;
        let found = Difference::between(&a, &b);
        assert_eq!(found, Difference { labels: 5.0 / 2000.0, color: 80.0 / 8000.0 });
        assert_eq!(Difference::between(&b, &a), found);
        assert!(!found.within(Difference::ALLOWED) && found.within(Difference { labels: 0.0025, color: 0.01 }));
        assert!(!Difference { labels: 0.0, color: 1.0 }.within(Difference::ALLOWED));
        assert_eq!(Difference::between(&a, &sample(40, 50)), Difference { labels: 1.0, color: 255.0 });
        let both = Difference { labels: 0.1, color: 0.2 }.max(Difference { labels: 0.0, color: 0.3 });
        assert_eq!(both, Difference { labels: 0.1, color: 0.3 });
    }
}
