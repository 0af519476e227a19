//! Memory needed by images, computed from their headers before they are decoded.
//!
//! The constants are bytes per pixel, derived from the data that [`Texture`](super::Texture), [`Height`](super::Height)
//! and [`Maps`](super::Maps) keep and from their temporary buffers. Measured: a soil layer of 11000 × 11000 without a
//! height map peaks at 39 bytes per pixel, the estimate is 40. Four colour images of a model of that size take 7.4
//! each, the estimate is 7.7.

use super::decoded_image::{MAX_BYTES, reader};
use super::{MAX_SIZE, exr_size, rgbe};
use furrow_base::input;
use image::ImageDecoder;
use std::io::{BufRead, BufReader, Cursor, Seek};
use std::iter::Sum;
use std::ops::Add;
use std::path::Path;

/// Texels of all mip levels per texel of the finest level.
const LEVELS: f64 = 4.0 / 3.0;
/// Bytes in a MiB.
const MIB: f64 = (1 << 20) as f64;
/// Bytes per texel of a colour texture: four bytes on all levels.
const COLOR: f64 = 4.0 * LEVELS;
/// Peak bytes per texel while a colour texture is built: its pixels, all coarser levels as floats (16 bytes for a
/// quarter of the texels, and so on), and the result.
const COLOR_MADE: f64 = 4.0 + 16.0 * (LEVELS - 1.0) + COLOR;
/// Bytes per height.
const HEIGHT: f64 = 4.0;
/// Bytes per texel of a slope map.
const SLOPES: f64 = 8.0 * LEVELS;
/// Peak bytes while a slope map is built: the plane, its finest level and the next plane.
const SLOPES_MADE: f64 = 8.0 + 8.0 + 2.0;
/// Bytes per texel of an ambient-occlusion map.
const OCCLUSION: f64 = 4.0 * LEVELS;
/// Peak bytes while ambient occlusion is built: the map and the two planes of a blur.
const OCCLUSION_MADE: f64 = 3.0 * 4.0;
/// Peak bytes while heights are derived from a colour texture, in addition to it: fine and coarse brightness, and the
/// three planes of a double blur.
const READ_OFF: f64 = 5.0 * 4.0;
/// Fine and coarse brightness, which stay in memory until the maps are built from the heights.
const BRIGHTNESS: f64 = 2.0 * 4.0;

/// Peak bytes per texel while an environment map is downscaled: four floats, twice.
const PANORAMA: f64 = 2.0 * 16.0;

/// Memory needed by an image, in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Need {
    /// Bytes kept once the image is ready.
    pub held: f64,
    /// Peak bytes while it is being prepared.
    pub peak: f64,
}

impl Need {
    /// Returns the temporary part, peak minus held.
    pub fn passing(self) -> f64 {
        self.peak - self.held
    }

    /// Returns the need of `pixels` pixels from bytes per pixel.
    fn of(pixels: f64, held: f64, peak: f64) -> Self {
        Self { held: pixels * held, peak: pixels * peak.max(held) }
    }

    /// Returns the need of both if `next` is built while this one is kept.
    fn then(self, next: Self) -> Self {
        Self { held: self.held + next.held, peak: self.peak.max(self.held + next.peak) }
    }
}

/// Returns the need of both, built one after the other in any order.
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

/// Image size from a file's header.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Header {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Bytes per decoded pixel.
    pub bytes: u8,
}

impl Header {
    /// Returns `false` if the file has no alpha channel.
    pub fn may_have_alpha(&self) -> bool {
        // Grey or colours with alpha, of 8 or 16 bits; also grey of 16 bits.
        [2, 4, 8].contains(&self.bytes)
    }

    /// Reads the header of a file. `None` if it is not a readable image or exceeds the limits; decoding then reports
    /// the error.
    pub fn of_file(path: &Path) -> Option<Self> {
        Self::read(BufReader::new(input::open(path).ok()?))
    }

    /// Reads the header of an OpenEXR or Radiance environment map. `None` if the file is neither; decoding then reports
    /// the error.
    pub fn of_panorama(path: &Path) -> Option<Self> {
        let source = || input::open(path).ok().map(BufReader::new);
        let (width, height) = rgbe::size(source()?).or_else(|| input::caught(|| exr_size::size(source()?)).ok()?)?;
        Some(Self { width: width.try_into().ok()?, height: height.try_into().ok()?, bytes: 12 })
    }

    /// Reads the header from the bytes of a file, like [`Header::of_file`].
    pub fn of(bytes: &[u8]) -> Option<Self> {
        Self::read(Cursor::new(bytes))
    }

    fn read(source: impl BufRead + Seek) -> Option<Self> {
        let of = || {
            let decoder = reader(source, MAX_SIZE).ok()?.into_decoder().ok()?;
            let (width, height) = decoder.dimensions();
            let bytes = decoder.color_type().bytes_per_pixel();
            (decoder.total_bytes() <= MAX_BYTES).then_some(Self { width, height, bytes })
        };
        input::caught(of).ok().flatten()
    }

    /// Returns the number of pixels.
    pub fn pixels(&self) -> f64 {
        f64::from(self.width) * f64::from(self.height)
    }

    /// Returns the need as an environment map; only a small downscaled version of it is kept.
    pub fn panorama(&self) -> Need {
        Need::of(self.pixels(), 0.0, PANORAMA)
    }

