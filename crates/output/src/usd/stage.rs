//! Camera and lights.
//!
//! Intensities are in nits for a flat spectrum, those of the sun in lux on a plane that faces it; USD defines an
//! intensity of 1 as 1 nit. The camera's exposure gives a white horizontal surface in the open a value of 1.

use super::text::{Names, Text, matrix, number, quoted, tuple};
use crate::exr;
use crate::gltf::{LUMENS, NEAR, lens};
use furrow_base::Result;
use furrow_base::math::{DMat4, Frame, Spectrum, ToFloat, Vec3, direction};
use furrow_optics::light::{Form, HALF_ANGLE_DEG, Light, Outline};
use furrow_optics::sensor::Camera;
use furrow_render::scene::Scene;
use rayon::prelude::*;
use std::f32::consts::{PI, TAU};

/// Path of the image of the sky in the folder of the export.
pub(super) const SKY: &str = "textures/sky.exr";

/// Width and height of the image of the sky. An even number of rows splits at the horizon.
const SKY_SIZE: (u32, u32) = (1024, 512);

/// Number of samples per texel of the sky in each direction.
const SKY_SAMPLES: u32 = 2;

/// Far clipping distance for other programs, metres.
const FAR: f64 = 1e5;

/// Focal length of a camera whose scene file gives it in pixels only, metres. Only its ratio to the aperture matters.
const FOCAL: f64 = 0.024;

/// Focal length and aperture of USD are in tenths of the stage's unit.
const TENTHS: f64 = 10.0;

/// Writes the camera.
pub(super) fn camera(scene: &Scene, text: &mut Text) {
    let camera = &scene.camera;
    let [fx, fy, cx, cy] = camera.intrinsics();
    let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
    let focal = focal(camera) * TENTHS;
    text.open("Camera", "camera", &[]);
    text.set("float2 clippingRange", format_args!("({NEAR}, {FAR})"));
    text.set("float exposure", number(exposure(&scene.lights)));
    text.set("float focalLength", single(focal));
    if let Some(of) = camera.aperture() {
        text.set("float focusDistance", number(of.focus));
        text.set("float fStop", number(of.f_number));
    }
    text.set("float horizontalAperture", single(w * focal / fx));
    text.set("float horizontalApertureOffset", single((0.5 * w - cx) * focal / fx));
    text.set("float verticalAperture", single(h * focal / fy));
    text.set("float verticalApertureOffset", single((cy - 0.5 * h) * focal / fy));
    let (model, distortion) = lens(camera.distortion());
    text.set("custom int2 furrow:size", format_args!("({}, {})", camera.width(), camera.height()));
    text.set("custom string furrow:distortionModel", quoted(model));
    text.set("custom double[] furrow:distortion", format_args!("{distortion:?}"));
    let pose = camera.pose();
    let [x, y, z] = [pose.axes.x_axis, -pose.axes.y_axis, -pose.axes.z_axis];
    place(&Frame { x, y, z }, pose.position, text);
    text.close();
}

/// Returns the focal length of a camera, metres.
fn focal(camera: &Camera) -> f64 {
    let of_lens = camera.aperture().map(|of| 2.0 * f64::from(of.radius) * f64::from(of.f_number));
    of_lens.or(camera.focal_mm().map(|mm| 1e-3 * mm)).unwrap_or(FOCAL)
}

/// Returns the exposure, in stops, that gives a white horizontal surface under all lights the value 1.
fn exposure(lights: &[Light]) -> f32 {
    let irradiance = lights.iter().fold(Spectrum::ZERO, |sum, light| sum + light.horizontal_irradiance());
    let luminance = irradiance.0.truncate().element_sum() / 3.0 / PI * LUMENS.to_f32();
    if luminance > 0.0 { -luminance.log2() } else { 0.0 }
}

/// Writes all lights in the scope `lights`. Returns the image of the sky, which is [`SKY`], if there is one.
pub(super) fn lights(scene: &Scene, text: &mut Text) -> Result<Option<Vec<u8>>> {
    let mut names = Names::default();
    text.open("Scope", "lights", &[]);
    for light in &scene.lights {
        match light.form() {
            Form::Distant { towards, normal_irradiance } => {
                text.open("DistantLight", &names.unique("sun"), &[]);
                text.set("float inputs:angle", number(2.0 * HALF_ANGLE_DEG));
                text.set("bool inputs:normalize", 1);
                strength(normal_irradiance, "Irradiance", text);
                place(&Frame::about(towards), Vec3::ZERO, text);
                text.close();
            }
            Form::Area { outline, centre, frame, radiance, .. } => {
                let name = names.unique("lamp");
                lamp(&name, outline, text);
                strength(radiance, "Radiance", text);
                // Lights of USD emit along −z.
                place(&Frame { x: frame.x, y: -frame.y, z: -frame.z }, centre, text);
                text.close();
            }
            Form::Dome { .. } | Form::Unsupported => {}
        }
    }
    let around: Vec<&Light> = scene.lights.iter().filter(|light| matches!(light.form(), Form::Dome { .. })).collect();
    let image = if around.is_empty() { None } else { sky(&around, text)? };
    text.close();
    Ok(image)
}

