//! The denoising library: loaded once, with one device for each image in progress, reused during the run.
//!
//! A device processes one image at a time, so concurrent images have separate devices, each with the number of threads
//! of its image.

use super::noisy_image::{NoisyImage, Rgb};
use super::oidn::{Device, Oidn};
use furrow_base::Result;
use furrow_render::accel::prepare_thread;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The loaded library. Clones share its devices.
#[derive(Clone, Debug)]
pub(super) struct Library {
    oidn: Oidn,
    /// Idle devices, with their number of threads.
    idle: Arc<Mutex<Vec<(usize, Device)>>>,
}

impl Library {
    /// Loads the library from a folder, or by the system loader, and tests it by creating a device. The error is the
    /// reason of the failure.
    pub(super) fn load(folder: Option<&Path>) -> Result<Self, String> {
        let oidn = Oidn::load(folder)?;
        device(&oidn, 1).map_err(|e| e.to_string())?;
        Ok(Self { oidn, idle: Arc::default() })
    }

    /// Denoises an image on `threads` threads (0: all).
    pub(super) fn denoise(&self, picture: &NoisyImage<'_>, threads: usize) -> Result<Vec<Rgb>> {
        let idle = {
            let mut idle = self.idle();
            idle.iter().position(|(of, _)| *of == threads).map(|place| idle.swap_remove(place).1)
        };
        let mut device = idle.map_or_else(|| device(&self.oidn, threads), Ok)?;
        // A device that failed is not reused.
        let clean = device.denoise(picture)?;
        self.idle().push((threads, device));
        Ok(clean)
    }

    fn idle(&self) -> MutexGuard<'_, Vec<(usize, Device)>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Creates a device. Its threads inherit the floating-point settings of this thread, so they are set here to be always
/// the same: denormals are flushed to zero, as the documentation recommends and `oidnDenoise` does.
fn device(oidn: &Oidn, threads: usize) -> Result<Device> {
    prepare_thread();
    oidn.device(threads)
}
