//! Scenes of triangles: built once, then asked about rays from any thread.

use super::device::Device;
use super::query;
use super::sys::{self, Lanes, RTC_INVALID_GEOMETRY_ID};
use crate::Result;
use crate::geometry::{PACKET, Ray};
use crate::math::Vec3;
use std::ffi::c_void;
use std::mem::MaybeUninit;
use std::ptr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Says which hits count. A panic in it ends the process, since it must not unwind through Embree.
pub(in crate::accel) trait Filter: Send + Sync {
    /// Whether a triangle is there at these barycentric coordinates.
    fn keeps(&self, primitive: u32, u: f32, v: f32) -> bool;
}

/// A hit in Embree's numbers.
#[derive(Clone, Copy)]
pub(in crate::accel) struct Hit {
    /// The instance that was hit, by its place among the geometries of [`Scene::build`].
    pub(in crate::accel) instance: Option<u32>,
    /// Its place among the geometries of [`Scene::build`]; of an instance among those of its scene.
    pub(in crate::accel) geometry: u32,
    /// Which of its triangles.
    pub(in crate::accel) primitive: u32,
    pub(in crate::accel) u: f32,
    pub(in crate::accel) v: f32,
    pub(in crate::accel) t: f32,
}

/// A scene that nothing changes any more.
pub(in crate::accel) struct Scene<F> {
    handle: *mut sys::RTCScene,
    /// Released after the scene, with what their filters point to. They hold the device.
    geometries: Vec<Arc<Geometry<F>>>,
    device: Arc<Device>,
}

// SAFETY: Embree's committed scenes may be asked from any thread, and from several at once; filters may be as well.
unsafe impl<F: Send + Sync> Send for Scene<F> {}
unsafe impl<F: Send + Sync> Sync for Scene<F> {}

impl<F> Drop for Scene<F> {
    fn drop(&mut self) {
        // SAFETY: the pointer is `rtcNewScene`'s, this is its only release, and no query runs: they borrow the scene.
        unsafe { sys::rtcReleaseScene(self.handle) }
    }
}

impl<F: Filter> Scene<F> {
    /// Builds the hierarchy over geometries of this device, which is traversed robustly; an interruption where the flag is raised meanwhile.
    /// A quick one is built in a fraction of the time and traversed more slowly.
    pub(in crate::accel) fn build(
        device: &Arc<Device>,
        geometries: Vec<Arc<Geometry<F>>>,
        quick: bool,
        outdated: Option<&AtomicBool>,
    ) -> Result<Self> {
        let quality = if quick { sys::RTC_BUILD_QUALITY_LOW } else { sys::RTC_BUILD_QUALITY_MEDIUM };
        // SAFETY: the device lives.
        let handle = device.made(unsafe { sys::rtcNewScene(device.handle()) })?;
        let scene = Self { handle, geometries, device: device.clone() };
        // SAFETY: the scene lives; both numbers are among the headers' values.
        unsafe {
            sys::rtcSetSceneFlags(handle, sys::RTC_SCENE_FLAG_ROBUST);
            sys::rtcSetSceneBuildQuality(handle, quality);
        }
        for geometry in &scene.geometries {
            // SAFETY: geometry and scene live and are of one device; a geometry may be attached to several scenes, and none changes it.
            unsafe { sys::rtcAttachGeometry(handle, geometry.handle) };
        }
        if let Some(outdated) = outdated {
            let flag = ptr::from_ref(outdated).cast_mut().cast::<c_void>();
            // SAFETY: the scene lives; `wanted` reads an `AtomicBool` behind the pointer, which outlives the commit, and Embree forgets it below.
            unsafe { sys::rtcSetSceneProgressMonitorFunction(handle, Some(wanted), flag) };
        }
        // SAFETY: the scene lives, and nothing else knows it yet.
        unsafe {
            sys::rtcCommitScene(handle);
            sys::rtcSetSceneProgressMonitorFunction(handle, None, ptr::null_mut());
        }
        scene.device.check()?;
        Ok(scene)
    }

