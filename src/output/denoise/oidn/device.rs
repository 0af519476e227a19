//! Devices: what denoises pictures, and what its errors say.

use super::super::picture::{Kind, Picture, Rgb};
use super::sys::{self, Functions};
use crate::{Error, Result};
use std::ffi::{CStr, c_char, c_int};
use std::path::Path;
use std::ptr::{null, null_mut};
use std::sync::Arc;

/// The library, loaded.
#[derive(Clone, Debug)]
pub(in crate::output::denoise) struct Oidn(Arc<Functions>);

impl Oidn {
    /// Loads it from a folder, or from where the system's loader finds it; else the loader's words.
    pub(in crate::output::denoise) fn load(folder: Option<&Path>) -> Result<Self, String> {
        sys::load(folder).map(|functions| Self(Arc::new(functions))).map_err(|e| e.to_string())
    }

    /// A device on the processor with this many threads (0: all there are). Its threads take over this one's floating-point settings.
    pub(in crate::output::denoise) fn device(&self, threads: usize) -> Result<Device> {
        let oidn = self.0.clone();
        // SAFETY: the number is one of the header's.
        let handle = unsafe { (oidn.oidnNewDevice)(sys::OIDN_DEVICE_TYPE_CPU) };
        if handle.is_null() {
            return Err(failure(&oidn, null_mut()).unwrap_or_else(|| failed("there is no device for this processor")));
        }
        let device = Device { handle, oidn };
        // SAFETY: the device lives, the texts end in a null character, and both are parameters of a device of this type.
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

/// A device: its threads, its networks, its last error.
#[derive(Debug)]
pub(in crate::output::denoise) struct Device {
    handle: *mut sys::OIDNDevice,
    oidn: Arc<Functions>,
}

// SAFETY: Open Image Denoise's objects may be used from any thread.
unsafe impl Send for Device {}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the pointer is `oidnNewDevice`'s, and this is its only release; filters borrow the device, so none is left.
        unsafe { (self.oidn.oidnReleaseDevice)(self.handle) }
    }
}

impl Device {
    /// The picture without its noise.
    ///
    /// # Panics
    /// Where the picture's images are not of its size.
    pub(in crate::output::denoise) fn denoise(&mut self, picture: &Picture<'_>) -> Result<Vec<Rgb>> {
        let mut clean: Vec<Rgb> = vec![[0.0; 3]; picture.pixels()];
        let filter = Filter::new(self)?;
        for (name, pixels) in images(picture) {
            // SAFETY: the image has the picture's pixels, outlives the filter, and is not written to: it is no output.
            unsafe { filter.image(name, pixels.as_ptr().cast_mut(), picture.size) };
        }
        // SAFETY: it has the picture's pixels, outlives the filter, and nothing else has it until the filter is done.
        unsafe { filter.image(c"output", clean.as_mut_ptr(), picture.size) };
        filter.run(matches!(picture.kind, Kind::Radiance { .. }));
        drop(filter);
        self.check()?;
        Ok(clean)
    }

    /// The first error of this thread's calls since it was last asked for.
    fn check(&self) -> Result<()> {
        failure(&self.oidn, self.handle).map_or(Ok(()), Err)
    }
}

/// The images that a filter is given, by the names that it knows them by.
fn images<'a>(picture: &Picture<'a>) -> Vec<(&'static CStr, &'a [Rgb])> {
    match picture.kind {
        Kind::Albedo => vec![(c"albedo", picture.noisy)],
        Kind::Normal => vec![(c"normal", picture.noisy)],
        Kind::Radiance { albedo, normal } => {
            vec![(c"color", picture.noisy), (c"albedo", albedo), (c"normal", normal)]
        }
    }
}

/// A filter for one picture. It is made anew for each, which takes no time: the device keeps the networks.
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
        // SAFETY: the device lives and is committed; the text ends in a null character.
        let handle = unsafe { (device.oidn.oidnNewFilter)(device.handle, c"RT".as_ptr()) };
        if handle.is_null() {
            device.check()?;
            return Err(failed("there is no filter RT"));
        }
        Ok(Self { handle, device })
    }

    /// Names an image of three floats a pixel, row by row without gaps.
    ///
    /// # Safety
    /// The pointer is valid for that many pixels, for writing where it is the output, until the filter has run.
    unsafe fn image(&self, name: &CStr, pixels: *mut Rgb, [width, height]: [u32; 2]) {
        let (width, height) = (width as usize, height as usize);
        // SAFETY: the filter lives, the text ends in a null character, and the pointer is the caller's promise. No gaps are strides of 0.
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

    /// Filters, and returns when it is done. Radiance has no bound and clean guides.
    fn run(&self, radiance: bool) {
        let oidn = &self.device.oidn;
        // SAFETY: the filter lives, its images are valid by the promise of [`Self::image`], the texts end in a null character, and the numbers
        // are the header's. Without the first two it takes guides as noisy and radiance as at most 1, which is what guides alone want.
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

/// The first error of this thread's calls to a device, or without one (null) of those that make one, since it was last asked for.
fn failure(oidn: &Functions, device: *mut sys::OIDNDevice) -> Option<Error> {
    let mut words: *const c_char = null();
    // SAFETY: the device lives or is null, which the function allows; the other pointer is valid for writing.
    let code = unsafe { (oidn.oidnGetDeviceError)(device, &raw mut words) };
    if code == sys::OIDN_ERROR_NONE {
        return None;
    }
    if words.is_null() {
        return Some(failed(&format!("error {code}")));
    }
    // SAFETY: the library's text ends in a null character, and stays until this thread asks again.
    Some(failed(&unsafe { CStr::from_ptr(words) }.to_string_lossy()))
}

fn failed(words: &str) -> Error {
    Error::failed(format!("Open Image Denoise: {words}"))
}
