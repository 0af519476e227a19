//! Haze: light that air scatters out of and into the line of sight.
//!
//! Homogeneous haze of extinction coefficient β attenuates the radiance of a surface at distance d by T = e^{−βd} and adds (1 − T) times
//! the radiance of an infinitely long horizontal path, which is that of the sky at the horizon in the same direction (Koschmieder 1924,
//! "Theorie der horizontalen Sichtweite"). A surface far away thus approaches the colour of the sky behind it.
//!
//! Haze acts on camera rays only: on the metres that scattered and shadow rays travel it is too thin to be seen. It follows the horizon
//! sky of the scene's lights, so lamps, which are near, add none.

use furrow_base::math::{Spectrum, Vec3};

/// Contrast at the meteorological optical range. Source: WMO-No. 8, Guide to Instruments and Methods of Observation, part I, chapter 9.
const CONTRAST: f32 = 0.05;
/// Extinction of R, G, B and NIR relative to that at 550 nm: (λ / 550 nm)^−1.3 at 610, 550, 465 and 800 nm. Exponent of continental
/// aerosol: Ångström 1964, "The parameters of atmospheric turbidity".
const BANDS: [f32; 4] = [0.874, 1.0, 1.244, 0.614];
/// Upward component of the direction of the horizon sky, about 1°: the sky models end at 0.
const JUST_ABOVE: f32 = 0.02;

/// Homogeneous haze.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Haze {
    /// Extinction coefficient, 1/m.
    pub extinction: Spectrum,
}

impl Haze {
    /// Returns the haze with a meteorological optical range in metres, the distance at which the contrast of a dark object is 5 %.
    pub fn of_range(range_m: f32) -> Self {
        Self { extinction: Spectrum::from(BANDS.map(|band| band * -CONTRAST.ln() / range_m)) }
    }

    /// Returns the transmittance of `distance` metres of air.
    pub fn transmittance(&self, distance: f32) -> Spectrum {
        Spectrum::from(self.extinction.to_array().map(|beta| (-beta * distance).exp()))
    }

    /// Returns the radiance of a surface seen through `distance` metres of air before a horizon sky of radiance `sky`.
    pub fn over(&self, distance: f32, surface: Spectrum, sky: Spectrum) -> Spectrum {
        let clear = self.transmittance(distance);
        surface * clear + sky * (Spectrum::ONE - clear)
    }

    /// Returns the direction of the horizon sky in the azimuth of a ray.
    pub fn horizontal(direction: Vec3) -> Vec3 {
        let level = direction.truncate().normalize_or(furrow_base::math::Vec2::Y);
        (level * (1.0 - JUST_ABOVE * JUST_ABOVE).sqrt()).extend(JUST_ABOVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: at the optical range the contrast of a black object to the sky is 5 % at 550 nm; near objects are unchanged, far ones
    /// become sky, whatever their radiance. Source: the definition of the range.
    #[test]
    fn contrast_at_the_optical_range_is_five_percent() {
        let haze = Haze::of_range(2000.0);
        let sky = Spectrum::splat(3.0);
        let contrast = |distance| 1.0 - haze.over(distance, Spectrum::ZERO, sky).to_array()[1] / 3.0;
        assert!((contrast(2000.0) - 0.05).abs() < 1e-5, "{}", contrast(2000.0));
        assert!(contrast(1.0) > 0.998);
        for surface in [0.0, 50.0] {
            let far = haze.over(1e5, Spectrum::splat(surface), sky);
            assert!((far - sky).to_array().iter().all(|d| d.abs() < 1e-3), "{far:?}");
        }
        let [r, g, b, nir] = haze.transmittance(2000.0).to_array();
        assert!(nir > r && r > g && g > b);
        assert!((Haze::horizontal(Vec3::new(0.3, -0.4, -0.5)).length() - 1.0).abs() < 1e-6);
    }
}
