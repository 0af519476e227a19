//! Conversion from a spectrum to the four bands R, G, B and NIR.
//!
//! R, G, B: the colour seen by the CIE 1931 standard observer under D65, in linear Rec.709 primaries. NIR: the mean
//! over the second sensor of a JAI AD-130, weighted by photon count (quantum efficiency × sunlight × wavelength).
//!
//! Colour matching functions: the analytic fit of Wyman, Sloan & Shirley 2013 (JCGT 2(2):1). D65: CIE 15. Sunlight:
//! ASTM G173-03 global tilt. The quantum efficiency is an estimate for a Sony ICX445-class sensor behind the camera's
//! prism.

use furrow_base::math::{Spectrum, ToFloat, ToInt};
use std::sync::LazyLock;

/// Relative power of D65 every 10 nm from 400 to 780 nm.
const D65: [f64; 39] = [
    82.7549, 91.4860, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923, 108.811, 109.354, 107.802,
    104.790, 107.689, 104.405, 104.046, 100.000, 96.3342, 95.7880, 88.6856, 90.0062, 89.5991, 87.6987, 83.2886,
    83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.3490, 61.6040, 69.8856, 75.0870, 63.5927,
    46.4182, 66.8054, 63.3828,
];

/// Wavelength in nm, quantum efficiency, spectral irradiance of sunlight in W·m⁻²·nm⁻¹.
const NIR: [(u32, f64, f64); 30] = [
    (710, 0.00002, 1.3175),
    (720, 0.00015, 0.9855),
    (730, 0.00113, 1.1285),
    (740, 0.00814, 1.2195),
    (750, 0.04807, 1.2341),
    (760, 0.14818, 0.26604),
    (770, 0.20107, 1.1608),
    (780, 0.20048, 1.1636),
    (790, 0.18874, 1.0910),
    (800, 0.17547, 1.0725),
    (810, 0.16200, 1.0559),
    (820, 0.14850, 0.86188),
    (830, 0.13650, 0.91601),
    (840, 0.12450, 1.0157),
    (850, 0.11250, 0.89372),
    (860, 0.10200, 0.98816),
    (870, 0.09150, 0.96755),
    (880, 0.08100, 0.93957),
    (890, 0.07200, 0.92393),
    (900, 0.06300, 0.7426),
    (910, 0.05490, 0.62467),
    (920, 0.04680, 0.74414),
    (930, 0.04110, 0.4321),
    (940, 0.03540, 0.47181),
    (950, 0.02970, 0.14726),
    (960, 0.02520, 0.42066),
    (970, 0.02070, 0.63461),
    (980, 0.01620, 0.60468),
    (990, 0.01260, 0.73227),
    (1000, 0.00900, 0.73532),
];

/// Wavelength step of the visible weights, nm: half the step of D65, to resolve the steep absorption edges of pigments.
const STEP_NM: u32 = 5;

/// Returns CIE 1931 x̄, ȳ, z̄ at a wavelength in nm, within 1 % of the peak of the tabulated functions.
/// Source: Wyman, Sloan & Shirley 2013, multi-lobe fit.
pub fn observer(wavelength_nm: f64) -> [f64; 3] {
    let lobe = |mean: f64, below: f64, above: f64| {
        let t = (wavelength_nm - mean) * if wavelength_nm < mean { below } else { above };
        (-0.5 * t * t).exp()
    };
    [
        0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323) - 0.065 * lobe(501.1, 0.0490, 0.0382),
        0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322),
        1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725),
    ]
}

/// Converts XYZ to linear Rec.709. Source: IEC 61966-2-1.
pub(super) fn rec709([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
        -0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
        0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
    ]
}

fn daylight(wavelength_nm: u32) -> f64 {
    let offset = wavelength_nm.clamp(400, 780) - 400;
    let (i, part) = ((offset / 10).to_usize(), f64::from(offset % 10) / 10.0);
    D65[i] + part * (D65[(i + 1).min(D65.len() - 1)] - D65[i])
}

/// Weights of R, G, B every [`STEP_NM`] from 400 nm. The weights of each band sum to one, so a perfect white is (1, 1,
/// 1).
static VISIBLE: LazyLock<Vec<(u32, [f64; 3])>> = LazyLock::new(|| {
    let mut weights: Vec<(u32, [f64; 3])> = (400..=780)
        .step_by(STEP_NM.to_usize())
        .map(|nm| (nm, rec709(observer(f64::from(nm)).map(|x| x * daylight(nm)))))
        .collect();
    let sums = weights.iter().fold([0.0; 3], |s, (_, w)| std::array::from_fn(|i| s[i] + w[i]));
    for (_, w) in &mut weights {
        *w = std::array::from_fn(|i| w[i] / sums[i]);
    }
    weights
});

/// Returns the four bands of two spectra, both given by one function of the wavelength in nm. Negative bands are
/// clamped to 0: they occur for colours outside the gamut, such as light transmitted by chlorophyll.
pub fn weigh2(spectra: impl Fn(u32) -> (f64, f64)) -> (Spectrum, Spectrum) {
    let mut sum = [[0.0; 4]; 2];
    for (nm, w) in VISIBLE.iter() {
        let (a, b) = spectra(*nm);
        for i in 0..3 {
            sum[0][i] += w[i] * a;
            sum[1][i] += w[i] * b;
        }
    }
    let mut total = 0.0;
    for (nm, efficiency, sunlight) in NIR {
        let (a, b) = spectra(nm);
        let w = efficiency * sunlight * f64::from(nm);
        sum[0][3] += w * a;
        sum[1][3] += w * b;
        total += w;
    }
    let band = |s: [f64; 4]| {
        Spectrum::new(s[0].to_f32(), s[1].to_f32(), s[2].to_f32(), (s[3] / total).to_f32()).clamp(0.0, 1.0)
    };
    (band(sum[0]), band(sum[1]))
}

/// Returns the four bands of one spectrum; see [`weigh2`].
pub fn weigh(spectrum: impl Fn(u32) -> f64) -> Spectrum {
    weigh2(|nm| (spectrum(nm), 0.0)).0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grey_stays_grey() {
        let grey = weigh(|_| 0.25).to_array();
        assert!(grey.iter().all(|v| (v - 0.25).abs() < 1e-6), "{grey:?}");
    }

    #[test]
    fn bands_see_their_own_part_of_the_spectrum() {
        let red = weigh(|nm| f64::from(u8::from((600..700).contains(&nm))));
        assert!(red.0.x > 0.85 && red.0.z < 0.1 && red.0.w < 1e-6, "{red:?}");
        let nir = weigh(|nm| f64::from(u8::from(nm > 780)));
        assert!(nir.0.truncate().max_element() < 1e-6 && nir.0.w > 0.7, "{nir:?}");
    }
}
