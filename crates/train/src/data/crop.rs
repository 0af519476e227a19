//! Random crops of training images.

use super::example::Example;
use super::ground::Ground;
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::sampling::Stream;
use furrow_dataset::model::sample::IGNORE;

/// Parameters of the random crop of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crop {
    /// Width and height of the image, pixels.
    pub image: (u32, u32),
    /// Width and height of the crop, pixels; not larger than the image.
    pub size: (u32, u32),
    /// Fraction of crops that are placed around a rare-class pixel, 0 to 1. The class is sampled with probabilities inverse to its
    /// number of pixels in the image, and its pixel is anywhere in the crop. Other crops are anywhere in the image. Based on Isensee
    /// et al. 2021 (nnU-Net), where a third of the patches contain foreground.
    pub rare: f64,
    /// Pixel sizes on the ground for scaling; `None` to scale by 1/1.5 to 1.5.
    pub ground: Option<Ground>,
}

/// Crop of a training image.
#[derive(Clone, Debug, PartialEq)]
pub struct Augmented {
    /// Pixels, bands interleaved.
    pub pixels: Vec<f32>,
    /// Class of each pixel; 255 for no label.
    pub labels: Vec<u8>,
    /// Plant number of each pixel, 0 for none; empty unless the example has them.
    pub plants: Vec<u32>,
}

/// Largest number of sample points across a pixel of a reduced crop.
const FINEST: f32 = 8.0;

/// Geometric augmentations that are enabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "each is an independent switch, not a state")]
pub(super) struct GeometricAugmentation {
    pub(super) flip: bool,
    pub(super) rotate: bool,
    pub(super) scale: bool,
    pub(super) shift: bool,
}

/// Samples a class with probabilities inverse to the number of pixels of the classes, then one of its pixels. Returns its position
/// relative to the image's centre, or `None` if no pixel has a label.
pub(super) fn rare_pixel(labels: &[u8], (w, h): (u32, u32), stream: &mut Stream) -> Option<[f32; 2]> {
    let mut counts = [0usize; IGNORE as usize];
    labels.iter().filter(|l| **l != IGNORE).for_each(|l| counts[usize::from(*l)] += 1);
    let chance = |count: usize| if count > 0 { 1.0 / count.to_f64() } else { 0.0 };
    let mut left = stream.uniform() * counts.iter().map(|count| chance(*count)).sum::<f64>();
    let class = (0..counts.len()).find(|class| {
        left -= chance(counts[*class]);
        left < 0.0
    })?;
    let place = stream.index(counts[class]);
    let (i, _) = labels.iter().enumerate().filter(|(_, l)| usize::from(**l) == class).nth(place)?;
    let (x, y) = (i.to_u32() % w, i.to_u32() / w);
    Some([x.to_f32() + 0.5 - w.to_f32() / 2.0, y.to_f32() + 0.5 - h.to_f32() / 2.0])
}

/// Transform from the crop to the image, both relative to their centres: a linear map, then a shift.
pub(super) struct Placement {
    matrix: [f32; 4],
    shift: [f32; 2],
    /// Sample points per axis in each pixel; the pixel's value is their mean.
    points: u32,
}

