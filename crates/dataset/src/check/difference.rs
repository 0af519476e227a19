//! Difference of two renderings of the same image.
//!
//! Another version of Embree, or of the C library's sine and cosine, may change the last bits of a hit position. Rays
//! at the edge of a leaf can then hit or miss it, so a few label pixels and a few paths differ, although the images
//! show the same field. The files always differ, since label maps contain the name of the kernels that made them.

use crate::model::sample::Sample;
use furrow_base::math::ToFloat;
use std::fmt;

/// The difference of two images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Fraction of the pixels whose class, species, plant, leaf or depth differs.
    pub labels: f64,
    /// Mean absolute difference of the image values, on a scale to 255.
    pub color: f64,
}

impl Difference {
    /// No difference.
    pub const NONE: Self = Self { labels: 0.0, color: 0.0 };
    /// Largest difference that is attributed to other kernels. Measured: none between Embree 3.13.5 and 4.4.0; 0.023 in
    /// colour and no label to 4.3.3 on another system; `docs/results/tests-and-build.md` has the table.
    pub const ALLOWED: Self = Self { labels: 1e-3, color: 0.5 };
    /// Largest relative difference of two depths that count as equal.
    const SAME_DEPTH: f32 = 1e-3;

    /// Computes the difference of two images; the maximum if their sizes differ.
    pub fn between(a: &Sample, b: &Sample) -> Self {
        if a.size() != b.size() || a.nir.len() != b.nir.len() || a.depth.len() != b.depth.len() {
            return Self { labels: 1.0, color: 255.0 };
        }
        let label = |s: &Sample, i: usize| (s.semantics[i], s.species.get(i).copied(), s.plants[i], s.leaves[i]);
        let near = |i: usize| match (a.depth.get(i), b.depth.get(i)) {
            // Depths of pixels without a hit are infinite and compare equal.
            (Some(a), Some(b)) => a == b || (a - b).abs() <= Self::SAME_DEPTH * a.abs(),
            _ => true,
        };
        let pixels = a.semantics.len();
        let other = (0..pixels).filter(|i| label(a, *i) != label(b, *i) || !near(*i)).count();
        let values = |s: &Sample| s.rgb.as_flattened().iter().chain(&s.nir).copied().collect::<Vec<u8>>();
        let (a, b) = (values(a), values(b));
        let apart: u64 = a.iter().zip(&b).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        Self { labels: other.to_f64() / pixels.max(1).to_f64(), color: apart.to_f64() / a.len().max(1).to_f64() }
    }

    /// Returns the larger value of each measure.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self { labels: self.labels.max(other.labels), color: self.color.max(other.color) }
    }

    /// Returns `true` if neither measure exceeds that of `most`.
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
    use furrow_base::math::ToInt;

    fn sample(width: u32, height: u32) -> Sample {
        let n = (width * height).to_usize();
        Sample {
            record: Record {
                index: 0,
                name: "000000".into(),
                source: None,
                split: Split::Train,
                capture: None,
                light: None,
                sampling: None,
                quality: None,
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

    /// Rationale: the limits decide whether a dataset passes verification. Expected: a pixel counts once, however many
    /// of its labels differ; colour is the mean over all values; images of different sizes differ by the maximum.
    /// Source: counted by hand.
    #[test]
    fn labels_are_counted_by_pixel_and_colours_by_value() {
        let a = sample(50, 40);
        assert_eq!(Difference::between(&a, &sample(50, 40)), Difference::NONE);
        let mut b = sample(50, 40);
        (b.plants[3], b.leaves[3], b.semantics[4], b.species[5], b.leaves[6]) = (8, 1, 2, 2, 0);
        // Depth differences of 1 cm, which counts, and 0.1 mm, which does not.
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
