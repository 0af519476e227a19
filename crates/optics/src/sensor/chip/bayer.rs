//! Colour filter mosaic: each pixel measures one colour, and the other two are interpolated.
//!
//! The mosaic belongs to the sensor, so its phase is that of the camera's whole image, whatever window is rendered.
//! Each pixel is read out in its own colour. The values already contain noise, which demosaicing spreads over
//! neighbours, as in any single-chip camera. Beyond the window's edge the mosaic is mirrored about the outermost
//! pixels, which preserves its colours.

use furrow_base::math::ToInt;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Colour filter mosaic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum MosaicDesc {
    /// Every pixel measures all colours, as in a prism camera.
    #[default]
    Off,
    /// Bayer mosaic: green on every second pixel, red and blue on every fourth.
    Bayer {
        /// Colours of the image's first two pixels and of the two below them; default RGGB.
        #[serde(default)]
        pattern: Pattern,
        /// Method to interpolate the missing colours; default bilinear.
        #[serde(default)]
        demosaic: Demosaic,
    },
}

/// Phase of the Bayer pattern.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Pattern {
    /// Red first.
    #[default]
    Rggb,
    /// Blue first.
    Bggr,
    /// Green first, red beside it.
    Grbg,
    /// Green first, blue beside it.
    Gbrg,
}

impl Pattern {
    /// Returns column and row, 0 or 1, of the red pixel in each 2×2 block.
    fn red(self) -> (u32, u32) {
        match self {
            Self::Rggb => (0, 0),
            Self::Bggr => (1, 1),
            Self::Grbg => (1, 0),
            Self::Gbrg => (0, 1),
        }
    }

    /// Returns which of R, G, B (0, 1, 2) the pixel at column x, row y of the camera's image measures.
    pub fn color(self, x: u32, y: u32) -> usize {
        let (rx, ry) = self.red();
        match ((x ^ rx) & 1, (y ^ ry) & 1) {
            (0, 0) => 0,
            (1, 1) => 2,
            _ => 1,
        }
    }
}

/// Demosaicing method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Demosaic {
    /// Bilinear: the mean of the nearest pixels of each colour.
    #[default]
    Bilinear,
    /// Bilinear, corrected by the Laplacian of the measured colour. Source: Malvar, He & Cutler 2004, "High-quality
    /// linear interpolation for demosaicing of Bayer-patterned color images", figure 2.
    MalvarHeCutler,
}

/// Weights of a 5 × 5 neighbourhood in eighths. Only the quarter to the right of and below the middle is stored; the
/// rest is symmetric.
type Kernel = [[f32; 3]; 3];

/// Kernels of a colour that is measured to the left and right.
const ROW: [Kernel; 2] =
    [[[0.0, 4.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], [[5.0, 4.0, -1.0], [0.0, -1.0, 0.0], [0.5, 0.0, 0.0]]];
/// Kernels of a colour that is measured on all four sides.
const CROSS: [Kernel; 2] =
    [[[0.0, 2.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 0.0]], [[4.0, 2.0, -1.0], [2.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]];
/// Kernels of a colour that is measured on the diagonals.
const DIAGONAL: [Kernel; 2] =
    [[[0.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 0.0]], [[6.0, 0.0, -1.5], [0.0, 2.0, 0.0], [-1.5, 0.0, 0.0]]];

/// Window of a mosaic: one value per pixel, row by row.
pub(in crate::sensor) struct Mosaic<'a> {
    /// Measured values.
    pub(in crate::sensor) values: &'a [f32],
    /// Pixels in a row.
    pub(in crate::sensor) width: u32,
    /// The window's first column and row in the camera's image.
    pub(in crate::sensor) corner: (u32, u32),
    /// Phase of the Bayer pattern.
    pub(in crate::sensor) pattern: Pattern,
}

impl Mosaic<'_> {
    /// Returns R, G, B of every pixel.
    pub(in crate::sensor) fn interpolate(&self, method: Demosaic) -> Vec<[f32; 3]> {
        let which = usize::from(method == Demosaic::MalvarHeCutler);
        let (row, cross, diagonal) = (&ROW[which], &CROSS[which], &DIAGONAL[which]);
        let column = transposed(row);
        let (width, (left, top)) = (self.width.to_usize(), self.corner);
        let height = self.values.len() / width.max(1);
        let around_columns: Vec<[usize; 5]> = (0..width).map(|x| around(x, width)).collect();
        let mut seen = vec![[0.0; 3]; width * height];
        seen.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row_of)| {
            let rows = around(y, height).map(|y| &self.values[y * width..][..width]);
            for (x, (columns, seen)) in around_columns.iter().zip(row_of).enumerate() {
                let (own, weigh) = (rows[2][x], |kernel| weigh(kernel, &rows, columns));
                let at = (left + x.to_u32(), top + y.to_u32());
                *seen = match self.pattern.color(at.0, at.1) {
                    0 => [own, weigh(cross), weigh(diagonal)],
                    2 => [weigh(diagonal), weigh(cross), own],
                    _ => {
                        let red_beside = self.pattern.color(at.0 + 1, at.1) == 0;
                        let (beside, above) = (weigh(row), weigh(&column));
                        if red_beside { [beside, own, above] } else { [above, own, beside] }
                    }
                };
            }
        });
        seen
    }
}

