//! Open Image Denoise's C interface, version 2, and a safe layer over the few functions that [`super::library`] needs.
//!
//! This folder and `src/accel/rtc/` hold all `unsafe` of the library. `sys.rs` declares and loads, `device.rs` calls. Each call's contract,
//! from the header `oidn.h` and the documentation, stands where it is made.
//!
//! ## oneTBB
//! The library needs `libtbb.so.12`, and so does Embree, which is loaded before. The loader gives both the one of that name that it has
//! first, which is Embree's. Where Embree's has another name, as in a Python wheel, the folder's own is loaded as well, but calls still reach
//! Embree's, which is searched first.
//!
//! So Open Image Denoise may run on an older oneTBB than the one it was built with, which oneTBB does not promise to work. Version 2.5.1, built
//! with 2023.1, was tried on 2021.5, 2021.8, 2021.11, 2021.12 and 2022.1: each made the same bits as its own. All symbols are looked up while it
//! is loaded, so one that an older oneTBB lacks is an error then and does not end the process later.
//!
//! Embree bounds oneTBB's threads for the whole process to those of its last device. Several images at once that have several threads each may
//! therefore be denoised on fewer than they have; the bits are the same.
#![allow(unsafe_code, reason = "calls C")]

mod device;
mod sys;

pub(super) use device::{Device, Oidn};
