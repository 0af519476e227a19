//! Ground that is made for the pixels of a camera is as bright as the ground itself.

use crate::common::program::{field, shoot};
use furrow::light::Light;
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

/// A camera that looks straight down on pixels of so many millimetres.
fn from_above(pixel_mm: f64) -> String {
    let (size, focal) = (80, 240.0);
    let lens = format!("intrinsics: Pixels(fx: {focal}, fy: {focal}, cx: 40, cy: 40)");
    format!("size: ({size}, {size}), {lens}, pose: Nadir(height_m: {})", focal * pixel_mm * 1e-3)
}

/// A camera that looks at the origin from three metres away, north, so many degrees above the horizon; 5 mm across a pixel.
fn at_a_slant(degrees: f64) -> String {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let pose = format!("LookAt(position_m: (0, {}, {}), target_m: (0, 0, 0))", -3.0 * cos, 3.0 * sin);
    format!("size: (100, 24), intrinsics: Pixels(fx: 600, fy: 600, cx: 50, cy: 12), pose: {pose}")
}

/// The lights of a scene file, from a field that is quickly grown.
fn lit(lights: &str) -> Vec<Light> {
    let camera = "size: (4, 3), intrinsics: Pixels(fx: 4, fy: 4, cx: 2, cy: 1.5), pose: Nadir(height_m: 0.1)";
    field(&format!("Field(camera: Pinhole({camera}), lights: [{lights}])"), &Options::default()).scene.lights
}

/// Mean radiance of bare ground under each of the lights: ground does not depend on its light, and takes longest to grow.
fn means(camera: &str, lights: &[Vec<Light>], soil: &str, detail: &str) -> Vec<Spectrum> {
    let text = format!(
        r#"Field(
            seed: 3,
            detail: {detail},
            camera: Pinhole({camera}),
            lights: [{}],
            soil: (
                layers: [(albedo: "textures/soil/dirt.png", height: "textures/soil/dirt.height.png", size_m: 0.5, height_mm: (-4, 8))],
                relief: (rms_mm: 0), stones: [], litter: (bits_per_m2: 0, sticks_per_m2: 0, straw_cover: 0), {soil}
            ),
        )"#,
        LIGHTS[0]
    );
    let mut field = field(&text, &Options::default());
    let mut mean = |lights: &Vec<Light>| {
        field.scene.lights.clone_from(lights);
        let (film, _) = shoot(&field, 16, 0);
        let sum = film.pixels.iter().map(|pixel| pixel.mean).fold(Spectrum::ZERO, |sum, mean| sum + mean);
        sum / film.pixels.len() as f32
    };
    lights.iter().map(&mut mean).collect()
}

/// Ratios of the mean radiance of bare ground made by pixel to that in full detail, in each band, printed and held to the bound of each light.
fn compare(camera: &str, lights: &[(String, f32)], soil: &str) {
    let lit: Vec<Vec<Light>> = lights.iter().map(|(light, _)| lit(light)).collect();
    let [coarse, full] = ["ByPixel", "Full"].map(|detail| means(camera, &lit, soil, detail));
    for (((light, bound), coarse), full) in lights.iter().zip(coarse).zip(full) {
        let ratio = (coarse / full).to_array();
        let name = format!("{soil}, {light}, {camera}: {ratio:.3?}");
        eprintln!("{name}");
        assert!(ratio.iter().all(|ratio| (ratio - 1.0).abs() < *bound), "{name}");
    }
}

/// The same from above at two sizes of pixels, under all lights, dry and moist.
fn compare_from_above(clods: &str, bound: f32) {
    let lights = LIGHTS.map(|light| (light.to_owned(), bound));
    for moisture in MOISTURES {
        for pixel_mm in [5.0, 15.0] {
            compare(&from_above(pixel_mm), &lights, &format!("{moisture}, clods: ({clods})"));
        }
    }
}

/// Rationale: a field that a drone sees must not be darker or brighter than the same field is, by what its ground no longer shows, wherever the
/// sun stands. Expected: mean radiance of bare ground in each band within 4 % of that of full detail, at pixels of 5 and 15 mm, dry and moist,
/// under an even sky and under suns of 30°, 50° and 70°. Source: the same scene file in full detail.
#[test]
fn coarse_ground_is_as_bright_as_the_ground() {
    compare_from_above("over_5mm_per_m2: 0", 0.04);
}

/// Expected: the same under clods, which shade each other, within 6 %.
#[test]
fn coarse_ground_is_as_bright_as_the_clods_on_it() {
    compare_from_above("over_5mm_per_m2: 9000", 0.06);
}

/// Rationale: what a front camera sees far away is seen at a grazing angle, where ground that only hides would go black. Expected: as bright as in full
/// detail within 20 % at 20° and 8° above the horizon, under an even sky and under a sun beside and behind the camera, within 40 % where it stands
/// before it.
#[test]
fn coarse_ground_is_as_bright_at_a_slant() {
    let sun = |(azimuth, bound): (i32, f32)| {
        (format!("Daylight(sun: Angles(elevation_deg: 34, azimuth_deg: {azimuth}), turbidity: 3)"), bound)
    };
    let mut lights = vec![(LIGHTS[0].to_owned(), 0.2)];
    lights.extend([(0, 0.4), (90, 0.2), (180, 0.2)].map(sun));
    for degrees in [20.0, 8.0] {
        for clods in ["over_5mm_per_m2: 0", "over_5mm_per_m2: 9000"] {
            compare(&at_a_slant(degrees), &lights, &format!("{}, clods: ({clods})", MOISTURES[1]));
        }
    }
}
