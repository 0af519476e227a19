//! A material reduced to what other file formats can represent: images of reflectance and transmittance at normal
//! incidence, a tint, and a gloss.
//!
//! Specimens that differ only in tint share one image, identified by [`Swatch::key`].

use furrow_base::math::{Spectrum, ToFloat, Vec2, Vec3};

/// Reflectance and transmittance at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tone {
    /// Reflectance per band.
    pub reflectance: Spectrum,
    /// Transmittance per band.
    pub transmittance: Spectrum,
}

/// Sub-texel surface properties.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grain {
    /// Fraction of the sky visible past the relief of the image, 0–1 (ambient occlusion); 1 if it is already included
    /// in the reflectance.
    pub open: f32,
    /// Fraction covered by a water film, 0–1.
    pub film: f32,
}

/// Per-specimen values of specimens that share an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dye {
    /// Factor on reflected R, G, B.
    pub tint: Vec3,
    /// Factor on transmitted R, G, B.
    pub tint_transmitted: Vec3,
    /// Mean tone, including the tint.
    pub mean: Tone,
}

/// A material in exportable form. Reflectance in R, G, B at a texel is [`Swatch::texel`] times `tint`, transmittance is
/// the texel's times `tint_transmitted`.
pub struct Swatch<'a> {
    /// Identifies the image: equal for materials that share it.
    pub key: [usize; 2],
    /// Width and height of the image; `None` for a uniform material.
    pub size: Option<(u32, u32)>,
    /// Identifies the relief: equal for materials that share it.
    pub relief_key: usize,
    texel: Box<dyn Fn(u32, u32) -> Tone + Send + Sync + 'a>,
    slope: Box<dyn Fn(u32, u32) -> Vec2 + Send + Sync + 'a>,
    grain: Box<dyn Fn(u32, u32) -> Grain + Send + Sync + 'a>,
    /// Strength of the relief: a factor on [`Swatch::slope`]; 0 for none.
    pub relief: f32,
    /// Factor on reflected R, G, B.
    pub tint: Vec3,
    /// Factor on transmitted R, G, B.
    pub tint_transmitted: Vec3,
    /// GGX roughness α of the coat; 1 without a coat.
    pub roughness: f32,
    /// Ratio of visible reflectance, lower side to upper side.
    pub back_paleness: f32,
    /// Mean tone, including the tint.
    pub mean: Tone,
}

impl<'a> Swatch<'a> {
    /// Builds a uniform swatch.
    pub(super) fn plain(tone: Tone, roughness: f32) -> Self {
        Self {
            key: [0; 2],
            size: None,
            relief_key: 0,
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

    /// Builds a swatch with an image of `size` texels.
    pub(super) fn pictured(
        key: [usize; 2],
        size: (u32, u32),
        texel: impl Fn(u32, u32) -> Tone + Send + Sync + 'a,
        mean: Tone,
        roughness: f32,
    ) -> Self {
        let plain = Self::plain(mean, roughness);
        Self { key, size: Some(size), relief_key: key[0], texel: Box::new(texel), ..plain }
    }

    /// Sets the tint.
    pub(super) fn tinted(self, reflected: Vec3, transmitted: Vec3) -> Self {
        Self { tint: reflected, tint_transmitted: transmitted, ..self }
    }

    /// Adds a relief of `strength`.
    pub(super) fn raised(self, slope: impl Fn(u32, u32) -> Vec2 + Send + Sync + 'a, strength: f32) -> Self {
        Self { slope: Box::new(slope), relief: strength, ..self }
    }

    /// Adds sub-texel properties.
    pub(super) fn grained(self, grain: impl Fn(u32, u32) -> Grain + Send + Sync + 'a) -> Self {
        Self { grain: Box::new(grain), ..self }
    }

    /// Sets the ratio of visible reflectance, lower side to upper side.
    pub(super) fn paler_below(self, factor: f32) -> Self {
        Self { back_paleness: factor, ..self }
    }

    /// Returns the per-specimen values under another tint, given as factors from
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

    /// Sub-texel properties at texel (x, y).
    pub fn grain(&self, x: u32, y: u32) -> Grain {
        (self.grain)(x, y)
    }

    /// Slope of the relief at texel (x, y): ∂h/∂x to the right of the image, ∂h/∂y towards its top.
    pub fn slope(&self, x: u32, y: u32) -> Vec2 {
        (self.slope)(x, y)
    }

    /// Tone of texel (x, y) of the image, origin at the top left; the uniform tone of a material without an image.
    pub fn texel(&self, x: u32, y: u32) -> Tone {
        (self.texel)(x, y)
    }
}

/// Texture coordinates of the centre of texel (x, y) in an image of this size.
pub(super) fn centre(size: (u32, u32), x: u32, y: u32) -> Vec2 {
    Vec2::new((x.to_f32() + 0.5) / size.0.to_f32(), (y.to_f32() + 0.5) / size.1.to_f32())
}
