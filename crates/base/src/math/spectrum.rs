//! The four spectral bands. This file is the only place that defines them.
//!
//! R, G and B are linear Rec.709 (D65) when read as colour. Their effective wavelengths (about 612, 549 and 465 nm) are
//! close to those of the JAI AD-130's colour channels (619, 537, 472 nm), so tabulated band means of sun, soil and leaf
//! serve both. NIR is the second sensor of that camera: 760–1000 nm, effective wavelength 824 nm.

use glam::Vec4;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Sub};

/// A value in each band: R, G, B, NIR. Linear; radiance is W·m⁻²·sr⁻¹·nm⁻¹, reflectance is dimensionless.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(from = "[f32; 4]", into = "[f32; 4]")]
pub struct Spectrum(pub Vec4);

impl Spectrum {
    /// Number of bands.
    pub const BANDS: usize = 4;
    /// Names of the bands, in order.
    pub const NAMES: [&'static str; 4] = ["R", "G", "B", "NIR"];
    /// Zero in all bands.
    pub const ZERO: Self = Self(Vec4::ZERO);
    /// One in all bands.
    pub const ONE: Self = Self(Vec4::ONE);

    /// Builds a spectrum from its four bands.
    #[inline]
    pub const fn new(r: f32, g: f32, b: f32, nir: f32) -> Self {
        Self(Vec4::new(r, g, b, nir))
    }

    /// Returns a spectrum with the same value in every band.
    #[inline]
    pub const fn splat(v: f32) -> Self {
        Self(Vec4::splat(v))
    }

    /// Returns the bands as an array R, G, B, NIR.
    #[inline]
    pub fn to_array(self) -> [f32; 4] {
        self.0.to_array()
    }

    /// Rec.709 luminance of the R, G and B bands.
    #[inline]
    pub fn luminance(self) -> f32 {
        self.0.dot(Vec4::new(0.2126, 0.7152, 0.0722, 0.0))
    }

    /// Mean of the four bands, used as the importance for sampling.
    #[inline]
    pub fn mean(self) -> f32 {
        self.0.dot(Vec4::splat(0.25))
    }

    /// Largest of the four bands.
    #[inline]
    pub fn max(self) -> f32 {
        self.0.max_element()
    }

    /// Returns `true` if every band is zero.
    #[inline]
    pub fn is_black(self) -> bool {
        self.0 == Vec4::ZERO
    }

    /// Returns `true` if every band is finite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.is_finite()
    }

    /// Clamps each band to `lo..=hi`.
    #[inline]
    #[must_use]
    pub fn clamp(self, lo: f32, hi: f32) -> Self {
        Self(self.0.clamp(Vec4::splat(lo), Vec4::splat(hi)))
    }

    /// Linear interpolation: `self` at `t` = 0, `other` at `t` = 1.
    #[inline]
    #[must_use]
    pub fn lerp(self, other: Self, t: f32) -> Self {
        Self(self.0.lerp(other.0, t))
    }

    /// Applies `f` to each band.
    #[must_use]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self(Vec4::from_array(self.to_array().map(f)))
    }
}

impl From<[f32; 4]> for Spectrum {
    fn from(v: [f32; 4]) -> Self {
        Self(Vec4::from_array(v))
    }
}

impl From<Spectrum> for [f32; 4] {
    fn from(s: Spectrum) -> Self {
        s.to_array()
    }
}

impl Add for Spectrum {
    type Output = Self;
    #[inline]
    fn add(self, rhs: Self) -> Self {
        Self(self.0 + rhs.0)
    }
}

impl Sub for Spectrum {
    type Output = Self;
    #[inline]
    fn sub(self, rhs: Self) -> Self {
        Self(self.0 - rhs.0)
    }
}

impl AddAssign for Spectrum {
    #[inline]
    fn add_assign(&mut self, rhs: Self) {
        self.0 += rhs.0;
    }
}

impl Mul for Spectrum {
    type Output = Self;
    #[inline]
    fn mul(self, rhs: Self) -> Self {
        Self(self.0 * rhs.0)
    }
}

impl Mul<f32> for Spectrum {
    type Output = Self;
    #[inline]
    fn mul(self, rhs: f32) -> Self {
        Self(self.0 * rhs)
    }
}

impl MulAssign for Spectrum {
    #[inline]
    fn mul_assign(&mut self, rhs: Self) {
        self.0 *= rhs.0;
    }
}

impl MulAssign<f32> for Spectrum {
    #[inline]
    fn mul_assign(&mut self, rhs: f32) {
        self.0 *= rhs;
    }
}

impl Div<f32> for Spectrum {
    type Output = Self;
    #[inline]
    fn div(self, rhs: f32) -> Self {
        Self(self.0 / rhs)
    }
}

impl Div for Spectrum {
    type Output = Self;
    #[inline]
    fn div(self, rhs: Self) -> Self {
        Self(self.0 / rhs.0)
    }
}
