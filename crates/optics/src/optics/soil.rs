//! Soil colours in four bands, and their darkening by water.
//!
//! Dry values are band means of measured or modelled spectra. The soils `LOAM` to `REDDISH` follow the brightness–shape
//! model of Verhoef, van der Tol & Middleton 2018, with its parameters in the comment of each; `CHALKY` is the dry
//! reference soil that is commonly used with the PROSAIL canopy model. R, G, B are linear Rec.709 under D65, NIR is the
//! band of the camera's second sensor.
//!
//! Moisture covers a fraction of the grains with films of water, which let light in and trap it by internal reflection,
//! so the soil darkens. Source: Lekner & Dorf 1988 (Appl. Opt. 27:1278); random distribution of films over the grains,
//! Verhoef et al. 2018 (Remote Sens. Environ. 204:942).

use super::interface::transmissivity;
use furrow_base::math::{Spectrum, ToFloat};
use std::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;

/// Slope angle of the soil's facets below a millimetre, radians. For ground with explicit relief down to 1 mm, Irons et
/// al. 1992 imply 0.26–0.52.
pub const FACETS: f32 = 0.35;

/// Returns A and B of Oren & Nayar 1994, the qualitative model `f = ρ/π (A + B max(0, cos Δφ) sin α tan β)`, for facets
/// whose slope angles have the standard deviation `sigma` in radians, 0–1.
///
/// With σ = 0 the surface is Lambertian, and it never reflects more than a Lambertian surface of the same albedo. The
/// published model reflects ρ (A + B/2) at grazing angles, up to 1.5 % too much for small σ, so A and B are divided by
/// A + B/2 where that exceeds one.
pub fn facets(sigma: f32) -> [f32; 2] {
    let s = sigma * sigma;
    let (a, b) = (1.0 - 0.5 * s / (s + 0.33), 0.45 * s / (s + 0.09));
    let most = (a + 0.5 * b).max(1.0);
    [a / most, b / most]
}

/// Common loam: brightness 0.5, shape angles 25° and 45°.
pub const LOAM: Spectrum = Spectrum::new(0.2041, 0.1436, 0.0914, 0.2514);
/// Loess silt loam, the soil of many beet fields: brightness 0.52, shape angles 26° and 50°.
pub const LOESS: Spectrum = Spectrum::new(0.2200, 0.1437, 0.0877, 0.2726);
/// Bright sand: brightness 0.75, shape angles 28° and 48°.
pub const SANDY: Spectrum = Spectrum::new(0.3443, 0.2308, 0.1412, 0.4081);
/// Dark humic clay: brightness 0.25, shape angles 22° and 45°.
pub const HUMIC: Spectrum = Spectrum::new(0.0887, 0.0632, 0.0413, 0.1164);
/// Reddish clay loam: brightness 0.45, shape angles 35° and 60°.
pub const REDDISH: Spectrum = Spectrum::new(0.2572, 0.1512, 0.0825, 0.2871);
/// Pale, chalky dry soil.
pub const CHALKY: Spectrum = Spectrum::new(0.3057, 0.2537, 0.2189, 0.3958);
/// Field stone, estimated from glacial gravel; individual stones differ by ±30 %.
pub const STONE: Spectrum = Spectrum::new(0.30, 0.27, 0.23, 0.36);
/// Dry straw and wood shavings.
pub const STRAW: Spectrum = Spectrum::new(0.35, 0.24, 0.16, 0.585);

/// Presets by the name used in scene files.
pub const PRESETS: [(&str, Spectrum); 8] = [
    ("loam", LOAM),
    ("loess", LOESS),
    ("sandy", SANDY),
    ("humic", HUMIC),
    ("reddish", REDDISH),
    ("chalky", CHALKY),
    ("stone", STONE),
    ("straw", STRAW),
];

/// Returns the preset with this name.
pub fn preset(name: &str) -> Option<Spectrum> {
    PRESETS.iter().find(|(n, _)| *n == name).map(|(_, s)| *s)
}

/// Extends a soil texel's linear colour to four bands. Soil spectra rise steadily into the near infrared, so NIR is the
/// texel's red times the NIR/R ratio of the soil `like` (1.1–1.3 among the presets). All bands are clamped to 0–0.9.
#[inline]
pub fn at(rgb: [f32; 3], like: Spectrum) -> Spectrum {
    let nir = rgb[0] * like.0.w / like.0.x.max(1e-4);
    Spectrum::new(rgb[0], rgb[1], rgb[2], nir).clamp(0.0, 0.9)
}

/// Returns the measured soil with the most similar colour: the least sum of squared differences of log₂ R, G, B.
pub fn most_similar(rgb: [f32; 3]) -> Spectrum {
    let far = |soil: &Spectrum| -> f32 {
        let of = soil.to_array();
        (0..3).map(|k| (rgb[k].max(1e-4) / of[k]).log2().powi(2)).sum()
    };
    let measured = [LOAM, LOESS, SANDY, HUMIC, REDDISH, CHALKY];
    measured.into_iter().min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(LOAM)
}

