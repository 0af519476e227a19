//! Devices, and the errors that they report.

use super::sys;
use std::ffi::CString;
use std::fmt;
use std::ptr::null_mut;

/// An error that Embree reports (`RTCError`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// A parameter that Embree does not accept.
    InvalidArgument,
    /// A call that is not allowed in the object's state.
    InvalidOperation,
    /// Memory ran out while a structure was built.
    OutOfMemory,
    /// The processor lacks the requested instruction set.
    UnsupportedCpu,
    /// The build was cancelled by its flag.
    Cancelled,
    /// Any other error.
    Unknown,
}

impl Error {
    /// Returns the error with this number in `RTCError`.
    fn from_code(code: u32) -> Self {
        match code {
            2 => Self::InvalidArgument,
            3 => Self::InvalidOperation,
            4 => Self::OutOfMemory,
            5 => Self::UnsupportedCpu,
            6 => Self::Cancelled,
            _ => Self::Unknown,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::InvalidArgument => "Embree: invalid argument",
            Self::InvalidOperation => "Embree: invalid operation",
            Self::OutOfMemory => "Embree: out of memory",
            Self::UnsupportedCpu => "Embree: this processor is not supported",
            Self::Cancelled => "Embree: the build was cancelled",
            Self::Unknown => "Embree: unknown error",
        })
    }
}

impl std::error::Error for Error {}

/// Makes the calling thread flush denormals to zero, as Embree requires of threads that trace rays.
pub fn prepare_thread() {
    // Bits of the control register MXCSR: flush to zero, denormals are zero. Other bits, such as the rounding mode, are
    // kept.
    const FTZ_DAZ: u32 = 0x8000 | 0x0040;
    let mut mxcsr: u32 = 0;
    // SAFETY: both instructions access only MXCSR and the four bytes of `mxcsr`, which is a local variable.
    unsafe {
        std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut mxcsr, options(nostack, preserves_flags));
        mxcsr |= FTZ_DAZ;
        std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const mxcsr, options(nostack, readonly, preserves_flags));
    }
}

/// An Embree device: builds and owns scenes, with its own threads, instruction set and error state.
pub struct Device(*mut sys::RTCDevice);

// SAFETY: Embree's devices may be used from any thread, and from several at once.
unsafe impl Send for Device {}
unsafe impl Sync for Device {}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the pointer comes from `rtcNewDevice` and is released only here.
        unsafe { sys::rtcReleaseDevice(self.0) }
    }
}

impl Device {
    /// Creates a device with the kernels of instruction set `isa` (such as `"avx2"`) and `threads` build threads (0:
    /// one per core), and calls [`prepare_thread`].
    pub fn new(isa: &str, threads: u32) -> Result<Self, Error> {
        prepare_thread();
        let config =
            CString::new(format!("threads={threads},isa={isa},max_isa={isa}")).map_err(|_| Error::InvalidArgument)?;
        // SAFETY: the text ends in a null character and outlives the call.
        let device = unsafe { sys::rtcNewDevice(config.as_ptr()) };
        if device.is_null() {
            // SAFETY: with a null device, the call reads the error of this thread.
            return Err(Error::from_code(unsafe { sys::rtcGetDeviceError(null_mut()) }));
        }
        Ok(Self(device))
    }

    /// Returns Embree's version as one number: 31305 is 3.13.5.
    pub fn version(&self) -> isize {
        // SAFETY: the device is alive, and every device has this property.
        unsafe { sys::rtcGetDeviceProperty(self.0, sys::RTC_DEVICE_PROPERTY_VERSION) }
    }

    /// Returns the raw pointer, which is valid while `self` is alive.
    pub(super) fn handle(&self) -> *mut sys::RTCDevice {
        self.0
    }

    /// Returns and clears the first error of the calling thread since the last check.
    pub(super) fn check(&self) -> Result<(), Error> {
        // SAFETY: the device is alive.
        match unsafe { sys::rtcGetDeviceError(self.0) } {
            0 => Ok(()),
            code => Err(Error::from_code(code)),
        }
    }

    /// Returns a non-null pointer unchanged, and the device's error for a null pointer.
    pub(super) fn made<T>(&self, pointer: *mut T) -> Result<*mut T, Error> {
        if !pointer.is_null() {
            return Ok(pointer);
        }
        self.check()?;
        Err(Error::from_code(1))
    }
}