    /// The device that it was built with.
    pub(in crate::accel) fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// The geometries that it was built over.
    pub(in crate::accel) fn geometries(&self) -> &[Arc<Geometry<F>>] {
        &self.geometries
    }
}

/// Whether a build goes on: Embree's progress monitor.
unsafe extern "C" fn wanted(flag: *mut c_void, _: f64) -> bool {
    // SAFETY: `commit` has given a reference to an `AtomicBool` that lives as long as the build.
    !unsafe { &*flag.cast::<AtomicBool>() }.load(Ordering::Relaxed)
}

/// Triangles with a filter, or a scene that stands somewhere, which nothing changes any more.
pub(in crate::accel) struct Geometry<F> {
    handle: *mut sys::RTCGeometry,
    /// What the filter functions point to: it lives as long as the geometry, and does not move.
    filter: Option<Arc<F>>,
    /// The scene of an instance: Embree counts it, and this keeps what its filters point to.
    _shared: Option<Arc<Scene<F>>>,
    /// Released after the geometry.
    device: Arc<Device>,
}

// SAFETY: Embree's objects may be used from any thread; a committed geometry is only read, and so is its filter.
unsafe impl<F: Send + Sync> Send for Geometry<F> {}
unsafe impl<F: Send + Sync> Sync for Geometry<F> {}

impl<F> Drop for Geometry<F> {
    fn drop(&mut self) {
        // SAFETY: the pointer is `rtcNewGeometry`'s, and this is the only release of it; scenes that still have it count for themselves, and are
        // not asked any more: they hold this.
        unsafe { sys::rtcReleaseGeometry(self.handle) }
    }
}

impl<F: Filter> Geometry<F> {
    /// One of these triangles; without any it is one point, so that it has a number all the same.
    ///
    /// # Panics
    /// Where a triangle names a corner that is not there.
    pub(in crate::accel) fn new(
        device: &Arc<Device>,
        corners: &[Vec3],
        triangles: impl ExactSizeIterator<Item = [u32; 3]>,
        filter: Option<F>,
    ) -> Result<Self> {
        // SAFETY: the device lives; the number is among the headers' values.
        let handle = unsafe { sys::rtcNewGeometry(device.handle(), sys::RTC_GEOMETRY_TYPE_TRIANGLE) };
        let handle = device.made(handle)?;
        let mut geometry = Self { handle, filter: filter.map(Arc::new), _shared: None, device: device.clone() };
        let (points, count) = (corners.len().max(1), triangles.len().max(1));
        let to = geometry.buffer(sys::RTC_BUFFER_TYPE_VERTEX, sys::RTC_FORMAT_FLOAT3, points)?;
        fill(to, corners.iter().map(Vec3::to_array));
        let to = geometry.buffer(sys::RTC_BUFFER_TYPE_INDEX, sys::RTC_FORMAT_UINT3, count)?;
        let there = |triangle: &[u32; 3]| triangle.iter().all(|corner| (*corner as usize) < corners.len());
        fill(to, triangles.inspect(|triangle| assert!(there(triangle), "{triangle:?} of {} corners", corners.len())));
        // SAFETY: the geometry lives; the number is among the headers' values.
        unsafe { sys::rtcSetGeometryBuildQuality(handle, sys::RTC_BUILD_QUALITY_MEDIUM) };
        if let Some(filter) = &geometry.filter {
            let data = Arc::as_ptr(filter).cast_mut().cast::<c_void>();
            // SAFETY: the geometry lives. `confirm` reads an `F` behind the pointer, and `filter` keeps it while a scene can ask.
            unsafe {
                sys::rtcSetGeometryUserData(handle, data);
                sys::rtcSetGeometryIntersectFilterFunction(handle, confirm::<F>);
                sys::rtcSetGeometryOccludedFilterFunction(handle, confirm::<F>);
            }
        }
        // SAFETY: the geometry lives.
        unsafe { sys::rtcCommitGeometry(handle) };
        device.check()?;
        Ok(geometry)
    }