/// Begins a lamp of this outline.
fn lamp(name: &str, outline: Outline, text: &mut Text) {
    match outline {
        Outline::Rectangle(half) => {
            text.open("RectLight", name, &[]);
            text.set("float inputs:width", number(2.0 * half.x));
            text.set("float inputs:height", number(2.0 * half.y));
        }
        Outline::Disc(radius) => {
            text.open("DiskLight", name, &[]);
            text.set("float inputs:radius", number(radius));
        }
    }
}

/// Writes all lights at infinity but the sun as one dome. Returns its image unless it is uniform.
fn sky(around: &[&Light], text: &mut Text) -> Result<Option<Vec<u8>>> {
    let radiance = |towards: Vec3| around.iter().fold(Spectrum::ZERO, |sum, light| sum + light.le(towards));
    text.open("DomeLight", "sky", &[]);
    let uniform = around.iter().all(|light| light.form() == Form::Dome { uniform: true });
    let image = if uniform {
        strength(radiance(Vec3::Z), "Radiance", text);
        None
    } else {
        text.set("float inputs:intensity", LUMENS);
        text.set("asset inputs:texture:file", format_args!("@./{SKY}@"));
        text.set("token inputs:texture:format", quoted("latlong"));
        Some(sky_image(radiance)?)
    };
    // The dome's poles are on its y axis, and its image is centred on z: up and south.
    place(&Frame { x: Vec3::X, y: Vec3::Z, z: Vec3::NEG_Y }, Vec3::ZERO, text);
    text.close();
    Ok(image)
}

/// Encodes the radiance of all directions in R, G, B. Columns are azimuths from north through east, rows are zenith
/// angles.
fn sky_image(radiance: impl Fn(Vec3) -> Spectrum + Sync) -> Result<Vec<u8>> {
    let (w, h) = SKY_SIZE;
    let mean = |i: u32| {
        let samples = (0..SKY_SAMPLES * SKY_SAMPLES).map(|k| {
            let of = |texel: u32, k: u32| (texel * SKY_SAMPLES + k).to_f32() + 0.5;
            let (x, y) = (of(i % w, k % SKY_SAMPLES), of(i / w, k / SKY_SAMPLES));
            let zenith = PI * y / (h * SKY_SAMPLES).to_f32();
            radiance(direction(zenith, TAU * x / (w * SKY_SAMPLES).to_f32()))
        });
        samples.fold(Spectrum::ZERO, |sum, of| sum + of) / (SKY_SAMPLES * SKY_SAMPLES).to_f32()
    };
    let pixels: Vec<Spectrum> = (0..w * h).into_par_iter().map(mean).collect();
    let band = |k: usize| pixels.iter().map(|pixel| pixel.to_array()[k]).collect();
    exr::encode_map(w, h, &[("R", band(0)), ("G", band(1)), ("B", band(2))])
}

/// Writes colour and intensity of a light from its irradiance or radiance per band, and near infrared as an attribute.
fn strength(of: Spectrum, quantity: &str, text: &mut Text) {
    let [r, g, b, nir] = of.to_array();
    let most = r.max(g).max(b).max(f32::MIN_POSITIVE);
    text.set("color3f inputs:color", tuple(&[r / most, g / most, b / most]));
    text.set("float inputs:intensity", single(f64::from(most) * LUMENS));
    text.set(&format!("custom float furrow:nir{quantity}"), number(nir));
}

/// Writes the transform of a prim with these axes and position.
fn place(frame: &Frame, at: Vec3, text: &mut Text) {
    let [x, y, z, w] = [frame.x, frame.y, frame.z, at].map(Vec3::as_dvec3);
    let of = DMat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), w.extend(1.0));
    text.set("matrix4d xformOp:transform", matrix(&of));
    text.set("uniform token[] xformOpOrder", "[\"xformOp:transform\"]");
}

/// Returns a number in single precision.
fn single(value: f64) -> String {
    number(value.to_f32())
}
