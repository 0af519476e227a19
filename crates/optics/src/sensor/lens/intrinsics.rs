//! Focal length and principal point of a camera, as written in a scene file.

use super::calibration::Calibration;
use super::model::Lens;
use furrow_base::ron_file::{Positive, Signed, Vary};
use furrow_base::sampling::rng::Stream;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};

/// Intrinsics in a scene file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum IntrinsicsDesc {
    /// OpenCV's camera matrix in pixels, with pixel centres at +0.5. For a calibration that puts the first pixel's
    /// centre at 0, add 0.5 to cx and cy.
    Pixels {
        /// Focal length along x.
        #[schemars(extend("x-example" = "500"))]
        fx: Vary<Positive<1_000_000>>,
        /// Focal length along y.
        #[schemars(extend("x-example" = "500"))]
        fy: Vary<Positive<1_000_000>>,
        /// Principal point: distance from the left edge, pixels.
        #[schemars(extend("x-example" = "320"))]
        cx: Vary<Signed<1_000_000>>,
        /// Principal point: distance from the top edge, pixels.
        #[schemars(extend("x-example" = "240"))]
        cy: Vary<Signed<1_000_000>>,
    },
    /// Derived from the lens and the sensor, with the optical axis in the image's middle.
    Millimetres {
        /// Focal length.
        #[schemars(extend("x-example" = "8"))]
        focal_mm: Vary<Positive<10_000>>,
        /// Side of a square pixel, micrometres.
        #[schemars(extend("x-example" = "3.75"))]
        pixel_um: Vary<Positive<1000>>,
    },
    /// Derived from the angle of view between the left and right edges, with square pixels and the optical axis in the
    /// image's middle.
    FieldOfView {
        /// Angle of view, degrees, below 180.
        #[schemars(extend("x-example" = "60"))]
        horizontal_deg: Vary<Positive<180>>,
    },
    /// Intrinsics and lens from a calibration file that OpenCV has written (`cv2.FileStorage`, YAML or XML):
    /// `camera_matrix` and `distortion_coefficients`. Pixel centres are converted; images of another size than the
    /// file's are scaled.
    Calibration {
        /// File, relative to the scene file.
        #[schemars(extend("x-example" = "\"camera.yaml\""))]
        file: String,
        /// Whether the coefficients are those of `cv2.fisheye`, if the file does not say so by `fisheye_model`.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        fisheye: bool,
    },
}

/// Sampled intrinsics.
pub(super) struct Intrinsics {
    /// Focal lengths, pixels.
    pub(super) focal: [f64; 2],
    /// Optical axis, pixels.
    pub(super) centre: [f64; 2],
    /// Focal length in millimetres, if the scene file gives it.
    pub(super) focal_mm: Option<f64>,
    /// Lens of a calibration file.
    pub(super) lens: Option<Lens>,
}

impl Intrinsics {
    fn new(focal: [f64; 2], centre: [f64; 2]) -> Self {
        Self { focal, centre, focal_mm: None, lens: None }
    }
}

impl IntrinsicsDesc {
    /// Samples the intrinsics of images of `size` pixels. `open` reads a calibration file.
    pub(super) fn draw(
        &self,
        size: (u32, u32),
        stream: &mut Stream,
        open: &mut dyn FnMut(&str) -> Result<Calibration>,
    ) -> Result<Intrinsics> {
        let middle = middle(size);
        Ok(match self {
            Self::Pixels { fx, fy, cx, cy } => {
                Intrinsics::new([fx.draw(stream), fy.draw(stream)], [cx.draw(stream), cy.draw(stream)])
            }
            Self::Millimetres { focal_mm, pixel_um } => {
                let focal = focal_mm.draw(stream);
                let pixels = focal * 1e3 / pixel_um.draw(stream);
                Intrinsics { focal_mm: Some(focal), ..Intrinsics::new([pixels; 2], middle) }
            }
            Self::FieldOfView { horizontal_deg } => {
                let angle = horizontal_deg.draw(stream);
                if angle >= 180.0 {
                    return Err(Error::input(format!(
                        "horizontal_deg {angle} is out of range: a pinhole sees less than 180 degrees"
                    ))
                    .help("write an angle of view such as 60"));
                }
                Intrinsics::new([middle[0] / (angle / 2.0).to_radians().tan(); 2], middle)
            }
            Self::Calibration { file, fisheye } => {
                let (focal, centre, lens) = open(file)?.lens(size, *fisheye)?;
                Intrinsics { lens: Some(lens), ..Intrinsics::new(focal, centre) }
            }
        })
    }
}

/// Returns the middle of an image of `width` × `height` pixels.
pub(super) fn middle((width, height): (u32, u32)) -> [f64; 2] {
    [f64::from(width) / 2.0, f64::from(height) / 2.0]
}
