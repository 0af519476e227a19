//! Ground that is made for the pixels of a camera is as bright as the ground itself.

use crate::common::program::{field, shoot};
use furrow::math::Spectrum;
use furrow::scene::assemble::Options;

/// Lights, moisture and aggregates of the grounds.
const LIGHTS: [&str; 4] = [
    "Constant(radiance: (1, 1, 1, 1))",
    "Daylight(sun: Angles(elevation_deg: 30, azimuth_deg: 150), turbidity: 3)",
    "Daylight(sun: Angles(elevation_deg: 50, azimuth_deg: 150), turbidity: 3)",
    "Daylight(sun: Angles(elevation_deg: 70, azimuth_deg: 150), turbidity: 3)",
];
const MOISTURES: [&str; 2] = ["moisture: (mean: 0, spread: 0)", "moisture: (mean: 0.3)"];

/// Mean radiance of bare ground seen from above, by pixels of so many millimetres.
fn mean(lights: &str, soil: &str, detail: &str, pixel_mm: f64) -> Spectrum {
    let (size, focal) = (80, 240.0);
    let text = format!(
        r#"Field(
            seed: 3,
            detail: {detail},
            camera: Pinhole(size: ({size}, {size}), intrinsics: Pixels(fx: {focal}, fy: {focal}, cx: 40, cy: 40), pose: Nadir(height_m: {})),
            lights: [{lights}],
            soil: (
                layers: [(albedo: "textures/soil/dirt.png", height: "textures/soil/dirt.height.png", size_m: 0.5, height_mm: (-4, 8))],
                relief: (rms_mm: 0), stones: [], litter: (bits_per_m2: 0, sticks_per_m2: 0, straw_cover: 0), {soil}
            ),
        )"#,
        focal * pixel_mm * 1e-3
    );
    let (film, _) = shoot(&field(&text, &Options::default()), 16, 0);
    film.pixels.iter().map(|pixel| pixel.mean).fold(Spectrum::ZERO, |sum, mean| sum + mean) / film.pixels.len() as f32
}

/// Ratios of the mean radiance of bare ground made by pixel to that in full detail, in each band, at two sizes of pixels, printed and held to `bound`.
fn compare(clods: &str, bound: f32) {
    for moisture in MOISTURES {
        for lights in LIGHTS {
            for pixel_mm in [5.0, 15.0] {
                let soil = format!("{moisture}, clods: ({clods})");
                let ratio = mean(lights, &soil, "ByPixel", pixel_mm) / mean(lights, &soil, "Full", pixel_mm);
                let ratio = ratio.to_array();
                let name = format!("{soil}, {lights}, {pixel_mm} mm: {ratio:.3?}");
                eprintln!("{name}");
                assert!(ratio.iter().all(|ratio| (ratio - 1.0).abs() < bound), "{name}");
            }
        }
    }
}

/// Rationale: a field that a drone sees must not be darker or brighter than the same field is, by what its ground no longer shows, wherever the
/// sun stands. Expected: mean radiance of bare ground in each band within 3 % of that of full detail, at pixels of 5 and 15 mm, dry and moist,
/// under an even sky and under suns of 30°, 50° and 70°. Source: the same scene file in full detail.
#[test]
fn coarse_ground_is_as_bright_as_the_ground() {
    compare("over_5mm_per_m2: 0", 0.03);
}

/// Expected: the same under clods, which shade each other, within 5 %.
#[test]
fn coarse_ground_is_as_bright_as_the_clods_on_it() {
    compare("over_5mm_per_m2: 9000", 0.05);
}
