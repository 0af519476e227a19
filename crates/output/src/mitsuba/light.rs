//! Lights: the sun as a distant disc, sky and environment as one image of the whole sphere, lamps as area emitters.
//!
//! Lamps and the sun's disc let rays through (`null`), because in this renderer they are not geometry and cast no
//! shadow.

use super::files::{Band, Files, SCALE, matrix};
use super::xml::Element;

use furrow_base::Result;
use furrow_base::math::{Frame, Spectrum, ToFloat, ToInt, Vec3, direction, vec3};
use furrow_optics::light::{Form, Light, Outline};
use std::f32::consts::{PI, TAU};

/// Distance of the sun's disc, metres. At 1 m from the origin, a shadow's direction is off by 10⁻⁴ rad, a hundredth of
/// the disc.
const SUN_M: f32 = 1e4;
/// Width of the sun's image in texels.
const SUN_SIDE: u32 = 128;
/// Size of the sky's image. Its rows are at multiples of π / (rows − 1), so an even number of rows splits at the
/// horizon.
const SKY: (u32, u32) = (2048, 1024);

/// Lights of a scene, with their images written.
pub(super) struct Lights {
    /// Each sun: its frame, half the side of its square, and the image's stem.
    suns: Vec<(Frame, f32, String)>,
    sky: Option<Dome>,
    lamps: Vec<Lamp>,
}

/// Flat light that emits along z of its frame.
struct Lamp {
    outline: Outline,
    centre: Vec3,
    frame: Frame,
    radiance: Spectrum,
}

enum Dome {
    Constant(Spectrum),
    Texture(String),
}

impl Lights {
    /// Writes the images of the lights.
    pub(super) fn write(lights: &[Light], files: &mut Files<'_>) -> Result<Self> {
        let mut of = Self { suns: Vec::new(), sky: None, lamps: Vec::new() };
        let mut around: Vec<&Light> = Vec::new();
        for light in lights {
            match light.form() {
                Form::Distant { towards, normal_irradiance } => {
                    let stem = format!("textures/sun-{}", of.suns.len());
                    let (half, stem) = sun_picture(light, towards, normal_irradiance, &stem, files)?;
                    of.suns.push((Frame::about(-towards), half, stem));
                }
                Form::Area { outline, centre, frame, radiance, .. } => {
                    of.lamps.push(Lamp { outline, centre, frame, radiance });
                }
                Form::Dome { .. } => around.push(light),
                Form::Unsupported => {}
            }
        }
        let radiance = |d: Vec3| around.iter().fold(Spectrum::ZERO, |sum, l| sum + l.le(d));
        of.sky = if around.is_empty() {
            None
        } else if around.iter().all(|l| l.form() == Form::Dome { uniform: true }) {
            Some(Dome::Constant(radiance(Vec3::Z)))
        } else {
            let (w, h) = SKY;
            let at = |i: u32| {
                let (column, row) = (i % w, i / w);
                let zenith = PI * row.to_f32() / (h - 1).to_f32();
                radiance(direction(zenith, TAU * (column.to_f32() + 0.5) / w.to_f32()))
            };
            let pixels: Vec<Spectrum> = (0..w * h).map(at).collect();
            Some(Dome::Texture(files.spectra("textures/sky", (w, h), &pixels)?))
        };
        Ok(of)
    }

    /// Returns `true` if the scene has lamps, which must be hidden from the camera.
    pub(super) fn has_lamps(&self) -> bool {
        !self.lamps.is_empty()
    }

    /// Returns `true` if the scene has a light at infinity other than the sun.
    pub(super) fn has_sky(&self) -> bool {
        self.sky.is_some()
    }

    /// Returns the XML elements.
    pub(super) fn elements(&self, band: Band) -> Vec<Element> {
        let mut all = Vec::new();
        for (frame, half, stem) in &self.suns {
            let path = band.path(stem);
            let radiance = Element::plugin("texture", "bitmap")
                .with("name", "radiance")
                .string("filename", path)
                .string("filter_type", "nearest")
                .boolean("raw", true);
            let emitter = Element::plugin("emitter", "area").float("sampling_weight", "$sun_weight").inside([radiance]);
            all.push(area("rectangle", frame, [*half; 2], -frame.z * SUN_M, emitter));
        }
        match &self.sky {
            Some(Dome::Constant(radiance)) => {
                all.push(Element::plugin("emitter", "constant").inside([band.rgb("radiance", *radiance)]));
            }
            // Mitsuba's sphere has y upwards and starts at −z; it is rotated so that its columns are azimuths from
            // north through east.
            Some(Dome::Texture(stem)) => all.push(
                Element::plugin("emitter", "envmap")
                    .string("filename", band.path(stem))
                    .inside([matrix([Vec3::X, Vec3::Z, Vec3::NEG_Y], Vec3::ZERO)]),
            ),
            None => {}
        }
        for lamp in &self.lamps {
            let (shape, half) = match lamp.outline {
                Outline::Rectangle(half) => ("rectangle", half.to_array()),
                Outline::Disc(radius) => ("disk", [radius; 2]),
            };
            let emitter = Element::plugin("emitter", "area").inside([band.rgb("radiance", lamp.radiance)]);
            all.push(area(shape, &lamp.frame, half, lamp.centre, emitter));
        }
        all
    }
}

/// Returns a flat light with the half sizes `half` along its frame's x and y that emits along z.
fn area(shape: &str, frame: &Frame, half: [f32; 2], centre: Vec3, emitter: Element) -> Element {
    let columns = [frame.x * half[0] * SCALE, frame.y * half[1] * SCALE, frame.z];
    Element::plugin("shape", shape).inside([matrix(columns, centre * SCALE), Element::plugin("bsdf", "null"), emitter])
}

/// Writes the image of the square around the sun's disc, normalised to give exactly the sun's irradiance. Returns half
/// the square's side, metres, and the stem of the image.
fn sun_picture(
    light: &Light,
    towards: Vec3,
    normal_irradiance: Spectrum,
    stem: &str,
    files: &mut Files<'_>,
) -> Result<(f32, String)> {
    const SUB: u32 = 4;
    let half = SUN_M * furrow_optics::light::HALF_ANGLE_DEG.to_radians().tan();
    let frame = Frame::about(-towards);
    let n = SUN_SIDE * SUB;
    let place = |i: u32| half * (2.0 * (i.to_f32() + 0.5) / n.to_f32() - 1.0);
    let mut pixels = vec![Spectrum::ZERO; (SUN_SIDE * SUN_SIDE).to_usize()];
    for y in 0..n {
        for x in 0..n {
            let to = frame.to_world(vec3(place(x), place(y), -SUN_M));
            pixels[(y / SUB * SUN_SIDE + x / SUB).to_usize()] += light.le(to.normalize()) / (SUB * SUB).to_f32();
        }
    }
    let solid_angle = (2.0 * half / SUN_M).powi(2) / pixels.len().to_f32();
    let sum = pixels.iter().fold([0.0_f64; 4], |sum, p| {
        let p = p.to_array();
        std::array::from_fn(|i| sum[i] + f64::from(p[i]) * f64::from(solid_angle))
    });
    let wanted = normal_irradiance.to_array();
    let scale =
        Spectrum::from(std::array::from_fn(
            |i| {
                if sum[i] > 0.0 { (f64::from(wanted[i]) / sum[i]).to_f32() } else { 0.0 }
            },
        ));
    for pixel in &mut pixels {
        *pixel *= scale;
    }
    Ok((half, files.spectra(stem, (SUN_SIDE, SUN_SIDE), &pixels)?))
}