    /// An instance of a scene: its points p stand at `columns` · (p, 1) in the scene that this is attached to.
    pub(in crate::accel) fn instance(of: &Arc<Scene<F>>, columns: [Vec3; 4]) -> Result<Self> {
        let device = of.device.clone();
        // SAFETY: the device lives; the number is among the headers' values.
        let handle = device.made(unsafe { sys::rtcNewGeometry(device.handle(), sys::RTC_GEOMETRY_TYPE_INSTANCE) })?;
        let geometry = Self { handle, filter: None, _shared: Some(of.clone()), device };
        let columns = columns.map(|column| column.to_array());
        // SAFETY: geometry and scene live, are of one device, and the scene is committed. The format has 3 × 4 floats, which Embree copies.
        unsafe {
            sys::rtcSetGeometryInstancedScene(handle, of.handle);
            let format = sys::RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR;
            sys::rtcSetGeometryTransform(handle, 0, format, columns.as_ptr().cast::<c_void>());
            sys::rtcCommitGeometry(handle);
        }
        geometry.device.check()?;
        Ok(geometry)
    }

    /// A new buffer of `count` triples, to be filled; its format has three values of four bytes, as `T` has.
    fn buffer<T>(&mut self, kind: u32, format: u32, count: usize) -> Result<&mut [MaybeUninit<[T; 3]>]> {
        const { assert!(size_of::<T>() == 4 && align_of::<T>() == 4) };
        let stride = size_of::<[T; 3]>();
        // SAFETY: the geometry lives; the numbers are among the headers' values.
        let data = unsafe { sys::rtcSetNewGeometryBuffer(self.handle, kind, 0, format, stride, count) };
        let data = self.device.made(data)?.cast();
        // SAFETY: Embree's buffer has that many triples, aligned to 16 bytes; it lives as long as the geometry, which nothing else changes meanwhile.
        Ok(unsafe { std::slice::from_raw_parts_mut(data, count) })
    }
}

/// Fills a buffer; with zeros where there are too few values.
fn fill<T: Copy + Default>(to: &mut [MaybeUninit<[T; 3]>], values: impl Iterator<Item = [T; 3]>) {
    for (to, value) in to.iter_mut().zip(values.chain(std::iter::repeat([T::default(); 3]))) {
        to.write(value);
    }
}

/// Clears the lanes whose hit does not count.
///
/// # Safety
/// Embree calls it with arguments of `N` lanes; the geometry's pointer leads to an `F`.
unsafe extern "C" fn confirm<F: Filter>(arguments: *const sys::RTCFilterFunctionNArguments) {
    // SAFETY: the caller's promise. The lanes are this call's alone, the filter is shared with other threads.
    let (arguments, filter, lanes) = unsafe {
        let arguments = &*arguments;
        let lanes = std::slice::from_raw_parts_mut(arguments.valid, arguments.N as usize);
        (arguments, &*arguments.geometryUserPtr.cast::<F>(), lanes)
    };
    for lane in 0..lanes.len() {
        let at = |field: usize| field * lanes.len() + lane;
        // SAFETY: hits are arrays of one value a lane: normal (3), u, v, primitive. A lane that is not valid is not read.
        let keeps = |hit: *mut c_void| unsafe {
            let (u, v) = (*hit.cast::<f32>().add(at(3)), *hit.cast::<f32>().add(at(4)));
            filter.keeps(*hit.cast::<u32>().add(at(5)), u, v)
        };
        if lanes[lane] == -1 && !keeps(arguments.hit) {
            lanes[lane] = 0;
        }
    }
}

