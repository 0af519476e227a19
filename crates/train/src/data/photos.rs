//! Photographs without labels for self-training: each random crop is used twice, once unchanged and once with other colours, blur
//! and noise.
//!
//! Crops are augmented like rendered images, with [`Augment`]; they depend only on the seed and the step.

use super::augment::Augment;
use super::bands::Band;
use super::crop::Crop;
use super::example::Example;
use super::order::BatchSettings;
use super::resize::Resize;
use furrow_base::Result;
use furrow_base::math::{RoundTo, ToInt};
use furrow_base::sampling::{Purpose, Stream};
use furrow_dataset::model::sample::IGNORE;
use sha2::{Digest, Sha256};

/// Photographs in memory, each at the largest of its input sizes.
pub struct Photos {
    bands: Vec<Band>,
    resize: Resize,
    /// Training size of the network, pixels.
    trained: (u32, u32),
    all: Vec<Photo>,
    hash: Sha256,
}

struct Photo {
    /// Input sizes, the largest last.
    sizes: Vec<(u32, u32)>,
    /// Planes at the largest size, one for each band.
    planes: Vec<Vec<u8>>,
}

/// Two views of the same crops of photographs: images × height × width × bands, normalized.
#[derive(Clone, Debug, PartialEq)]
pub struct Views {
    /// Crops with geometric augmentation only.
    pub plain: Vec<f32>,
    /// The same crops with other colours, blur and noise.
    pub changed: Vec<f32>,
}

impl Photos {
    /// Returns an empty collection for a network with these bands and this training size. Photographs are resized by the rule
    /// `resize`.
    pub fn new(bands: &[Band], trained: (u32, u32), resize: Resize) -> Self {
        Self { bands: bands.to_vec(), resize, trained, all: Vec::new(), hash: Sha256::new() }
    }

    /// Adds a photograph of this size with one plane for each band.
    pub fn add(&mut self, (w, h): (u32, u32), planes: &[Vec<u8>]) -> Result<()> {
        let mut sizes = self.resize.sizes(self.trained, (w, h))?;
        sizes.sort_by_key(|(w, h)| u64::from(*w) * u64::from(*h));
        let largest = sizes.last().copied().unwrap_or(self.trained);
        let planes: Vec<Vec<u8>> =
            planes.iter().map(|plane| furrow_output::resize_gray(w, h, plane, largest)).collect();
        self.hash.update(largest.0.to_le_bytes());
        self.hash.update(largest.1.to_le_bytes());
        for plane in &planes {
            self.hash.update(plane);
        }
        self.all.push(Photo { sizes, planes });
        Ok(())
    }

    /// Returns the number of photographs.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// Returns whether there are no photographs.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Returns the SHA-256 of the pixels of all photographs, in their order.
    pub fn checksum(&self) -> String {
        hex::encode(self.hash.clone().finalize())
    }

    /// Returns the crops of a step; `order` gives their number, size and augmentation. There must be at least one photograph.
    pub fn views(&self, order: &BatchSettings, step: u64) -> Views {
        let color: Vec<bool> = self.bands.iter().map(Band::is_color).collect();
        let Augment { flip, rotate, scale, crop, .. } = order.augment;
        let moved = Augment { flip, rotate, scale, crop, ..Augment::NONE };
        let changed = Augment { colour: true, blur: true, noise: true, ..moved };
        let mut views = Views { plain: Vec::new(), changed: Vec::new() };
        for slot in 0..order.batch.to_u64() {
            let mut stream = Stream::of(order.seed, step * order.batch.to_u64() + slot, Purpose::Training, 3);
            let photo = &self.all[stream.index(self.all.len())];
            let (image, example) = photo.at(stream.index(photo.sizes.len()), order.crop_size);
            let crop = Crop { image, size: order.crop_size, rare: 0.0, ground: None };
            // Both views start with the same random numbers and so show the same part of the photograph.
            let mut again = stream.clone();
            views.plain.extend(moved.apply(&example, &crop, &color, &order.normalization, &mut stream).pixels);
            views.changed.extend(changed.apply(&example, &crop, &color, &order.normalization, &mut again).pixels);
        }
        views
    }
}

