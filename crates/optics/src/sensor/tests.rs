//! Tests of the sensor with synthetic cards and images.

use super::*;
use furrow_base::math::{Spectrum, ToFloat};
use furrow_base::sampling::{Purpose, Stream};

fn sensor(page: &str) -> Sensor {
    ron::from_str::<SensorDesc>(page).unwrap().build(&mut Stream::of(1, 0, Purpose::Test, 0))
}

fn jai() -> Camera {
    ron::from_str::<CameraDesc>("JaiAd130()").unwrap().build(&mut Stream::of(1, 0, Purpose::Test, 0)).unwrap()
}

/// Returns a camera of 48 × 32 pixels, downscaled from one with `times` as many pixels per side.
fn few(times: u32) -> Camera {
    let (width, height) = (48 * times, 32 * times);
    let camera = jai().with_size(width, height);
    let [fx, fy, cx, cy] = camera.intrinsics();
    let own = Camera::new((width, height), [fx, fy], [cx, cy], camera.distortion(), *camera.pose()).unwrap();
    own.with_size(48, 32)
}

fn small() -> Camera {
    few(1)
}

/// Rationale: scene files are rendered with fewer pixels for networks and previews. Expected: the blur of the same
/// lens, in units of the new pixels; no mosaic if pixels average two by two sensor pixels.
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
        let of = |i: usize| green[i] * ((i % 48).to_f64() - 24.0).powi(2);
        ((0..green.len()).map(of).sum::<f64>() / green.iter().sum::<f64>()).sqrt()
    };
    let half = few(2);
    assert!((spread("", &small()) - 3.0).abs() < 0.05, "{}", spread("", &small()));
    assert!((spread("", &half) - 1.5).abs() < 0.03, "{}", spread("", &half));
    let bayer = "mosaic: Bayer(pattern: Rggb, demosaic: Bilinear)";
    assert!(spread(bayer, &small()) != spread("", &small()) && spread(bayer, &half) == spread("", &half));
    assert_eq!(jai().with_size(648, 483).scale(), 0.5);
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
    assert!(black.rgb.iter().all(|&v| v < 40), "no light, black image");
}

#[test]
fn more_light_never_gives_a_darker_pixel() {
    for tone in ["Film", "Srgb", "Linear"] {
        let page = format!(
            "(noise: (on: false), natural_vignetting: false, corner_shading: 0, tone: {tone}, exposure: Fixed(gain: 1), \
             nir_exposure: Fixed(gain: 1))"
        );
        let ramp: Vec<Spectrum> = (0..48 * 32).map(|i| Spectrum::splat(i.to_f32() / 1000.0)).collect();
        let shot = expose(&sensor(&page), &ramp, Spectrum::ONE);
        assert!(shot.nir.is_sorted() && shot.rgb.chunks(3).map(|c| c[1]).is_sorted(), "{tone}");
        assert_eq!((shot.nir[0], shot.nir[1535]), (0, 255));
    }
}

#[test]
fn automatic_exposure_brings_the_mean_to_its_level() {
    let scene: Vec<Spectrum> = (0..48 * 32).map(|i| EVENING * (0.05 + (i % 97).to_f32() / 400.0)).collect();
    let auto = sensor(
        "(tone: Linear, noise: (on: false), limits: (on: false), exposure: Auto(level: 0.18), nir_exposure: Auto(level: 0.25))",
    );
    for brightness in [1e-3, 1.0, 500.0] {
        let scene: Vec<Spectrum> = scene.iter().map(|&s| s * brightness).collect();
        let shot = expose(&auto, &scene, EVENING * brightness);
        let mean = |of: &[u8]| of.iter().map(|&v| f64::from(v)).sum::<f64>() / of.len().to_f64() / 255.0;
        assert!((mean(&shot.rgb) - 0.18).abs() < 0.004 && (mean(&shot.nir) - 0.25).abs() < 0.004, "{brightness}");
    }
    let median = sensor("(tone: Linear, noise: (on: false), exposure: Percentile(percent: 50, level: 0.4))");
    let mut green: Vec<u8> = expose(&median, &scene, EVENING).rgb.chunks(3).map(|c| c[1]).collect();
    green.sort_unstable();
    assert!((f32::from(green[768]) / 255.0 - 0.4).abs() < 0.01);
}