impl Placement {
    /// Samples the placement of a crop. With a point `about` (relative to the image's centre), the crop contains that point. Returns
    /// `None` if the crop is the unchanged image.
    pub(super) fn draw(
        moves: GeometricAugmentation,
        &Crop { image, size, ground, .. }: &Crop,
        about: Option<[f32; 2]>,
        stream: &mut Stream,
    ) -> Option<Self> {
        if size == image && !(moves.flip || moves.rotate || moves.scale || moves.shift) {
            return None;
        }
        let mirror = if moves.flip && stream.chance(0.5) { -1.0 } else { 1.0 };
        let angle = if moves.rotate { stream.range32(0.0, std::f32::consts::TAU) } else { 0.0 };
        let ground = ground.filter(|_| moves.scale);
        let zoom = match ground {
            Some(ground) => ground.zoom(stream),
            None if moves.scale => 1.5f32.powf(stream.range32(-1.0, 1.0)),
            None => 1.0,
        };
        // In a strongly reduced image, single sample points would alias.
        let points = if ground.is_some() { (1.0 / zoom).ceil().clamp(1.0, FINEST).trunc_to::<u32>() } else { 1 };
        let reach = if moves.shift { 0.1 + (0.5 - 0.5 / zoom).max(0.0) } else { 0.0 };
        let (sin, cos) = angle.sin_cos();
        let matrix = [mirror * cos / zoom, -sin / zoom, mirror * sin / zoom, cos / zoom];
        // The shift moves the point to a uniformly random pixel of the crop.
        let about = about.map(|[x, y]| {
            let [u, v] = [size.0, size.1].map(|n| stream.index(n.to_usize()).to_f32() + 0.5 - 0.5 * n.to_f32());
            [x - matrix[0] * u - matrix[1] * v, y - matrix[2] * u - matrix[3] * v]
        });
        let shift = [0, 1].map(|axis| {
            let (n, part) = [(image.0, size.0), (image.1, size.1)][axis];
            let rest = 0.5 * (n - part).to_f32();
            let reach = reach * n.to_f32() + rest;
            let shift = about.map_or_else(|| stream.range32(-reach, reach), |shift| shift[axis].clamp(-reach, reach));
            // Without rotation and scaling, the shift is a whole number of pixels, so that the image stays sharp.
            if moves.rotate || moves.scale { shift } else { (shift + rest).round() - rest }
        });
        Some(Self { matrix, shift, points })
    }

    /// Maps a point of the crop to the image, both relative to their centres.
    pub(super) fn map(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [a, b, c, d] = self.matrix;
        [a * x + b * y + self.shift[0], c * x + d * y + self.shift[1]]
    }

    /// Returns the crop with pixels of 0 to 1.
    pub(super) fn read(&self, example: &Example, crop: &Crop) -> Augmented {
        let &Crop { image: (w, h), size, .. } = crop;
        let bands = example.planes.len();
        let (cx, cy) = (w.to_f32() / 2.0, h.to_f32() / 2.0);
        let (wx, wy) = (size.0.to_f32() / 2.0, size.1.to_f32() / 2.0);
        let source = |x: f32, y: f32| {
            let [x, y] = self.map([x - wx, y - wy]);
            [mirrored(x + cx, w), mirrored(y + cy, h)]
        };
        let count = size.0.to_usize() * size.1.to_usize();
        let mut pixels = Vec::with_capacity(count * bands);
        let mut labels = Vec::with_capacity(count);
        let mut plants = Vec::with_capacity(if example.plants.is_empty() { 0 } else { count });
        for y in 0..size.1 {
            for x in 0..size.0 {
                let middle = source(x.to_f32() + 0.5, y.to_f32() + 0.5);
                let [column, row] = middle.map(RoundTo::trunc_to::<usize>);
                let nearest = row.min(h.to_usize() - 1) * w.to_usize() + column.min(w.to_usize() - 1);
                labels.push(example.labels[nearest]);
                plants.extend(example.plants.get(nearest));
                if self.points == 1 {
                    let around = BilinearTaps::new(middle, (w, h));
                    pixels.extend(example.planes.iter().map(|plane| around.value(plane)));
                    continue;
                }
                let first = pixels.len();
                pixels.resize(first + bands, 0.0);
                let part = |k: u32| (k.to_f32() + 0.5) / self.points.to_f32();
                let share = 1.0 / (self.points * self.points).to_f32();
                for k in 0..self.points * self.points {
                    let at = source(x.to_f32() + part(k % self.points), y.to_f32() + part(k / self.points));
                    let around = BilinearTaps::new(at, (w, h));
                    for (mean, plane) in pixels[first..].iter_mut().zip(&example.planes) {
                        *mean += share * around.value(plane);
                    }
                }
            }
        }
        Augmented { pixels, labels, plants }
    }
}

/// The four pixels around a point of an image, with interpolation weights.
struct BilinearTaps {
    columns: (usize, usize, f32),
    rows: (usize, usize, f32),
    width: usize,
}

impl BilinearTaps {
    fn new([x, y]: [f32; 2], (w, h): (u32, u32)) -> Self {
        Self { columns: between(x, w), rows: between(y, h), width: w.to_usize() }
    }

