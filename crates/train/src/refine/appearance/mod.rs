//! Refinement step `appearance`: plants of one field with similar appearance features tend to be of one class.
//!
//! A network cannot recognize a crop that it was never trained on. The rows, the plant sizes and the network give each plant of a
//! field a probability of being crop. These probabilities are the labels from which a classifier learns the appearance of crop and
//! weeds in this field; a plant between rows that looks like the plants in rows is then crop. This needs no labelled images and no
//! further training of the network.
//!
//! Appearance features are activations of the network's encoder, at its levels with strides of 8 and 16 pixels.
//!
//! The classifier is weighted by its cross-validated accuracy on held-out images. If crop and weeds look alike, or all plants are of one
//! class, a classifier can only predict the more frequent class; it is then left out.
//!
//! Points on plants of known class, if there are any, correct the sum of all log odds; see [`Examples::correction`].
//!
//! Source: self-training on the arrangement of plants, Lottes & Stachniss 2017, "Semi-supervised online visual crop and weed
//! classification in precision farming exploiting plant arrangement"; features and constants are our choice.

mod logistic;

use crate::measure::components::Components;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2};
use logistic::Classifier;
use std::collections::BTreeMap;

pub use logistic::Examples;
use logistic::Marked;

/// Weight of the appearance log odds relative to the sum of the other log odds.
const WEIGHT: f64 = 8.0;
/// Weight of the local log odds at a pixel; the rest, 1 − `PLACE`, is that of the mean over its plant.
const PLACE: f64 = 0.5;
/// Standard deviation of the Gaussian blur of the local log odds, as a fraction of the longer side of the feature map.
const BLUR: f64 = 1.0 / 60.0;
/// Bound on the absolute log odds of the labels.
const SURE: f64 = 8.0;
/// Maximum number of regions per image used as examples, the largest first: bounds the memory on noisy predictions.
const MOST: usize = 2000;
/// Range of the cross-validated pseudo-R² over which the classifier's weight rises linearly from 0 to 1.
const ACCURACY_RANGE: (f64, f64) = (0.05, 0.15);
/// Largest distance of a point from the plant that it marks, as a fraction of the longer side of the image.
const BESIDE: f32 = 0.01;
/// Log odds that a point adds at its pixel, and the standard deviation of the Gaussian with which they fall over its region, as a fraction of
/// the longer side of the image: about a leaf.
const AT_POINT: (f64, f32) = (16.0, 0.03);
/// Minimum number of images with plants: within one image, plants only repeat the errors of its rows.
const LEAST: usize = 2;

/// Point on a plant of known class.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Position in an image as fractions of its width and height, from the left and the top.
    pub at: Vec2,
    /// Whether the plant is crop; otherwise it is a weed.
    pub is_crop: bool,
}

impl Point {
    /// Returns the pixel that the point marks in an image of this size: that at the point, or the nearest pixel of a plant. `None` if no
    /// plant is near.
    fn pixel(&self, regions: &Components, (width, height): (usize, usize)) -> Option<usize> {
        let place = |part: f32, cells: usize| ((part * cells.to_f32()).trunc_to::<usize>()).min(cells - 1);
        let (x, y) = (place(self.at.x, width), place(self.at.y, height));
        let reach = (BESIDE * width.max(height).to_f32()).ceil_to::<usize>();
        let pixels = (y.saturating_sub(reach)..=(y + reach).min(height - 1))
            .flat_map(|j| (x.saturating_sub(reach)..=(x + reach).min(width - 1)).map(move |i| (i, j)));
        let far = |(i, j): &(usize, usize)| i.abs_diff(x).pow(2) + j.abs_diff(y).pow(2);
        let plants = pixels.filter(|(i, j)| regions.labels[j * width + i] > 0);
        plants.min_by_key(far).filter(|pixel| far(pixel) <= reach.pow(2)).map(|(i, j)| j * width + i)
    }
}

/// Encoder features of an image: a vector for each cell of a grid.
#[derive(Clone, Debug, Default)]
pub struct Features {
    /// Width and height of the grid, cells.
    pub size: (usize, usize),
    /// One plane of cells per feature.
    pub planes: Vec<Vec<f32>>,
}

impl Features {
    /// Returns the index of the cell that contains pixel `at` of an image of this size.
    fn cell(&self, at: usize, (width, height): (usize, usize)) -> usize {
        let (x, y) = (at % width * self.size.0 / width, at / width * self.size.1 / height);
        y * self.size.0 + x
    }

