//! Pixel reconstruction filters.

use furrow_base::math::{RoundTo, ToFloat, Vec2, vec2};
use furrow_base::ron_file::{NonNegative, Num};
use serde::Deserialize;

/// Reconstruction filter of a pixel. It is importance-sampled (filter importance sampling), so pixels stay independent.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
pub enum Filter {
    /// The pixel's own square: a sensor with full fill factor and a perfect lens.
    Box,
    /// The square convolved with a Gaussian of this standard deviation in pixels: the point spread function of a lens.
    Gaussian(
        #[serde(deserialize_with = "blur")]
        #[schemars(with = "Num<NonNegative<100>>")]
        f32,
    ),
}

/// Reads the standard deviation of a Gaussian filter.
fn blur<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    Num::<NonNegative<100>>::deserialize(deserializer).map(Num::f32)
}

impl Filter {
    /// Tabulates the filter for sampling.
    pub fn footprint(self) -> Footprint {
        let quantiles = match self {
            Self::Gaussian(sigma) if sigma > 0.0 => Some(blurred_square(f64::from(sigma))),
            Self::Box | Self::Gaussian(_) => None,
        };
        Footprint { filter: self, quantiles }
    }
}

/// Number of cells in the quantile table.
const CELLS: usize = 1024;

/// A filter as a quantile function per axis. Square and blur together consume two random numbers instead of four, so a
/// stratified sequence stays stratified over the footprint.
#[derive(Clone, Debug)]
pub struct Footprint {
    filter: Filter,
    /// Quantiles of an offset at k / [`CELLS`]; `None` for the square alone.
    quantiles: Option<Box<[f32]>>,
}

impl Footprint {
    /// Returns the filter that this was built from.
    pub fn filter(&self) -> Filter {
        self.filter
    }

    /// Samples an offset from the pixel centre, in pixels, from two numbers in [0, 1).
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Vec2 {
        match &self.quantiles {
            None => Vec2::from(u) - 0.5,
            Some(q) => {
                let offset = |u: f32| {
                    let place = u * CELLS.to_f32();
                    let cell = place.trunc_to::<usize>().min(CELLS - 1);
                    q[cell] + (q[cell + 1] - q[cell]) * (place - cell.to_f32())
                };
                vec2(offset(u[0]), offset(u[1]))
            }
        }
    }
}

/// Quantiles of the sum of a uniform number in [−½, ½) and a normal one of standard deviation `sigma`. The density Φ((x
/// + ½)/σ) − Φ((x − ½)/σ) is summed numerically.
fn blurred_square(sigma: f64) -> Box<[f32]> {
    const STEPS: usize = 1 << 14;
    let end = 0.5 + 5.0 * sigma;
    let step = 2.0 * end / STEPS.to_f64();
    let at = |i: usize| (i.to_f64() + 0.5) * step - end;
    // Unnormalised Φ by the rectangle rule over the same steps, clamped at both ends of the table.
    let mut below = Vec::with_capacity(STEPS + 1);
    let mut sum = 0.0;
    let normal = |x: f64| (-0.5 * (x / sigma).powi(2)).exp();
    below.push(0.0);
    for i in 0..STEPS {
        sum += normal(at(i));
        below.push(sum);
    }
    let phi = |x: f64| {
        let place = ((x + end) / step).clamp(0.0, STEPS.to_f64());
        let cell = place.trunc_to::<usize>().min(STEPS - 1);
        below[cell] + (below[cell + 1] - below[cell]) * (place - cell.to_f64())
    };
    let density: Vec<f64> = (0..STEPS).map(|i| phi(at(i) + 0.5) - phi(at(i) - 0.5)).collect();
    let total: f64 = density.iter().sum();
    let mut quantiles = Vec::with_capacity(CELLS + 1);
    let (mut i, mut mass) = (0, 0.0);
    for k in 0..=CELLS {
        let goal = k.to_f64() / CELLS.to_f64() * total;
        while i < STEPS && mass + density[i] < goal {
            mass += density[i];
            i += 1;
        }
        let within = if i < STEPS { (goal - mass) / density[i].max(f64::MIN_POSITIVE) } else { 0.0 };
        quantiles.push(((i.to_f64() + within.clamp(0.0, 1.0)) * step - end).to_f32());
    }
    // The outermost cells are chosen to preserve the tail means: cells up to the ends of the tails would be far too
    // wide.
    let (inner, mut tail, mut weight) = (f64::from(quantiles[1]), 0.0, 0.0);
    for (i, density) in density.iter().enumerate().take_while(|(i, _)| at(*i) < inner) {
        tail += density * at(i);
        weight += density;
    }
    let outer = (2.0 * tail / weight - inner).to_f32();
    quantiles[0] = outer;
    quantiles[CELLS] = -outer;
    quantiles.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: mean 0, variance 1/12 + σ², and the probability of an offset within half a pixel from numerical
    /// integration of Φ((x + ½)/σ) − Φ((x − ½)/σ) (0.6824 at σ = 0.4).
    #[test]
    fn a_blurred_square_has_the_moments_of_a_square_and_a_blur() {
        for sigma in [0.1_f32, 0.4, 1.5] {
            let footprint = Filter::Gaussian(sigma).footprint();
            let n = 1_000_000;
            let xs = (0..n).map(|i| f64::from(footprint.sample([(i.to_f32() + 0.5) / n.to_f32(), 0.5]).x));
            let (mut mean, mut square, mut inside) = (0.0, 0.0, 0.0);
            for x in xs {
                mean += x / f64::from(n);
                square += x * x / f64::from(n);
                inside += f64::from(u8::from(x.abs() < 0.5)) / f64::from(n);
            }
            let expected = 1.0 / 12.0 + f64::from(sigma * sigma);
            assert!(mean.abs() < 1e-4, "σ {sigma}: mean {mean}");
            assert!((square / expected - 1.0).abs() < 5e-3, "σ {sigma}: {square} for {expected}");
            if sigma == 0.4 {
                assert!((inside - 0.6824).abs() < 1e-3, "{inside}");
            }
        }
    }

    #[test]
    fn a_box_is_the_square() {
        for filter in [Filter::Box, Filter::Gaussian(0.0)] {
            assert_eq!(filter.footprint().sample([0.0, 0.75]), vec2(-0.5, 0.25));
        }
    }
}
