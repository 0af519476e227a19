//! What a document of another program can hold of a material: reflectance and transmittance at normal incidence over a
//! picture, a tint, a gloss.
//!
//! Specimens that differ only in their tint share one picture, as they do here: [`Swatch::key`] tells.

use crate::math::{Spectrum, Vec2, Vec3};

/// Reflectance and transmittance of one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tone {
    /// Reflected, per band.
    pub reflectance: Spectrum,
    /// Transmitted, per band.
    pub transmittance: Spectrum,
}

/// What is finer than the shape of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grain {
    /// Share of the sky that it sees past the picture's own relief, 0–1; 1 where its reflectance already says so.
    pub open: f32,
    /// Share that lies under a film of water, 0–1.
    pub film: f32,
}

/// What specimens that share a picture have of their own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dye {
    /// Factor on reflected R, G, B.
    pub tint: Vec3,
    /// Factor on transmitted R, G, B.
    pub tint_transmitted: Vec3,
    /// The mean place, tint included.
    pub mean: Tone,
}

/// A material as others can hold it. A place's reflectance in R, G, B is that of [`Swatch::texel`] times `tint`, its
/// transmittance times `tint_transmitted`.
pub struct Swatch<'a> {
    /// The same for materials that share a picture.
    pub key: [usize; 2],
    /// Width and height of the picture; `None` where the material is the same everywhere.
    pub size: Option<(u32, u32)>,
    texel: Box<dyn Fn(u32, u32) -> Tone + 'a>,
    slope: Box<dyn Fn(u32, u32) -> Vec2 + 'a>,
    grain: Box<dyn Fn(u32, u32) -> Grain + 'a>,
    /// Strength of the relief, a factor on [`Swatch::slope`]; 0 for none.
    pub relief: f32,
    /// Factor on reflected R, G, B.
    pub tint: Vec3,
    /// Factor on transmitted R, G, B.
    pub tint_transmitted: Vec3,
    /// GGX roughness α of the coat; 1 where there is none.
    pub roughness: f32,
    /// How much more visible light the lower side reflects.
    pub back_paleness: f32,
    /// The mean place, tint included.
    pub mean: Tone,
}

impl<'a> Swatch<'a> {
    /// Of one tone everywhere.
    pub(super) fn plain(tone: Tone, roughness: f32) -> Self {
        Self {
            key: [0; 2],
            size: None,
            texel: Box::new(move |_, _| tone),
            slope: Box::new(|_, _| Vec2::ZERO),
            grain: Box::new(|_, _| Grain { open: 1.0, film: 0.0 }),
            relief: 0.0,
            tint: Vec3::ONE,
            tint_transmitted: Vec3::ONE,
            roughness,
            back_paleness: 1.0,
            mean: tone,
        }
    }

    /// Of a picture of `size` texels.
    pub(super) fn pictured(
        key: [usize; 2],
        size: (u32, u32),
        texel: impl Fn(u32, u32) -> Tone + 'a,
        mean: Tone,
        roughness: f32,
    ) -> Self {
        let plain = Self::plain(mean, roughness);
        Self { key, size: Some(size), texel: Box::new(texel), ..plain }
    }

    /// The same picture in another tint.
    pub(super) fn tinted(self, reflected: Vec3, transmitted: Vec3) -> Self {
        Self { tint: reflected, tint_transmitted: transmitted, ..self }
    }

    /// The same picture with a relief of `strength`.
    pub(super) fn raised(self, slope: impl Fn(u32, u32) -> Vec2 + 'a, strength: f32) -> Self {
        Self { slope: Box::new(slope), relief: strength, ..self }
    }

    /// The same with what is finer than the shape of its places.
    pub(super) fn grained(self, grain: impl Fn(u32, u32) -> Grain + 'a) -> Self {
        Self { grain: Box::new(grain), ..self }
    }

    /// The same with a lower side that reflects `factor` times the visible light.
    pub(super) fn paler_below(self, factor: f32) -> Self {
        Self { back_paleness: factor, ..self }
    }

    /// What it has of its own, where it is in another tint that comes to these factors, see
    /// [`Material::tint_factors`](super::Material::tint_factors).
    pub fn dyed(&self, by: Tone) -> Dye {
        let mean = Tone {
            reflectance: self.mean.reflectance * by.reflectance,
            transmittance: self.mean.transmittance * by.transmittance,
        };
        Dye {
            tint: self.tint * by.reflectance.0.truncate(),
            tint_transmitted: self.tint_transmitted * by.transmittance.0.truncate(),
            mean,
        }
    }

    /// What is finer than the shape of texel (x, y).
    pub fn grain(&self, x: u32, y: u32) -> Grain {
        (self.grain)(x, y)
    }

    /// Slope of the relief at texel (x, y): ∂h/∂x to the picture's right, ∂h/∂y up the picture.
    pub fn slope(&self, x: u32, y: u32) -> Vec2 {
        (self.slope)(x, y)
    }

    /// Texel (x, y) of the picture, top left first; the one tone of a material without a picture.
    pub fn texel(&self, x: u32, y: u32) -> Tone {
        (self.texel)(x, y)
    }
}

/// The middle of texel (x, y) of a picture of this size, as texture coordinates.
pub(super) fn centre(size: (u32, u32), x: u32, y: u32) -> Vec2 {
    Vec2::new((x as f32 + 0.5) / size.0 as f32, (y as f32 + 0.5) / size.1 as f32)
}
