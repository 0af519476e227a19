//! Ray queries of Embree 3: each takes an intersection context.

use super::sys::{
    Lanes, RTC_INVALID_GEOMETRY_ID, RTCFilterFunctionN, RTCRay, RTCRay8, RTCRayHit, RTCRayHit8, RTCScene,
};
use std::ffi::{c_int, c_uint};

/// Intersection context, initialised as `rtcInitIntersectContext` does in C.
#[repr(C)]
struct RTCIntersectContext {
    flags: c_uint,
    filter: Option<RTCFilterFunctionN>,
    inst_id: [c_uint; 1],
}

const INCOHERENT: c_uint = 0;
const COHERENT: c_uint = 1;

impl RTCIntersectContext {
    fn new(flags: c_uint) -> Self {
        Self { flags, filter: None, inst_id: [RTC_INVALID_GEOMETRY_ID] }
    }
}

unsafe extern "C" {
    fn rtcIntersect1(scene: *mut RTCScene, context: *mut RTCIntersectContext, query: *mut RTCRayHit);
    fn rtcIntersect8(
        valid: *const c_int,
        scene: *mut RTCScene,
        context: *mut RTCIntersectContext,
        query: *mut RTCRayHit8,
    );
    fn rtcOccluded1(scene: *mut RTCScene, context: *mut RTCIntersectContext, ray: *mut RTCRay);
    fn rtcOccluded8(valid: *const c_int, scene: *mut RTCScene, context: *mut RTCIntersectContext, ray: *mut RTCRay8);
}

/// Finds the nearest hit.
///
/// # Safety
/// `scene` is committed and not modified during the call. The same holds for all functions of this file.
#[inline]
pub(super) unsafe fn intersect1(scene: *mut RTCScene, query: &mut RTCRayHit) {
    // SAFETY: the caller guarantees the scene; the other arguments are initialised and outlive the call. The same holds
    // in all functions below.
    unsafe { rtcIntersect1(scene, &mut RTCIntersectContext::new(INCOHERENT), query) }
}

/// Finds the nearest hits of a coherent packet.
#[inline]
pub(super) unsafe fn intersect8(scene: *mut RTCScene, lanes: &Lanes, query: &mut RTCRayHit8) {
    unsafe { rtcIntersect8(lanes.0.as_ptr(), scene, &mut RTCIntersectContext::new(COHERENT), query) }
}

/// Sets `tfar` to −∞ if the ray hits anything.
#[inline]
pub(super) unsafe fn occluded1(scene: *mut RTCScene, ray: &mut RTCRay) {
    unsafe { rtcOccluded1(scene, &mut RTCIntersectContext::new(INCOHERENT), ray) }
}

/// [`occluded1`] for a coherent packet.
#[inline]
pub(super) unsafe fn occluded8(scene: *mut RTCScene, lanes: &Lanes, ray: &mut RTCRay8) {
    unsafe { rtcOccluded8(lanes.0.as_ptr(), scene, &mut RTCIntersectContext::new(COHERENT), ray) }
}