/// Applies a kernel at a pixel, given the five rows and the five columns around it.
fn weigh(kernel: &Kernel, rows: &[&[f32]; 5], columns: &[usize; 5]) -> f32 {
    let mut sum = 0.0;
    for (dy, weights) in kernel.iter().enumerate() {
        for (dx, weight) in weights.iter().enumerate() {
            if *weight == 0.0 {
                continue;
            }
            let mut around = rows[2 + dy][columns[2 + dx]];
            if dx > 0 {
                around += rows[2 + dy][columns[2 - dx]];
            }
            if dy > 0 {
                around += rows[2 - dy][columns[2 + dx]];
            }
            if dx > 0 && dy > 0 {
                around += rows[2 - dy][columns[2 - dx]];
            }
            sum += weight * around;
        }
    }
    sum / 8.0
}

/// Returns an index with the two on either side, mirrored about the first and the last of `count`; if `count` is 1, all
/// are that one.
fn around(i: usize, count: usize) -> [usize; 5] {
    let last = count.to_i64() - 1;
    [-2, -1, 0, 1, 2].map(|d| {
        let i = (i.to_i64() + d).abs();
        (if i > last { 2 * last - i } else { i }).clamp(0, last).to_usize()
    })
}

fn transposed(kernel: &Kernel) -> Kernel {
    std::array::from_fn(|y| std::array::from_fn(|x| kernel[x][y]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToFloat;
    use furrow_base::sampling::{Purpose, Stream};

    const PATTERNS: [Pattern; 4] = [Pattern::Rggb, Pattern::Bggr, Pattern::Grbg, Pattern::Gbrg];
    const METHODS: [Demosaic; 2] = [Demosaic::Bilinear, Demosaic::MalvarHeCutler];

    /// Samples a colour image with the mosaic and demosaics it.
    fn through(size: u32, pattern: Pattern, method: Demosaic, see: impl Fn(u32, u32) -> [f32; 3]) -> Vec<[f32; 3]> {
        let corner = (3, 5);
        let places = (0..size).flat_map(|y| (0..size).map(move |x| (x, y)));
        let values: Vec<f32> = places.map(|(x, y)| see(x, y)[pattern.color(corner.0 + x, corner.1 + y)]).collect();
        Mosaic { values: &values, width: size, corner, pattern }.interpolate(method)
    }

    #[test]
    fn every_two_by_two_has_its_letters() {
        for (pattern, letters) in PATTERNS.into_iter().zip(["RGGB", "BGGR", "GRBG", "GBRG"]) {
            let seen = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| ["R", "G", "B"][pattern.color(x + 6, y + 4)]);
            assert_eq!(seen.concat(), letters);
        }
    }

    /// Expected: constant images and linear ramps, different for each colour, are reproduced up to rounding; ramps
    /// except for two pixels at the border, where the mirror image is not a ramp.
    #[test]
    fn a_linear_ramp_survives() {
        for (pattern, method) in PATTERNS.into_iter().flat_map(|p| METHODS.map(|m| (p, m))) {
            let ramp = |x: u32, y: u32| {
                let (x, y) = (x.to_f32(), y.to_f32());
                [2.0 + 0.5 * x - 0.25 * y, 1.0 + 0.125 * x + 0.75 * y, 4.0 - 0.25 * x + 0.5 * y]
            };
            let seen = through(16, pattern, method, ramp);
            for (x, y) in (2..14).flat_map(|y| (2..14).map(move |x| (x, y))) {
                assert_eq!(seen[(y * 16 + x).to_usize()], ramp(x, y), "{pattern:?} {method:?} at {x}, {y}");
            }
            let flat = through(7, pattern, method, |_, _| [0.25, 0.5, 0.75]);
            assert!(flat.iter().all(|c| *c == [0.25, 0.5, 0.75]), "{pattern:?} {method:?}");
        }
        assert_eq!(through(1, Pattern::Rggb, Demosaic::Bilinear, |_, _| [1.0; 3]), [[1.0; 3]]);
    }

    /// Rationale: rows and columns are mirrored once instead of at each tap. Expected: the same bits as a sum that
    /// looks up each neighbour, including in images narrower than the kernel.
    #[test]
    fn every_tap_is_the_mirrored_neighbour() {
        let mut stream = Stream::of(6, 0, Purpose::Test, 0);
        for (width, height) in [(1, 1), (1, 4), (2, 2), (3, 1), (2, 5), (4, 3), (9, 7)] {
            let values: Vec<f32> = (0..width * height).map(|_| stream.normal().to_f32()).collect();
            for (pattern, method) in PATTERNS.into_iter().flat_map(|p| METHODS.map(|m| (p, m))) {
                let mosaic = Mosaic { values: &values, width: width.to_u32(), corner: (3, 6), pattern };
                let seen = mosaic.interpolate(method);
                let plain = |i: usize| plain(&mosaic, method, (i.to_i64() % width, i.to_i64() / width));
                let plain: Vec<[f32; 3]> = (0..values.len()).map(plain).collect();
                assert_eq!(seen, plain, "{pattern:?} {method:?} {width} × {height}");
            }
        }
    }

    /// Returns the colours of one pixel, computed neighbour by neighbour.
    fn plain(mosaic: &Mosaic<'_>, method: Demosaic, (x, y): (i64, i64)) -> [f32; 3] {
        let (width, which) = (i64::from(mosaic.width), usize::from(method == Demosaic::MalvarHeCutler));
        let height = mosaic.values.len().to_i64() / width;
        let mirrored = |i: i64, count: i64| {
            let i = i.abs();
            let i = if i >= count { 2 * (count - 1) - i } else { i };
            i.clamp(0, count - 1)
        };
        let at = |x: i64, y: i64| mosaic.values[(mirrored(y, height) * width + mirrored(x, width)).to_usize()];
        let sum = |kernel: &Kernel, turned: bool| {
            let mut sum = 0.0;
            for (dy, dx) in (0..3).flat_map(|dy| (0..3).map(move |dx| (dy, dx))) {
                let weight = if turned { kernel[dx][dy] } else { kernel[dy][dx] };
                let (dx, dy) = (dx.to_i64(), dy.to_i64());
                let mut all = at(x + dx, y + dy);
                if dx > 0 {
                    all += at(x - dx, y + dy);
                }
                if dy > 0 {
                    all += at(x + dx, y - dy);
                }
                if dx > 0 && dy > 0 {
                    all += at(x - dx, y - dy);
                }
                sum += weight * all;
            }
            sum / 8.0
        };
        let color = |dx: u32| mosaic.pattern.color(mosaic.corner.0 + x.to_u32() + dx, mosaic.corner.1 + y.to_u32());
        let (own, cross, diagonal) = (at(x, y), sum(&CROSS[which], false), sum(&DIAGONAL[which], false));
        let (beside, above) = (sum(&ROW[which], false), sum(&ROW[which], true));
        match (color(0), color(1)) {
            (0, _) => [own, cross, diagonal],
            (2, _) => [diagonal, cross, own],
            (_, 0) => [beside, own, above],
            _ => [above, own, beside],
        }
    }

    /// Expected: on a grey image with a fine wave the corrected method has less than half the error of the bilinear
    /// one. Around a single bright pixel among black ones, green equals the published kernel's weights.
    #[test]
    fn the_laplacian_of_one_colour_guides_the_others() {
        let wave = |x: u32, y: u32| [0.5 + 0.25 * (1.1 * x.to_f32() + 0.4 * y.to_f32()).sin(); 3];
        let error = |method| -> f32 {
            let seen = through(32, Pattern::Rggb, method, wave);
            let places = (2..30).flat_map(|y| (2..30).map(move |x| (x, y)));
            places
                .map(|(x, y)| {
                    (0..3).map(|c| (seen[y * 32 + x][c] - wave(x.to_u32(), y.to_u32())[c]).powi(2)).sum::<f32>()
                })
                .sum()
        };
        let [plain, guided] = METHODS.map(error);
        assert!(guided.sqrt() < 0.5 * plain.sqrt(), "{guided} against {plain}");

        // A single red pixel.
        let mut values = vec![0.0; 81];
        values[4 * 9 + 4] = 8.0;
        let mosaic = Mosaic { values: &values, width: 9, corner: (0, 0), pattern: Pattern::Rggb };
        let seen = mosaic.interpolate(Demosaic::MalvarHeCutler);
        let at = |x: usize, y: usize| seen[y * 9 + x];
        assert_eq!((at(4, 4), at(6, 4), at(5, 4)), ([8.0, 4.0, 6.0], [0.0, -1.0, -1.5], [4.0, 0.0, 0.0]));
        assert_eq!((at(5, 5), at(4, 3)), ([2.0, 0.0, 0.0], [4.0, 0.0, 0.0]));
    }

    /// Rationale: the noise of a real camera is not white, so neither is the noise that a network sees. Expected for
    /// independent noise of variance 1 after bilinear interpolation: green has variance 1 and ¼ alternately, mean ⅝,
    /// and covariance ¼ between neighbours in a row, a correlation of 0.4; red has variance (1 + ½ + ½ + ¼)/4 = 9/16
    /// and covariance (½ + ¼)/2 = ⅜, a correlation of ⅔.
    #[test]
    fn noise_becomes_that_of_neighbours() {
        const SIZE: usize = 400;
        let mut stream = Stream::of(5, 0, Purpose::Test, 0);
        let values: Vec<f32> = (0..SIZE * SIZE).map(|_| stream.normal().to_f32()).collect();
        let mosaic = Mosaic { values: &values, width: SIZE.to_u32(), corner: (0, 0), pattern: Pattern::Grbg };
        let seen = mosaic.interpolate(Demosaic::Bilinear);
        for (color, variance, correlation) in
            [(0, 9.0 / 16.0, 2.0 / 3.0), (1, 5.0 / 8.0, 0.4), (2, 9.0 / 16.0, 2.0 / 3.0)]
        {
            let (mut squares, mut products, mut count) = (0.0, 0.0, 0.0);
            for y in 2..SIZE - 2 {
                for x in 2..SIZE - 2 {
                    let value = |x: usize| f64::from(seen[y * SIZE + x][color]);
                    squares += value(x).powi(2);
                    products += value(x) * value(x + 1);
                    count += 1.0;
                }
            }
            let (is, along): (f64, f64) = (squares / count, products / squares);
            assert!((is / variance - 1.0).abs() < 0.03, "{color}: variance {is} for {variance}");
            assert!((along - correlation).abs() < 0.02, "{color}: correlation {along} for {correlation}");
        }
    }
}
