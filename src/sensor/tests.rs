//! The camera against OpenCV's conventions and itself; the sensor against what a card should look like.

use super::*;
use crate::math::Spectrum;
use crate::sampling::{Purpose, Stream};

fn build(page: &str) -> Result<Camera, String> {
    let desc: CameraDesc = ron::from_str(page).map_err(|e| e.to_string())?;
    desc.build(&mut Stream::of(1, 0, Purpose::Test, 0)).map_err(|e| e.to_string())
}

fn cameras() -> Vec<Camera> {
    [
        "JaiAd130()",
        "JaiAd130(focal_mm: 8, height_m: 1.1, at_m: (3, -2), yaw_deg: 35, pitch_deg: 4, roll_deg: -3, \
         distortion: (k1: -0.1, k2: 0.02, p1: 0.001, p2: -0.0007, k3: 0.004))",
        "Pinhole(size: (640, 480), intrinsics: Pixels(fx: 400, fy: 420, cx: 300, cy: 250), \
         pose: LookAt(position_m: (0.5, -2, 1.5), target_m: (0, 0, 0.1)), distortion: (k1: -0.2, k2: 0.05))",
        "Pinhole(size: (320, 240), intrinsics: FieldOfView(horizontal_deg: 90), pose: Nadir(height_m: 2), \
         distortion: (k1: 0.05, p1: 0.002))",
        "Phone(height_m: 0.4, yaw_deg: 70)",
    ]
    .map(|page| build(page).unwrap())
    .to_vec()
}

/// Rationale: labels, masks and stem points are projected; images are ray traced; both must mean the same pixel. Expected: a pixel
/// unprojected and projected returns to itself within 10⁻⁴ pixels, distorted or not; through f32 world points within what f32
/// leaves of a pixel.
#[test]
fn a_pixel_projected_back_is_itself() {
    for camera in cameras() {
        let mut s = Stream::of(2, 0, Purpose::Test, 0);
        let depth_digits = 4.0 * camera.focal[0] as f32 * f32::EPSILON * (1.0 + camera.pose.position.length());
        for i in 0..2000 {
            let (w, h) = (f64::from(camera.width), f64::from(camera.height));
            let px = match i {
                0 => [0.0, 0.0],
                1 => [w, h],
                _ => [s.range(0.0, w), s.range(0.0, h)],
            };
            let [x, y] = camera.unproject(px);
            let z = s.range(0.2, 5.0);
            let back = camera.project_camera([x * z, y * z, z]).unwrap();
            assert!((back[0] - px[0]).abs() < 1e-4 && (back[1] - px[1]).abs() < 1e-4, "{px:?} {back:?}");

            let px = vec2(px[0] as f32, px[1] as f32);
            let (origin, dir) = camera.ray(px, [0.3, 0.7]);
            assert!((dir.length() - 1.0).abs() < 1e-6);
            let back = camera.project(origin + dir * z as f32).unwrap();
            assert!((back - px).length() < depth_digits / z.min(1.0) as f32 + 1e-4, "{px} {back}");
        }
    }
}

