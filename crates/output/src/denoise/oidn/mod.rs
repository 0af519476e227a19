//! C interface of Open Image Denoise, version 2, and a safe layer over the functions that [`super::library`] needs.
//!
//! This folder and `crates/render/src/accel/rtc/` contain all `unsafe` code of the library. `sys.rs` declares and loads
//! functions, `device.rs` calls them. The contract of each call, from the header `oidn.h` and the documentation, is
//! documented at the call.
//!
//! ## oneTBB
//! The library needs `libtbb.so.12`, and so does Embree, which is loaded earlier. The loader gives both the first
//! library of that name, which is Embree's. If Embree's has another name, as in a Python wheel, the folder's own is
//! loaded too, but calls still reach Embree's, which is searched first.
//!
//! Open Image Denoise may therefore run on an older oneTBB than it was built with, for which oneTBB gives no guarantee.
//! Version 2.5.1, built with 2023.1, was tested on 2021.5, 2021.8, 2021.11, 2021.12 and 2022.1: each gave the same bits
//! as its own. All symbols are resolved when it is loaded, so a symbol missing from an older oneTBB is an error at that
//! point and does not end the process later.
//!
//! Embree limits oneTBB's threads for the whole process to those of its last device. Concurrent images with several
//! threads each may therefore be denoised on fewer threads than requested; the bits are the same.
#![allow(unsafe_code, reason = "calls C")]

mod device;
mod sys;

pub(super) use device::{Device, Oidn};
