//! Ground that is made for the pixels of a camera is as bright as the ground itself.

use crate::common::program::{field, shoot};
use furrow::math::Spectrum;
use furrow::scene::assemble::Options;

/// Light, moisture and aggregates of one ground.
struct Case {
    name: &'static str,
    lights: &'static str,
    soil: &'static str,
}

const CASES: [Case; 3] = [
    Case {
        name: "dry, even sky",
        lights: "Constant(radiance: (1, 1, 1, 1))",
        soil: "moisture: (mean: 0, spread: 0), clods: (over_5mm_per_m2: 0)",
    },
    Case {
        name: "moist, sun",
        lights: "Daylight(sun: Angles(elevation_deg: 50, azimuth_deg: 150), turbidity: 3)",
        soil: "moisture: (mean: 0.3), clods: (over_5mm_per_m2: 0)",
    },
    Case {
        name: "clods, sun",
        lights: "Daylight(sun: Angles(elevation_deg: 50, azimuth_deg: 150), turbidity: 3)",
        soil: "moisture: (mean: 0.3)",
    },
];

/// Mean radiance of bare ground seen from above, by pixels of so many millimetres.
fn mean(case: &Case, detail: &str, pixel_mm: f64) -> Spectrum {
    let (size, focal) = (80, 240.0);
    let text = format!(
        r#"Field(
            seed: 3,
            detail: {detail},
            camera: Pinhole(size: ({size}, {size}), intrinsics: Pixels(fx: {focal}, fy: {focal}, cx: 40, cy: 40), pose: Nadir(height_m: {})),
            lights: [{}],
            soil: (
                layers: [(albedo: "textures/soil/dirt.png", height: "textures/soil/dirt.height.png", size_m: 0.5, height_mm: (-4, 8))],
                relief: (rms_mm: 0), stones: [], litter: (bits_per_m2: 0, sticks_per_m2: 0, straw_cover: 0), {}
            ),
        )"#,
        focal * pixel_mm * 1e-3,
        case.lights,
        case.soil
    );
    let (film, _) = shoot(&field(&text, &Options::default()), 16, 0);
    film.pixels.iter().map(|pixel| pixel.mean).fold(Spectrum::ZERO, |sum, mean| sum + mean) / film.pixels.len() as f32
}

/// Rationale: a field that a drone sees must not be darker or brighter than the same field is, by what its ground no longer shows. Expected: mean
/// radiance of bare ground in each band within 3 % of that of full detail, at pixels of 2, 5 and 15 mm, dry and moist, under an even sky and the
/// sun, with clods and without. Source: the same scene file in full detail.
#[test]
fn coarse_ground_is_as_bright_as_the_ground() {
    for case in &CASES {
        for pixel_mm in [2.0, 5.0, 15.0] {
            let ratio = (mean(case, "ByPixel", pixel_mm) / mean(case, "Full", pixel_mm)).to_array();
            eprintln!("{}, {pixel_mm} mm: {ratio:.3?}", case.name);
            assert!(ratio.iter().all(|ratio| (ratio - 1.0).abs() < 0.03), "{}, {pixel_mm} mm: {ratio:?}", case.name);
        }
    }
}
