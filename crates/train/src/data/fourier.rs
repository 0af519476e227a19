//! Fourier style transfer: blends the amplitudes of the lowest spatial frequencies with those of another image.
//!
//! The amplitudes of the lowest frequencies represent the illumination, colours and soft shadows of an image; the phases represent its
//! objects. Amplitudes up to a few waves per image are blended with those of another training image. Phases stay, and so the labels
//! remain valid.
//!
//! Sources: Yang & Soatto 2020, "FDA: Fourier domain adaptation for semantic segmentation", eq. 3; blending by a random fraction as in
//! Xu et al. 2021, "A Fourier-based framework for domain generalization", eq. 4. Only these few coefficients are computed, by direct
//! sums over the image.

use super::example::Example;
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::sampling::Stream;
use std::f64::consts::TAU;

/// Highest blended frequency in waves per image, horizontally and vertically: wavelengths of 60 and 45 pixels in 480 × 360.
const MOST: usize = 8;

/// Returns the example with the style of `other`, blended by a random fraction, or with probability 1/2 `None`. `size` is width and
/// height of both.
pub(super) fn restyled(example: &Example, other: &Example, size: (u32, u32), stream: &mut Stream) -> Option<Example> {
    if stream.chance(0.5) {
        return None;
    }
    let waves = Waves::new((size.0.to_usize(), size.1.to_usize()), 1 + stream.index(MOST));
    let share = stream.uniform().to_f32();
    let values = |plane: &[u8]| plane.iter().map(|v| f32::from(*v)).collect::<Vec<f32>>();
    let planes = example.planes.iter().zip(&other.planes).map(|(own, other)| {
        let mut own = values(own);
        waves.blend(&mut own, &values(other), share);
        own.into_iter().map(|v| v.round().clamp(0.0, 255.0).trunc_to::<u8>()).collect()
    });
    Some(Example { planes: planes.collect(), ..example.clone() })
}

/// Array of complex numbers, as separate real and imaginary parts.
#[derive(Clone)]
struct Complex {
    re: Vec<f32>,
    im: Vec<f32>,
}

impl Complex {
    fn zeros(n: usize) -> Self {
        Self { re: vec![0.0; n], im: vec![0.0; n] }
    }
}

/// Tabulated waves of the lowest frequencies, horizontal and vertical.
struct Waves {
    width: usize,
    /// Cosine and sine of each frequency from 0 to `most` at each column (`across`) and row (`down`).
    across: Vec<Complex>,
    down: Vec<Complex>,
}

impl Waves {
    fn new((width, height): (usize, usize), most: usize) -> Self {
        let of = |n: usize| {
            let wave = |k: usize| {
                let angle = |i: usize| TAU * (k * i % n.max(1)).to_f64() / n.to_f64();
                Complex {
                    re: (0..n).map(|i| angle(i).cos().to_f32()).collect(),
                    im: (0..n).map(|i| angle(i).sin().to_f32()).collect(),
                }
            };
            // Frequencies from half of the number of pixels on are aliases of lower ones.
            (0..=most.min((n.max(1) - 1) / 2)).map(wave).collect()
        };
        Self { width, across: of(width), down: of(height) }
    }

    /// Iterates over the horizontal frequencies from −most to most, as magnitude and sign.
    fn signed(&self) -> impl Iterator<Item = (usize, f32)> + use<> {
        let most = self.across.len() - 1;
        (1..=most).rev().map(|k| (k, -1.0)).chain((0..=most).map(|k| (k, 1.0)))
    }

    /// Returns the Fourier coefficients of a plane: for each vertical frequency, those of all horizontal ones in the order of
    /// [`Waves::signed`].
    fn coefficients(&self, plane: &[f32]) -> Vec<Complex> {
        let coefficients = |down: &Complex| {
            let mut sums = Complex::zeros(self.width);
            for (row, (cos, sin)) in plane.chunks_exact(self.width).zip(down.re.iter().zip(&down.im)) {
                add_times(&mut sums.re, row, *cos);
                add_times(&mut sums.im, row, -sin);
            }
            let one = |(k, sign): (usize, f32)| {
                let wave = &self.across[k];
                let (mut re, mut im) = (0.0, 0.0);
                for i in 0..self.width {
                    let (cos, sin) = (wave.re[i], sign * wave.im[i]);
                    re += sums.re[i] * cos + sums.im[i] * sin;
                    im += sums.im[i] * cos - sums.re[i] * sin;
                }
                (re, im)
            };
            let (re, im) = self.signed().map(one).unzip();
            Complex { re, im }
        };
        self.down.iter().map(coefficients).collect()
    }