    /// Interpolates cell values bilinearly between cell centres at pixel `at` of an image of this size.
    fn between(&self, values: &[f64], at: usize, (width, height): (usize, usize)) -> f64 {
        let place = |pixel: usize, pixels: usize, cells: usize| {
            let place =
                ((pixel.to_f64() + 0.5) * cells.to_f64() / pixels.to_f64() - 0.5).clamp(0.0, (cells - 1).to_f64());
            (place.trunc_to::<usize>(), (place.trunc_to::<usize>() + 1).min(cells - 1), place.fract())
        };
        let (left, right, x) = place(at % width, width, self.size.0);
        let (above, below, y) = place(at / width, height, self.size.1);
        let linear = |from: f64, to: f64, share: f64| from + (to - from) * share;
        let row = |row: usize| linear(values[row * self.size.0 + left], values[row * self.size.0 + right], x);
        linear(row(above), row(below), y)
    }

    /// Counts the pixels of each (region, cell) pair; regions are numbered from 0. `size` is that of the image.
    fn shared(&self, regions: &Components, size: (usize, usize)) -> BTreeMap<(usize, usize), f32> {
        let mut shared = BTreeMap::new();
        for (at, region) in regions.labels.iter().enumerate().filter(|(_, region)| **region > 0) {
            *shared.entry((region.to_usize() - 1, self.cell(at, size))).or_insert(0.0) += 1.0;
        }
        shared
    }

    /// Sums the plant pixels of each cell over all regions.
    fn counts(&self, shared: &BTreeMap<(usize, usize), f32>) -> Vec<f64> {
        let mut counts = vec![0.0; self.size.0 * self.size.1];
        for ((_, cell), pixels) in shared {
            counts[*cell] += f64::from(*pixels);
        }
        counts
    }

    /// Evaluates a classifier in each cell; returns log odds.
    fn cells(&self, classifier: &Classifier) -> Vec<f64> {
        let mut cells = vec![classifier.bias; self.size.0 * self.size.1];
        for (plane, weight) in self.planes.iter().zip(&classifier.weights) {
            cells.iter_mut().zip(plane).for_each(|(cell, value)| *cell += weight * f64::from(*value));
        }
        cells
    }
}

impl Examples {
    /// Collects the largest regions of an image as examples. `odds` holds each region's log odds of crop over weed from the
    /// network, sizes and rows; an example's weight is the square root of its area. `points` mark plants of known class.
    pub(super) fn of(
        regions: &Components,
        size: (usize, usize),
        odds: &[f64],
        features: &Features,
        points: &[Point],
    ) -> Self {
        let mut largest: Vec<usize> = (0..regions.areas.len()).collect();
        largest.sort_by_key(|region| std::cmp::Reverse(regions.areas[*region]));
        largest.truncate(MOST);
        let mut places = vec![None; regions.areas.len()];
        largest.iter().enumerate().for_each(|(place, region)| places[*region] = Some(place));
        let channels = features.planes.len();
        let mut means = vec![0.0f32; largest.len() * channels];
        let shared = features.shared(regions, size);
        for (&(region, cell), pixels) in &shared {
            let Some(place) = places[region] else { continue };
            let share = pixels / regions.areas[region].to_f32();
            let means = &mut means[place * channels..(place + 1) * channels];
            means.iter_mut().zip(&features.planes).for_each(|(mean, plane)| *mean += share * plane[cell]);
        }
        let label = |region: &usize| 1.0 / (1.0 + (-odds[*region].clamp(-SURE, SURE)).exp());
        let (mut marked, mut pixels) = (Marked::default(), Vec::new());
        for (point, at) in points.iter().filter_map(|point| Some((point, point.pixel(regions, size)?))) {
            let region = regions.labels[at].to_usize() - 1;
            let Some(place) = places[region] else { continue };
            let means = &means[place * channels..(place + 1) * channels];
            pixels.push(at);
            marked.features.extend(means);
            marked.odds.push(odds[region]);
            marked.crops.push(point.is_crop);
        }
        let counts = features.counts(&shared);
        for (c, plane) in features.planes.iter().enumerate().filter(|_| !pixels.is_empty()) {
            let plane: Vec<f64> = plane.iter().map(|value| f64::from(*value)).collect();
            let near = blurred(&plane, &counts, features.size);
            for (k, at) in pixels.iter().enumerate() {
                let value = &mut marked.features[k * channels + c];
                *value = ((1.0 - PLACE) * f64::from(*value) + PLACE * features.between(&near, *at, size)).to_f32();
            }
        }
        Self {
            features: means,
            labels: largest.iter().map(label).collect(),
            weights: largest.iter().map(|region| f64::from(regions.areas[*region]).sqrt()).collect(),
            marked,
        }
    }
}

