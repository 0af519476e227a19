//! Declarations used here that are common to the headers of Embree 3.13 and Embree 4. The names are those of Embree.
//!
//! Source: `rtcore_device.h`, `rtcore_common.h`, `rtcore_buffer.h`, `rtcore_geometry.h`, `rtcore_scene.h`,
//! `rtcore_ray.h` of 3.13.5, 4.3.3 and 4.4.0, built with one level of instances (`RTC_MAX_INSTANCE_LEVEL_COUNT`), as
//! Debian, Ubuntu and PyPI's `embreex` do.
#![expect(non_snake_case, reason = "Embree's own names")]

use std::ffi::{c_char, c_int, c_uint, c_void};

/// Opaque, reference-counted objects of Embree.
macro_rules! opaque {
    ($($name:ident)*) => {$(
        #[repr(C)]
        pub(super) struct $name {
            private: [u8; 0],
        }
    )*};
}
opaque! { RTCDevice RTCScene RTCGeometry }

pub(super) const RTC_INVALID_GEOMETRY_ID: c_uint = c_uint::MAX;
pub(super) const RTC_DEVICE_PROPERTY_VERSION: c_uint = 0;
pub(super) const RTC_GEOMETRY_TYPE_TRIANGLE: c_uint = 0;
pub(super) const RTC_GEOMETRY_TYPE_INSTANCE: c_uint = 121;
pub(super) const RTC_BUFFER_TYPE_INDEX: c_uint = 0;
pub(super) const RTC_BUFFER_TYPE_VERTEX: c_uint = 1;
pub(super) const RTC_FORMAT_UINT3: c_uint = 0x5003;
pub(super) const RTC_FORMAT_FLOAT3: c_uint = 0x9003;
pub(super) const RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR: c_uint = 0x9234;
pub(super) const RTC_BUILD_QUALITY_LOW: c_uint = 0;
pub(super) const RTC_BUILD_QUALITY_MEDIUM: c_uint = 1;
pub(super) const RTC_SCENE_FLAG_ROBUST: c_uint = 1 << 2;

/// A ray. It hits a geometry if their masks share a bit; a geometry's default mask has all bits (Embree 3) or the first
/// one (Embree 4).
#[repr(C, align(16))]
pub(super) struct RTCRay {
    pub(super) org: [f32; 3],
    pub(super) tnear: f32,
    pub(super) dir: [f32; 3],
    pub(super) time: f32,
    pub(super) tfar: f32,
    pub(super) mask: c_uint,
    pub(super) id: c_uint,
    pub(super) flags: c_uint,
}

/// A hit. The last element of `instID` is Embree 4's `instPrimID`; Embree 3's struct ends before it.
#[repr(C, align(16))]
pub(super) struct RTCHit {
    pub(super) Ng: [f32; 3],
    pub(super) u: f32,
    pub(super) v: f32,
    pub(super) primID: c_uint,
    pub(super) geomID: c_uint,
    pub(super) instID: [c_uint; 2],
}

#[repr(C)]
pub(super) struct RTCRayHit {
    pub(super) ray: RTCRay,
    pub(super) hit: RTCHit,
}

/// Eight rays as a structure of arrays.
#[repr(C, align(32))]
pub(super) struct RTCRay8 {
    pub(super) org: [[f32; 8]; 3],
    pub(super) tnear: [f32; 8],
    pub(super) dir: [[f32; 8]; 3],
    pub(super) time: [f32; 8],
    pub(super) tfar: [f32; 8],
    pub(super) mask: [c_uint; 8],
    pub(super) id: [c_uint; 8],
    pub(super) flags: [c_uint; 8],
}

/// Hits of eight rays; see [`RTCHit`].
#[repr(C, align(32))]
pub(super) struct RTCHit8 {
    pub(super) Ng: [[f32; 8]; 3],
    pub(super) u: [f32; 8],
    pub(super) v: [f32; 8],
    pub(super) primID: [c_uint; 8],
    pub(super) geomID: [c_uint; 8],
    pub(super) instID: [[c_uint; 8]; 2],
}

