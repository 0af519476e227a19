//! What the page shows of a picture: a part of it pixel by pixel, and the whole made small by one factor, the same for all.

use crate::compare::{Picture, Region};
use crate::{Result, output};

/// Most pixels of the part that is shown, as wide as half a page.
const PART: (u32, u32) = (552, 414);
/// By how much whole pictures are made smaller.
const SMALLER: u32 = 4;
/// Quality of the JPEGs: high, since noise is looked at.
const QUALITY: u8 = 94;

/// A picture to look at, as JPEG.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// What the picture is called.
    pub name: String,
    /// Width and height of the part, pixels.
    pub size: (u32, u32),
    /// A part at its own scale: the one of most plants, else the middle.
    pub part: Vec<u8>,
    /// Width and height of the whole as shown, a quarter of its own.
    pub whole_size: (u32, u32),
    /// All of it, small.
    pub whole: Vec<u8>,
}

impl Window {
    /// What is shown of a picture.
    pub(super) fn take(name: &str, picture: &Picture, labels: Option<&[u8]>) -> Result<Self> {
        let size = (PART.0.min(picture.width), PART.1.min(picture.height));
        let (left, top) = place(picture.size(), size, labels);
        let start = |y: u32| (y * picture.width + left) as usize;
        let part: Vec<[u8; 3]> =
            (top..top + size.1).flat_map(|y| &picture.rgb[start(y)..][..size.0 as usize]).copied().collect();
        let most = picture.width.max(picture.height).div_ceil(SMALLER);
        let (width, height, small) = output::shrink(picture.width, picture.height, &picture.rgb, most);
        Ok(Self {
            name: name.to_owned(),
            size,
            part: output::encode_jpeg(size.0, size.1, &part, QUALITY)?,
            whole_size: (width, height),
            whole: output::encode_jpeg(width, height, &small, QUALITY)?,
        })
    }
}

/// The corner of the part with most plants, of 5 by 5 places; of equal ones the nearest to the middle.
fn place(whole: (u32, u32), part: (u32, u32), labels: Option<&[u8]>) -> (u32, u32) {
    let room = (whole.0 - part.0, whole.1 - part.1);
    let mut places: Vec<(u32, u32)> = (0..25).map(|k| (k % 5, k / 5)).collect();
    places.sort_by_key(|(x, y)| (x.abs_diff(2) + y.abs_diff(2), *y, *x));
    let corners = places.into_iter().map(|(x, y)| (room.0 * x / 4, room.1 * y / 4));
    let plants = |(left, top): (u32, u32)| {
        let row = |y: u32| &labels.unwrap_or_default()[(y * whole.0 + left) as usize..][..part.0 as usize];
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