/// Appearance model of crop and weeds in one field.
#[derive(Clone, Debug, PartialEq)]
pub struct Appearance {
    /// Classifier that was learnt from rows and sizes, and its weight by its cross-validated accuracy, 0 to 1.
    learnt: Option<(Classifier, f64)>,
    /// Factor on all log odds and the classifier that is added to them, from points on plants of known class; `None` if there are too few
    /// plants.
    correction: Option<(f64, Classifier)>,
    /// Number of points on plants.
    pub points: usize,
}

impl Appearance {
    /// Learns the model from the plants of several images. Returns `None` if there are too few of them, or if no points mark plants and
    /// appearance does not predict the labels of held-out images.
    pub fn learn(pictures: &[Examples]) -> Option<Self> {
        let pictures: Vec<&Examples> = pictures.iter().filter(|picture| !picture.labels.is_empty()).collect();
        let (mut all, mut numbers) = (Examples::default(), Vec::new());
        for (number, picture) in pictures.iter().enumerate() {
            all.features.extend(&picture.features);
            all.labels.extend(&picture.labels);
            all.weights.extend(&picture.weights);
            all.marked.extend(&picture.marked);
            numbers.resize(all.labels.len(), number);
        }
        let components = all.components();
        let learnt = components.as_ref().filter(|_| pictures.len() >= LEAST);
        let learnt =
            learnt.and_then(|components| all.learn(components, &numbers)).and_then(|(classifier, accuracy)| {
                let trust = ((accuracy - ACCURACY_RANGE.0) / (ACCURACY_RANGE.1 - ACCURACY_RANGE.0)).clamp(0.0, 1.0);
                (trust > 0.0).then_some((classifier, trust))
            });
        let looks =
            |k: usize| learnt.as_ref().map_or(0.0, |(c, trust)| WEIGHT * trust * c.log_odds(all.marked.features(k)));
        let odds: Vec<f64> =
            all.marked.odds.iter().enumerate().map(|(k, odds)| (odds + looks(k)).clamp(-SURE, SURE)).collect();
        let correction = components.and_then(|components| all.correction(&components, &odds));
        let points = odds.len();
        (learnt.is_some() || points > 0).then_some(Self { learnt, correction, points })
    }

    /// Returns the log odds of crop over weed at each plant pixel of an image; 0 at other pixels. `odds` holds those of each region from the
    /// network, sizes and rows; `points` add to those around them.
    pub(super) fn log_odds(
        &self,
        regions: &Components,
        size: (usize, usize),
        odds: &[f64],
        features: &Features,
        points: &[Point],
    ) -> Vec<f64> {
        let shared = features.shared(regions, size);
        let counts = features.counts(&shared);
        let spread = |classifier: &Classifier| -> Vec<f64> {
            let cells = features.cells(classifier);
            let mut sums = vec![0.0; regions.areas.len()];
            for ((region, cell), pixels) in &shared {
                sums[*region] += f64::from(*pixels) * cells[*cell];
            }
            let near = blurred(&cells, &counts, features.size);
            let value = |(at, region): (usize, &u32)| {
                let Some(region) = region.to_usize().checked_sub(1) else { return 0.0 };
                let whole = sums[region] / f64::from(regions.areas[region]);
                (1.0 - PLACE) * whole + PLACE * features.between(&near, at, size)
            };
            regions.labels.iter().enumerate().map(value).collect()
        };
        let looks = self.learnt.as_ref().map(|(classifier, trust)| (WEIGHT * trust, spread(classifier)));
        let added = self.correction.as_ref().map(|(factor, classifier)| (*factor, spread(classifier)));
        let around = around(regions, size, points);
        let value = |(at, region): (usize, &u32)| {
            let Some(region) = region.to_usize().checked_sub(1) else { return 0.0 };
            let odds = odds[region] + looks.as_ref().map_or(0.0, |(weight, looks)| weight * looks[at]);
            let all = added.as_ref().map_or(odds, |(factor, added)| factor * odds.clamp(-SURE, SURE) + added[at]);
            all + around.get(at).copied().unwrap_or(0.0)
        };
        regions.labels.iter().enumerate().map(value).collect()
    }
}

