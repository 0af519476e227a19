//! Selection of images of a set to show with their predictions: evenly spread over the set and, on request, those with the worst
//! predictions.

use super::thumbnail::{Thumbnail, spread};
use crate::data::{Band, Example};
use crate::measure::{Confusion, Scores};
use furrow_base::Result;

/// Collector of the images to show.
pub struct Thumbnails {
    places: Vec<usize>,
    next: usize,
    classes: usize,
    worst: usize,
    /// Indices of red, green and blue among the bands; the first band three times if one of them is missing.
    planes: [usize; 3],
    most: u32,
    /// Kept images: index, mean I/U (only for those kept as the worst), and image; the worst first, then the evenly spread ones.
    kept: Vec<(usize, Option<f64>, Thumbnail)>,
}

impl Thumbnails {
    /// Collects at most `shown` of `images` images with these bands, each downscaled to at most `most` pixels wide and high.
    pub fn new(images: usize, shown: usize, most: u32, bands: &[Band]) -> Self {
        let place = |band: &Band| bands.iter().position(|b| b == band);
        let [red, green, blue] = Band::RGB.map(|band| place(&band));
        let planes = match (red, green, blue) {
            (Some(red), Some(green), Some(blue)) => [red, green, blue],
            _ => [0; 3],
        };
        Self { places: spread(images, shown), next: 0, classes: 0, worst: 0, planes, most, kept: Vec::new() }
    }

    /// Also collects the `worst` images with the lowest mean I/U over `classes` classes.
    #[must_use]
    pub fn and_worst(self, worst: usize, classes: usize) -> Self {
        Self { classes, worst, ..self }
    }

    /// Adds the next image with its prediction; it is kept only if it is one of the images to show. `size` is its width and height.
    pub fn see(&mut self, example: &Example, size: (u32, u32), predicted: &[u8]) -> Result<()> {
        let place = self.next;
        self.next += 1;
        let iou = if self.worst > 0 { self.mean_iou(example, predicted)? } else { None };
        // Ties keep the earlier image; images without a score are not among the worst.
        let at = iou.map(|iou| self.kept.iter().take_while(|(_, there, _)| there.is_some_and(|t| t <= iou)).count());
        let at = at.filter(|at| *at < self.worst);
        if at.is_none() && !self.places.contains(&place) {
            return Ok(());
        }
        let planes = self.planes.map(|band| &example.planes[band]);
        let rgb: Vec<[u8; 3]> = (0..example.labels.len()).map(|i| planes.map(|plane| plane[i])).collect();
        let thumbnail = Thumbnail::new(&example.name, size, &rgb, &example.labels, &[predicted], self.most);
        match at {
            Some(at) => self.kept.insert(at, (place, iou, thumbnail)),
            None => self.kept.push((place, None, thumbnail)),
        }
        let scored = self.kept.iter().take_while(|(_, iou, _)| iou.is_some()).count();
        if scored > self.worst {
            let (place, _, thumbnail) = self.kept.remove(self.worst);
            if self.places.contains(&place) {
                self.kept.push((place, None, thumbnail));
            }
        }
        Ok(())
    }

    /// Returns the kept images: the worst in ascending order of mean I/U, then the evenly spread ones in their order, without duplicates.
    pub fn kept(mut self) -> Vec<Thumbnail> {
        self.kept.sort_by_key(|(place, iou, _)| if iou.is_some() { (false, 0) } else { (true, *place) });
        self.kept.into_iter().map(|(_, _, thumbnail)| thumbnail).collect()
    }

    fn mean_iou(&self, example: &Example, predicted: &[u8]) -> Result<Option<f64>> {
        let mut confusion = Confusion::new(self.classes);
        confusion.add(&example.labels, predicted)?;
        let plants: Vec<bool> = (0..self.classes).map(|class| class > 0).collect();
        Ok(Scores::of(&confusion, &plants).mean_iou)
    }
}
