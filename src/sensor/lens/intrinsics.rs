//! Focal length, centre and aperture of a camera, as a scene file writes them.

use crate::ron_file::{Finite, Positive, Vary};
use crate::sampling::rng::Stream;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// Intrinsics, as they are written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum IntrinsicsDesc {
    /// OpenCV's matrix, pixels; with pixel centres at +0.5. A calibration that puts the first pixel's centre at 0 needs 0.5 added
    /// to cx and cy.
    Pixels {
        /// Focal length along x.
        #[schemars(extend("x-example" = "500"))]
        fx: Vary<Positive>,
        /// Focal length along y.
        #[schemars(extend("x-example" = "500"))]
        fy: Vary<Positive>,
        /// Optical axis, from the left edge.
        #[schemars(extend("x-example" = "320"))]
        cx: Vary<Finite>,
        /// Optical axis, from the top edge.
        #[schemars(extend("x-example" = "240"))]
        cy: Vary<Finite>,
    },
    /// From the lens and the sensor; the axis in the image's middle.
    Millimetres {
        /// Focal length.
        #[schemars(extend("x-example" = "8"))]
        focal_mm: Vary<Positive>,
        /// Side of a square pixel, micrometres.
        #[schemars(extend("x-example" = "3.75"))]
        pixel_um: Vary<Positive>,
    },
    /// From the angle of view between the left and right edges; square pixels, the axis in the image's middle.
    FieldOfView {
        /// Degrees, below 180.
        #[schemars(extend("x-example" = "60"))]
        horizontal_deg: Vary<Positive>,
    },
}

impl IntrinsicsDesc {
    /// Draws focal lengths and centre, pixels, and the focal length in millimetres where the scene file has it.
    pub(super) fn draw(&self, size: (u32, u32), stream: &mut Stream) -> Result<([f64; 2], [f64; 2], Option<f64>)> {
        let middle = middle(size);
        Ok(match self {
            Self::Pixels { fx, fy, cx, cy } => {
                ([fx.draw(stream), fy.draw(stream)], [cx.draw(stream), cy.draw(stream)], None)
            }
            Self::Millimetres { focal_mm, pixel_um } => {
                let focal = focal_mm.draw(stream);
                ([focal * 1e3 / pixel_um.draw(stream); 2], middle, Some(focal))
            }
            Self::FieldOfView { horizontal_deg } => {
                let angle = horizontal_deg.draw(stream);
                if angle >= 180.0 {
                    return Err(Error::input(format!(
                        "horizontal_deg {angle} is out of range: a pinhole sees less than 180 degrees"
                    ))
                    .help("write an angle of view such as 60"));
                }
                ([middle[0] / (angle / 2.0).to_radians().tan(); 2], middle, None)
            }
        })
    }
}

/// The middle of an image of so many pixels.
pub(super) fn middle((width, height): (u32, u32)) -> [f64; 2] {
    [f64::from(width) / 2.0, f64::from(height) / 2.0]
}