/// Rationale: noise must be that of a photon counter and the same in every run. Expected: variance (e + read²)/white²
/// of levels; equal bytes in two runs; a window has the bytes of the whole image. Source: Poisson statistics, EMVA
/// 1288.
#[test]
fn noise_is_counted_in_electrons_and_never_changes() {
    let page = "(tone: Linear, natural_vignetting: false, corner_shading: 0, white_balance: Raw, \
                exposure: Fixed(gain: 0.5), nir_exposure: Fixed(gain: 0.5), noise: (full_well: 500, read: 10, read_nir: 10))";
    let noisy = sensor(page);
    let flat = vec![Spectrum::ONE; 48 * 32];
    let shot = expose(&noisy, &flat, Spectrum::ONE);
    assert_eq!(shot, expose(&noisy, &flat, Spectrum::ONE));
    let green: Vec<f64> = shot.rgb.chunks(3).map(|c| f64::from(c[1]) / 255.0).collect();
    let mean = green.iter().sum::<f64>() / green.len().to_f64();
    let variance = green.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / green.len().to_f64();
    let expected = (0.5 * 450.0 + 100.0) / (450.0 * 450.0);
    assert!((mean - 0.5).abs() < 0.005, "{mean}");
    assert!((variance / expected - 1.0).abs() < 0.15, "{variance} {expected}");

    let window = Linear { pixels: &flat[..100], width: 10, left: 5, top: 7 };
    let part = noisy.expose(window, &small(), Spectrum::ONE, &Stream::of(3, 0, Purpose::Sensor, 0));
    assert_eq!((part.width, part.height), (10, 10));
    assert_eq!(part.nir[23], shot.nir[(7 + 2) * 48 + 5 + 3]);
}

/// Returns mean and squared signal-to-noise ratio of the NIR levels of an even card of this radiance.
fn nir_of(sensor: &Sensor, radiance: f32) -> (f64, f64, ShotRecord) {
    let shot = expose(sensor, &vec![Spectrum::splat(radiance); 48 * 32], Spectrum::ONE);
    let levels: Vec<f64> = shot.deep.unwrap().nir.iter().map(|v| f64::from(*v) / 65535.0).collect();
    let mean = levels.iter().sum::<f64>() / levels.len().to_f64();
    let variance = levels.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / levels.len().to_f64();
    (mean, mean * mean / variance, shot.shot)
}

/// Rationale: an exposure without limits makes any light as bright and as clean as the sun. Expected: at a thousandth of
/// the light the longest time and the largest gain are reached, the image is darker, and SNR² without read noise is the
/// number of electrons; with read noise it is n² / (n + read²). Source: EMVA 1288, equation 21.
#[test]
fn a_thousandth_of_the_light_is_darker_and_noisier() {
    let page = |read: u32| {
        sensor(&format!(
            "(tone: Linear, natural_vignetting: false, corner_shading: 0, bits: 16, nir_exposure: Auto(level: 0.18), \
             noise: (read_nir: {read}))"
        ))
    };
    for read in [0, 14] {
        let [(bright, clean, full), (dark, noisy, dim)] = [0.08, 0.08e-3].map(|light| nir_of(&page(read), light));
        assert!((bright - 0.18).abs() < 0.002 && full.analog_gain == [1.0; 4] && full.time_s[3] < 5e-3, "{full:?}");
        assert!((dim.time_s[3] - 0.03176).abs() < 1e-6 && (dim.analog_gain[3] - 3.981).abs() < 1e-3, "{dim:?}");
        // Electrons: 1.04e9 / 16 · 0.93 · radiance · time.
        let electrons = 1.04e9 / 16.0 * 0.93 * 0.08e-3 * 0.03176;
        assert!((dark / (electrons * 3.981 / 6300.0) - 1.0).abs() < 0.05, "{dark} {electrons}");
        for (n, snr2) in [(0.18 * 6300.0, clean), (electrons, noisy)] {
            let expected = n * n / (n + f64::from(read * read));
            assert!((snr2 / expected - 1.0).abs() < 0.15, "{snr2} for {expected}");
        }
    }
}

