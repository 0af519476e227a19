//! Images decoded once, the noise they are drawn with, and the maps derived from them.
//!
//! A leaf's texture may be drawn by the program ([`draw`]) or photographed: both are PNG or JPEG files named by a scene file, and
//! nothing below knows the difference. v runs down the image: uv (0, 0) is its top left corner.
//!
//! This file is the only door to the `image` crate for reading.

mod cutout;
pub mod draw;
pub(crate) mod exr_size;
mod height;
pub mod maps;
mod need;
pub mod noise;
pub mod panorama;
mod pyramid;
mod rgbe;
mod srgb;
mod texels;

pub use cutout::{Cutting, cut_out, doubts};
pub use height::Height;
pub use maps::{AmbientOcclusion, HeightFromBrightness, Maps, NormalMap};
pub use need::{Allowance, Header, Need};
pub use pyramid::Wrap;
pub use srgb::ColorSpace;

use crate::error::{Error, Result};
use crate::geometry::AlphaMask;
use crate::input::{self, Refusal};
use crate::math::Vec2;
use pyramid::{Level, Plane, Pyramid, halve};
use std::io::{BufRead, BufReader, Cursor, ErrorKind, Seek};
use std::path::Path;

/// The largest width and height of an image.
pub const MAX_SIZE: u32 = 16384;

/// The most that the pixels of an image may take, decoded, bytes: 8192 × 8192 of 16 bits with opacity. A small file may hold many.
const MAX_BYTES: u64 = 1 << 29;

/// A colour image with opacity and its mip pyramid.
#[derive(Clone, Debug)]
pub struct Texture {
    pyramid: Pyramid<[u8; 4]>,
    decode: &'static [f32; 256],
    wrap: Wrap,
    opaque: bool,
}

impl Texture {
    /// Reads a PNG or JPEG file. Outside uv ∈ [0, 1]² its edge is repeated; see [`Texture::wrapped`].
    pub fn load(path: &Path, space: ColorSpace) -> Result<Self> {
        let pixels = decode(path)?.into_rgba8();
        let (width, height) = pixels.dimensions();
        Ok(Self::from_rgba8(width, height, pixels.as_raw(), space))
    }

    /// From the bytes of a PNG or JPEG file, as models hold them inside; in words what is wrong with them.
    pub fn decode(bytes: &[u8], space: ColorSpace) -> Result<Self, String> {
        let pixels = read(Cursor::new(bytes)).map_err(Fault::words)?.into_rgba8();
        let (width, height) = pixels.dimensions();
        Ok(Self::from_rgba8(width, height, pixels.as_raw(), space))
    }

    /// From rows of R, G, B, A bytes, top first. Sizes are 1 to [`MAX_SIZE`]; `rgba` holds width × height × 4 bytes.
    pub fn from_rgba8(width: u32, height: u32, rgba: &[u8], space: ColorSpace) -> Self {
        assert!(width > 0 && height > 0 && rgba.len() == width as usize * height as usize * 4);
        let table = space.table();
        let bytes = |x: u32, y: u32| -> [u8; 4] {
            let i = (y as usize * width as usize + x as usize) * 4;
            [rgba[i], rgba[i + 1], rgba[i + 2], rgba[i + 3]]
        };
        // Colours are averaged weighed by opacity, or the dark that lies under transparent texels would creep in.
        let weighed = |x, y| {
            let [r, g, b, a] = bytes(x, y);
            let alpha = f32::from(a) / 255.0;
            [table[r as usize] * alpha, table[g as usize] * alpha, table[b as usize] * alpha, alpha]
        };
        let mut planes: Vec<Plane<4>> = Vec::new();
        let mut next = halve(width, height, weighed);
        while let Some(plane) = next {
            next = halve(plane.width, plane.height, |x, y| plane.get(x, y));
            planes.push(plane);
        }
        bleed(&mut planes);
        let quantise = |c: [f32; 4]| [space.encode(c[0]), space.encode(c[1]), space.encode(c[2]), alpha_code(c[3])];
        let finest = Level::new(width, height, |x, y| {
            let [r, g, b, a] = bytes(x, y);
            match planes.first() {
                Some(coarser) if a == 0 => {
                    let [r, g, b, _] =
                        quantise(coarser.get((x / 2).min(coarser.width - 1), (y / 2).min(coarser.height - 1)));
                    [r, g, b, 0]
                }
                _ => [r, g, b, a],
            }
        });
        let coarse = planes.iter().map(|p| Level::new(p.width, p.height, |x, y| quantise(p.get(x, y))));
        let levels: Vec<_> = std::iter::once(finest).chain(coarse).collect();
        let opaque = rgba.iter().skip(3).step_by(4).all(|&a| a >= 128);
        Self { pyramid: Pyramid { levels }, decode: table, wrap: Wrap::Clamp, opaque }
    }

    /// The same texture with another rule for what lies outside.
    #[must_use]
    pub fn wrapped(self, wrap: Wrap) -> Self {
        Self { wrap, ..self }
    }

    /// What lies outside uv ∈ [0, 1]².
    pub fn wrap(&self) -> Wrap {
        self.wrap
    }

    /// Width in texels.
    pub fn width(&self) -> u32 {
        self.pyramid.levels[0].width
    }

    /// Height in texels.
    pub fn height(&self) -> u32 {
        self.pyramid.levels[0].height
    }

