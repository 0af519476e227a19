//! Thin lens: its description and its sampled values.

use furrow_base::math::ToFloat;
use furrow_base::ron_file::{Positive, Vary};
use furrow_base::sampling::rng::Stream;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};

/// Thin lens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ApertureDesc {
    /// Focal length divided by the pupil's diameter.
    #[schemars(extend("x-example" = "4"))]
    pub f_number: Vary<Positive<1000>>,
    /// Distance of the plane in focus.
    #[schemars(extend("x-example" = "0.85"))]
    pub focus_m: Vary<Positive<1_000_000>>,
}

impl ApertureDesc {
    /// Samples the aperture of a lens with the given focal length.
    pub(super) fn draw(&self, focal_mm: Option<f64>, stream: &mut Stream) -> Result<Aperture> {
        let Some(focal) = focal_mm else {
            return Err(Error::input("an f_number needs a focal length in millimetres").help(
                "write intrinsics: Millimetres(focal_mm: …, \
                 pixel_um: …)",
            ));
        };
        let f_number = self.f_number.draw(stream);
        Ok(Aperture::new(focal, f_number, self.focus_m.draw32(stream)))
    }
}

/// Thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aperture {
    /// Radius of the pupil, metres.
    pub radius: f32,
    /// Distance of the plane in focus along the optical axis, metres.
    pub focus: f32,
    /// Focal length divided by the pupil's diameter.
    pub f_number: f32,
}

impl Aperture {
    /// Creates the aperture of a lens of `focal_mm` that is focused at `focus` metres.
    pub(super) fn new(focal_mm: f64, f_number: f64, focus: f32) -> Self {
        Self { radius: (focal_mm * 1e-3 / (2.0 * f_number)).to_f32(), focus, f_number: f_number.to_f32() }
    }
}
