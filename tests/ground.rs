//! Colour of rendered ground beside that of photographs.

use crate::common::program::{field, shoot};
use furrow_base::math::Spectrum;
use furrow_field::assemble::Options;

/// Standard deviations of a* and b* of soil in photographs, the largest median of six public data sets, by
/// `benches/ground.py`. Source: `docs/results/ground.md`.
const MOST_A: f64 = 5.10;
const MOST_B: f64 = 5.74;

/// Brightest part of the blocks that counts, which leaves out shadows.
const BRIGHTEST: f64 = 0.7;
const SIDE: usize = 4;

/// Returns CIE Lab of linear Rec.709, relative to a white of luminance 1.
fn lab([r, g, b]: [f64; 3]) -> [f64; 3] {
    let xyz = [
        (0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505,
        0.2126 * r + 0.7152 * g + 0.0722 * b,
        (0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.089,
    ];
    let f = xyz.map(|t| if t > 0.008856 { t.cbrt() } else { 7.787 * t + 4.0 / 29.0 });
    [116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])]
}

fn sd(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

/// Returns the standard deviations of a* and b* over blocks of 4 × 4 pixels of ground in the sun, exposed to a mean
/// luminance of 0.2.
fn chroma(soil: &str) -> [f64; 2] {
    let (width, height) = (240, 180);
    let text = format!(
        r#"Field(
            seed: 5,
            camera: Pinhole(size: ({width}, {height}), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.24)),
            lights: [Daylight(sun: Angles(elevation_deg: 50, azimuth_deg: 150), turbidity: 3)],
            soil: (
                layers: [(albedo: "textures/soil/dirt.png", height: "textures/soil/dirt.height.png", size_m: 0.5, height_mm: (-4, 8))],
                {soil}
            ),
        )"#
    );
    let (film, _) = shoot(&field(&text, &Options::default()), 16, 0);
    let sum = film.pixels.iter().fold(Spectrum::ZERO, |sum, pixel| sum + pixel.mean);
    let gain = 0.2 * film.pixels.len() as f32 / sum.luminance();
    let block = |k: usize| {
        let (i, j) = (k % (width / SIDE) * SIDE, k / (width / SIDE) * SIDE);
        let pixels = (0..SIDE * SIDE).map(|p| film.pixels[(j + p / SIDE) * width + i + p % SIDE].mean);
        let [r, g, b, _] = (pixels.fold(Spectrum::ZERO, |sum, p| sum + p) * (gain / (SIDE * SIDE) as f32)).to_array();
        lab([r, g, b].map(f64::from))
    };
    let mut blocks: Vec<[f64; 3]> = (0..width / SIDE * (height / SIDE)).map(block).collect();
    blocks.sort_by(|a, b| b[0].total_cmp(&a[0]));
    blocks.truncate((blocks.len() as f64 * BRIGHTEST) as usize);
    [1, 2].map(|band| sd(&blocks.iter().map(|block| block[band]).collect::<Vec<f64>>()))
}

/// Rationale: ground of one hue gives a render away at once, and ground of many looks like paint. Expected: default iron
/// and humus, algae and stones raise the standard deviation of a* of ground of one soil by a half and that of b* by a quarter; grains
/// and crumbs of the textures alone give 0.75 in a*; all stay below those of photographs.
#[test]
fn pigments_and_stones_vary_the_chroma_of_ground() {
    let one = "pigments: (iron: 0, humus: 0, lime: 0), clods: (hue_sigma: 0)";
    let many = "pigments: (algae: 2), stones: [(cover: 0.02, median_mm: 6, min_mm: 2, rocks: [Quartz, Flint, Granite, Brick])]";
    let soils = ["Loess", "Reddish"];
    let mean = |extra: &str| {
        let all = soils.map(|soil| chroma(&format!("colors: [{soil}], {extra}")));
        [0, 1].map(|k| all.iter().map(|found| found[k]).sum::<f64>() / soils.len() as f64)
    };
    let ([a, b], [plain_a, plain_b]) = (mean(many), mean(one));
    assert!(a > 1.5 * plain_a && b > 1.25 * plain_b && plain_a > 0.75, "{a} {b} {plain_a} {plain_b}");
    assert!(a < MOST_A && b < MOST_B, "{a} {b}");
}
