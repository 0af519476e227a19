//! What pictures take in memory, told by their headers before they are decoded.
//!
//! Counted in bytes a pixel from what [`Texture`](super::Texture), [`Height`](super::Height) and [`Maps`](super::Maps) keep and what
//! they need while they are made. Measured: a soil layer of 11000 × 11000 without a height map takes 39 at its peak, counted are 40; four colour
//! pictures of a model of that size take 7.4 each, counted are 7.7.

use super::{MAX_BYTES, exr_size, reader};
use crate::input;
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;
use std::io::{BufRead, BufReader, Cursor, Seek};
use std::iter::Sum;
use std::ops::Add;
use std::path::Path;

/// Texels of all levels of a pyramid for each of its finest.
const LEVELS: f64 = 4.0 / 3.0;
/// Bytes of a MiB.
const MIB: f64 = (1 << 20) as f64;
/// Bytes of a texel that a colour keeps: four bytes on all levels.
const COLOR: f64 = 4.0 * LEVELS;
/// The most while a colour is made: its pixels, all coarser levels as numbers (16 bytes of a quarter of the texels, and so on), and what
/// it keeps.
const COLOR_MADE: f64 = 4.0 + 16.0 * (LEVELS - 1.0) + COLOR;
/// Bytes of a height.
const HEIGHT: f64 = 4.0;
/// Bytes of a texel that slopes keep.
const SLOPES: f64 = 8.0 * LEVELS;
/// The most while slopes are made: the plane, its finest level and the next plane.
const SLOPES_MADE: f64 = 8.0 + 8.0 + 2.0;
/// Bytes of a texel that ambient occlusion keeps.
const OCCLUSION: f64 = 4.0 * LEVELS;
/// The most while ambient occlusion is made: itself and the two planes of a mean.
const OCCLUSION_MADE: f64 = 3.0 * 4.0;
/// The most while heights are read off a colour, beside it: brightness and the coarse one, and the three planes of a mean of means.
const READ_OFF: f64 = 5.0 * 4.0;
/// Brightness and the coarse one, which are there until maps are made of the heights.
const BRIGHTNESS: f64 = 2.0 * 4.0;

/// The most bytes of a texel while a picture of all directions is averaged down: four numbers, twice.
const PANORAMA: f64 = 2.0 * 16.0;

/// Bytes that a picture takes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Need {
    /// From when it is ready.
    pub held: f64,
    /// At most, while it is made ready.
    pub peak: f64,
}

impl Need {
    /// What is taken for a while alone.
    pub fn passing(self) -> f64 {
        self.peak - self.held
    }

    /// So many pixels, with so many bytes of each.
    fn of(pixels: f64, held: f64, peak: f64) -> Self {
        Self { held: pixels * held, peak: pixels * peak.max(held) }
    }

    /// This, and then what is made beside it.
    fn then(self, next: Self) -> Self {
        Self { held: self.held + next.held, peak: self.peak.max(self.held + next.peak) }
    }
}

/// Both, one made after the other, whichever is first.
impl Add for Need {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let held = self.held + other.held;
        Self { held, peak: held + self.passing().max(other.passing()) }
    }
}

impl Sum for Need {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), Add::add)
    }
}

/// What the header of a picture's file says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Header {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Bytes of a pixel as they are decoded.
    pub bytes: u8,
}

impl Header {
    /// Of a file; `None` where that cannot be read as a picture or is beyond the limits of one, which is told when it is decoded.
    pub fn of_file(path: &Path) -> Option<Self> {
        Self::read(BufReader::new(input::open(path).ok()?))
    }

    /// Of an OpenEXR or Radiance file of all directions; `None` where it is neither, which is told when it is decoded.
    pub fn of_panorama(path: &Path) -> Option<Self> {
        let source = || input::open(path).ok().map(BufReader::new);
        let of = |(width, height)| Self { width, height, bytes: 12 };
        if let Ok(decoder) = HdrDecoder::new(source()?) {
            return Some(of((decoder.metadata().width, decoder.metadata().height)));
        }
        let (width, height) = exr_size::size(source()?)?;
        Some(of((width.try_into().ok()?, height.try_into().ok()?)))
    }

    /// Of the bytes of a file, likewise.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        Self::read(Cursor::new(bytes))
    }

    fn read(source: impl BufRead + Seek) -> Option<Self> {
        let decoder = reader(source).ok()?.into_decoder().ok()?;
        let (width, height) = decoder.dimensions();
        let bytes = decoder.color_type().bytes_per_pixel();
        (decoder.total_bytes() <= MAX_BYTES).then_some(Self { width, height, bytes })
    }

    /// Number of pixels.
    pub fn pixels(&self) -> f64 {
        f64::from(self.width) * f64::from(self.height)
    }

    /// As a picture of all directions, of which little is kept.
    pub fn panorama(&self) -> Need {
        Need::of(self.pixels(), 0.0, PANORAMA)
    }

    /// As a colour.
    pub fn color(&self) -> Need {
        Need::of(self.pixels(), COLOR, COLOR_MADE.max(f64::from(self.bytes) + 4.0))
    }

    /// As a picture of normals, whose colour goes when its slopes are made.
    pub fn normals(&self) -> Need {
        let slopes = Need::of(self.pixels(), SLOPES, COLOR + SLOPES_MADE);
        Need { peak: slopes.peak.max(self.color().peak), ..slopes }
    }

    /// As the colour of a soil layer with this height map; without one heights are read off the colour, for which all maps are made.
    pub fn layer(&self, height: Option<&Self>) -> Need {
        let heights = match height {
            Some(height) => height.heights(),
            None => Need { held: self.pixels() * HEIGHT, ..self.maps_read_off() },
        };
        self.color().then(heights)
    }

    /// As the picture of a leaf with this height map; without one heights are read off the colour.
    pub fn leaf(&self, height: Option<&Self>) -> Need {
        let maps = match height {
            Some(height) => height.heights().then(maps(height.pixels(), 0.0)),
            None => self.maps_read_off(),
        };
        self.color().then(maps)
    }

    /// As heights: its pixels, the same in grey of 16 bits, and these as numbers.
    fn heights(&self) -> Need {
        Need::of(self.pixels(), HEIGHT, (f64::from(self.bytes) + 2.0).max(2.0 + HEIGHT))
    }

    /// Heights read off it, and the maps that are made of them.
    fn maps_read_off(&self) -> Need {
        let read = Need::of(self.pixels(), HEIGHT, READ_OFF);
        read.then(maps(self.pixels(), BRIGHTNESS))
    }
}