/// Rationale: a mirrored or turned image trains a robot to steer the wrong way. Expected: looking down at yaw 0, image right is
/// east and image down is south; yaw 90 puts east at the top; pitch looks towards the top, roll to the right. Source: OpenCV's
/// frame, the azimuths of math::direction.
#[test]
fn the_image_of_a_nadir_camera_has_north_at_its_top() {
    let at = |page: &str, p: Vec3| build(page).unwrap().project(p).unwrap();
    let (east, north) = (vec3(0.05, 0.0, 0.0), vec3(0.0, 0.05, 0.0));
    let (middle, still) = (vec2(648.0, 483.0), "JaiAd130(height_m: 1)");
    assert!((at(still, Vec3::ZERO) - middle).length() < 1e-3);
    assert!((at(still, east) - vec2(648.0 + 200.0, 483.0)).length() < 1e-2);
    assert!((at(still, north) - vec2(648.0, 483.0 - 200.0)).length() < 1e-2);
    let turned = "JaiAd130(height_m: 1, yaw_deg: 90)";
    assert!((at(turned, east) - vec2(648.0, 483.0 - 200.0)).length() < 1e-2);
    assert!((at(turned, north) - vec2(648.0 - 200.0, 483.0)).length() < 1e-2);
    let shift = 4000.0 * 2.0_f32.to_radians().tan();
    assert!((at("JaiAd130(height_m: 1, pitch_deg: 2)", Vec3::ZERO) - vec2(648.0, 483.0 + shift)).length() < 0.1);
    assert!((at("JaiAd130(height_m: 1, roll_deg: 2)", Vec3::ZERO) - vec2(648.0 - shift, 483.0)).length() < 0.1);
    let upright = "Pinhole(size: (100, 100), intrinsics: FieldOfView(horizontal_deg: 60), \
                   pose: LookAt(position_m: (0, -3, 1), target_m: (0, 0, 1)))";
    assert!(at(upright, vec3(0.0, 0.0, 1.5)).y < 50.0 && at(upright, vec3(0.5, 0.0, 1.0)).x > 50.0);
    let down = "Pinhole(size: (100, 100), intrinsics: FieldOfView(horizontal_deg: 60), \
                pose: LookAt(position_m: (0, 0, 1), target_m: (0, 0, 0)))";
    assert!(at(down, east).x > 50.0 && at(down, north).y < 50.0);
}

#[test]
fn distortion_has_opencvs_signs() {
    // Barrel distortion draws corners inward; p1 and p2 by their formula at one point.
    let barrel = Distortion { k1: -0.1, ..Distortion::default() };
    assert_eq!(barrel.distort([0.5, 0.0]), [0.5 * (1.0 - 0.1 * 0.25), 0.0]);
    let tangential = Distortion { p1: 0.01, p2: 0.02, ..Distortion::default() };
    let [x, y] = tangential.distort([0.3, 0.4]);
    assert!((x - (0.3 + 2.0 * 0.01 * 0.12 + 0.02 * (0.25 + 0.18))).abs() < 1e-12);
    assert!((y - (0.4 + 0.01 * (0.25 + 0.32) + 2.0 * 0.02 * 0.12)).abs() < 1e-12);
}

#[test]
fn the_preset_sees_what_its_data_sheet_says() {
    let camera = build("JaiAd130(focal_mm: 15, height_m: 0.85)").unwrap();
    let [a, b, c, _] = camera.footprint(0.0).unwrap();
    assert!((b.x - a.x - 0.2754).abs() < 1e-4 && (b.y - c.y - 0.2053).abs() < 1e-4, "275 × 205 mm");
    assert!((camera.pixel_angle() * 0.85 - 0.2125e-3).abs() < 1e-6, "0.2125 mm per pixel");
    assert!(camera.contains(vec2(0.0, 0.0)) && !camera.contains(vec2(1296.0, 1.0)));
}

#[test]
fn another_size_keeps_the_field_of_view() {
    for camera in cameras() {
        let small = camera.with_size(camera.width() / 4, camera.height() / 2);
        for share in [[0.0, 0.0], [0.3, 0.9], [1.0, 1.0]] {
            let dir = |c: &Camera| c.ray(vec2(share[0] * c.width() as f32, share[1] * c.height() as f32), [0.5; 2]).1;
            assert!((dir(&camera) - dir(&small)).length() < 1e-6);
        }
    }
}

#[test]
fn a_lens_is_sharp_in_its_plane_and_passes_through_its_centre() {
    let camera = build("JaiAd130(height_m: 1, f_number: 2, distortion: (k1: -0.05))").unwrap();
    let px = vec2(300.5, 200.5);
    let (eye, straight) = camera.centre_ray(300, 200);
    let focus = eye + straight / -straight.z;
    let mut s = Stream::of(1, 0, Purpose::Test, 0);
    for _ in 0..200 {
        let (origin, dir) = camera.ray(px, [s.uniform32(), s.uniform32()]);
        assert!((origin + dir / -dir.z - focus).length() < 1e-6, "a blurred plane of focus");
        assert!((origin - eye).length() <= 0.00375 * 1.0001 && (origin.z - eye.z).abs() < 1e-6);
    }
    let (pinhole, same) = build("JaiAd130(height_m: 1, distortion: (k1: -0.05))").unwrap().ray(px, [0.1, 0.9]);
    assert!((pinhole - eye).length() < 1e-6 && (same - straight).length() < 1e-6, "labels use the same lens");
}

