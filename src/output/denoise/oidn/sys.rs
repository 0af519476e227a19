//! What the header of Open Image Denoise 2 declares, as far as it is used here, and how it is loaded. Names are the library's.
//!
//! Source: `oidn.h` of 2.5.1.
#![allow(non_snake_case, reason = "Open Image Denoise's own names")]

use libloading::Error;
use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use std::ffi::{c_char, c_int, c_void};
use std::path::{Path, PathBuf};

/// The library; its number is that of the interface.
const LIBRARY: &str = "libOpenImageDenoise.so.2";
/// How the name of the part begins that it loads for the processor.
const MODULE: &str = "libOpenImageDenoise_device_cpu.so";

pub(super) const OIDN_DEVICE_TYPE_CPU: c_int = 1;
pub(super) const OIDN_FORMAT_FLOAT3: c_int = 3;
pub(super) const OIDN_QUALITY_HIGH: c_int = 6;
pub(super) const OIDN_ERROR_NONE: c_int = 0;

/// What the pointers to devices and filters lead to; counted by the library.
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
        /// The functions of the loaded library, which is never unloaded.
        #[derive(Debug)]
        pub(super) struct Functions {
            $(pub(super) $name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            /// Looks each up.
            ///
            /// # Safety
            /// The library is Open Image Denoise, version 2, and is not unloaded while the functions are called.
            unsafe fn of(library: &Library) -> Result<Self, Error> {
                Ok(Self {$(
                    // SAFETY: the caller's promise; the type is the header's.
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

/// Loads the library from a folder, or from where the system's loader finds it. Its other parts lie beside it: it finds them itself.
pub(super) fn load(folder: Option<&Path>) -> Result<Functions, Error> {
    let path = folder.map_or_else(|| PathBuf::from(LIBRARY), |folder| folder.join(LIBRARY));
    // SAFETY: what runs when Open Image Denoise is loaded makes its own objects and asks nothing of us.
    let library = unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL) }?;
    if let Some(module) = folder.and_then(module) {
        // SAFETY: as above. The library would load it with the first device and look up its symbols when they are called: one that is missing,
        // for a oneTBB too old, would end the process then. It stays loaded, so the library takes this one.
        let module = unsafe { Library::open(Some(module), RTLD_NOW | RTLD_LOCAL) }?;
        module.into_raw();
    }
    // SAFETY: the number in its name says version 2, and it is not unloaded: see below.
    let functions = unsafe { Functions::of(&library) }?;
    // Not unloaded: its threads, and oneTBB's, may outlive the last device.
    library.into_raw();
    Ok(functions)
}

/// The part for the processor, in the library's folder.
fn module(folder: &Path) -> Option<PathBuf> {
    let names = std::fs::read_dir(folder).ok()?.filter_map(|entry| Some(entry.ok()?.file_name()));
    names.filter(|name| name.to_string_lossy().starts_with(MODULE)).min().map(|name| folder.join(name))
}