#[repr(C)]
pub(super) struct RTCRayHit8 {
    pub(super) ray: RTCRay8,
    pub(super) hit: RTCHit8,
}

/// Mask of active lanes: −1 for active, 0 for inactive. Embree reads it in one aligned load.
#[repr(C, align(32))]
pub(super) struct Lanes(pub(super) [c_int; 8]);

// Sizes of the structs in C, compiled from Embree 4's headers.
const _: () = assert!(size_of::<RTCRay>() == 48 && size_of::<RTCRayHit>() == 96);
const _: () = assert!(size_of::<RTCRay8>() == 384 && size_of::<RTCRayHit8>() == 672);

/// Arguments of a filter callback: `N` hits, to be tested in the lanes where `valid` is −1.
#[repr(C)]
pub(super) struct RTCFilterFunctionNArguments {
    pub(super) valid: *mut c_int,
    pub(super) geometryUserPtr: *mut c_void,
    pub(super) context: *mut c_void,
    pub(super) ray: *mut c_void,
    /// Structure of arrays: `N` values for each member of [`RTCHit`], in its order.
    pub(super) hit: *mut c_void,
    pub(super) N: c_uint,
}

/// Called during a build; returning `false` cancels it.
pub(super) type RTCProgressMonitorFunction = unsafe extern "C" fn(*mut c_void, f64) -> bool;

pub(super) type RTCFilterFunctionN = unsafe extern "C" fn(*const RTCFilterFunctionNArguments);

unsafe extern "C" {
    pub(super) fn rtcNewDevice(config: *const c_char) -> *mut RTCDevice;
    pub(super) fn rtcReleaseDevice(device: *mut RTCDevice);
    pub(super) fn rtcGetDeviceProperty(device: *mut RTCDevice, property: c_uint) -> isize;
    pub(super) fn rtcGetDeviceError(device: *mut RTCDevice) -> c_uint;

    pub(super) fn rtcNewGeometry(device: *mut RTCDevice, kind: c_uint) -> *mut RTCGeometry;
    pub(super) fn rtcReleaseGeometry(geometry: *mut RTCGeometry);
    pub(super) fn rtcCommitGeometry(geometry: *mut RTCGeometry);
    pub(super) fn rtcSetGeometryBuildQuality(geometry: *mut RTCGeometry, quality: c_uint);
    pub(super) fn rtcSetNewGeometryBuffer(
        geometry: *mut RTCGeometry,
        kind: c_uint,
        slot: c_uint,
        format: c_uint,
        stride: usize,
        count: usize,
    ) -> *mut c_void;
    pub(super) fn rtcSetGeometryInstancedScene(geometry: *mut RTCGeometry, scene: *mut RTCScene);
    pub(super) fn rtcSetGeometryTransform(
        geometry: *mut RTCGeometry,
        time_step: c_uint,
        format: c_uint,
        transform: *const c_void,
    );
    pub(super) fn rtcSetGeometryUserData(geometry: *mut RTCGeometry, data: *mut c_void);
    pub(super) fn rtcSetGeometryIntersectFilterFunction(geometry: *mut RTCGeometry, filter: RTCFilterFunctionN);
    pub(super) fn rtcSetGeometryOccludedFilterFunction(geometry: *mut RTCGeometry, filter: RTCFilterFunctionN);

    pub(super) fn rtcNewScene(device: *mut RTCDevice) -> *mut RTCScene;
    pub(super) fn rtcReleaseScene(scene: *mut RTCScene);
    pub(super) fn rtcSetSceneFlags(scene: *mut RTCScene, flags: c_uint);
    pub(super) fn rtcSetSceneBuildQuality(scene: *mut RTCScene, quality: c_uint);
    pub(super) fn rtcSetSceneProgressMonitorFunction(
        scene: *mut RTCScene,
        progress: Option<RTCProgressMonitorFunction>,
        data: *mut c_void,
    );
    pub(super) fn rtcAttachGeometry(scene: *mut RTCScene, geometry: *mut RTCGeometry) -> c_uint;
    pub(super) fn rtcCommitScene(scene: *mut RTCScene);
}
