//! Soil colour of a whole field: a mix of measured or named soils that the layers' textures are shifted to.

use super::LayerMaps;
use furrow_base::Result;
use furrow_base::math::{Spectrum, vec2};
use furrow_base::ron_file::{Fraction, Num};
use furrow_base::sampling::Stream;
use furrow_optics::optics::{Munsell, soil};
use serde::{Deserialize, Serialize};

/// Dry soil with known reflectance. The book's page on soil has the sources.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum SoilColor {
    /// Common loam.
    Loam,
    /// Loess silt loam, the soil of many beet fields.
    Loess,
    /// Bright sand.
    Sandy,
    /// Dark humic clay.
    Humic,
    /// Reddish clay loam.
    Reddish,
    /// Pale, chalky soil.
    Chalky,
    /// Custom soil: reflectance of the dry soil in R, G, B and NIR, from a spectrometer or a photograph with a grey
    /// card.
    #[schemars(extend("x-example" = "(0.2, 0.15, 0.11, 0.28)"))]
    Rgbn(Num<Fraction>, Num<Fraction>, Num<Fraction>, Num<Fraction>),
    /// Munsell colour of the dry soil: hue, value and chroma. The near infrared is that of the measured soil with the
    /// most similar colour.
    #[schemars(extend("x-example" = "(\"10YR 5/3\")"))]
    Munsell(Munsell),
    /// Spectrum of the dry soil from a CSV file: wavelength in nm, reflectance from 0 to 1, at least from 420 to 900
    /// nm. The path is relative to the scene file's folder.
    #[schemars(extend("x-example" = "(\"soil.csv\")"))]
    Spectrum(String),
}

impl SoilColor {
    /// Soils that ship with the program.
    pub const ALL: [Self; 6] = [Self::Loam, Self::Loess, Self::Sandy, Self::Humic, Self::Reddish, Self::Chalky];

    /// Returns the reflectance of the dry soil: R, G, B, NIR. `read` reads the file of a spectrum.
    pub fn reflectance(&self, read: &mut dyn FnMut(&str) -> Result<Spectrum>) -> Result<Spectrum> {
        Ok(match self {
            Self::Loam => soil::LOAM,
            Self::Loess => soil::LOESS,
            Self::Sandy => soil::SANDY,
            Self::Humic => soil::HUMIC,
            Self::Reddish => soil::REDDISH,
            Self::Chalky => soil::CHALKY,
            Self::Rgbn(r, g, b, nir) => Spectrum::new(r.f32(), g.f32(), b.f32(), nir.f32()),
            Self::Munsell(color) => color.reflectance(),
            Self::Spectrum(file) => read(file)?,
        })
    }
}

/// Colour transform of the layers' textures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ColorTransform {
    /// Factor on R, G, B.
    pub(super) gain: [f32; 3],
    /// Mean reflectance, which determines the NIR from red.
    pub(super) like: Spectrum,
}

impl ColorTransform {
    /// Leaves the textures unchanged.
    pub(super) const NONE: Self = Self { gain: [1.0; 3], like: soil::LOESS };

    /// Draws a random mix of `colors`, uniform among all mixes, and shifts the mean of the first layer's texture to it;
    /// the other layers get the same factors. Without colours nothing is shifted.
    pub(super) fn draw<L: LayerMaps>(colors: &[Spectrum], first: &L, stream: &mut Stream) -> Self {
        if colors.is_empty() {
            return Self::NONE;
        }
        // Weights −ln u divided by their sum are uniform on the simplex.
        let weights: Vec<f32> = colors.iter().map(|_| -stream.uniform32().max(1e-6).ln()).collect();
        let sum: f32 = weights.iter().sum();
        let mut like = Spectrum::ZERO;
        for (color, weight) in colors.iter().zip(&weights) {
            like += *color * (weight / sum);
        }
        let mean = mean(first);
        let wanted = like.to_array();
        Self { gain: std::array::from_fn(|k| wanted[k] / mean[k].max(1e-3)), like }
    }
}

/// Returns the mean colour of a tile, from 64 × 64 points.
pub(super) fn mean<L: LayerMaps>(maps: &L) -> [f32; 3] {
    const SIDE: u16 = 64;
    let mut sum = [0.0; 3];
    for k in 0..SIDE * SIDE {
        let uv = vec2(f32::from(k % SIDE) + 0.5, f32::from(k / SIDE) + 0.5) / f32::from(SIDE);
        for (s, a) in sum.iter_mut().zip(maps.albedo(uv)) {
            *s += a / f32::from(SIDE * SIDE);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::soil::Plain;
    use furrow_base::math::ToFloat;
    use furrow_base::sampling::Purpose;

    #[test]
    fn mixes_stay_between_the_soils_and_one_alone_is_itself() {
        let plain = Plain { albedo: [0.2, 0.1, 0.05], height: 0.5 };
        let draw =
            |colors: &[Spectrum], k| ColorTransform::draw(colors, &plain, &mut Stream::of(3, k, Purpose::Test, 0));
        let alone = draw(&[soil::SANDY], 0);
        let got: Vec<f32> = alone.gain.iter().zip(plain.albedo).map(|(g, a)| g * a).collect();
        let sandy = soil::SANDY.to_array();
        assert!((0..3).all(|k| (got[k] - sandy[k]).abs() < 1e-4), "{got:?}");
        let (mut least, mut most) = (f32::MAX, 0f32);
        for k in 0..200 {
            let red = draw(&[soil::HUMIC, soil::SANDY], k).like.0.x;
            (least, most) = (least.min(red), most.max(red));
        }
        assert!(least > soil::HUMIC.0.x && most < soil::SANDY.0.x, "{least} {most}");
        assert!(most - least > 0.9 * (soil::SANDY.0.x - soil::HUMIC.0.x), "{least} {most}");
        assert_eq!(draw(&[], 0), ColorTransform::NONE);
        let own = |text: &str| {
            let color: SoilColor = ron::from_str(text).unwrap();
            color.reflectance(&mut |file| Ok(Spectrum::splat(file.len().to_f32()))).unwrap()
        };
        assert_eq!(own("Rgbn(0.3, 0.2, 0.1, 0.4)"), Spectrum::new(0.3, 0.2, 0.1, 0.4));
        assert_eq!(own("Spectrum(\"a.csv\")"), Spectrum::splat(5.0));
        assert_eq!(own("Munsell(\"10YR 5/3\")"), Munsell::parse("10YR 5/3").unwrap().reflectance());
        assert!(ron::from_str::<SoilColor>("Rgbn(0.3, 0.2, 0.1, 1.4)").is_err());
    }
}
