//! The lens and where it stands: which ray belongs to a pixel, which pixel to a point, and what the optics blur.
//!
//! | file | idea |
//! |---|---|
//! | `desc` | a camera as a scene file writes it |
//! | `intrinsics`, `distortion`, `aperture`, `pose`, `motion` | its parts, as they are written and as they are drawn |
//! | `camera` | rays and projections of a camera at its place |
//! | `driving`, `bounds` | the same while it moves; where triangles lie in its image |
//! | `psf` | the point spread of the optics |
//! | `record` | a camera as it was drawn |

mod aperture;
mod bare;
mod bounds;
mod camera;
mod desc;
mod distortion;
mod driving;
mod intrinsics;
mod motion;
mod pose;
mod psf;
mod record;
#[cfg(test)]
mod tests;

pub use aperture::{Aperture, ApertureDesc};
pub use bounds::PixelBox;
pub use camera::Camera;
pub use desc::{CameraDesc, CameraModel};
pub use distortion::{Distortion, DistortionDesc};
pub use intrinsics::IntrinsicsDesc;
pub use motion::{Motion, MotionDesc};
pub use pose::{Pose, PoseDesc};
pub(super) use psf::PsfWritten;
pub use psf::{Psf, PsfDesc};
pub use record::{ApertureRecord, CameraRecord, MotionRecord};