#[test]
fn cameras_that_see_nothing_say_why() {
    for (page, why) in [
        ("JaiAd130(focal_mm: 2, distortion: (k1: -3))", "folds the image"),
        (
            "Pinhole(size: (10, 10), intrinsics: FieldOfView(horizontal_deg: 60), pose: Nadir(height_m: 1), \
             aperture: (f_number: 2, focus_m: 1))",
            "focal length in millimetres",
        ),
        (
            "Pinhole(size: (10, 10), intrinsics: FieldOfView(horizontal_deg: 180), pose: Nadir(height_m: 1))",
            "less than 180",
        ),
        (
            "Pinhole(size: (10, 10), intrinsics: FieldOfView(horizontal_deg: 60), \
             pose: LookAt(position_m: (1, 1, 1), target_m: (1, 1, 1)))",
            "its own position",
        ),
        ("JaiAd130(height_m: -1)", "above 0"),
    ] {
        let message = build(page).err().unwrap_or_default();
        assert!(message.contains(why), "{page}: {message}");
    }
    assert!(build("JaiAd130()").unwrap().project(vec3(0.0, 0.0, 2.0)).is_none(), "behind the lens");
    let page = "JaiAd130(focal_mm:8.0,height_m:1.0,at_m:(0.0,0.0),yaw_deg:0.0,pitch_deg:0.0,roll_deg:0.0,\
                distortion:(k1:-0.1,k2:0.0,p1:0.0,p2:0.0,k3:0.0),f_number:4.0)";
    let desc: CameraDesc = ron::from_str(page).unwrap();
    assert_eq!(ron::to_string(&desc).unwrap(), page);
}

fn sensor(page: &str) -> Sensor {
    ron::from_str::<SensorDesc>(page).unwrap().build(&mut Stream::of(1, 0, Purpose::Test, 0))
}

fn small() -> Camera {
    Camera { scale: 1.0, ..cameras()[0].with_size(48, 32) }
}

/// Rationale: pages are drawn in fewer pixels for networks and for a look. Expected: the blur of the same lens, in the new pixels; no mosaic
/// where pixels are of two by two.
#[test]
fn a_smaller_image_is_blurred_by_the_same_lens() {
    let page = |more: &str| {
        sensor(&format!(
            "(noise: (on: false), natural_vignetting: false, corner_shading: 0, tone: Linear, exposure: Fixed(gain: 1), \
             white_balance: Raw, bits: 16, psf: (color_px: 3), {more})"
        ))
    };
    let spread = |more: &str, camera: &Camera| {
        let mut pixels = vec![Spectrum::ZERO; 48 * 32];
        pixels[16 * 48 + 24] = Spectrum::splat(10.0);
        let film = Linear { pixels: &pixels, width: 48, left: 0, top: 0 };
        let shot = page(more).expose(film, camera, Spectrum::ONE, &Stream::of(3, 0, Purpose::Sensor, 0));
        let green: Vec<f64> = shot.deep.unwrap().rgb.chunks(3).map(|c| f64::from(c[1])).collect();
        let of = |i: usize| green[i] * ((i % 48) as f64 - 24.0).powi(2);
        ((0..green.len()).map(of).sum::<f64>() / green.iter().sum::<f64>()).sqrt()
    };
    let half = Camera { scale: 0.5, ..small() };
    assert!((spread("", &small()) - 3.0).abs() < 0.05, "{}", spread("", &small()));
    assert!((spread("", &half) - 1.5).abs() < 0.03, "{}", spread("", &half));
    let bayer = "mosaic: Bayer(pattern: Rggb, demosaic: Bilinear)";
    assert!(spread(bayer, &small()) != spread("", &small()) && spread(bayer, &half) == spread("", &half));
    assert_eq!(cameras()[0].with_size(648, 483).scale(), 0.5);
}

