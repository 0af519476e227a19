//! Devices of Open Image Denoise and their errors.

use super::super::noisy_image::{Kind, NoisyImage, Rgb};
use super::sys::{self, Functions};
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use std::ffi::{CStr, c_char, c_int};
use std::path::Path;
use std::ptr::{null, null_mut};
use std::sync::Arc;

/// The loaded library.
#[derive(Clone, Debug)]
pub(in crate::denoise) struct Oidn(Arc<Functions>);

impl Oidn {
    /// Loads the library from a folder, or by the system loader. The error is the loader's message.
    pub(in crate::denoise) fn load(folder: Option<&Path>) -> Result<Self, String> {
        sys::load(folder).map(|functions| Self(Arc::new(functions))).map_err(|e| e.to_string())
    }

    /// Creates a CPU device with this many threads (0: all). Its threads inherit the floating-point settings of this
    /// thread.
    pub(in crate::denoise) fn device(&self, threads: usize) -> Result<Device> {
        let oidn = self.0.clone();
        // SAFETY: the constant is the header's.
        let handle = unsafe { (oidn.oidnNewDevice)(sys::OIDN_DEVICE_TYPE_CPU) };
        if handle.is_null() {
            return Err(failure(&oidn, null_mut()).unwrap_or_else(|| failed("no device supports this processor")));
        }
        let device = Device { handle, oidn };
        // SAFETY: the device is alive, the texts are null-terminated, and both are parameters of a device of this type.
        unsafe {
            (device.oidn.oidnSetDeviceBool)(handle, c"setAffinity".as_ptr(), false);
            if threads > 0 {
                let threads = c_int::try_from(threads).unwrap_or(c_int::MAX);
                (device.oidn.oidnSetDeviceInt)(handle, c"numThreads".as_ptr(), threads);
            }
            (device.oidn.oidnCommitDevice)(handle);
        }
        device.check()?;
        Ok(device)
    }
}

/// Device with its threads, networks and last error.
#[derive(Debug)]
pub(in crate::denoise) struct Device {
    handle: *mut sys::OIDNDevice,
    oidn: Arc<Functions>,
}

// SAFETY: Open Image Denoise's objects may be used from any thread.
unsafe impl Send for Device {}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the pointer is `oidnNewDevice`'s, and this is its only release; filters borrow the device, so none is alive.
        unsafe { (self.oidn.oidnReleaseDevice)(self.handle) }
    }
}

impl Device {
    /// Denoises an image.
    ///
    /// # Panics
    /// Panics if the picture's images do not have its size.
    pub(in crate::denoise) fn denoise(&mut self, picture: &NoisyImage<'_>) -> Result<Vec<Rgb>> {
        let mut clean: Vec<Rgb> = vec![[0.0; 3]; picture.pixels()];
        let filter = Filter::new(self)?;
        for (name, pixels) in images(picture) {
            // SAFETY: the image has the picture's pixels, outlives the filter, and is an input, so it is not written
            // to.
            unsafe { filter.image(name, pixels.as_ptr().cast_mut(), picture.size) };
        }
        // SAFETY: the image has the picture's pixels, outlives the filter, and nothing else accesses it until the
        // filter is done.
        unsafe { filter.image(c"output", clean.as_mut_ptr(), picture.size) };
        filter.run(matches!(picture.kind, Kind::Radiance { .. }));
        drop(filter);
        self.check()?;
        Ok(clean)
    }

    /// Returns the first error of this thread's calls since the last check.
    fn check(&self) -> Result<()> {
        failure(&self.oidn, self.handle).map_or(Ok(()), Err)
    }
}

/// Returns the input images of a filter with their names in the library.
fn images<'a>(picture: &NoisyImage<'a>) -> Vec<(&'static CStr, &'a [Rgb])> {
    match picture.kind {
        Kind::Albedo => vec![(c"albedo", picture.noisy)],
        Kind::Normal => vec![(c"normal", picture.noisy)],
        Kind::Radiance { albedo, normal } => {
            vec![(c"color", picture.noisy), (c"albedo", albedo), (c"normal", normal)]
        }
    }
}

/// Filter for one picture. Creating one per picture costs no time, because the device keeps the networks.
struct Filter<'a> {
    handle: *mut sys::OIDNFilter,
    device: &'a Device,
}

impl Drop for Filter<'_> {
    fn drop(&mut self) {
        // SAFETY: the pointer is `oidnNewFilter`'s, and this is its only release.
        unsafe { (self.device.oidn.oidnReleaseFilter)(self.handle) }
    }
}

impl<'a> Filter<'a> {
    fn new(device: &'a Device) -> Result<Self> {
        // SAFETY: the device is alive and committed; the text is null-terminated.
        let handle = unsafe { (device.oidn.oidnNewFilter)(device.handle, c"RT".as_ptr()) };
        if handle.is_null() {
            device.check()?;
            return Err(failed("the filter RT is missing"));
        }
        Ok(Self { handle, device })
    }

    /// Sets an image of three floats per pixel, row by row without gaps.
    ///
    /// # Safety
    /// The pointer must be valid for that many pixels, for writing if it is the output, until the filter has run.
    unsafe fn image(&self, name: &CStr, pixels: *mut Rgb, [width, height]: [u32; 2]) {
        let (width, height) = (width.to_usize(), height.to_usize());
        // SAFETY: the filter is alive, the text is null-terminated, and the caller guarantees the pointer. Strides of 0
        // mean no gaps.
        unsafe {
            (self.device.oidn.oidnSetSharedFilterImage)(
                self.handle,
                name.as_ptr(),
                pixels.cast(),
                sys::OIDN_FORMAT_FLOAT3,
                width,
                height,
                0,
                0,
                0,
            );
        }
    }

    /// Runs the filter and waits for it. For `radiance`, values are unbounded and the guides are noise-free.
    fn run(&self, radiance: bool) {
        let oidn = &self.device.oidn;
        // SAFETY: the filter is alive, the callers of [`Self::image`] guarantee the images, the texts are
        // null-terminated, and the constants are those of the header. Without the two settings the filter assumes noisy
        // guides and values up to 1, which is correct for prefiltering guides.
        unsafe {
            if radiance {
                (oidn.oidnSetFilterBool)(self.handle, c"hdr".as_ptr(), true);
                (oidn.oidnSetFilterBool)(self.handle, c"cleanAux".as_ptr(), true);
            }
            (oidn.oidnSetFilterInt)(self.handle, c"quality".as_ptr(), sys::OIDN_QUALITY_HIGH);
            (oidn.oidnCommitFilter)(self.handle);
            (oidn.oidnExecuteFilter)(self.handle);
        }
    }
}

/// Returns the first error of this thread's calls since the last query: of calls to a device, or, for null, of calls
/// that create one.
fn failure(oidn: &Functions, device: *mut sys::OIDNDevice) -> Option<Error> {
    let mut words: *const c_char = null();
    // SAFETY: the device is alive or null, which the function allows; the other pointer is valid for writing.
    let code = unsafe { (oidn.oidnGetDeviceError)(device, &raw mut words) };
    if code == sys::OIDN_ERROR_NONE {
        return None;
    }
    if words.is_null() {
        return Some(failed(&format!("error {code}")));
    }
    // SAFETY: the library's text is null-terminated and stays valid until this thread queries again.
    Some(failed(&unsafe { CStr::from_ptr(words) }.to_string_lossy()))
}

fn failed(words: &str) -> Error {
    Error::failed(format!("Open Image Denoise: {words}"))
}
