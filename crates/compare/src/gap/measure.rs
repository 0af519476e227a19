//! Measurement of one image.

use super::feature::{Feature, Sample, Samples};
use super::{frequency, noise, outline, regions};
use crate::color::{lab, linear};
use crate::{RasterImage, Region};
use furrow_base::math::{ToFloat, ToInt};
use furrow_report::{Bins, Histogram};

/// Range and number of bins of L*, of a* and b*, of NDVI, of gradients in dB, of log₁₀ of areas.
const LIGHTNESS: (f64, f64, usize) = (0.0, 100.0, 400);
const CHROMA: (f64, f64, usize) = (-128.0, 128.0, 512);
const NDVI: (f64, f64, usize) = (-1.0, 1.0, 400);
/// The lower end is a three-hundredth of the mean, less than one step of 8 bits, so smaller gradients cannot be
/// distinguished.
const GRADIENT: (f64, f64, usize) = (-50.0, 20.0, 280);
const AREA: (f64, f64, usize) = (0.0, 8.0, 160);
/// Smallest component that is counted, pixels. Exact labels contain many smaller ones, manual labels none.
const SPECK: u64 = 8;
/// Distance in pixels up to which soil is considered to surround a class.
const AROUND: usize = 16;
/// Smallest number of pixels of class and of soil for a comparison of their means.
const FEWEST: usize = 64;

/// Linear luminance that replaces 0 for an all-black image: half a step of 8 bits.
const BLACK: f64 = 0.5 / 255.0 / 12.92;

/// Measures an image, and its classes if it has labels, one per pixel. Spectra use tiles of `tile` pixels, which must
/// fit into the image.
pub(super) fn measure(picture: &RasterImage, labels: Option<&[u8]>, tile: Option<usize>) -> Samples {
    let size = (picture.width.to_usize(), picture.height.to_usize());
    let mut samples = Samples::new();
    let colors: Vec<[f32; 3]> = picture.rgb.iter().map(|rgb| lab(*rgb)).collect();
    for region in [Region::All, Region::Soil, Region::Crop, Region::Weed] {
        if labels.is_some() || region == Region::All {
            pixels(&mut samples, region, picture, &colors, labels);
        }
    }
    light(&mut samples, picture, size, tile);
    if let Some(labels) = labels {
        for region in [Region::Vegetation, Region::Crop, Region::Weed] {
            plants(&mut samples, region, &colors, labels, size.0);
        }
    }
    samples
}

fn empty((from, to, bins): (f64, f64, usize)) -> Histogram {
    Histogram::new(Bins::between(from, to, bins))
}

/// Measures colours and NDVI of a region's pixels.
fn pixels(samples: &mut Samples, region: Region, picture: &RasterImage, colors: &[[f32; 3]], labels: Option<&[u8]>) {
    let inside = |k: &usize| labels.is_none_or(|labels| region.holds(labels[*k]));
    let mut channels = [LIGHTNESS, CHROMA, CHROMA].map(empty);
    let mut ndvi = empty(NDVI);
    for k in (0..colors.len()).filter(inside) {
        channels.iter_mut().zip(colors[k]).for_each(|(channel, value)| channel.add(f64::from(value)));
        let Some(near) = picture.nir.get(k) else { continue };
        let (near, red) = (f64::from(*near), f64::from(picture.rgb[k][0]));
        // Black in both bands has no NDVI.
        if near + red > 0.0 {
            ndvi.add((near - red) / (near + red));
        }
    }
    if channels[0].total() > 0 {
        samples.insert(Feature::Color(region), Sample::Counts(channels.to_vec()));
    }
    if ndvi.total() > 0 {
        samples.insert(Feature::Ndvi(region), Sample::Counts(vec![ndvi]));
    }
}