/// Refractive index of water in the visible.
const WATER_INDEX: f64 = 1.33;
/// Refractive index of soil minerals.
const SOIL_INDEX: f64 = 2.0;
/// Mean absorption of liquid water over the NIR band, 1/cm (Kou, Labrie & Chylek 1993). In the visible it is
/// negligible.
const WATER_NIR_PER_CM: f32 = 0.05;
/// Thickness of one film, cm.
const FILM_CM: f32 = 0.015;
/// Mean number of films on a grain of saturated soil: (55 − 5 vol. %)/25 vol. %.
const FILMS_AT_SATURATION: f32 = 2.0;
/// Remaining reflectance when the pores fill with water too. An estimate within the 0.45–0.6 of dry soil that Lobell &
/// Asner 2002 report at saturation.
const SATURATED: f32 = 0.8;

struct Film {
    /// Reflectance of the film's outer side for a 40° cone.
    outer: f32,
    /// Internal reflectance for diffuse light.
    inner: f32,
    /// Transmission into the mineral from water relative to that from air.
    entry: f32,
}

static FILM: LazyLock<Film> = LazyLock::new(|| Film {
    outer: (1.0 - transmissivity(40f64.to_radians(), WATER_INDEX)).to_f32(),
    inner: (1.0 - transmissivity(FRAC_PI_2, WATER_INDEX) / (WATER_INDEX * WATER_INDEX)).to_f32(),
    entry: (transmissivity(FRAC_PI_2, SOIL_INDEX / WATER_INDEX) / transmissivity(FRAC_PI_2, SOIL_INDEX)).to_f32(),
});

/// Returns the reflectance of soil of reflectance `r` under a film of water; `through` is the transmission of two
/// passes through the film.
fn under_film(r: f32, through: f32) -> f32 {
    let film = &*FILM;
    let seen = 1.0 - (1.0 - r) * (r * film.entry + 1.0 - r);
    film.outer + (1.0 - film.outer) * (1.0 - film.inner) * through * seen / (1.0 - film.inner * through * seen)
}

/// Returns the reflectance of moist soil and the fraction of its surface under a film of water, which is the glistening
/// part. `moisture` is 0 for air-dry soil (5 vol. %), 1 for saturated soil (55 vol. %), and clamped to that range.
pub fn wet(dry: Spectrum, moisture: f32) -> (Spectrum, f32) {
    let moisture = if moisture > 0.0 { moisture.min(1.0) } else { 0.0 };
    let films = FILMS_AT_SATURATION * moisture;
    let bare = (-films).exp();
    let thickness = FILM_CM * (films / (1.0 - bare).max(1e-6)).max(1.0);
    let through = (-2.0 * WATER_NIR_PER_CM * thickness).exp();
    let dry = dry.clamp(0.0, 1.0);
    let [r, g, b, nir] = dry.to_array();
    let filmed = Spectrum::new(under_film(r, 1.0), under_film(g, 1.0), under_film(b, 1.0), under_film(nir, through));
    let pores = 1.0 + (SATURATED - 1.0) * ((moisture - 0.9) / 0.1).clamp(0.0, 1.0);
    (dry.lerp(filmed, 1.0 - bare) * pores, 1.0 - bare)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Source: the same film model computed spectrally, for fully covered soil of each reflectance.
    #[test]
    fn a_film_darkens_as_the_full_spectra_say() {
        for (dry, filmed) in [(0.10, 0.071), (0.15, 0.098), (0.20, 0.127), (0.25, 0.157), (0.30, 0.189), (0.40, 0.259)]
        {
            assert!((under_film(dry, 1.0) - filmed).abs() < 2e-3, "{dry}: {}", under_film(dry, 1.0));
        }
    }

    /// Source: band means of spectra at 15, 25, 35 and 50 vol. % of moisture.
    #[test]
    fn moist_soils_match_their_spectra() {
        let rows = [
            (LOAM, 15.0, [0.1794, 0.1275, 0.0833, 0.2209]),
            (LOAM, 25.0, [0.1628, 0.1167, 0.0779, 0.2004]),
            (LOAM, 50.0, [0.1411, 0.1025, 0.0707, 0.1736]),
            (LOESS, 25.0, [0.1750, 0.1167, 0.0751, 0.2174]),
            (SANDY, 35.0, [0.2560, 0.1709, 0.1072, 0.3098]),
            (HUMIC, 25.0, [0.0757, 0.0573, 0.0417, 0.0963]),
            (REDDISH, 50.0, [0.1760, 0.1067, 0.0653, 0.1986]),
        ];
        for (dry, percent, expected) in rows {
            let (got, _) = wet(dry, (percent - 5.0) / 50.0);
            let off = (got.0 - Spectrum::from(expected).0).abs().max_element();
            assert!(off < 0.008, "{dry:?} at {percent} %: {got:?} for {expected:?}");
        }
    }

    #[test]
    fn saturated_soil_keeps_about_half_of_its_light() {
        let (got, films) = wet(LOAM, 1.0);
        let ratio = got.luminance() / LOAM.luminance();
        assert!((0.45..0.62).contains(&ratio), "{ratio}");
        assert!((films - 0.865).abs() < 0.01, "{films}");
        assert_eq!(wet(LOAM, 0.0), (LOAM, 0.0));
    }

    #[test]
    fn a_texel_of_the_soils_own_colour_has_its_nir() {
        for (name, soil) in PRESETS {
            let [r, g, b, nir] = soil.to_array();
            assert!((at([r, g, b], soil).0.w - nir).abs() < 1e-5, "{name}");
        }
    }
}