impl Photo {
    /// Returns the photograph at the input size `which`, enlarged if necessary to contain a crop of the size `crop`.
    fn at(&self, which: usize, crop: (u32, u32)) -> ((u32, u32), Example) {
        let largest = self.sizes[self.sizes.len() - 1];
        let (w, h) = self.sizes[which];
        let larger = (f64::from(crop.0) / f64::from(w)).max(f64::from(crop.1) / f64::from(h)).max(1.0);
        let size = ((f64::from(w) * larger).ceil_to::<u32>(), (f64::from(h) * larger).ceil_to::<u32>());
        let plane = |plane: &Vec<u8>| {
            if size == largest { plane.clone() } else { furrow_output::resize_gray(largest.0, largest.1, plane, size) }
        };
        let planes = self.planes.iter().map(plane).collect();
        let labels = vec![IGNORE; size.0.to_usize() * size.1.to_usize()];
        (size, Example { name: String::new(), planes, labels, plants: Vec::new(), species: Vec::new() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Normalization;
    use furrow_base::math::ToFloat;

    fn order(batch: usize) -> BatchSettings {
        BatchSettings {
            seed: 3,
            batch,
            crop_size: (32, 24),
            rare: 0.0,
            augment: Augment::default(),
            pixels: None,
            naming: None,
            normalization: Normalization::Fixed { mean: vec![0.0; 3], sd: vec![1.0; 3] },
        }
    }

    fn photos() -> Photos {
        let mut photos = Photos::new(&Band::RGB, (64, 48), Resize::LongSides(vec![96, 64]));
        let plane = |k: usize| (0..128 * 96).map(|i| if i % 128 > 60 { 40 + 50 * k.to_u8() } else { 20 }).collect();
        photos.add((128, 96), &[plane(0), plane(1), plane(2)]).unwrap();
        photos
    }

    /// Expected: a step always has the same crops and another step has others; the changed view shows the same place (edges correlate)
    /// with other values. Source: the rule of the views.
    #[test]
    fn both_views_lie_at_one_place() {
        let photos = photos();
        let views = photos.views(&order(4), 7);
        assert_eq!(views, photos.views(&order(4), 7));
        assert_ne!(views.plain, photos.views(&order(4), 8).plain);
        assert_eq!(views.plain.len(), 4 * 32 * 24 * 3);
        assert_ne!(views.plain, views.changed);
        for (plain, changed) in views.plain.chunks_exact(32 * 24 * 3).zip(views.changed.chunks_exact(32 * 24 * 3)) {
            let mean = |v: &[f32]| v.iter().sum::<f32>() / v.len().to_f32();
            let (a, b) = (mean(plain), mean(changed));
            let sum =
                |f: &dyn Fn(f32, f32) -> f32| plain.iter().zip(changed).map(|(x, y)| f(x - a, y - b)).sum::<f32>();
            let correlation = sum(&|x, y| x * y) / (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt().max(1e-9);
            let flat = sum(&|x, _| x * x) < 1e-3;
            assert!(flat || correlation > 0.5, "{correlation}");
        }
    }

    /// Expected: a photograph smaller than a crop is enlarged with its aspect ratio; other pixels give another checksum.
    #[test]
    fn small_photographs_are_enlarged() {
        let mut photos = photos();
        let before = photos.checksum();
        photos.add((40, 200), &vec![vec![9; 40 * 200]; 3]).unwrap();
        assert_ne!(before, photos.checksum());
        let (size, example) = photos.all[1].at(0, (32, 24));
        assert!(size.0 >= 32 && size.1 >= 24 && size.1 > size.0, "{size:?}");
        assert_eq!(example.labels.len(), (size.0 * size.1).to_usize());
        for step in 0..20 {
            assert_eq!(photos.views(&order(2), step).changed.len(), 2 * 32 * 24 * 3);
        }
    }
}
