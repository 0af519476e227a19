//! Crops that are named: a rendered image knows the species of every plant, so any of them can be its crop.
//!
//! A species of the image is named, and the labels follow: its plants are crop, all others weed. Weeds are named as well, so that a
//! network must learn what species look like: it cannot get by with rows and sizes. Sometimes a species is named that the image does
//! not contain; then all plants are weeds. The image is seen again with other names in later epochs.

use super::example::Example;
use furrow_base::math::ToInt;
use furrow_base::sampling::Stream;

/// Number of the class crop.
const CROP: u8 = 1;
/// Number of the class weed.
const WEED: u8 = 2;
/// Fraction of the named images whose sown crop is named.
const SOWN: f64 = 0.55;
/// Fraction of the named images in which a species that they do not contain is named. In the others it is a weed of the image.
const ABSENT: f64 = 0.2;
/// Fraction of the named images with a second name.
const SECOND: f64 = 0.15;
/// Smallest number of pixels of a species for it to be named as one that the image contains.
const LEAST: usize = 40;

/// Naming of crops in the images of a training.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Naming {
    /// Fraction of the images with a named crop, 0 to 1.
    pub share: f64,
    /// Number of species that can be named.
    pub species: usize,
}

impl Naming {
    /// Draws the species that are named in an image, as indices, and changes its labels accordingly. If none are named, or the image has no
    /// species, the labels stay.
    pub fn name(&self, example: &mut Example, stream: &mut Stream) -> Vec<u8> {
        if example.species.is_empty() || self.species == 0 || !stream.chance(self.share) {
            return Vec::new();
        }
        let mut named = vec![self.draw(example, stream)];
        if stream.chance(SECOND) {
            let second = self.draw(example, stream);
            if second != named[0] {
                named.push(second);
            }
        }
        for (label, species) in example.labels.iter_mut().zip(&example.species) {
            if matches!(*label, CROP | WEED) {
                let is_named = species.checked_sub(1).is_some_and(|species| named.contains(&species));
                *label = if is_named { CROP } else { WEED };
            }
        }
        named
    }

    /// Draws one species.
    fn draw(&self, example: &Example, stream: &mut Stream) -> u8 {
        let mut pixels = vec![[0usize; 2]; self.species];
        for (label, species) in example.labels.iter().zip(&example.species) {
            let found = species.checked_sub(1).and_then(|species| pixels.get_mut(usize::from(species)));
            if let (Some(found), CROP | WEED) = (found, *label) {
                found[usize::from(*label == WEED)] += 1;
            }
        }
        let all = || pixels.iter().enumerate();
        let sown: Vec<usize> = all().filter(|(_, [crop, _])| *crop >= LEAST).map(|(k, _)| k).collect();
        let weeds: Vec<usize> =
            all().filter(|(_, [crop, weed])| *crop == 0 && *weed >= LEAST).map(|(k, _)| k).collect();
        let absent: Vec<usize> = all().filter(|(_, pixels)| **pixels == [0, 0]).map(|(k, _)| k).collect();
        let kind = stream.range(0.0, 1.0);
        let order = if kind < SOWN {
            [&sown, &weeds, &absent]
        } else if kind < 1.0 - ABSENT {
            [&weeds, &sown, &absent]
        } else {
            [&absent, &sown, &weeds]
        };
        match order.into_iter().find(|list| !list.is_empty()) {
            Some(list) => list[stream.index(list.len())],
            None => stream.index(self.species),
        }
        .to_u8()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::Purpose;

    /// Expected: the plants of the named species, and only they, are crop; soil and pixels without a label stay; all of sown crop, weed
    /// and absent species are named, the sown crop most often; without species or names the labels stay.
    #[test]
    fn labels_follow_the_name() {
        // Soil, 60 pixels of the sown species 0, 60 of the weed 2, and pixels without a label; species 1 is absent.
        let labels = [vec![0; 60], vec![1; 60], vec![2; 60], vec![255; 4]].concat();
        let species = [vec![0; 60], vec![1; 60], vec![3; 60], vec![1; 4]].concat();
        let image = Example { name: String::new(), planes: Vec::new(), labels, plants: Vec::new(), species };
        let mut counts = [0; 3];
        for seed in 0..400 {
            let mut example = image.clone();
            let named =
                Naming { share: 1.0, species: 3 }.name(&mut example, &mut Stream::of(seed, 0, Purpose::Test, 0));
            counts[usize::from(named[0])] += 1;
            let class = |species: u8| if named.contains(&species) { 1 } else { 2 };
            let expected = [vec![0; 60], vec![class(0); 60], vec![class(2); 60], vec![255; 4]].concat();
            assert_eq!(example.labels, expected, "{named:?}");
        }
        assert!(counts[0] > counts[2] && counts[2] > 40 && counts[1] > 40, "{counts:?}");
        let bare = Example { species: Vec::new(), ..image.clone() };
        for (share, mut example) in [(0.0, image.clone()), (1.0, bare)] {
            let named = Naming { share, species: 3 }.name(&mut example, &mut Stream::of(1, 0, Purpose::Test, 0));
            assert_eq!((named, example.labels), (Vec::new(), image.labels.clone()));
        }
    }
}