    /// Blends the amplitudes of a plane's coefficients with those of another plane by the fraction `share`; phases stay.
    fn blend(&self, plane: &mut [f32], other: &[f32], share: f32) {
        let (own, other) = (self.coefficients(plane), self.coefficients(other));
        let n = plane.len().to_f32();
        for (y, (own, other)) in own.iter().zip(&other).enumerate() {
            // Change of the coefficient of this vertical frequency at each column. The negative frequency adds the conjugate.
            let mut added = Complex::zeros(self.width);
            for (at, (k, sign)) in self.signed().enumerate() {
                let amplitude = own.re[at].hypot(own.im[at]);
                if amplitude <= f32::MIN_POSITIVE {
                    continue;
                }
                let twins = if y == 0 { 1.0 } else { 2.0 };
                let change = twins * share * (other.re[at].hypot(other.im[at]) / amplitude - 1.0) / n;
                let (re, im, wave) = (change * own.re[at], change * own.im[at], &self.across[k]);
                add_times(&mut added.re, &wave.re, re);
                add_times(&mut added.re, &wave.im, -sign * im);
                add_times(&mut added.im, &wave.im, sign * re);
                add_times(&mut added.im, &wave.re, im);
            }
            let down = &self.down[y];
            for (row, (cos, sin)) in plane.chunks_exact_mut(self.width).zip(down.re.iter().zip(&down.im)) {
                add_times(row, &added.re, *cos);
                add_times(row, &added.im, -sin);
            }
        }
    }
}

fn add_times(to: &mut [f32], values: &[f32], factor: f32) {
    for (to, v) in to.iter_mut().zip(values) {
        *to += factor * v;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::Purpose;

    fn noise(n: usize, seed: u64) -> Vec<f32> {
        let mut stream = Stream::of(seed, 0, Purpose::Test, 0);
        (0..n).map(|_| stream.range32(20.0, 230.0)).collect()
    }

    /// Computes all Fourier coefficients by the definition.
    fn transformed(plane: &[f32], (w, h): (usize, usize)) -> Vec<(f64, f64)> {
        let one = |ky: usize, kx: usize| {
            let mut sum = (0.0, 0.0);
            for (i, v) in plane.iter().enumerate() {
                let (sin, cos) =
                    (-TAU * ((kx * (i % w)).to_f64() / w.to_f64() + (ky * (i / w)).to_f64() / h.to_f64())).sin_cos();
                sum = (sum.0 + f64::from(*v) * cos, sum.1 + f64::from(*v) * sin);
            }
            sum
        };
        (0..h).flat_map(|ky| (0..w).map(move |kx| (ky, kx))).map(|(ky, kx)| one(ky, kx)).collect()
    }

    /// Expected: coefficients up to frequency 2 have the phase of the image and the blended amplitude; all others are those of the
    /// image. Source: the discrete Fourier transform by its definition.
    #[test]
    fn low_amplitudes_are_blended_and_all_else_stays() {
        let size @ (w, h) = (13, 10);
        let (own, other) = (noise(w * h, 1), noise(w * h, 2));
        let mut blended = own.clone();
        Waves::new(size, 2).blend(&mut blended, &other, 0.7);
        let [own, other, blended] = [&own, &other, &blended].map(|plane| transformed(plane, size));
        let amplitude = |(re, im): (f64, f64)| re.hypot(im);
        for at in 0..w * h {
            let waves = |k: usize, n: usize| k.min(n - k);
            let low = waves(at % w, w) <= 2 && waves(at / w, h) <= 2;
            let expected = if low { 0.3 * amplitude(own[at]) + 0.7 * amplitude(other[at]) } else { amplitude(own[at]) };
            let scale = expected / amplitude(own[at]);
            let off = amplitude((blended[at].0 - scale * own[at].0, blended[at].1 - scale * own[at].1));
            assert!(off < 0.05, "{at}: {off} of {expected}");
        }
    }

    /// Expected: uniform images become uniform images between both values; an image in its own style is unchanged up to rounding;
    /// labels stay; half of the samples change nothing. Source: the definition.
    #[test]
    fn pictures_take_the_others_mean_and_keep_their_labels() {
        let (w, h) = (24u32, 16u32);
        let example = |value: u8, label: u8| Example {
            name: String::new(),
            planes: vec![vec![value; (w * h).to_usize()]; 3],
            labels: vec![label; (w * h).to_usize()],
            plants: Vec::new(),
            species: Vec::new(),
        };
        let mut changed = 0;
        for seed in 0..40 {
            let mut stream = Stream::of(seed, 0, Purpose::Test, 0);
            let Some(found) = restyled(&example(40, 1), &example(200, 2), (w, h), &mut stream) else { continue };
            changed += 1;
            assert!(found.labels.iter().all(|l| *l == 1));
            let value = found.planes[0][0];
            assert!((40..=200).contains(&value) && found.planes.iter().flatten().all(|v| v.abs_diff(value) <= 1));
        }
        assert!((10..=30).contains(&changed), "{changed} of 40");
        let plane = noise(24 * 16, 3);
        let mut same = plane.clone();
        Waves::new((24, 16), MOST).blend(&mut same, &plane, 1.0);
        assert!(same.iter().zip(&plane).all(|(a, b)| (a - b).abs() < 1e-2));
        // A plane with fewer pixels than frequencies.
        let mut tiny = vec![10.0f32, 30.0];
        Waves::new((2, 1), MOST).blend(&mut tiny, &[50.0, 50.0], 1.0);
        assert!((tiny[0] - 40.0).abs() < 1e-3 && (tiny[1] - 60.0).abs() < 1e-3, "{tiny:?}");
    }
}