/// Expected: within the limits the longest time is used before any gain; a scene file sets both limits, a larger
/// aperture or a fixed time counts, and values outside their ranges are refused.
#[test]
fn limits_are_those_of_the_scene_file() {
    let shot = |limits: &str, camera: &str| {
        let camera =
            ron::from_str::<CameraDesc>(camera).unwrap().build(&mut Stream::of(1, 0, Purpose::Test, 0)).unwrap();
        let sensor = sensor(&format!("(exposure: Fixed(gain: 400), limits: ({limits}))"));
        let film = Linear { pixels: &[Spectrum::splat(1e-3); 16], width: 4, left: 0, top: 0 };
        sensor.expose(film, &camera, Spectrum::ONE, &Stream::of(3, 0, Purpose::Sensor, 0))
    };
    let still = "JaiAd130()";
    // A level of 10,317 per radiance and second: 38.8 ms for a gain of 400.
    let usual = shot("", still);
    assert!((usual.shot.time_s[0] - 0.03176).abs() < 1e-6 && (usual.shot.analog_gain[0] - 1.2208).abs() < 1e-3);
    assert!((usual.gain - 400.0).abs() < 1e-3 && (usual.shot.full_scale_electrons[0] - 7000.0 / 1.2208).abs() < 5.0);
    let long = shot("longest_ms: 50", still);
    assert!((long.shot.time_s[0] - 0.03877).abs() < 1e-4 && long.shot.analog_gain[0] == 1.0);
    let short = shot("longest_ms: 10, gain_db: 6", still);
    assert!((short.gain - 103.17 * 1.9953).abs() < 0.1, "{}", short.gain);
    let open = shot("", "JaiAd130(f_number: 2)");
    assert!((open.shot.time_s[0] - 0.03877 / 4.0).abs() < 1e-4);
    let fixed = shot("", "JaiAd130(motion: (exposure_ms: 15))").shot;
    assert!((fixed.time_s[0] - 0.015).abs() < 1e-6 && (fixed.analog_gain[0] - 2.585).abs() < 1e-2, "{fixed:?}");
    let none = shot("on: false", "JaiAd130(f_number: 8)");
    assert!(none.gain == 400.0 && none.shot.analog_gain[0] == 1.0 && none.shot.time_s[0] > 0.1);
    for (limits, why) in [("gain_db: 61", "between 0 and 60"), ("longest_ms: 0", "above 0"), ("f_number: 0", "above 0")]
    {
        let error = ron::from_str::<SensorDesc>(&format!("(limits: ({limits}))")).unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    }
}

/// Expected: the fraction of saturated pixels is counted before noise, for each band.
#[test]
fn saturated_pixels_are_counted() {
    let ramp: Vec<Spectrum> = (0..48 * 32).map(|i| Spectrum::splat(i.to_f32() / 768.0)).collect();
    let page =
        "(natural_vignetting: false, corner_shading: 0, exposure: Fixed(gain: 1), nir_exposure: Fixed(gain: 0.1))";
    let [red, green, _, nir] = expose(&sensor(page), &ramp, Spectrum::ONE).shot.saturated;
    // White is reached at 1 / 0.9.
    assert!((green - (1.0 - 0.5 / 0.9)).abs() < 2e-3 && red < green && nir == 0.0, "{red} {green} {nir}");
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

/// Expected: a scene of two halves keeps its mean, and its difference shrinks by the glare; an even scene stays the
/// same.
#[test]
fn glare_lifts_the_dark_half_and_keeps_the_mean() {
    let page = "(tone: Linear, noise: (on: false), natural_vignetting: false, corner_shading: 0, nir_exposure: Fixed(gain: 0.8), glare: 0.2)";
    let halves: Vec<Spectrum> = (0..48 * 32).map(|i| Spectrum::splat(if i % 48 < 24 { 0.2 } else { 0.8 })).collect();
    let level = |scene: &[Spectrum], page: &str| {
        let shot = expose(&sensor(page), scene, Spectrum::ONE);
        [shot.nir[0], shot.nir[47]].map(f32::from)
    };
    let ([dark, bright], [clear_dark, clear_bright]) =
        (level(&halves, page), level(&halves, &page.replace("0.2)", "0)")));
    assert!((dark + bright - clear_dark - clear_bright).abs() <= 2.0, "{dark} {bright}");
    assert!(((bright - dark) / (clear_bright - clear_dark) - 0.8).abs() < 0.02, "{dark} {bright}");
    let even = vec![Spectrum::splat(0.5); 48 * 32];
    assert_eq!(level(&even, page), level(&even, &page.replace("0.2)", "0)")));
}

/// Rationale: steps act in sequence, and the properties tested for each must hold for the result. Expected: under any
/// light and for every named sensor, a white card is neutral and has the exposure's brightness, two runs give equal
/// bytes, and noise stays with its pixel in a window, except for the few edge pixels whose filters reach outside.
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
            // Linear 0.5 is 188 in sRGB; the mean of noisy values is slightly lower.
            assert!((mean - 187.7).abs() < 1.0, "{name}: {mean}");
        }
        let window = Linear { pixels: &card[..400], width: 20, left: 5, top: 7 };
        let part = sensor.expose(window, &small(), EVENING, &Stream::of(3, 0, Purpose::Sensor, 0));
        let (inner, whole) = ((10 * 20 + 10) * 3, ((7 + 10) * 48 + 5 + 10) * 3);
        assert_eq!(part.rgb[inner..inner + 3], shot.rgb[whole..whole + 3], "{name}");
        assert_eq!(shot.deep.is_some(), name == "MachineVision");
    }
}