/// Measures features of luminance.
fn light(samples: &mut Samples, picture: &RasterImage, (width, height): (usize, usize), tile: Option<usize>) {
    let linear = linear();
    let weigh = |[r, g, b]: [f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let mut luminance: Vec<f32> = picture.rgb.iter().map(|c| weigh(c.map(|c| linear[usize::from(c)]))).collect();
    let mean = luminance.iter().map(|y| f64::from(*y)).sum::<f64>() / luminance.len().max(1).to_f64();
    let mean = mean.max(BLACK);
    samples.insert(Feature::Exposure, Sample::Value(mean.log2()));
    for y in &mut luminance {
        *y = (f64::from(*y) / mean).to_f32();
    }

    let mut gradients = empty(GRADIENT);
    for y in 1..height.saturating_sub(1) {
        for x in 1..width.saturating_sub(1) {
            let at = |x: usize, y: usize| luminance[y * width + x];
            let (dx, dy) = (0.5 * (at(x + 1, y) - at(x - 1, y)), 0.5 * (at(x, y + 1) - at(x, y - 1)));
            gradients.add(20.0 * f64::from(dx.hypot(dy)).log10());
        }
    }
    if gradients.total() > 0 {
        samples.insert(Feature::Gradient, Sample::Counts(vec![gradients]));
    }
    if let Some(tile) = tile {
        let power = frequency::power(&luminance, (width, height), tile);
        samples.insert(Feature::Slope, Sample::Value(frequency::slope(&power, tile)));
        samples.insert(Feature::Spectrum, Sample::Power(power));
    }
    let luma: Vec<f32> = picture.rgb.iter().map(|c| weigh(c.map(f32::from))).collect();
    if let Some(sigma) = noise::level(&luma, (width, height)) {
        samples.insert(Feature::Noise, Sample::Value(sigma));
    }
}

/// Measures features of one class from labels.
fn plants(samples: &mut Samples, region: Region, colors: &[[f32; 3]], labels: &[u8], width: usize) {
    let mask: Vec<bool> = labels.iter().map(|label| region.holds(*label)).collect();
    let pixels = mask.iter().filter(|inside| **inside).count();
    samples.insert(Feature::Cover(region), Sample::Value(100.0 * pixels.to_f64() / mask.len().max(1).to_f64()));
    if region == Region::Vegetation {
        if let Some(margin) = outline::margin(colors, &mask, width) {
            samples.insert(Feature::Outline, Sample::Value(margin));
        }
        return;
    }
    let areas: Vec<u64> = regions::blobs(&mask, width).into_iter().filter(|area| *area >= SPECK).collect();
    let density = 1e6 * areas.len().to_f64() / mask.len().max(1).to_f64();
    samples.insert(Feature::BlobCount(region), Sample::Value(density));
    if !areas.is_empty() {
        let mut sizes = empty(AREA);
        for area in areas {
            sizes.add(area.to_f64().log10());
        }
        samples.insert(Feature::BlobSize(region), Sample::Counts(vec![sizes]));
    }
    let near = regions::near(&mask, width, AROUND);
    let soil = |k: &usize| near[*k] && Region::Soil.holds(labels[*k]);
    let of_class = mean(colors, (0..mask.len()).filter(|k| mask[*k]));
    let of_soil = mean(colors, (0..mask.len()).filter(soil));
    if let (Some([l, a, b]), Some([soil_l, soil_a, soil_b])) = (of_class, of_soil) {
        samples.insert(Feature::Lightness(region), Sample::Value(l - soil_l));
        samples.insert(Feature::Chroma(region), Sample::Value((a - soil_a).hypot(b - soil_b)));
    }
}

/// Returns the mean colour of some pixels; `None` for too few.
fn mean(colors: &[[f32; 3]], places: impl Iterator<Item = usize>) -> Option<[f64; 3]> {
    let (mut sum, mut n) = ([0.0; 3], 0);
    for k in places {
        sum.iter_mut().zip(colors[k]).for_each(|(sum, value)| *sum += f64::from(value));
        n += 1;
    }
    (n >= FEWEST).then(|| sum.map(|sum| sum / n.to_f64()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::rng::{Purpose, Stream};

    /// Returns a green square on brown ground, with labels.
    fn scene() -> (RasterImage, Vec<u8>) {
        let inside = |k: usize| (20..36).contains(&(k % 80)) && (10..26).contains(&(k / 80));
        let labels: Vec<u8> = (0..80 * 64).map(|k| u8::from(inside(k))).collect();
        let rgb = labels.iter().map(|l| if *l == 1 { [60, 120, 40] } else { [100, 80, 60] }).collect();
        let nir = labels.iter().map(|l| if *l == 1 { 180 } else { 100 }).collect();
        (RasterImage { width: 80, height: 64, rgb, nir }, labels)
    }

    fn value(samples: &Samples, feature: Feature) -> f64 {
        match &samples[&feature] {
            Sample::Value(value) => *value,
            Sample::Counts(channels) => channels[0].mean(),
            Sample::Power(_) => unreachable!(),
        }
    }

    #[test]
    fn a_square_on_soil_is_what_it_was_drawn_as() {
        let (picture, labels) = scene();
        let samples = measure(&picture, Some(&labels), Some(32));
        let close = |feature, expected: f64, by: f64| {
            assert!((value(&samples, feature) - expected).abs() <= by, "{feature:?}: {}", value(&samples, feature));
        };
        let cover = 100.0 * 256.0 / 5120.0;
        close(Feature::Cover(Region::Crop), cover, 1e-9);
        close(Feature::Cover(Region::Vegetation), cover, 1e-9);
        close(Feature::Cover(Region::Weed), 0.0, 0.0);
        close(Feature::BlobSize(Region::Crop), 256.0_f64.log10(), 0.05);
        close(Feature::BlobCount(Region::Crop), 1e6 / 5120.0, 1e-9);
        close(Feature::Ndvi(Region::Crop), 0.5, 0.005);
        close(Feature::Ndvi(Region::Soil), 0.0, 0.005);
        close(Feature::Noise, 0.0, 0.0);
        close(Feature::Outline, 0.0, 1e-6);
        let ([l, a, b], [m, c, d]) = (lab([60, 120, 40]), lab([100, 80, 60]));
        close(Feature::Lightness(Region::Crop), f64::from(l - m), 1e-3);
        close(Feature::Chroma(Region::Crop), f64::from((a - c).hypot(b - d)), 1e-3);
        // A missing class has no colour and no size.
        for absent in [Feature::Color, Feature::Ndvi, Feature::BlobSize, Feature::Lightness] {
            assert!(!samples.contains_key(&absent(Region::Weed)));
        }
    }

    #[test]
    fn without_labels_and_near_infrared_only_pixels_are_measured() {
        let (picture, _) = scene();
        let samples = measure(&RasterImage { nir: Vec::new(), ..picture }, None, None);
        let known: Vec<Feature> = samples.into_keys().collect();
        assert_eq!(known, [Feature::Exposure, Feature::Color(Region::All), Feature::Gradient, Feature::Noise]);
    }

    /// Expected: an image with half the light has one stop less, and the same structure.
    #[test]
    fn exposure_is_not_structure() {
        let linear = linear();
        let code = |y: f32| linear.iter().position(|v| *v >= y).unwrap_or(255).to_u8();
        let picture = |scale: f32| {
            let mut stream = Stream::of(1, 0, Purpose::Test, 3);
            let wave = |k: u32| ((k % 64).to_f32() * 0.4).sin() * ((k / 64).to_f32() * 0.7).cos();
            let mut y = |k: u32| 0.4 + 0.2 * wave(k) + 0.05 * stream.normal().to_f32();
            let rgb = (0..64 * 64).map(|k| [code(scale * y(k)); 3]).collect();
            measure(&RasterImage { width: 64, height: 64, rgb, nir: Vec::new() }, None, Some(64))
        };
        let (bright, dark) = (picture(1.0), picture(0.5));
        let stops = value(&bright, Feature::Exposure) - value(&dark, Feature::Exposure);
        assert!((stops - 1.0).abs() < 0.02, "{stops}");
        let gradient = value(&bright, Feature::Gradient) - value(&dark, Feature::Gradient);
        assert!(gradient.abs() < 0.5, "{gradient}");
        assert!((value(&bright, Feature::Slope) - value(&dark, Feature::Slope)).abs() < 0.1);
    }
}