/// Slopes and ambient occlusion of so many heights, while so many bytes of each are there beside them.
fn maps(pixels: f64, beside: f64) -> Need {
    let slopes = Need::of(pixels, SLOPES, SLOPES_MADE + beside);
    slopes.then(Need::of(pixels, OCCLUSION, OCCLUSION_MADE + beside))
}

/// How much memory pictures may take, and what those that were counted take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowance {
    /// The most bytes.
    pub most: f64,
    /// What is taken.
    pub taken: Need,
}

impl Allowance {
    /// Help where a picture is refused.
    pub const HELP: &'static str = "scale the picture down; --memory sets the limit, in GiB";

    /// As much as there is.
    pub const UNLIMITED: Self = Self { most: f64::INFINITY, taken: Need { held: 0.0, peak: 0.0 } };

    /// Counts a picture that is about to be decoded; in words why it may not be, where all would take too much.
    pub fn take(&mut self, of: &Header, need: Need) -> Result<(), String> {
        let all = self.taken + need;
        if all.peak > self.most {
            let held = self.taken.held;
            let beside = if held < MIB { String::new() } else { format!(", beside {} of other pictures", words(held)) };
            return Err(format!(
                "{} × {} pixels would take about {} of memory{beside}; the limit is {}",
                of.width,
                of.height,
                words(need.peak),
                words(self.most)
            ));
        }
        self.taken = all;
        Ok(())
    }
}

/// Bytes in words.
fn words(bytes: f64) -> String {
    if bytes < 1024.0 * MIB { format!("{:.0} MiB", bytes / MIB) } else { format!("{:.1} GiB", bytes / (1024.0 * MIB)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(side: u32, bytes: u8) -> Header {
        Header { width: side, height: side, bytes }
    }

    /// Expected: what the audit of 11000 × 11000 pixels measured (39 bytes a pixel), and the bytes of the parts that stay.
    #[test]
    fn bytes_of_a_pixel_are_those_of_its_maps() {
        let one = header(1, 3);
        let near = |need: Need, held: f64, peak: f64| {
            assert!((need.held - held).abs() < 1e-9 && (need.peak - peak).abs() < 1e-9, "{need:?}: {held} {peak}");
        };
        near(one.color(), 16.0 / 3.0, 44.0 / 3.0);
        near(one.layer(None), 28.0 / 3.0, 40.0);
        near(one.layer(Some(&header(1, 2))), 28.0 / 3.0, 44.0 / 3.0);
        near(one.leaf(None), 76.0 / 3.0, 40.0);
        near(one.leaf(Some(&header(1, 2))), 76.0 / 3.0, 32.0);
        near(one.normals(), 32.0 / 3.0, 70.0 / 3.0);
    }

    /// Expected: all that is held, and the passing bytes of one alone, whatever the order.
    #[test]
    fn pictures_are_made_one_after_the_other() {
        let (a, b) = (header(3, 3).layer(None), header(5, 3).color());
        assert_eq!(a + b, b + a);
        assert_eq!([a, b].into_iter().sum::<Need>().held, a.held + b.held);
        assert!(((a + b).passing() - a.passing().max(b.passing())).abs() < 1e-9);
    }

    #[test]
    fn what_is_too_much_is_told_and_not_counted() {
        let of = header(11_000, 3);
        let mut allowance = Allowance { most: 1024.0 * MIB, taken: Need::default() };
        let words = allowance.take(&of, of.layer(None)).unwrap_err();
        assert_eq!(words, "11000 × 11000 pixels would take about 4.5 GiB of memory; the limit is 1.0 GiB");
        assert_eq!(allowance.taken, Need::default());
        let small = header(4000, 3);
        allowance.take(&small, small.color()).unwrap();
        let words = allowance.take(&of, of.color()).unwrap_err();
        assert!(words.contains("beside 81 MiB of other pictures"), "{words}");
        let mut unlimited = Allowance::UNLIMITED;
        assert!(unlimited.take(&of, of.color()).is_ok());
    }

    #[test]
    fn headers_of_files_are_read() {
        let read = |path: &str| Header::of_file(Path::new(path));
        assert_eq!(read("textures/soil/dirt.png"), Some(header(1024, 3)));
        assert_eq!(read("textures/soil/dirt.height.png"), Some(header(1024, 2)));
        assert_eq!(read("Cargo.toml"), None);
        assert_eq!(read("textures/none.png"), None);
        assert_eq!(Header::of(b"\x89PNG"), None);
    }
}
