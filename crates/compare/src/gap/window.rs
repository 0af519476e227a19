//! Views of an image for the page: a part at full resolution, and the whole image downscaled by a constant factor.

use crate::{RasterImage, Region};
use furrow_base::Result;
use furrow_base::math::ToInt;

/// Largest size of the part in pixels; as wide as half a page.
const PART: (u32, u32) = (552, 414);
/// Downscaling factor of whole images.
const SMALLER: u32 = 4;
/// JPEG quality; high, so that noise is visible.
const QUALITY: u8 = 94;

/// Views of an image, as JPEG.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Name of the image.
    pub name: String,
    /// Width and height of the part, pixels.
    pub size: (u32, u32),
    /// Part at full resolution: where most plants are, otherwise the middle.
    pub part: Vec<u8>,
    /// Width and height of the downscaled image, a quarter of the original.
    pub whole_size: (u32, u32),
    /// Whole image, downscaled.
    pub whole: Vec<u8>,
}

impl Window {
    /// Creates the views of an image.
    pub(super) fn take(name: &str, picture: &RasterImage, labels: Option<&[u8]>) -> Result<Self> {
        let size = (PART.0.min(picture.width), PART.1.min(picture.height));
        let (left, top) = place(picture.size(), size, labels);
        let start = |y: u32| (y * picture.width + left).to_usize();
        let part: Vec<[u8; 3]> =
            (top..top + size.1).flat_map(|y| &picture.rgb[start(y)..][..size.0.to_usize()]).copied().collect();
        let most = picture.width.max(picture.height).div_ceil(SMALLER);
        let (width, height, small) = furrow_output::shrink(picture.width, picture.height, &picture.rgb, most);
        Ok(Self {
            name: name.to_owned(),
            size,
            part: furrow_output::encode_jpeg(size.0, size.1, &part, QUALITY)?,
            whole_size: (width, height),
            whole: furrow_output::encode_jpeg(width, height, &small, QUALITY)?,
        })
    }
}

/// Returns the corner of the part with most plants, out of 5 × 5 positions; in a tie, the one closest to the middle.
fn place(whole: (u32, u32), part: (u32, u32), labels: Option<&[u8]>) -> (u32, u32) {
    let room = (whole.0 - part.0, whole.1 - part.1);
    let mut places: Vec<(u32, u32)> = (0..25).map(|k| (k % 5, k / 5)).collect();
    places.sort_by_key(|(x, y)| (x.abs_diff(2) + y.abs_diff(2), *y, *x));
    let corners = places.into_iter().map(|(x, y)| (room.0 * x / 4, room.1 * y / 4));
    let plants = |(left, top): (u32, u32)| {
        let row = |y: u32| &labels.unwrap_or_default()[(y * whole.0 + left).to_usize()..][..part.0.to_usize()];
        (top..top + part.1).flat_map(row).filter(|label| Region::Vegetation.holds(**label)).count()
    };
    let mut best = (room.0 / 2, room.1 / 2);
    let mut most = 0;
    for corner in corners.filter(|_| labels.is_some()) {
        let found = plants(corner);
        if found > most {
            (best, most) = (corner, found);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_is_where_plants_are() {
        let (whole, part) = ((100, 60), (20, 20));
        assert_eq!(place(whole, part, None), (40, 20));
        assert_eq!(place(whole, part, Some(&[0; 6000])), (40, 20));
        let mut labels = [0; 6000];
        labels[59 * 100 + 99] = 2;
        assert_eq!(place(whole, part, Some(&labels)), (80, 40));
        assert_eq!(place(part, part, Some(&[1; 400])), (0, 0));
    }
}