fn expose(sensor: &Sensor, pixels: &[Spectrum], illuminant: Spectrum) -> Photograph {
    let film = Linear { pixels, width: 48, left: 0, top: 0 };
    sensor.expose(film, &small(), illuminant, &Stream::of(3, 0, Purpose::Sensor, 0))
}

const EVENING: Spectrum = Spectrum::new(0.9, 0.7, 0.4, 0.8);

#[test]
fn a_white_card_is_neutral_under_any_light() {
    let even = "(noise: (on: false), natural_vignetting: false, corner_shading: 0, exposure: White(level: 0.5))";
    for light in [EVENING, Spectrum::ONE, Spectrum::new(0.2, 0.5, 1.4, 0.1)] {
        let card = vec![light * (1.0 / std::f32::consts::PI); 48 * 32];
        let shot = expose(&sensor(even), &card, light);
        // Linear 0.5 is 188 in sRGB.
        assert!(shot.rgb.iter().all(|&v| v == 188), "{:?}", &shot.rgb[..3]);
    }
    let card = vec![EVENING * 0.3; 48 * 32];
    let warm = expose(&sensor("(noise: (on: false), white_balance: Daylight)"), &card, EVENING);
    assert!(warm.rgb[0] > warm.rgb[1] && warm.rgb[1] > warm.rgb[2], "evening light stays warm: {:?}", &warm.rgb[..3]);
    let black = expose(&sensor("()"), &vec![Spectrum::ZERO; 48 * 32], Spectrum::ZERO);
    assert!(black.rgb.iter().all(|&v| v < 40), "no light, no picture");
}

#[test]
fn more_light_never_gives_a_darker_pixel() {
    for tone in ["Film", "Srgb", "Linear"] {
        let page = format!(
            "(noise: (on: false), natural_vignetting: false, corner_shading: 0, tone: {tone}, exposure: Fixed(gain: 1), \
             nir_exposure: Fixed(gain: 1))"
        );
        let ramp: Vec<Spectrum> = (0..48 * 32).map(|i| Spectrum::splat(i as f32 / 1000.0)).collect();
        let shot = expose(&sensor(&page), &ramp, Spectrum::ONE);
        assert!(shot.nir.is_sorted() && shot.rgb.chunks(3).map(|c| c[1]).is_sorted(), "{tone}");
        assert_eq!((shot.nir[0], shot.nir[1535]), (0, 255));
    }
}

#[test]
fn automatic_exposure_brings_the_mean_to_its_level() {
    let scene: Vec<Spectrum> = (0..48 * 32).map(|i| EVENING * (0.05 + (i % 97) as f32 / 400.0)).collect();
    let auto =
        sensor("(tone: Linear, noise: (on: false), exposure: Auto(level: 0.18), nir_exposure: Auto(level: 0.25))");
    for brightness in [1e-3, 1.0, 500.0] {
        let scene: Vec<Spectrum> = scene.iter().map(|&s| s * brightness).collect();
        let shot = expose(&auto, &scene, EVENING * brightness);
        let mean = |of: &[u8]| of.iter().map(|&v| f64::from(v)).sum::<f64>() / of.len() as f64 / 255.0;
        assert!((mean(&shot.rgb) - 0.18).abs() < 0.004 && (mean(&shot.nir) - 0.25).abs() < 0.004, "{brightness}");
    }
    let median = sensor("(tone: Linear, noise: (on: false), exposure: Percentile(percent: 50, level: 0.4))");
    let mut green: Vec<u8> = expose(&median, &scene, EVENING).rgb.chunks(3).map(|c| c[1]).collect();
    green.sort_unstable();
    assert!((f32::from(green[768]) / 255.0 - 0.4).abs() < 0.01);
}

