//! Declarations from the header of Open Image Denoise 2 that are used here, and the loading of its functions. Names are
//! the library's.
//!
//! Source: `oidn.h` of 2.5.1.
#![allow(non_snake_case, reason = "Open Image Denoise's own names")]

use libloading::Error;
use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use std::ffi::{c_char, c_int, c_void};
use std::path::{Path, PathBuf};

/// File name of the library; its number is the version of the interface.
const LIBRARY: &str = "libOpenImageDenoise.so.2";
/// Name prefix of the module that the library loads for the CPU.
const MODULE: &str = "libOpenImageDenoise_device_cpu.so";

pub(super) const OIDN_DEVICE_TYPE_CPU: c_int = 1;
pub(super) const OIDN_FORMAT_FLOAT3: c_int = 3;
pub(super) const OIDN_QUALITY_HIGH: c_int = 6;
pub(super) const OIDN_ERROR_NONE: c_int = 0;

/// Opaque types of devices and filters, reference-counted by the library.
macro_rules! opaque {
    ($($name:ident)*) => {$(
        #[repr(C)]
        pub(super) struct $name {
            private: [u8; 0],
        }
    )*};
}
opaque! { OIDNDevice OIDNFilter }

macro_rules! functions {
    ($(fn $name:ident($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// Functions of the loaded library, which is never unloaded.
        #[derive(Debug)]
        pub(super) struct Functions {
            $(pub(super) $name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            /// Looks up all functions.
            ///
            /// # Safety
            /// The library must be Open Image Denoise, version 2, and must not be unloaded while the functions are
            /// called.
            unsafe fn of(library: &Library) -> Result<Self, Error> {
                Ok(Self {$(
                    // SAFETY: guaranteed by the caller; the type is the header's.
                    $name: *unsafe {
                        library.get::<unsafe extern "C" fn($($argument),*) $(-> $result)?>(
                            concat!(stringify!($name), "\0").as_bytes(),
                        )
                    }?,
                )*})
            }
        }
    };
}

functions! {
    fn oidnNewDevice(c_int) -> *mut OIDNDevice;
    fn oidnReleaseDevice(*mut OIDNDevice);
    fn oidnSetDeviceBool(*mut OIDNDevice, *const c_char, bool);
    fn oidnSetDeviceInt(*mut OIDNDevice, *const c_char, c_int);
    fn oidnCommitDevice(*mut OIDNDevice);
    fn oidnGetDeviceError(*mut OIDNDevice, *mut *const c_char) -> c_int;

    fn oidnNewFilter(*mut OIDNDevice, *const c_char) -> *mut OIDNFilter;
    fn oidnReleaseFilter(*mut OIDNFilter);
    fn oidnSetSharedFilterImage(
        *mut OIDNFilter, *const c_char, *mut c_void, c_int, usize, usize, usize, usize, usize
    );
    fn oidnSetFilterBool(*mut OIDNFilter, *const c_char, bool);
    fn oidnSetFilterInt(*mut OIDNFilter, *const c_char, c_int);
    fn oidnCommitFilter(*mut OIDNFilter);
    fn oidnExecuteFilter(*mut OIDNFilter);
}

/// Loads the library from a folder, or by the system loader. The library finds its modules, which are in the same
/// folder, itself.
pub(super) fn load(folder: Option<&Path>) -> Result<Functions, Error> {
    let path = folder.map_or_else(|| PathBuf::from(LIBRARY), |folder| folder.join(LIBRARY));
    // SAFETY: the initialisers of Open Image Denoise create their own objects and need nothing from this process.
    let library = unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL) }?;
    if let Some(module) = folder.and_then(module) {
        // SAFETY: as above. The library would load the module with the first device and resolve its symbols lazily, so
        // a symbol missing from an older oneTBB would end the process then. The module stays loaded, so the library
        // uses this one.
        let module = unsafe { Library::open(Some(module), RTLD_NOW | RTLD_LOCAL) }?;
        module.into_raw();
    }
    // SAFETY: the number in its file name states version 2, and it is not unloaded: see below.
    let functions = unsafe { Functions::of(&library) }?;
    // Not unloaded, because its threads and oneTBB's may outlive the last device.
    library.into_raw();
    Ok(functions)
}

/// Returns the path of the CPU module in the library's folder.
fn module(folder: &Path) -> Option<PathBuf> {
    let names = std::fs::read_dir(folder).ok()?.filter_map(|entry| Some(entry.ok()?.file_name()));
    names.filter(|name| name.to_string_lossy().starts_with(MODULE)).min().map(|name| folder.join(name))
}
