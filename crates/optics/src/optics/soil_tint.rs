//! Iron oxides, humus, lime and algae in soil, as changes of the logarithm of its reflectance.
//!
//! A substance multiplies the reflectance of the four bands by e to the power of its amount times a vector. The vectors
//! of iron, humus and lime are differences between the soils of [`super::soil`]; algae absorb as the chlorophyll and
//! carotenoids of the leaf model do.

use furrow_base::math::{Spectrum, Vec4};

/// Iron oxides: from loam to reddish clay loam, at equal luminance.
const IRON: Vec4 = Vec4::new(0.1311, -0.0486, -0.2026, 0.0326);
/// Humus: from loam to humic clay.
const HUMUS: Vec4 = Vec4::new(-0.8334, -0.8207, -0.7944, -0.7700);
/// Lime and salts: from loam to the pale, chalky soil.
const LIME: Vec4 = Vec4::new(0.4040, 0.5691, 0.8734, 0.4539);
/// Algae, per µg/cm² of chlorophyll a + b with a quarter as much of carotenoids, which light passes twice. Source: the
/// absorption of PROSPECT-D over the spectrum of loam, 4 µg/cm².
const ALGAE: Vec4 = Vec4::new(-0.0507, -0.0269, -0.2225, 0.0);

/// Amounts of what colours one place of the soil, relative to the mean soil.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SoilTint {
    /// Iron oxides: 1 is the difference between reddish clay loam and loam.
    pub iron: f32,
    /// Humus: 1 is the difference between humic clay and loam.
    pub humus: f32,
    /// Lime and salts: 1 is the difference between chalky soil and loam.
    pub lime: f32,
    /// Chlorophyll of algae, µg/cm².
    pub algae: f32,
}

impl SoilTint {
    /// Returns the factors on the reflectance in R, G, B, NIR.
    #[inline]
    pub fn factors(self) -> Spectrum {
        let log = IRON * self.iron + HUMUS * self.humus + LIME * self.lime + ALGAE * self.algae;
        Spectrum::from(log.to_array().map(f32::exp))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::bands;
    use crate::optics::soil::{CHALKY, HUMIC, LOAM, REDDISH};
    use furrow_base::math::ToInt;

    /// Expected: one unit of a substance turns loam into the soil that has it, iron at the luminance of loam.
    #[test]
    fn one_unit_is_the_difference_between_two_soils() {
        let near = |got: Spectrum, wanted: Spectrum| (got.0 - wanted.0).abs().max_element() < 3e-4;
        let made = |tint: SoilTint| LOAM * tint.factors();
        let none = SoilTint::default();
        assert_eq!(none.factors(), Spectrum::ONE);
        assert!(near(made(SoilTint { humus: 1.0, ..none }), HUMIC));
        assert!(near(made(SoilTint { lime: 1.0, ..none }), CHALKY));
        let iron = made(SoilTint { iron: 1.0, ..none });
        assert!((iron.luminance() / LOAM.luminance() - 1.0).abs() < 0.005, "{iron:?}");
        assert!(near(iron * (REDDISH.luminance() / LOAM.luminance()), REDDISH), "{iron:?}");
    }

    /// Expected: the factors of 4 µg/cm² of chlorophyll are those of the absorption spectra of the leaf model on a soil
    /// whose reflectance rises evenly from blue to near infrared, within 0.02. Source: PROSPECT-D, Beer-Lambert.
    #[test]
    fn algae_absorb_as_chlorophyll_does() {
        const AMOUNT: f64 = 4.0;
        let table =
            include_str!("prospect_d.csv").lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
        let absorption: Vec<f64> = table
            .map(|line| {
                let row: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
                row[2] + 0.25 * row[3]
            })
            .collect();
        let soil = |nm: u32| 0.06 + 0.2 * (f64::from(nm) - 400.0) / 450.0;
        let clean = bands::weigh(soil);
        let grown = bands::weigh(|nm| soil(nm) * (-2.0 * AMOUNT * absorption[(nm - 400).to_usize()]).exp());
        let wanted = grown / clean;
        let got = SoilTint { algae: 4.0, ..SoilTint::default() }.factors();
        assert!((got.0 - wanted.0).abs().max_element() < 0.02, "{got:?} {wanted:?}");
        assert!(got.0.y > got.0.x && got.0.x > got.0.z, "algae are not green: {got:?}");
    }
}
