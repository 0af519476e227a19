//! Pairs for display: both images and their error maps, downscaled so that a page has at most a few megabytes.

use super::figures::{Figures, Maps};
use super::flip;
use super::raster_image::RasterImage;
use furrow_base::Result;
use furrow_base::math::RoundTo;

/// Largest total size of a page's images in bytes; encoded as text in the page they take a third more.
const BYTES: usize = 6_500_000;
/// Largest side of an image in pixels, and the smallest side to which one is downscaled.
const SIDES: (u32, u32) = (1296, 160);
/// JPEG quality of images, and of maps.
const QUALITY: (u8, u8) = (90, 82);
/// ΔE₀₀ that is shown with the brightest colour.
pub(super) const MOST_DELTA_E: f32 = 20.0;

/// Pair for display, with images as JPEG.
#[derive(Clone, Debug, PartialEq)]
pub struct DisplayPair {
    /// Name of both images.
    pub name: String,
    /// Width in pixels, as displayed.
    pub width: u32,
    /// Height in pixels, as displayed.
    pub height: u32,
    /// Mean FLIP of the pair.
    pub flip: f64,
    /// Reference image.
    pub a: Vec<u8>,
    /// Test image.
    pub b: Vec<u8>,
    /// Maps of FLIP (0 to 1), 1 − SSIM (0 to 1) and ΔE₀₀ (0 to 20), black to pale yellow.
    pub maps: [Vec<u8>; 3],
}

impl DisplayPair {
    /// Creates a pair for a page with `shown` pairs, as large as the page allows.
    pub(super) fn take(
        name: &str,
        (a, b): (&RasterImage, &RasterImage),
        maps: &Maps,
        figures: &Figures,
        shown: usize,
    ) -> Result<Self> {
        let byte = |value: f32| (255.0 * value.clamp(0.0, 1.0)).round_to::<u8>();
        let grays: [Vec<u8>; 3] = [
            maps.flip.iter().map(|v| byte(*v)).collect(),
            maps.ssim.iter().map(|v| byte(1.0 - v)).collect(),
            maps.ciede2000.iter().map(|v| byte(v / MOST_DELTA_E)).collect(),
        ];
        let colors = flip::magma();
        let mut side = SIDES.0;
        loop {
            let (width, height) = furrow_output::shrunk(a.width, a.height, side);
            let photo = |of: &RasterImage| {
                let (w, h, rgb) = furrow_output::shrink(of.width, of.height, &of.rgb, side);
                furrow_output::encode_jpeg(w, h, &rgb, QUALITY.0)
            };
            let map = |gray: &Vec<u8>| {
                let small = furrow_output::resize_gray(a.width, a.height, gray, (width, height));
                let painted: Vec<[u8; 3]> = small.iter().map(|v| colors[usize::from(*v)]).collect();
                furrow_output::encode_jpeg(width, height, &painted, QUALITY.1)
            };
            let [flip, ssim, ciede2000] = &grays;
            let display_pair = Self {
                name: name.to_owned(),
                width,
                height,
                flip: figures.all().flip.unwrap_or_default(),
                a: photo(a)?,
                b: photo(b)?,
                maps: [map(flip)?, map(ssim)?, map(ciede2000)?],
            };
            if display_pair.bytes() * shown <= BYTES || side <= SIDES.1 {
                return Ok(display_pair);
            }
            side = (width.max(height) * 4 / 5).max(SIDES.1);
        }
    }

    fn bytes(&self) -> usize {
        self.a.len() + self.b.len() + self.maps.iter().map(Vec::len).sum::<usize>()
    }
}

/// Keeps the `most` pairs with the largest FLIP, in decreasing order, ties by name.
pub(super) fn worst(display_pairs: &mut Vec<DisplayPair>, most: usize) {
    display_pairs.sort_by(|a, b| b.flip.total_cmp(&a.flip).then_with(|| a.name.cmp(&b.name)));
    display_pairs.truncate(most);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PIXELS_PER_DEGREE, maps, pair};
    use furrow_base::sampling::rng::mix;

    /// Noise compresses worst in JPEG.
    #[test]
    fn pictures_of_a_page_weigh_what_they_may() {
        let noise = |seed: u64| RasterImage {
            width: 500,
            height: 400,
            rgb: (0..200_000).map(|k| mix(seed + k).to_le_bytes()).map(|[r, g, b, ..]| [r, g, b]).collect(),
            nir: Vec::new(),
        };
        let (a, b) = (noise(1), noise(1_000_000));
        let maps = maps(&a, &b, PIXELS_PER_DEGREE).unwrap();
        let figures = pair(&a, &b, None, PIXELS_PER_DEGREE).unwrap();
        let [one, many] = [1, 12].map(|shown| DisplayPair::take("x", (&a, &b), &maps, &figures, shown).unwrap());
        assert_eq!((one.width, one.height), (500, 400));
        assert!(12 * many.bytes() <= BYTES && many.width < 500 && many.width > 200, "{}", many.width);
    }
}
