//! The library: loaded once, with a device for each image that is under way, kept for the run.
//!
//! A device does one thing at a time, so images at once have one each, with as many threads as they have themselves.

use super::oidn::{Device, Oidn};
use super::picture::{Picture, Rgb};
use crate::Result;
use crate::accel::prepare_thread;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The library, loaded. Clones share its devices.
#[derive(Clone, Debug)]
pub(super) struct Library {
    oidn: Oidn,
    /// Devices that nobody uses now, with their number of threads.
    idle: Arc<Mutex<Vec<(usize, Device)>>>,
}

impl Library {
    /// Loads it from a folder, or from where the system's loader finds it, and makes a device as a trial; else says why not.
    pub(super) fn load(folder: Option<&Path>) -> Result<Self, String> {
        let oidn = Oidn::load(folder)?;
        device(&oidn, 1).map_err(|e| e.to_string())?;
        Ok(Self { oidn, idle: Arc::default() })
    }

    /// The picture without its noise, on `threads` threads (0: all).
    pub(super) fn denoise(&self, picture: &Picture<'_>, threads: usize) -> Result<Vec<Rgb>> {
        let idle = {
            let mut idle = self.idle();
            idle.iter().position(|(of, _)| *of == threads).map(|place| idle.swap_remove(place).1)
        };
        let mut device = idle.map_or_else(|| device(&self.oidn, threads), Ok)?;
        // One that has failed is not used again.
        let clean = device.denoise(picture)?;
        self.idle().push((threads, device));
        Ok(clean)
    }

    fn idle(&self) -> MutexGuard<'_, Vec<(usize, Device)>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A new device. Its threads begin with this one's floating-point settings, so these are always the same: denormals are flushed, as the
/// documentation advises and the program does.
fn device(oidn: &Oidn, threads: usize) -> Result<Device> {
    prepare_thread();
    oidn.device(threads)
}
