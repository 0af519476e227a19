//! Devices: what builds and holds scenes, and what their errors say.

use super::sys;
use crate::{Error, Result};
use std::ffi::CString;
use std::ptr::null_mut;

/// Makes this thread flush denormals, as Embree asks of those that trace rays and as its own threads do.
pub(in crate::accel) fn prepare_thread() {
    // Bits of the control register MXCSR: flush to zero, denormals are zero. The others, such as the rounding mode, stay.
    const FTZ_DAZ: u32 = 0x8000 | 0x0040;
    let mut mxcsr: u32 = 0;
    // SAFETY: both instructions touch that register and the four bytes that they are given, which live on this stack.
    unsafe {
        std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut mxcsr, options(nostack, preserves_flags));
        mxcsr |= FTZ_DAZ;
        std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const mxcsr, options(nostack, readonly, preserves_flags));
    }
}

/// A device of Embree: its threads, its instruction set, its last error.
pub(in crate::accel) struct Device(*mut sys::RTCDevice);

// SAFETY: Embree's devices may be used from any thread, and from several at once.
unsafe impl Send for Device {}
unsafe impl Sync for Device {}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the pointer is `rtcNewDevice`'s, and this is the only release of it.
        unsafe { sys::rtcReleaseDevice(self.0) }
    }
}

impl Device {
    /// One with these kernels (`avx2`) that builds with `threads` threads (0: all there are). Prepares this thread.
    pub(in crate::accel) fn new(isa: &str, threads: u32) -> Result<Self> {
        prepare_thread();
        let config = CString::new(format!("threads={threads},isa={isa},max_isa={isa}"))
            .map_err(|_| Error::failed("Embree: a null character in its settings"))?;
        // SAFETY: the text ends in a null character and outlives the call.
        let device = unsafe { sys::rtcNewDevice(config.as_ptr()) };
        if device.is_null() {
            // SAFETY: without a device it is this thread's error that is read.
            return Err(failed(unsafe { sys::rtcGetDeviceError(null_mut()) }));
        }
        Ok(Self(device))
    }

    /// Embree's version as one number: 31305 is 3.13.5.
    pub(in crate::accel) fn version(&self) -> isize {
        // SAFETY: the device lives, and has that property.
        unsafe { sys::rtcGetDeviceProperty(self.0, sys::RTC_DEVICE_PROPERTY_VERSION) }
    }

    /// The pointer, for calls that take one; it is valid as long as this is.
    pub(super) fn handle(&self) -> *mut sys::RTCDevice {
        self.0
    }

    /// The first error of this thread's calls since it was last asked for.
    pub(super) fn check(&self) -> Result<()> {
        // SAFETY: the device lives.
        match unsafe { sys::rtcGetDeviceError(self.0) } {
            0 => Ok(()),
            code => Err(failed(code)),
        }
    }

    /// What Embree made; where it made nothing, its error.
    pub(super) fn made<T>(&self, pointer: *mut T) -> Result<*mut T> {
        if !pointer.is_null() {
            return Ok(pointer);
        }
        self.check()?;
        Err(failed(1))
    }
}

/// An error by its number in `RTCError`.
fn failed(code: u32) -> Error {
    let words = match code {
        2 => "invalid argument",
        3 => "invalid operation",
        4 => "out of memory",
        5 => "this processor is not supported",
        6 => return Error::interrupted(),
        _ => "unknown error",
    };
    Error::failed(format!("Embree: {words}"))
}
