//! A moving camera, path-traced: motion blur and rolling shutter, with labels that follow the rolling shutter but are
//! not blurred.
//!
//! Rationale: a robot records images while it drives; objects that shift in the image must shift in the labels too.
//! Expected: an edge on the ground becomes a ramp of width speed × exposure × pixels per metre; with a rolling shutter
//! it shifts by speed × readout time × pixels per metre over the height of the image, in the image and the labels
//! alike; any number of threads gives the same bits. Source: geometry.

use crate::common::program::scratch;
use crate::common::scenes::{camera, scene, shoot, square, with_world};
use furrow_base::geometry::Window;
use furrow_base::math::{Spectrum, Vec3, vec3};
use furrow_base::sampling::Points;
use furrow_field::assemble::{self, Options};
use furrow_optics::bsdf::{Bsdf, OrenNayar};
use furrow_optics::sensor::Motion;
use furrow_render::accel::EmbreeAccel;
use furrow_render::film::Film;
use furrow_render::integrator::PathTracer;
use furrow_render::render::label::NONE;
use furrow_render::render::{self, Settings, label};
use furrow_render::scene::Scene;

const SIZE: (u32, u32) = (64, 48);

/// Builds a scene whose ground ends at x = 0, in the middle of the image; returns it with the number of pixels per
/// metre there.
fn edge(motion: Motion) -> (Scene, f64) {
    let eye = camera(SIZE, vec3(0.0, 0.0, 1.0), Vec3::ZERO, 60.0).with_motion(motion);
    let ground = (square(vec3(-4.0, 0.0, 0.0), 8.0), Bsdf::OrenNayar(OrenNayar::new(Spectrum::splat(0.5), 0.0)));
    (scene(vec![ground], Vec::new(), eye), eye.intrinsics()[0])
}

/// Fraction of the samples of each pixel that hit the ground, row by row.
fn shares(film: &Film) -> Vec<Vec<f64>> {
    let share =
        |p: &furrow_render::film::Pixel| p.tally.iter().map(|(_, n)| f64::from(n)).sum::<f64>() / f64::from(p.samples);
    film.pixels.chunks(SIZE.0 as usize).map(|row| row.iter().map(share).collect()).collect()
}

#[test]
fn a_moving_edge_is_as_wide_as_the_way_driven() {
    let pixels_a_metre = edge(Motion::default()).1;
    let motion =
        Motion { velocity: vec3(0.5, 0.2, 0.0), exposure: (16.0 / (0.5 * pixels_a_metre)) as f32, ..Motion::default() };
    let (scene, _) = edge(motion);
    for row in shares(&shoot(&scene, &PathTracer::default(), 256, 1)) {
        for (x, share) in row.iter().enumerate() {
            // The ramp extends from 8 pixels before the edge's position at mid-exposure to 8 pixels after it.
            let expected = ((40.0 - (x as f64 + 0.5)) / 16.0).clamp(0.0, 1.0);
            assert!((share - expected).abs() < 0.03, "pixel {x}: {share} for {expected}");
        }
    }
}

#[test]
fn a_rolling_shutter_leans_light_and_labels_alike() {
    let pixels_a_metre = edge(Motion::default()).1;
    let lean = 20.0;
    let motion = Motion {
        velocity: vec3(1.0, 0.0, 0.0),
        exposure: 0.0,
        readout: (lean / pixels_a_metre) as f32,
        ..Motion::default()
    };
    let (scene, _) = edge(motion);
    let film = shoot(&scene, &PathTracer::default(), 64, 1);
    let geometry = EmbreeAccel::build(&scene.surfaces(), 1).expect("an accelerator");
    let labels = label(&geometry, &scene.parts, &scene.camera, Window::full(SIZE.0, SIZE.1));
    for (y, (row, labels)) in shares(&film).iter().zip(labels.parts.chunks(SIZE.0 as usize)).enumerate() {
        let expected = 32.0 - lean * ((y as f64 + 0.5) / f64::from(SIZE.1) - 0.5);
        let seen = row.iter().sum::<f64>();
        assert!((seen - expected).abs() < 0.06, "row {y}: {seen} for {expected}");
        let labelled = labels.iter().filter(|part| **part != NONE).count() as f64;
        assert!((labelled - expected).abs() < 0.502, "row {y}: {labelled} for {expected}");
    }
}

#[test]
fn a_driving_camera_gives_the_same_bits_on_any_number_of_threads() {
    let (scene, _) = edge(Motion { velocity: vec3(0.4, -0.7, 0.0), exposure: 0.1, readout: 0.2, ..Motion::default() });
    let film = |threads| {
        with_world(&scene, threads, |world, watch| {
            let window = Window::full(SIZE.0, SIZE.1);
            let settings = Settings { spp: 8, seed: 5, window, points: Points::Sobol };
            render::render(world, &PathTracer::default(), &settings, watch).expect("a film")
        })
    };
    assert_eq!(film(1), film(3));
}

/// A calibration of `cv2.fisheye`, as `cv2.FileStorage` writes it.
const CALIBRATION: &str = "%YAML 1.2
---
image_width: 640
image_height: 480
fisheye_model: 1
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 500., 0., 322.5, 0., 510., 238.25, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 4
   cols: 1
   dt: d
   data: [ -0.031, 0.012,
       -0.0045, 0.00069999999999999999 ]
";

/// Expected: a scene that names a calibration has its camera: a point of the ground is at the pixel that
/// `cv2.fisheye.projectPoints` gives, for images of half the size; the ray of that pixel meets the point; the record
/// holds the model, and the scene's hash the file. A bad file is an error with both places.
#[test]
fn a_calibration_file_gives_the_camera_of_its_scene() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let field = |calibration: &str, more: &str| {
        std::fs::write(folder.join("camera.yaml"), calibration).unwrap();
        let camera =
            format!("size: (320, 240), intrinsics: Calibration(file: \"camera.yaml\"{more}), pose: Nadir(height_m: 1)");
        let page = folder.join("page.ron");
        std::fs::write(&page, format!("Field(camera: Pinhole({camera}), lights: [Overcast()])")).unwrap();
        assemble::field(&page, &Options::default())
    };
    let good = field(CALIBRATION, "").unwrap();
    let (camera, ground) = (good.scene.camera, vec3(0.3, 0.2, 0.0));
    let px = camera.project(ground).unwrap();
    // (465.953482, 140.701632) of 640 × 480 pixels, with centres at 0.
    assert!((px.x - 233.226_74).abs() < 1e-3 && (px.y - 70.600_82).abs() < 1e-3, "{px}");
    let (origin, direction) = camera.ray(px, [0.5; 2]);
    assert!((origin + direction * (origin.z / -direction.z) - ground).length() < 1e-5);
    let record = serde_json::to_value(&good.conditions.camera).unwrap();
    assert_eq!(record["lens"], serde_json::json!({ "model": "fisheye", "k": [-0.031, 0.012, -0.0045, 0.0007] }));
    assert_eq!(good.files.len(), 2);

    let error = field(&CALIBRATION.replace("-0.031, ", ""), "").err().unwrap().to_string();
    for part in ["page.ron:1", "camera.yaml", "line 11: distortion_coefficients has 3 numbers, not 4 × 1", "help: "] {
        assert!(error.contains(part), "{part}: {error}");
    }
    let twice = field(CALIBRATION, "), distortion: (k1: 0.1").err().unwrap().to_string();
    assert!(twice.contains("the calibration file has a distortion"), "{twice}");
}