impl<F> Scene<F> {
    /// The nearest hit.
    #[inline]
    pub(in crate::accel) fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut query = sys::RTCRayHit { ray: single(ray), hit: NO_HIT };
        // SAFETY: a `Scene` is committed, and nothing changes it. So below.
        unsafe { query::intersect1(self.handle, &mut query) };
        let sys::RTCRayHit { ray, hit } = query;
        found([hit.instID[0], hit.geomID, hit.primID], hit.u, hit.v, ray.tfar)
    }

    /// Whether anything is hit.
    #[inline]
    pub(in crate::accel) fn occluded(&self, ray: &Ray) -> bool {
        let mut ray = single(ray);
        unsafe { query::occluded1(self.handle, &mut ray) };
        ray.tfar == f32::NEG_INFINITY
    }

    /// The nearest hits of rays that go nearly the same way.
    #[inline]
    pub(in crate::accel) fn closest_packet(&self, rays: &[Option<Ray>; PACKET]) -> [Option<Hit>; PACKET] {
        let (ray, lanes) = packet(rays);
        let mut query = sys::RTCRayHit8 { ray, hit: NO_HITS };
        unsafe { query::intersect8(self.handle, &lanes, &mut query) };
        let sys::RTCRayHit8 { ray, hit } = query;
        std::array::from_fn(|i| {
            found([hit.instID[0][i], hit.geomID[i], hit.primID[i]], hit.u[i], hit.v[i], ray.tfar[i])
        })
    }

    /// Whether rays that go nearly the same way hit anything.
    #[inline]
    pub(in crate::accel) fn occluded_packet(&self, rays: &[Option<Ray>; PACKET]) -> [bool; PACKET] {
        let (mut ray, lanes) = packet(rays);
        unsafe { query::occluded8(self.handle, &lanes, &mut ray) };
        ray.tfar.map(|far| far == f32::NEG_INFINITY)
    }
}

/// What a ray has hit before it is asked about.
const NO_HIT: sys::RTCHit = sys::RTCHit {
    Ng: [0.0; 3],
    u: 0.0,
    v: 0.0,
    primID: RTC_INVALID_GEOMETRY_ID,
    geomID: RTC_INVALID_GEOMETRY_ID,
    instID: [RTC_INVALID_GEOMETRY_ID; 2],
};

/// The same for eight rays.
const NO_HITS: sys::RTCHit8 = sys::RTCHit8 {
    Ng: [[0.0; 8]; 3],
    u: [0.0; 8],
    v: [0.0; 8],
    primID: [RTC_INVALID_GEOMETRY_ID; 8],
    geomID: [RTC_INVALID_GEOMETRY_ID; 8],
    instID: [[RTC_INVALID_GEOMETRY_ID; 8]; 2],
};

/// A hit, unless it has the mark of a miss.
#[inline]
fn found([instance, geometry, primitive]: [u32; 3], u: f32, v: f32, t: f32) -> Option<Hit> {
    let instance = (instance != RTC_INVALID_GEOMETRY_ID).then_some(instance);
    (geometry != RTC_INVALID_GEOMETRY_ID).then_some(Hit { instance, geometry, primitive, u, v, t })
}

#[inline]
fn single(ray: &Ray) -> sys::RTCRay {
    sys::RTCRay {
        org: ray.origin.to_array(),
        tnear: 0.0,
        dir: ray.direction.to_array(),
        time: 0.0,
        tfar: ray.t_max,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}

/// Embree's packet of rays, and which lanes hold one.
#[inline]
fn packet(rays: &[Option<Ray>; PACKET]) -> (sys::RTCRay8, Lanes) {
    // A lane without a ray is not looked at.
    let idle = Ray::until(Vec3::ZERO, Vec3::Z, 0.0);
    let lane = |i: usize| rays[i].as_ref().unwrap_or(&idle);
    let each = |value: fn(&Ray) -> f32| std::array::from_fn(|i| value(lane(i)));
    let packet = sys::RTCRay8 {
        org: [each(|r| r.origin.x), each(|r| r.origin.y), each(|r| r.origin.z)],
        tnear: [0.0; 8],
        dir: [each(|r| r.direction.x), each(|r| r.direction.y), each(|r| r.direction.z)],
        time: [0.0; 8],
        tfar: each(|r| r.t_max),
        mask: [u32::MAX; 8],
        id: [0; 8],
        flags: [0; 8],
    };
    (packet, Lanes(rays.map(|ray| if ray.is_some() { -1 } else { 0 })))
}