/// Returns the log odds that points add at the pixels around them, within the region that each marks; empty without points.
fn around(regions: &Components, size: (usize, usize), points: &[Point]) -> Vec<f64> {
    let sd = AT_POINT.1 * size.0.max(size.1).to_f32();
    let reach = (3.0 * sd).ceil_to::<usize>();
    let bell: Vec<f64> = (0..=reach).map(|d| f64::from((-0.5 * (d.to_f32() / sd).powi(2)).exp())).collect();
    // Points on one pixel count together: however many there are, each pixel is marked once.
    let mut marks: BTreeMap<usize, f64> = BTreeMap::new();
    for (point, at) in points.iter().filter_map(|point| Some((point, point.pixel(regions, size)?))) {
        *marks.entry(at).or_insert(0.0) += if point.is_crop { AT_POINT.0 } else { -AT_POINT.0 };
    }
    let mut around = vec![0.0; if marks.is_empty() { 0 } else { regions.labels.len() }];
    for (at, odds) in marks {
        let (x, y) = (at % size.0, at / size.0);
        for j in y.saturating_sub(reach)..=(y + reach).min(size.1 - 1) {
            for i in x.saturating_sub(reach)..=(x + reach).min(size.0 - 1) {
                let pixel = j * size.0 + i;
                if regions.labels[pixel] == regions.labels[at] {
                    around[pixel] += odds * bell[i.abs_diff(x)] * bell[j.abs_diff(y)];
                }
            }
        }
    }
    around
}