    /// Returns the need as a colour texture.
    pub fn color(&self) -> Need {
        Need::of(self.pixels(), COLOR, COLOR_MADE.max(f64::from(self.bytes) + 4.0))
    }

    /// Returns the need as a normal map. The colour texture is dropped once the slopes are built.
    pub fn normals(&self) -> Need {
        let slopes = Need::of(self.pixels(), SLOPES, COLOR + SLOPES_MADE);
        Need { peak: slopes.peak.max(self.color().peak), ..slopes }
    }

    /// Returns the need as the colour of a soil layer with this height map. Without one, heights are derived from the
    /// colour, and for that all maps are built.
    pub fn layer(&self, height: Option<&Self>) -> Need {
        let heights = match height {
            Some(height) => height.heights(),
            None => Need { held: self.pixels() * HEIGHT, ..self.maps_read_off() },
        };
        self.color().then(heights)
    }

    /// Returns the need as the texture of a leaf with this height map; without one, heights are derived from the
    /// colour.
    pub fn leaf(&self, height: Option<&Self>) -> Need {
        let maps = match height {
            Some(height) => height.heights().then(maps(height.pixels(), 0.0)),
            None => self.maps_read_off(),
        };
        self.color().then(maps)
    }

    /// Returns the need as heights: the pixels, a 16-bit grey copy, and the floats.
    fn heights(&self) -> Need {
        Need::of(self.pixels(), HEIGHT, (f64::from(self.bytes) + 2.0).max(2.0 + HEIGHT))
    }

    /// Returns the need of deriving heights from this image and building the maps.
    fn maps_read_off(&self) -> Need {
        let read = Need::of(self.pixels(), HEIGHT, READ_OFF);
        read.then(maps(self.pixels(), BRIGHTNESS))
    }
}

/// Returns the need of building slopes and ambient occlusion for `pixels` heights, with `beside` other bytes per pixel
/// in memory.
fn maps(pixels: f64, beside: f64) -> Need {
    let slopes = Need::of(pixels, SLOPES, SLOPES_MADE + beside);
    slopes.then(Need::of(pixels, OCCLUSION, OCCLUSION_MADE + beside))
}

/// Memory limit for images, and the memory already counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MemoryLimit {
    /// Limit in bytes.
    pub most: f64,
    /// Memory counted so far.
    pub taken: Need,
}

impl MemoryLimit {
    /// Help text for a refused image.
    pub const HELP: &'static str = "scale the image down; --memory sets the limit, in GiB";

    /// No limit.
    pub const UNLIMITED: Self = Self { most: f64::INFINITY, taken: Need { held: 0.0, peak: 0.0 } };

    /// Counts an image that is about to be decoded. Fails with a message if the total would exceed the limit.
    pub fn take(&mut self, of: &Header, need: Need) -> Result<(), String> {
        let all = self.taken + need;
        if all.peak > self.most {
            let held = self.taken.held;
            let beside = if held < MIB { String::new() } else { format!(", beside {} of other images", words(held)) };
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

/// Formats a number of bytes as MiB or GiB.
fn words(bytes: f64) -> String {
    if bytes < 1024.0 * MIB { format!("{:.0} MiB", bytes / MIB) } else { format!("{:.1} GiB", bytes / (1024.0 * MIB)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(side: u32, bytes: u8) -> Header {
        Header { width: side, height: side, bytes }
    }

    /// Expected: the values measured for an image of 11000 × 11000 pixels (39 bytes per pixel), and the bytes of the
    /// parts that are kept.
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

    /// Expected: the sum of all held bytes plus the temporary bytes of the largest one, in any order.
    #[test]
    fn pictures_are_made_one_after_the_other() {
        let (a, b) = (header(3, 3).layer(None), header(5, 3).color());
        assert_eq!(a + b, b + a);
        assert_eq!([a, b].into_iter().sum::<Need>().held, a.held + b.held);
        assert!(((a + b).passing() - a.passing().max(b.passing())).abs() < 1e-9);
    }

    #[test]
    fn surplus_is_reported_and_not_counted() {
        let of = header(11_000, 3);
        let mut allowance = MemoryLimit { most: 1024.0 * MIB, taken: Need::default() };
        let words = allowance.take(&of, of.layer(None)).unwrap_err();
        assert_eq!(words, "11000 × 11000 pixels would take about 4.5 GiB of memory; the limit is 1.0 GiB");
        assert_eq!(allowance.taken, Need::default());
        let small = header(4000, 3);
        allowance.take(&small, small.color()).unwrap();
        let words = allowance.take(&of, of.color()).unwrap_err();
        assert!(words.contains("beside 81 MiB of other images"), "{words}");
        let mut unlimited = MemoryLimit::UNLIMITED;
        assert!(unlimited.take(&of, of.color()).is_ok());
    }

    #[test]
    fn headers_of_files_are_read() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let read = |path: &str| Header::of_file(&root.join(path));
        assert_eq!(read("textures/soil/dirt.png"), Some(header(1024, 3)));
        assert_eq!(read("textures/soil/dirt.height.png"), Some(header(1024, 2)));
        assert_eq!(read("Cargo.toml"), None);
        assert_eq!(read("textures/none.png"), None);
        assert_eq!(Header::of(b"\x89PNG"), None);
    }
}
