//! Ray queries of Embree 4: each takes an arguments struct, whose context may be null.

use super::sys::{Lanes, RTCFilterFunctionN, RTCRay, RTCRay8, RTCRayHit, RTCRayHit8, RTCScene};
use std::ffi::{c_int, c_uint, c_void};
use std::ptr::null_mut;

/// Arguments of a query: `RTCIntersectArguments` and `RTCOccludedArguments` in C, which differ only in the type of the
/// last function pointer.
#[repr(C)]
struct RTCArguments {
    flags: c_uint,
    feature_mask: c_uint,
    context: *mut c_void,
    filter: Option<RTCFilterFunctionN>,
    callback: *mut c_void,
}

const INCOHERENT: c_uint = 0;
const COHERENT: c_uint = 1 << 16;

impl RTCArguments {
    fn new(flags: c_uint) -> Self {
        Self { flags, feature_mask: c_uint::MAX, context: null_mut(), filter: None, callback: null_mut() }
    }
}

unsafe extern "C" {
    fn rtcIntersect1(scene: *mut RTCScene, query: *mut RTCRayHit, arguments: *mut RTCArguments);
    fn rtcIntersect8(valid: *const c_int, scene: *mut RTCScene, query: *mut RTCRayHit8, arguments: *mut RTCArguments);
    fn rtcOccluded1(scene: *mut RTCScene, ray: *mut RTCRay, arguments: *mut RTCArguments);
    fn rtcOccluded8(valid: *const c_int, scene: *mut RTCScene, ray: *mut RTCRay8, arguments: *mut RTCArguments);
}

/// Finds the nearest hit.
///
/// # Safety
/// `scene` is committed and not modified during the call. The same holds for all functions of this file.
#[inline]
pub(super) unsafe fn intersect1(scene: *mut RTCScene, query: &mut RTCRayHit) {
    // SAFETY: the caller guarantees the scene; the other arguments are initialised and outlive the call. The same holds
    // in all functions below.
    unsafe { rtcIntersect1(scene, query, &mut RTCArguments::new(INCOHERENT)) }
}

/// Finds the nearest hits of a coherent packet.
#[inline]
pub(super) unsafe fn intersect8(scene: *mut RTCScene, lanes: &Lanes, query: &mut RTCRayHit8) {
    unsafe { rtcIntersect8(lanes.0.as_ptr(), scene, query, &mut RTCArguments::new(COHERENT)) }
}

/// Sets `tfar` to −∞ if the ray hits anything.
#[inline]
pub(super) unsafe fn occluded1(scene: *mut RTCScene, ray: &mut RTCRay) {
    unsafe { rtcOccluded1(scene, ray, &mut RTCArguments::new(INCOHERENT)) }
}

/// [`occluded1`] for a coherent packet.
#[inline]
pub(super) unsafe fn occluded8(scene: *mut RTCScene, lanes: &Lanes, ray: &mut RTCRay8) {
    unsafe { rtcOccluded8(lanes.0.as_ptr(), scene, ray, &mut RTCArguments::new(COHERENT)) }
}
