//! Sampling noise of rendered images compared to the noise of the real set's cameras.
//!
//! A relative error ε of a linear value Y changes its sRGB code c = 255 (1.055 Y^(1/2.4) − 0.055) by ε dc/d ln Y = ε (c
//! + 14) / 2.4. This is an upper bound: samples are stratified, and blur and compression reduce noise.

use furrow_base::math::RoundTo;

/// Sampling noise above this fraction of the real set's noise is reported. At this fraction it adds an eighth to the
/// noise of an image that has both.
const LARGE: f64 = 0.5;
/// Target fraction for the suggested number of samples, which adds a twentieth to the noise.
const SMALL: f64 = 1.0 / 3.0;
/// Noise of an otherwise noise-free image, from rounding to integers.
const ROUNDING: f64 = 0.288_675;

/// Returns the sampling noise in 8-bit levels for a linear luminance and a relative error; downscaling by `factor`
/// reduces it.
pub(super) fn levels(luminance: f64, relative_error: f64, factor: f64) -> f64 {
    let slope = 255.0 * 1.055 / 2.4 * luminance.powf(1.0 / 2.4);
    relative_error * slope / factor
}

/// Returns a warning if sampling noise is not small compared to the noise of the real set, with a sufficient number of
/// samples per pixel.
pub(super) fn warning(spp: f64, levels: f64, real: f64) -> Option<String> {
    let real = real.max(ROUNDING);
    (levels > LARGE * real).then(|| {
        let enough = spp * (levels / (SMALL * real)).powi(2);
        let power = enough.log2().ceil().min(31.0).trunc_to::<u32>().max(1);
        format!(
            "--synthetic has up to {levels:.1} levels of sampling noise at {spp:.0} samples per pixel, --real has {real:.1} of total noise: \
             render with --spp {} before relying on noise, gradients and spectra",
            1_u64 << power
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: the formula is a derivative. Expected: equal to the difference of codes of two luminances that differ
    /// by a thousandth; the suggested samples reduce the noise as 1/√n to a third of the real one. Source: IEC
    /// 61966-2-1.
    #[test]
    fn noise_follows_the_curve_and_samples_follow_from_it() {
        let code = |y: f64| 255.0 * (1.055 * y.powf(1.0 / 2.4) - 0.055);
        for y in [0.05, 0.18, 0.7] {
            let difference = (code(y * 1.0005) - code(y * 0.9995)) / 0.001;
            assert!((levels(y, 1.0, 1.0) / difference - 1.0).abs() < 1e-4);
            assert_eq!(levels(y, 0.1, 2.0), levels(y, 0.05, 1.0));
        }
        assert_eq!(warning(16.0, 0.9, 2.0), None);
        // 3 levels at 16 samples are 0.67 at 324.
        let words = warning(16.0, 3.0, 2.0).unwrap();
        assert!(words.contains("--spp 512 ") && words.contains("3.0 levels"), "{words}");
        assert!(warning(4.0, 0.2, 0.0).is_some(), "an image without noise still has rounding noise");
    }
}
