//! Camera model: the ray of a pixel, the pixel of a point, and the blur of the optics.
//!
//! | file | contents |
//! |---|---|
//! | `desc` | camera description in a scene file |
//! | `intrinsics`, `distortion`, `aperture`, `pose`, `motion` | its parts: descriptions and sampled values |
//! | `model`, `opencv`, `fisheye` | models of the lens |
//! | `calibration`, `file_storage` | calibration files of OpenCV |
//! | `camera` | rays and projections of a camera with a pose |
//! | `driving`, `bounds` | the same for a moving camera; bounds of projected triangles |
//! | `psf` | the point spread of the optics |
//! | `record` | record of a sampled camera |

mod aperture;
mod bare;
mod bounds;
mod calibration;
mod camera;
mod desc;
mod distortion;
mod driving;
mod file_storage;
mod fisheye;
mod intrinsics;
mod model;
mod motion;
mod opencv;
mod pose;
mod psf;
mod record;
#[cfg(test)]
mod tests;

pub use aperture::{Aperture, ApertureDesc};
pub use bounds::PixelBox;
pub use calibration::Calibration;
pub use camera::Camera;
pub use desc::{CameraDesc, CameraModel};
pub use distortion::{Distortion, DistortionDesc};
pub use fisheye::Fisheye;
pub use intrinsics::IntrinsicsDesc;
pub use model::Lens;
pub use motion::{Motion, MotionDesc};
pub use opencv::OpenCv;
pub use pose::{Pose, PoseDesc};
pub(super) use psf::PsfWritten;
pub use psf::{Psf, PsfDesc};
pub use record::{ApertureRecord, CameraRecord, LensRecord, MotionRecord};