/// Rationale: noise must be that of a photon counter and the same in every run. Expected: variance (e + read²)/white² of levels;
/// equal bytes twice; a window has the bytes of the whole. Source: Poisson statistics, EMVA 1288.
#[test]
fn noise_is_counted_in_electrons_and_never_changes() {
    let page = "(tone: Linear, natural_vignetting: false, corner_shading: 0, white_balance: Raw, \
                exposure: Fixed(gain: 0.5), nir_exposure: Fixed(gain: 0.5), noise: (full_well: 500, read: 10, read_nir: 10))";
    let noisy = sensor(page);
    let flat = vec![Spectrum::ONE; 48 * 32];
    let shot = expose(&noisy, &flat, Spectrum::ONE);
    assert_eq!(shot, expose(&noisy, &flat, Spectrum::ONE));
    let green: Vec<f64> = shot.rgb.chunks(3).map(|c| f64::from(c[1]) / 255.0).collect();
    let mean = green.iter().sum::<f64>() / green.len() as f64;
    let variance = green.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / green.len() as f64;
    let expected = (0.5 * 450.0 + 100.0) / (450.0 * 450.0);
    assert!((mean - 0.5).abs() < 0.005, "{mean}");
    assert!((variance / expected - 1.0).abs() < 0.15, "{variance} {expected}");

    let window = Linear { pixels: &flat[..100], width: 10, left: 5, top: 7 };
    let part = noisy.expose(window, &small(), Spectrum::ONE, &Stream::of(3, 0, Purpose::Sensor, 0));
    assert_eq!((part.width, part.height), (10, 10));
    assert_eq!(part.nir[23], shot.nir[(7 + 2) * 48 + 5 + 3]);
}

#[test]
fn corners_are_darker_by_the_fourth_power_of_the_cosine() {
    let page = "(tone: Linear, noise: (on: false), corner_shading: 0, nir_exposure: Fixed(gain: 0.8))";
    let flat = vec![Spectrum::ONE; 48 * 32];
    let shot = expose(&sensor(page), &flat, Spectrum::ONE);
    let ratio = f32::from(shot.nir[0]) / f32::from(shot.nir[16 * 48 + 24]);
    let expected = small().axis_cosine([0.5, 0.5]).powi(4);
    assert!((ratio - expected).abs() < 0.01 && expected < 0.95, "{ratio} {expected}");
    let shaded = expose(&sensor(&page.replace("corner_shading: 0", "corner_shading: 0.2")), &flat, Spectrum::ONE);
    assert!(f32::from(shaded.nir[0]) < 0.85 * f32::from(shot.nir[0]));
}

/// Rationale: steps act one after another, and what each is tested for must hold of what comes out. Expected: under any light and for
/// every named sensor a white card is neutral and as bright as its exposure says, equal bytes come twice, and noise stays with its
/// pixel in a window, but for the few pixels at the window's edge that look around.
#[test]
fn a_white_card_is_neutral_through_every_chain() {
    let exposed =
        "exposure: White(level: 0.5), nir_exposure: White(level: 0.5), natural_vignetting: false, corner_shading: 0";
    for name in ["JaiAd130", "Phone", "MachineVision"] {
        let sensor = sensor(&format!("{name}({exposed}, tone: Srgb, jpeg: Off)"));
        let card = vec![EVENING * (1.0 / std::f32::consts::PI); 48 * 32];
        let shot = expose(&sensor, &card, EVENING);
        assert_eq!(shot, expose(&sensor, &card, EVENING));
        for band in 0..3 {
            let mean = shot.rgb.iter().skip(band).step_by(3).map(|v| f64::from(*v)).sum::<f64>() / 1536.0;
            // Linear 0.5 is 188 in sRGB; the mean of noisy values lies a little below it.
            assert!((mean - 187.7).abs() < 1.0, "{name}: {mean}");
        }
        let window = Linear { pixels: &card[..400], width: 20, left: 5, top: 7 };
        let part = sensor.expose(window, &small(), EVENING, &Stream::of(3, 0, Purpose::Sensor, 0));
        let (inner, whole) = ((10 * 20 + 10) * 3, ((7 + 10) * 48 + 5 + 10) * 3);
        assert_eq!(part.rgb[inner..inner + 3], shot.rgb[whole..whole + 3], "{name}");
        assert_eq!(shot.deep.is_some(), name == "MachineVision");
    }
}