/// Expected: of the colour image only the mosaic's samples are used, and NIR is unchanged; neighbouring pixels' noise
/// is correlated by demosaicing as in `bayer`: 0.4 in green, two thirds in red.
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

/// Expected: twelve bits resolve more than eight, in steps of 65535/4095.
#[test]
fn a_deep_photograph_has_its_steps() {
    let ramp: Vec<Spectrum> = (0..48 * 32).map(|i| Spectrum::splat(i.to_f32() / 1536.0)).collect();
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

/// Expected: at strength 1 the image's mean is grey, at 0 a white card is neutral; in between, the logarithms of the
/// gains are interpolated.
#[test]
fn a_grey_world_goes_part_of_the_way_to_a_grey_mean() {
    let scene: Vec<Spectrum> =
        (0..48 * 32).map(|i| EVENING * Spectrum::new(0.3, 0.2, 0.1, 0.3) * (1.0 + (i % 7).to_f32())).collect();
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

/// Rationale: a dataset that cannot be reproduced cannot be trusted. Expected: the same bits on 1, 2 and 7 threads for
/// every step: blur and shifted colours, metering, noise, both demosaicing methods, matrix, sharpening, JPEG with both
/// chroma resolutions, deep images. Source: none needed, equality is exact.
#[test]
fn photographs_are_the_same_bits_at_any_number_of_threads() {
    let camera = jai();
    let (width, height) = (251, 97);
    let mut s = Stream::of(9, 0, Purpose::Test, 0);
    let mut value = || 0.3 * s.uniform32().powi(3);
    let pixels: Vec<Spectrum> =
        (0..width * height).map(|_| Spectrum::new(value(), value(), value(), 2.0 * value())).collect();
    for page in [
        "()",
        "JaiAd130",
        "Phone",
        "MachineVision(exposure: Percentile(percent: 97, level: 0.8), white_balance: GreyWorld(strength: 0.6))",
        "Phone(jpeg: On(quality: 60, full_color: true), sharpen: (amount: 0.7), bits: 12, psf: (red_shift_px: 0.8), \
         mosaic: Bayer(pattern: Grbg, demosaic: Bilinear), noise: (body: 3, dsnu: 2, prnu: 0.01))",
    ] {
        let sensor = sensor(page);
        let take = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let film = Linear { pixels: &pixels, width, left: 13, top: 5 };
            pool.install(|| sensor.expose(film, &camera, Spectrum::ONE, &Stream::of(3, 0, Purpose::Sensor, 0)))
        };
        let one = take(1);
        assert!(one.rgb.iter().any(|v| *v != one.rgb[0]));
        for threads in [2, 7] {
            assert!(take(threads) == one, "{page}: {threads} threads give a different image");
        }
    }
}
