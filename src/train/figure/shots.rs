//! Some images of a set with their predictions, evenly spread over it, for people to look at.

use super::shot::{Shot, spread};
use crate::train::data::{Band, Example};

/// Images to look at, spread over a set.
pub struct Shots {
    places: Vec<usize>,
    next: usize,
    /// Red, green and blue among the bands; the first band for each where they are not all there.
    planes: [usize; 3],
    most: u32,
    /// Those that were kept.
    pub kept: Vec<Shot>,
}

impl Shots {
    /// At most `shown` of `images` images that have these bands, each at most `most` pixels wide and high.
    pub fn new(images: usize, shown: usize, most: u32, bands: &[Band]) -> Self {
        let place = |band: &Band| bands.iter().position(|b| b == band);
        let [red, green, blue] = Band::RGB.map(|band| place(&band));
        let planes = match (red, green, blue) {
            (Some(red), Some(green), Some(blue)) => [red, green, blue],
            _ => [0; 3],
        };
        Self { places: spread(images, shown), next: 0, planes, most, kept: Vec::new() }
    }

    /// Sees the next image, which has this width and height; keeps it if it is one of the chosen.
    pub fn see(&mut self, example: &Example, size: (u32, u32), predicted: &[u8]) {
        if self.places.contains(&self.next) {
            let planes = self.planes.map(|band| &example.planes[band]);
            let rgb: Vec<[u8; 3]> = (0..example.labels.len()).map(|i| planes.map(|plane| plane[i])).collect();
            self.kept.push(Shot::new(&example.name, size, &rgb, &example.labels, &[predicted], self.most));
        }
        self.next += 1;
    }
}
