//! Sharpening as in phones: the difference between the image's luminance and its blurred version is added to the image
//! (unsharp mask).

use crate::sensor::given::{Given, layered};
use crate::sensor::lens::Psf;
use furrow_base::math::Spectrum;
use furrow_base::ron_file::{NonNegative, Vary};
use furrow_base::sampling::rng::Stream;
use rayon::prelude::*;
use serde::Serialize;

layered! {
    /// Sharpening of the colour image; none by default.
    #[derive(Clone, Debug, PartialEq, Serialize, schemars::JsonSchema)]
    #[schemars(default)]
    pub struct SharpenDesc, SharpenWritten = "SharpenDesc" {
        /// Factor on the added difference; default 0.
        pub amount: Vary<NonNegative<100>> = Given<Vary<NonNegative<100>>>,
        /// Standard deviation of the blur, pixels; default 1.
        pub radius_px: Vary<NonNegative<100>> = Given<Vary<NonNegative<100>>>,
    }
}

impl Default for SharpenDesc {
    fn default() -> Self {
        Self { amount: Vary::fixed(0.0), radius_px: Vary::fixed(1.0) }
    }
}

impl SharpenDesc {
    /// Samples the sharpening.
    pub fn draw(&self, stream: &mut Stream) -> Sharpen {
        Sharpen { amount: self.amount.draw32(stream), radius: self.radius_px.draw32(stream) }
    }
}

/// Unsharp mask.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sharpen {
    /// Factor on the added difference.
    pub amount: f32,
    /// Standard deviation of the blur, pixels.
    pub radius: f32,
}

impl Sharpen {
    /// Sharpens the output values (0 to 1) of R, G, B; NIR is unchanged.
    pub fn apply(&self, values: &mut [Spectrum], width: u32) {
        if self.amount == 0.0 {
            return;
        }
        let mut blurred = values.to_vec();
        Psf { color: self.radius, ..Psf::default() }.spread(&mut blurred, width, (0, 0), (width, 0));
        values.par_iter_mut().zip(blurred).for_each(|(value, blurred)| {
            let more = self.amount * (value.luminance() - blurred.luminance());
            *value += Spectrum::new(more, more, more, 0.0);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_gets_a_rim_and_its_sides_stay() {
        let edge: Vec<Spectrum> = (0..400).map(|i| Spectrum::splat(if i % 20 < 10 { 0.3 } else { 0.6 })).collect();
        let mut seen = edge.clone();
        Sharpen { amount: 0.8, radius: 1.0 }.apply(&mut seen, 20);
        let at = |x: usize| seen[200 + x].to_array();
        assert!(at(9)[1] < 0.25 && at(10)[1] > 0.65, "{:?} {:?}", at(9), at(10));
        assert!((at(2)[1] - 0.3).abs() < 1e-5 && (at(17)[1] - 0.6).abs() < 1e-5 && at(9)[3] == 0.3);
        let mut same = edge.clone();
        Sharpen::default().apply(&mut same, 20);
        assert_eq!(same, edge);
    }
}