    /// Interpolates a plane bilinearly; returns 0 to 1.
    fn value(&self, plane: &[u8]) -> f32 {
        let ((x0, x1, fx), (y0, y1, fy)) = (self.columns, self.rows);
        let at = |x: usize, y: usize| f32::from(plane[y * self.width + x]);
        let top = at(x0, y0) + fx * (at(x1, y0) - at(x0, y0));
        let low = at(x0, y1) + fx * (at(x1, y1) - at(x0, y1));
        (top + fy * (low - top)) / 255.0
    }
}

/// Mirrors a coordinate at both edges into 0 to n.
fn mirrored(x: f32, n: u32) -> f32 {
    let n = n.to_f32();
    let folded = x.rem_euclid(2.0 * n);
    if folded < n { folded } else { 2.0 * n - folded }
}

/// Returns the pixels on both sides of a coordinate, and the weight of the second.
fn between(x: f32, n: u32) -> (usize, usize, f32) {
    let at = (x - 0.5).clamp(0.0, (n - 1).to_f32());
    let low = at.trunc_to::<usize>().min(n.to_usize() - 1);
    (low, (low + 1).min(n.to_usize() - 1), at - low.to_f32())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::{Augment, Normalization};
    use furrow_base::sampling::Purpose;

    /// Rationale: few crops contain a class of few pixels, so a network never learns it. Expected: with `rare`, crops contain it as
    /// often as the rule says (one pixel next to 18 of another class: 18 of 19 crops), anywhere in the crop, and labels still match the
    /// image; without, almost no crop does. Source: the sampling rule.
    #[test]
    fn crops_centred_on_rare_classes_hold_them_anywhere() {
        let image = (200, 150);
        let at = |x: usize, y: usize| y * 200 + x;
        let mut labels = vec![0; 200 * 150];
        (0..3).for_each(|y| labels[at(0, y)..at(6, y)].fill(1));
        labels[at(140, 100)] = 2;
        labels[at(1, 149)] = IGNORE;
        let picture = Example {
            name: String::new(),
            planes: vec![labels.clone()],
            labels,
            plants: Vec::new(),
            species: Vec::new(),
        };
        let as_it_is = Normalization::Fixed { mean: vec![0.0], sd: vec![1.0] };
        for augment in [Augment::NONE, Augment { flip: true, crop: true, ..Augment::NONE }] {
            let crops = |rare: f64| {
                let (mut holding, mut columns) = ([0; 3], [0; 4]);
                for seed in 0..400 {
                    let mut stream = Stream::of(seed, 0, Purpose::Test, 0);
                    let crop = Crop { image, size: (20, 16), rare, ground: None };
                    let Augmented { pixels, labels, .. } =
                        augment.apply(&picture, &crop, &[true], &as_it_is, &mut stream);
                    assert!(pixels.iter().zip(&labels).all(|(v, l)| (v * 255.0 - f32::from(*l)).abs() < 1e-3));
                    (0..3).for_each(|class| holding[class] += u32::from(labels.contains(&class.to_u8())));
                    if let Some(i) = labels.iter().position(|l| *l == 2) {
                        columns[i % 20 / 5] += 1;
                    }
                }
                (holding, columns)
            };
            let ([_, _, seldom], _) = crops(0.0);
            let ([_, crop, weed], columns) = crops(1.0);
            assert!(seldom < 16, "{seldom}");
            assert!((365..393).contains(&weed) && (7..36).contains(&crop), "{crop} {weed}");
            assert!(columns.iter().all(|n| (65..130).contains(n)), "{columns:?}");
        }
        assert_eq!(rare_pixel(&[IGNORE; 4], (2, 2), &mut Stream::of(1, 0, Purpose::Test, 0)), None);
    }

    /// Returns the width of a pixel of each of `draws` random crops, in pixels of the image. The image is a ramp whose value is the
    /// column number.
    fn widths(ground: Option<Ground>, draws: u64) -> Vec<(f64, Stream)> {
        let ramp: Vec<u8> = (0..256 * 8).map(|i| (i % 256).to_u8()).collect();
        let picture = Example {
            name: String::new(),
            labels: vec![0; ramp.len()],
            planes: vec![ramp],
            plants: Vec::new(),
            species: Vec::new(),
        };
        let as_it_is = Normalization::Fixed { mean: vec![0.0], sd: vec![1.0] };
        let augment = Augment { scale: true, ..Augment::NONE };
        let crop = Crop { image: (256, 8), size: (32, 8), rare: 0.0, ground };
        let width = |draw: u64| {
            let stream = Stream::of(draw, 0, Purpose::Test, 0);
            let pixels = augment.apply(&picture, &crop, &[true], &as_it_is, &mut stream.clone()).pixels;
            // At the mirrored edges of the image the ramp is less steep.
            let steps = pixels[..32].windows(2).map(|pair| f64::from((pair[1] - pair[0]).abs()));
            (255.0 * steps.fold(0.0, f64::max), stream)
        };
        (0..draws).map(width).collect()
    }

    /// Rationale: a network for all camera heights must be trained on all pixel sizes equally often, whatever the camera of its images.
    /// Expected: for images of 0.3 and 1.2 mm and a range of 0.3 to 1.5 mm, the pixel size of crops is log-uniform in the range
    /// (Kolmogorov–Smirnov, 2000 samples each, bound 0.06: false alarm below 1e-5), measured by the slope of a ramp in the crop; a range
    /// of one size gives only that size. Source: the rule.
    #[test]
    fn pixel_sizes_of_crops_are_log_uniform_in_the_range_asked_for() {
        let (lo, hi) = (0.3_f64, 1.5_f64);
        for pixel_mm in [0.3, 1.2] {
            let found = widths(Some(Ground { pixel_mm, range_mm: (lo, hi) }), 2000);
            let mut places: Vec<f64> =
                found.iter().map(|(width, _)| (width * pixel_mm / lo).ln() / (hi / lo).ln()).collect();
            places.sort_by(f64::total_cmp);
            assert!(places[0] > -0.01 && places[1999] < 1.01, "{} to {}", places[0], places[1999]);
            let apart =
                places.iter().enumerate().map(|(i, p)| (p - (i.to_f64() + 0.5) / 2000.0).abs()).fold(0.0, f64::max);
            assert!(apart < 0.06, "{pixel_mm}: {apart}");
        }
        let same = widths(Some(Ground { pixel_mm: 0.6, range_mm: (0.9, 0.9) }), 20);
        assert!(same.iter().all(|(width, _)| (width - 1.5).abs() < 0.01), "{:?}", same[0].0);
    }

    /// Rationale: all earlier trainings, including interrupted ones, scale by 1/1.5 to 1.5. Expected: without pixel sizes, the scale
    /// depends only on the first number of the stream, as in version 0.1. Source: the rule of version 0.1.
    #[test]
    fn without_pixel_sizes_crops_are_scaled_as_before() {
        for (width, mut stream) in widths(None, 200) {
            let expected = 1.5f64.powf(-f64::from(stream.range32(-1.0, 1.0)));
            assert!((width - expected).abs() < 0.01, "{width}, not {expected}");
        }
    }

    /// Rationale: single sample points alias in an image that is reduced to a sixth. Expected: stripes of 0 and 200 become their mean,
    /// 100; at mirrored edges, where one stripe of six differs, the value is within a sixth of 200. Source: the mean over six stripes.
    #[test]
    fn what_is_reduced_is_averaged() {
        let stripes: Vec<u8> = (0..240 * 180).map(|i| if i % 2 == 0 { 0 } else { 200 }).collect();
        let picture = Example {
            name: String::new(),
            labels: vec![0; stripes.len()],
            planes: vec![stripes],
            plants: Vec::new(),
            species: Vec::new(),
        };
        let ground = Some(Ground { pixel_mm: 0.5, range_mm: (3.0, 3.0) });
        let crop = Crop { image: (240, 180), size: (32, 24), rare: 0.0, ground };
        let as_it_is = Normalization::Fixed { mean: vec![0.0], sd: vec![1.0] };
        let augment = Augment { scale: true, ..Augment::NONE };
        for seed in 0..20 {
            let mut stream = Stream::of(seed, 0, Purpose::Test, 0);
            let pixels = augment.apply(&picture, &crop, &[true], &as_it_is, &mut stream).pixels;
            assert!(pixels.iter().all(|v| (255.0 * v - 100.0).abs() < 40.0), "{pixels:?}");
        }
    }
}