    /// Level of detail of a footprint that spans `extent` of uv: 0 at a texel or less, 1 at two texels.
    #[inline]
    pub fn lod(&self, extent: f32) -> f32 {
        (extent * self.width().max(self.height()) as f32).max(1.0).log2()
    }

    /// Linear R, G, B and opacity at `uv`, bilinear on the pyramid's level nearest to `lod` (0 is the finest).
    /// Colours are not multiplied by opacity and are sound where opacity is 0.
    #[inline]
    pub fn sample(&self, uv: Vec2, lod: f32) -> [f32; 4] {
        let mut sum = [0.0; 4];
        for (texel, weight) in self.pyramid.taps(uv, lod, self.wrap) {
            for i in 0..3 {
                sum[i] += weight * self.decode[texel[i] as usize];
            }
            sum[3] += weight * f32::from(texel[3]);
        }
        sum[3] *= 1.0 / 255.0;
        sum
    }

    /// Linear R, G, B and opacity of a texel of the finest level; x < width, y < height.
    pub fn texel(&self, x: u32, y: u32) -> [f32; 4] {
        let [r, g, b, a] = self.pyramid.levels[0].get(x, y);
        [self.decode[r as usize], self.decode[g as usize], self.decode[b as usize], f32::from(a) / 255.0]
    }

    /// Rows of R, G, B, A bytes of the finest level, top first. Where opacity is 0 the colours are those of what lies near.
    pub fn to_rgba8(&self) -> Vec<[u8; 4]> {
        let finest = &self.pyramid.levels[0];
        (0..self.height()).flat_map(|y| (0..self.width()).map(move |x| finest.get(x, y))).collect()
    }

    /// Where the texture is opaque (at least half); `None` when it is opaque all over.
    pub fn alpha_mask(&self) -> Option<AlphaMask> {
        if self.opaque { None } else { self.alpha_mask_from(128) }
    }

    /// Where its opacity is at least `least` of 255; `None` when that is so all over.
    pub fn alpha_mask_from(&self, least: u8) -> Option<AlphaMask> {
        let finest = &self.pyramid.levels[0];
        let there = |x, y| finest.get(x, y)[3] >= least;
        let all = (0..self.height()).all(|y| (0..self.width()).all(|x| there(x, y)));
        (!all).then(|| AlphaMask::new(self.width(), self.height(), there))
    }
}

fn alpha_code(alpha: f32) -> u8 {
    (alpha.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// Divides by opacity; texels without any take the colour of the coarser texel above them, from the coarsest down.
fn bleed(planes: &mut [Plane<4>]) {
    for i in (0..planes.len()).rev() {
        let (finer, coarser) = planes.split_at_mut(i + 1);
        let plane = &mut finer[i];
        for y in 0..plane.height {
            for x in 0..plane.width {
                let c = &mut plane.values[(y * plane.width + x) as usize];
                if c[3] > 0.0 {
                    *c = [c[0] / c[3], c[1] / c[3], c[2] / c[3], c[3]];
                } else if let Some(above) = coarser.first() {
                    let [r, g, b, _] = above.get((x / 2).min(above.width - 1), (y / 2).min(above.height - 1));
                    *c = [r, g, b, 0.0];
                }
            }
        }
    }
}

/// Why an image cannot be had.
enum Fault {
    /// The system refused.
    Io(std::io::Error),
    /// It is not what it should be, in words.
    Image(String),
}

impl Fault {
    fn words(self) -> String {
        match self {
            Self::Io(e) => e.to_string(),
            Self::Image(what) => what,
        }
    }
}

/// Opens and decodes an image file, with errors that say what to do.
fn decode(path: &Path) -> Result<image::DynamicImage> {
    let wrong = |what: String| Error::input(what).in_file(path);
    let file = input::open(path).map_err(|refusal| match refusal {
        Refusal::Io(e) if e.kind() == ErrorKind::NotFound => {
            wrong("there is no such image; a path in a scene file counts from the file's folder".into())
        }
        other => other.into_error(path),
    })?;
    read(BufReader::new(file)).map_err(|fault| match fault {
        Fault::Io(e) => Error::io(path)(e),
        Fault::Image(what) => wrong(what),
    })
}

/// A reader of an image that keeps to the limits.
fn reader<R: BufRead + Seek>(source: R) -> Result<image::ImageReader<R>, Fault> {
    let mut reader = image::ImageReader::new(source).with_guessed_format().map_err(Fault::Io)?;
    if reader.format().is_none() {
        return Err(Fault::Image("this is not an image; PNG and JPEG can be read".to_owned()));
    }
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_SIZE);
    limits.max_image_height = Some(MAX_SIZE);
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    Ok(reader)
}

/// Decodes an image within the limits.
fn read(source: impl BufRead + Seek) -> Result<image::DynamicImage, Fault> {
    let wrong = |what: &str| Fault::Image(what.to_owned());
    reader(source)?.decode().map_err(|e| match e {
        image::ImageError::Limits(_) => {
            let mib = MAX_BYTES >> 20;
            Fault::Image(format!(
                "the image has sides of more than {MAX_SIZE} pixels or takes more than {mib} MiB; scale it down"
            ))
        }
        image::ImageError::IoError(e) if e.kind() != ErrorKind::UnexpectedEof => Fault::Io(e),
        image::ImageError::IoError(_) => wrong("the image ends too early; the file is damaged"),
        e => Fault::Image(format!("the image cannot be read: {e}; PNG and JPEG can")),
    })
}

#[cfg(test)]
mod tests;