/// Blurs cell values with a Gaussian, each cell weighted by its number of plant pixels. Cells without plants nearby keep their value.
fn blurred(values: &[f64], counts: &[f64], (width, height): (usize, usize)) -> Vec<f64> {
    let sd = BLUR * width.max(height).to_f64();
    let reach = (3.0 * sd).ceil_to::<isize>();
    let kernel: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k.to_f64() / sd.max(1e-9)).powi(2)).exp()).collect();
    let along = |grid: &[f64], stride: usize, cells: usize| -> Vec<f64> {
        let value = |at: usize| {
            let place = (at / stride % cells).to_isize();
            let near = (-reach..=reach).zip(&kernel).filter(|(k, _)| (0..cells.to_isize()).contains(&(place + k)));
            near.map(|(k, weight)| weight * grid[at.wrapping_add_signed(k * stride.to_isize())]).sum()
        };
        (0..grid.len()).map(value).collect()
    };
    let both = |grid: Vec<f64>| along(&along(&grid, 1, width), width, height);
    let (sums, all) = (both(values.iter().zip(counts).map(|(v, n)| v * n).collect()), both(counts.to_vec()));
    let value = |((sum, all), value): ((&f64, &f64), &f64)| if *all > 0.0 { sum / all } else { *value };
    sums.iter().zip(&all).zip(values).map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::vec2;
    use furrow_base::sampling::{Purpose, Stream};

    /// Builds an image of 80 × 80 pixels in cells of 8. Each plant (cell x, cell y, feature value, log odds by rows) covers 6 × 6
    /// pixels of its cell. Returns the regions, the features and the log odds.
    fn picture(plants: &[(usize, usize, f32, f64)]) -> (Components, Features, Vec<f64>) {
        let inside = |at: usize| {
            let (x, y) = (at % 80, at / 80);
            let plant = plants.iter().position(|(cx, cy, ..)| x / 8 == *cx && y / 8 == *cy)?;
            ((1..7).contains(&(x % 8)) && (1..7).contains(&(y % 8))).then_some(plant)
        };
        let regions = Components::of(80, 80, inside);
        let cell =
            |c: usize| plants.iter().find(|(x, y, ..)| (*x, *y) == (c % 10, c / 10)).map_or(0.0, |plant| plant.2);
        let plane: Vec<f32> = (0..100).map(cell).collect();
        let other = (0..100).map(|c| (c % 7).to_f32()).collect();
        let mut order: Vec<_> = plants.to_vec();
        order.sort_by_key(|(x, y, ..)| (*y, *x));
        (regions, Features { size: (10, 10), planes: vec![plane, other] }, order.iter().map(|plant| plant.3).collect())
    }

    /// Expected: if plants in rows and plants between rows differ in appearance, a plant between rows that looks like those in rows
    /// is crop and a plant in a row that looks like those between rows is weed; soil has log odds 0. Source: the rule.
    #[test]
    fn plants_that_look_alike_are_of_one_class() {
        let crops = [(2, 0), (2, 2), (2, 4), (2, 6), (7, 1), (7, 3), (7, 5), (7, 7)].map(|(x, y)| (x, y, 1.0, 3.0));
        let weeds = [(0, 1), (4, 3), (5, 5), (4, 7), (0, 9), (9, 0)].map(|(x, y)| (x, y, -1.0, -3.0));
        let odd = [(2, 8, -1.0, 3.0), (9, 9, 1.0, -3.0)];
        let plants = [crops.as_slice(), &weeds, &odd].concat();
        let (regions, features, evidence) = picture(&plants);
        assert_eq!(regions.areas, [36; 16]);
        let learnt = || Examples::of(&regions, (80, 80), &evidence, &features, &[]);
        let appearance = Appearance::learn(&[learnt(), learnt(), Examples::default()]).unwrap();
        let odds = appearance.log_odds(&regions, (80, 80), &evidence, &features, &[]);
        for (x, y, looks, _) in plants {
            let at = (y * 8 + 4) * 80 + x * 8 + 4;
            assert_eq!(odds[at] > 0.0, looks > 0.0, "({x}, {y}): {}", odds[at]);
        }
        assert!(regions.labels.iter().zip(&odds).all(|(region, odds)| (*region == 0) == (*odds == 0.0)));
    }

    /// Expected: appearance that predicts the labels of held-out images counts fully; it is left out if it does not predict them, or if all
    /// plants have one label; if it predicts a third of the labels it counts in part. Source: the rule.
    #[test]
    fn appearance_is_weighted_by_its_cross_validated_accuracy() {
        let mut s = Stream::of(4, 0, Purpose::Test, 0);
        let mut field = |share: f64, kinds: bool| -> Vec<Examples> {
            let mut one = |_| {
                let mut examples = Examples::default();
                for _ in 0..60 {
                    let crop = s.chance(0.5);
                    let follows = s.chance(share);
                    let says = if follows { crop } else { s.chance(0.5) };
                    let looks = if crop { 1.0 } else { -1.0 };
                    examples.features.extend([looks + 0.2 * s.normal().to_f32(), s.normal().to_f32()]);
                    examples.labels.push(if says || !kinds { 0.95 } else { 0.05 });
                    examples.weights.push(s.range(0.5, 2.0));
                }
                examples
            };
            (0..8).map(&mut one).collect()
        };
        let trust = |pictures: &[Examples]| {
            Appearance::learn(pictures).and_then(|found| found.learnt).map_or(0.0, |(_, trust)| trust)
        };
        assert_eq!(trust(&field(0.9, true)), 1.0);
        assert_eq!(trust(&field(0.0, true)), 0.0);
        assert_eq!(trust(&field(0.9, false)), 0.0);
        let part = trust(&field(0.33, true));
        assert!(part > 0.0 && part < 1.0, "{part}");
    }

    /// Expected: rows and sizes call all plants the wrong class; a point on three of each kind turns the others, a plant with a point has its
    /// class whatever its looks, points of both classes cancel, and points on soil have no effect. Source: the rule.
    #[test]
    fn points_name_plants_and_those_that_look_alike() {
        let wrong = |k: usize| if k.is_multiple_of(2) { -4.0 } else { 4.0 };
        let looks = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let plants: Vec<_> = (0..24).map(|k| (2 * (k % 5), 2 * (k / 5), looks(k), wrong(k))).collect();
        let (regions, features, odds) = picture(&plants);
        let at = |k: usize| vec2((2.0 * (k % 5).to_f32() + 0.5) / 10.0, (2.0 * (k / 5).to_f32() + 0.5) / 10.0);
        let mut points: Vec<Point> = (0..6).map(|k| Point { at: at(k), is_crop: looks(k) > 0.0 }).collect();
        points.push(Point { at: vec2(0.15, 0.95), is_crop: true });
        let learnt = Appearance::learn(&[Examples::of(&regions, (80, 80), &odds, &features, &points)]).unwrap();
        assert_eq!(learnt.points, 6);
        let values = |points: &[Point]| learnt.log_odds(&regions, (80, 80), &odds, &features, points);
        let pixel = |k: usize| (2 * (k / 5) * 8 + 4) * 80 + 2 * (k % 5) * 8 + 4;
        for k in 0..24 {
            assert_eq!(values(&[])[pixel(k)] > 0.0, looks(k) > 0.0, "{k}");
        }
        // A single plant of another class than its looks.
        let odd = Point { at: at(10), is_crop: looks(10) < 0.0 };
        assert_eq!(values(&[odd])[pixel(10)] > 0.0, odd.is_crop);
        let both = [odd, Point { is_crop: !odd.is_crop, ..odd }];
        assert_eq!(values(&both)[pixel(10)], values(&[])[pixel(10)]);
    }

    /// Expected: nothing is learnt from one image alone, nor from images without plants. Source: the rule.
    #[test]
    fn one_image_is_too_little_evidence() {
        let side = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let plants: Vec<_> = (0..10).map(|k| (k, k, side(k), f64::from(side(k)))).collect();
        let (regions, features, evidence) = picture(&plants);
        let learnt = || Examples::of(&regions, (80, 80), &evidence, &features, &[]);
        assert!(Appearance::learn(&[learnt()]).is_none());
        assert!(Appearance::learn(&[learnt(), Examples::default()]).is_none());
        assert!(Appearance::learn(&[]).is_none());
        assert!(Appearance::learn(&[learnt(), learnt()]).is_some());
    }

    /// Expected: if each cell holds x + 10 y of its centre, interpolation returns x + 10 y of each pixel's centre; beyond the
    /// outermost cell centres values are clamped. Source: linear interpolation.
    #[test]
    fn values_are_linear_between_cells() {
        let features = Features { size: (5, 4), planes: Vec::new() };
        let centre = |c: usize| ((c % 5).to_f64() + 0.5) * 8.0 + 10.0 * ((c / 5).to_f64() + 0.5) * 8.0;
        let values: Vec<f64> = (0..20).map(centre).collect();
        for (x, y) in [(4, 4), (10, 4), (17, 21), (35, 27), (0, 0), (39, 31)] {
            let (cx, cy) = ((x.to_f64() + 0.5).clamp(4.0, 36.0), (y.to_f64() + 0.5).clamp(4.0, 28.0));
            let found = features.between(&values, y * 40 + x, (40, 32));
            assert!((found - cx - 10.0 * cy).abs() < 1e-9, "({x}, {y}): {found}");
        }
    }

    /// Expected: a constant map stays constant up to its edges, whichever cells hold plants; without plants values stay; a step is
    /// smoothed. Source: the rule.
    #[test]
    fn blurring_keeps_what_is_even() {
        let counts: Vec<f64> = (0..600).map(|c| f64::from(u8::from(c % 3 == 0))).collect();
        let even = blurred(&[0.25; 600], &counts, (30, 20));
        assert!(even.iter().all(|v| (v - 0.25).abs() < 1e-12), "{even:?}");
        assert_eq!(blurred(&[1.0, 2.0], &[0.0, 0.0], (2, 1)), [1.0, 2.0]);
        let halves: Vec<f64> = (0..600).map(|c| if c % 30 < 15 { 1.0 } else { -1.0 }).collect();
        let soft = blurred(&halves, &[1.0; 600], (30, 20));
        assert!(soft[0] > 0.999 && soft[29] < -0.999 && soft[14].abs() < 0.9 && (soft[14] + soft[15]).abs() < 1e-9);
    }

    /// Expected: of 2500 specks and one plant with the last region number, the plant is the first example and specks fill the rest.
    /// Source: the rule.
    #[test]
    fn the_largest_regions_are_learnt_from() {
        let plant = |at: usize| at / 202 > 100 && at % 202 < 10;
        let speck = |at: usize| [at / 202, at % 202].iter().all(|place| *place < 100 && place & 1 == 0);
        let regions = Components::of(202, 110, |at| (plant(at) || speck(at)).then_some(()));
        assert_eq!(regions.areas.len(), 2501);
        let odds: Vec<f64> = (0..2501).map(|k| if k == 2500 { 4.0 } else { -4.0 }).collect();
        let found = Examples::of(&regions, (202, 110), &odds, &Features { size: (1, 1), planes: vec![vec![2.5]] }, &[]);
        assert_eq!((found.labels.len(), found.weights[0], found.weights[1]), (MOST, 90f64.sqrt(), 1.0));
        assert!(found.labels[0] > 0.9 && found.labels[1..].iter().all(|p| *p < 0.1));
        assert!(found.features.iter().all(|f| (f - 2.5).abs() < 1e-5));
    }
}