/// Expected: of the colour image only what the mosaic sees is known, NIR is as it was without one; noise of neighbours then has in common
/// what interpolation gives it (`bayer`): 0.4 in green, two thirds in red.
#[test]
fn a_mosaic_spreads_noise_in_colour_and_leaves_nir() {
    let page = "(tone: Linear, natural_vignetting: false, corner_shading: 0, white_balance: Raw, exposure: Fixed(gain: 0.5), \
                nir_exposure: Fixed(gain: 0.5), noise: (full_well: 300, read: 8), mosaic: MOSAIC)";
    let flat = vec![Spectrum::ONE; 48 * 32];
    let with = expose(&sensor(&page.replace("MOSAIC", "Bayer()")), &flat, Spectrum::ONE);
    let without = expose(&sensor(&page.replace("MOSAIC", "Off")), &flat, Spectrum::ONE);
    assert_eq!(with.nir, without.nir);
    for (band, expected) in [(0, 2.0 / 3.0), (1, 0.4)] {
        let of = |shot: &Photograph| {
            let values: Vec<f64> = shot.rgb.iter().skip(band).step_by(3).map(|v| f64::from(*v)).collect();
            let mean = values.iter().sum::<f64>() / 1536.0;
            let pairs = values.chunks(48).flat_map(|row| row.windows(2).map(|p| (p[0] - mean, p[1] - mean)));
            let (both, one) = pairs.fold((0.0, 0.0), |(b, o), (x, y)| (b + x * y, o + 0.5 * (x * x + y * y)));
            both / one
        };
        assert!(
            (of(&with) - expected).abs() < 0.1 && of(&without).abs() < 0.1,
            "{band}: {} {}",
            of(&with),
            of(&without)
        );
    }
}

/// Expected: twelve bits tell more than eight, in steps of 65535/4095.
#[test]
fn a_deep_photograph_has_its_steps() {
    let ramp: Vec<Spectrum> = (0..48 * 32).map(|i| Spectrum::splat(i as f32 / 1536.0)).collect();
    let page = "(tone: Linear, noise: (on: false), exposure: Fixed(gain: 1), nir_exposure: Fixed(gain: 1), \
                natural_vignetting: false, corner_shading: 0, bits: 12)";
    let shot = expose(&sensor(page), &ramp, Spectrum::ONE);
    let nir = shot.deep.unwrap().nir;
    assert!(nir.is_sorted() && nir.iter().collect::<std::collections::BTreeSet<_>>().len() > 1200);
    assert!(nir.iter().all(|v| {
        (f64::from(*v) * 4095.0 / 65535.0).fract().min(1.0 - (f64::from(*v) * 4095.0 / 65535.0).fract()) < 0.04
    }));
    assert!(
        nir.iter().zip(&shot.nir).all(|(fine, coarse)| (f32::from(*fine) / 257.0 - f32::from(*coarse)).abs() < 0.6)
    );
}

/// Expected: at strength 1 the picture's mean is grey, at 0 a white card is, in between the gains' logarithms lie in between.
#[test]
fn a_grey_world_goes_part_of_the_way_to_a_grey_mean() {
    let scene: Vec<Spectrum> =
        (0..48 * 32).map(|i| EVENING * Spectrum::new(0.3, 0.2, 0.1, 0.3) * (1.0 + (i % 7) as f32)).collect();
    let gains = |strength: f32| {
        let page = format!("(noise: (on: false), white_balance: GreyWorld(strength: {strength}))");
        expose(&sensor(&page), &scene, EVENING).white_balance
    };
    let white = expose(&sensor("(noise: (on: false))"), &scene, EVENING).white_balance;
    let (none, half, all) = (gains(0.0), gains(0.5), gains(1.0));
    for band in 0..3 {
        assert!((none[band] / white[band] - 1.0).abs() < 1e-5);
        assert!((all[band] / white[band] / [2.0 / 3.0, 1.0, 2.0][band] - 1.0).abs() < 1e-3, "{all:?} {white:?}");
        assert!((half[band] * half[band] / (none[band] * all[band]) - 1.0).abs() < 1e-5);
    }
}
