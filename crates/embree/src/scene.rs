//! Geometries and scenes: built once, then queried from any thread.

use super::device::{Device, Error};
use super::query;
use super::ray::{Hit, PACKET, Ray};
use super::sys::{self, Lanes, RTC_INVALID_GEOMETRY_ID};
use std::ffi::c_void;
use std::mem::MaybeUninit;
use std::ptr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Decides which hits count, for alpha masks. A panic in it aborts the process, since it must not unwind through
/// Embree.
pub trait Filter: Send + Sync {
    /// Returns `true` if the surface exists at barycentric coordinates `u`, `v` of triangle `primitive`.
    fn accepts(&self, primitive: u32, u: f32, v: f32) -> bool;
}

/// The filter that keeps every hit, for geometries without one.
#[derive(Clone, Copy, Debug)]
pub enum Everything {}

impl Filter for Everything {
    fn accepts(&self, _: u32, _: f32, _: f32) -> bool {
        true
    }
}

/// A committed bounding volume hierarchy over geometries. Immutable.
pub struct Scene<F> {
    handle: *mut sys::RTCScene,
    /// Released after the scene, with their filters. They keep the device alive.
    geometries: Vec<Arc<Geometry<F>>>,
    device: Arc<Device>,
}

// SAFETY: committed scenes may be queried from several threads at once, and so may filters.
unsafe impl<F: Send + Sync> Send for Scene<F> {}
unsafe impl<F: Send + Sync> Sync for Scene<F> {}

impl<F> Drop for Scene<F> {
    fn drop(&mut self) {
        // SAFETY: the pointer comes from `rtcNewScene` and is released only here; no query runs, since queries borrow
        // the scene.
        unsafe { sys::rtcReleaseScene(self.handle) }
    }
}

impl<F: Filter> Scene<F> {
    /// Builds the hierarchy over `geometries`, which must belong to `device`.
    ///
    /// With `quick`, the build takes a fraction of the time and queries are slower (`RTC_BUILD_QUALITY_LOW`, Morton
    /// codes). If `outdated` becomes `true` while the hierarchy is built, the result is [`Error::Cancelled`].
    ///
    /// # Panics
    /// If a geometry belongs to another device.
    pub fn build(
        device: &Arc<Device>,
        geometries: Vec<Arc<Geometry<F>>>,
        quick: bool,
        outdated: Option<&AtomicBool>,
    ) -> Result<Self, Error> {
        assert!(geometries.iter().all(|g| Arc::ptr_eq(&g.device, device)), "a geometry of another Embree device");
        let quality = if quick { sys::RTC_BUILD_QUALITY_LOW } else { sys::RTC_BUILD_QUALITY_MEDIUM };
        // SAFETY: the device is alive.
        let handle = device.made(unsafe { sys::rtcNewScene(device.handle()) })?;
        let scene = Self { handle, geometries, device: device.clone() };
        // SAFETY: the scene is alive; both numbers are constants of Embree's headers.
        unsafe {
            sys::rtcSetSceneFlags(handle, sys::RTC_SCENE_FLAG_ROBUST);
            sys::rtcSetSceneBuildQuality(handle, quality);
        }
        for geometry in &scene.geometries {
            // SAFETY: geometry and scene are alive and belong to one device; a geometry may be attached to several
            // scenes, which do not modify it.
            unsafe { sys::rtcAttachGeometry(handle, geometry.handle) };
        }
        if let Some(outdated) = outdated {
            let flag = ptr::from_ref(outdated).cast_mut().cast::<c_void>();
            // SAFETY: the scene is alive; `wanted` reads an `AtomicBool` through the pointer, which outlives the commit
            // and is reset below.
            unsafe { sys::rtcSetSceneProgressMonitorFunction(handle, Some(wanted), flag) };
        }
        // SAFETY: the scene is alive, and no other thread can access it yet.
        unsafe {
            sys::rtcCommitScene(handle);
            sys::rtcSetSceneProgressMonitorFunction(handle, None, ptr::null_mut());
        }
        scene.device.check()?;
        Ok(scene)
    }

    /// Returns the device of the scene.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Returns the geometries of the scene; a [`Hit`] contains indices into this slice.
    pub fn geometries(&self) -> &[Arc<Geometry<F>>] {
        &self.geometries
    }
}

/// Embree's progress monitor: returns `false` to cancel the build.
unsafe extern "C" fn wanted(flag: *mut c_void, _: f64) -> bool {
    // SAFETY: `Scene::build` passes a reference to an `AtomicBool` that outlives the build.
    !unsafe { &*flag.cast::<AtomicBool>() }.load(Ordering::Relaxed)
}

/// Triangles with an optional filter, or an instance of a scene. Immutable.
pub struct Geometry<F> {
    handle: *mut sys::RTCGeometry,
    /// User data of the filter callback, at a fixed address as long as the geometry exists.
    filter: Option<Arc<F>>,
    /// The instanced scene. Embree holds its own reference to it; this one keeps its filters alive.
    _shared: Option<Arc<Scene<F>>>,
    /// Released after the geometry.
    device: Arc<Device>,
}

// SAFETY: Embree's objects may be used from any thread; a committed geometry is only read, and so is its filter.
unsafe impl<F: Send + Sync> Send for Geometry<F> {}
unsafe impl<F: Send + Sync> Sync for Geometry<F> {}

impl<F> Drop for Geometry<F> {
    fn drop(&mut self) {
        // SAFETY: the pointer comes from `rtcNewGeometry` and is released only here. Scenes that attach it keep this
        // struct alive and hold references of their own.
        unsafe { sys::rtcReleaseGeometry(self.handle) }
    }
}

impl<F: Filter> Geometry<F> {
    /// Creates a triangle mesh. An empty mesh becomes one degenerate triangle, so that it still occupies an index.
    ///
    /// # Panics
    /// If a triangle refers to a vertex that does not exist.
    pub fn new(
        device: &Arc<Device>,
        corners: impl ExactSizeIterator<Item = [f32; 3]>,
        triangles: impl ExactSizeIterator<Item = [u32; 3]>,
        filter: Option<F>,
    ) -> Result<Self, Error> {
        // SAFETY: the device is alive; the number is a constant of Embree's headers.
        let handle = unsafe { sys::rtcNewGeometry(device.handle(), sys::RTC_GEOMETRY_TYPE_TRIANGLE) };
        let handle = device.made(handle)?;
        let mut geometry = Self { handle, filter: filter.map(Arc::new), _shared: None, device: device.clone() };
        let known = corners.len();
        let (points, count) = (known.max(1), triangles.len().max(1));
        let to = geometry.buffer(sys::RTC_BUFFER_TYPE_VERTEX, sys::RTC_FORMAT_FLOAT3, points)?;
        fill(to, corners);
        let to = geometry.buffer(sys::RTC_BUFFER_TYPE_INDEX, sys::RTC_FORMAT_UINT3, count)?;
        let there = |triangle: &[u32; 3]| triangle.iter().all(|corner| (*corner as usize) < known);
        fill(to, triangles.inspect(|triangle| assert!(there(triangle), "{triangle:?} of {known} corners")));
        // SAFETY: the geometry is alive; the number is a constant of Embree's headers.
        unsafe { sys::rtcSetGeometryBuildQuality(handle, sys::RTC_BUILD_QUALITY_MEDIUM) };
        if let Some(filter) = &geometry.filter {
            let data = Arc::as_ptr(filter).cast_mut().cast::<c_void>();
            // SAFETY: the geometry is alive. `confirm` reads an `F` through the pointer, which `filter` keeps alive
            // while scenes can call it.
            unsafe {
                sys::rtcSetGeometryUserData(handle, data);
                sys::rtcSetGeometryIntersectFilterFunction(handle, confirm::<F>);
                sys::rtcSetGeometryOccludedFilterFunction(handle, confirm::<F>);
            }
        }
        // SAFETY: the geometry is alive.
        unsafe { sys::rtcCommitGeometry(handle) };
        device.check()?;
        Ok(geometry)
    }

    /// Creates an instance of a scene. `columns` is its 3 × 4 transform: a point p is at `columns` · (p, 1) in the
    /// scene that attaches the instance.
    pub fn instance(of: &Arc<Scene<F>>, columns: [[f32; 3]; 4]) -> Result<Self, Error> {
        let device = of.device.clone();
        // SAFETY: the device is alive; the number is a constant of Embree's headers.
        let handle = device.made(unsafe { sys::rtcNewGeometry(device.handle(), sys::RTC_GEOMETRY_TYPE_INSTANCE) })?;
        let geometry = Self { handle, filter: None, _shared: Some(of.clone()), device };
        // SAFETY: geometry and scene are alive and belong to one device, and the scene is committed. The format has 3 ×
        // 4 floats, which Embree copies.
        unsafe {
            sys::rtcSetGeometryInstancedScene(handle, of.handle);
            let format = sys::RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR;
            sys::rtcSetGeometryTransform(handle, 0, format, columns.as_ptr().cast::<c_void>());
            sys::rtcCommitGeometry(handle);
        }
        geometry.device.check()?;
        Ok(geometry)
    }

    /// Creates an uninitialised buffer of `count` triples; its format must have three values of four bytes, like `[T;
    /// 3]`.
    fn buffer<T>(&mut self, kind: u32, format: u32, count: usize) -> Result<&mut [MaybeUninit<[T; 3]>], Error> {
        const { assert!(size_of::<T>() == 4 && align_of::<T>() == 4) };
        let stride = size_of::<[T; 3]>();
        // SAFETY: the geometry is alive; the numbers are constants of Embree's headers.
        let data = unsafe { sys::rtcSetNewGeometryBuffer(self.handle, kind, 0, format, stride, count) };
        let data = self.device.made(data)?.cast();
        // SAFETY: Embree's buffer has `count` triples and is aligned to 16 bytes; it exists as long as the geometry,
        // which is borrowed exclusively.
        Ok(unsafe { std::slice::from_raw_parts_mut(data, count) })
    }
}

/// Fills a buffer, with zeros if there are too few values.
fn fill<T: Copy + Default>(to: &mut [MaybeUninit<[T; 3]>], values: impl Iterator<Item = [T; 3]>) {
    for (to, value) in to.iter_mut().zip(values.chain(std::iter::repeat([T::default(); 3]))) {
        to.write(value);
    }
}

/// Filter callback: clears the lanes whose hit is rejected.
///
/// # Safety
/// The arguments must have `N` lanes, and the geometry's user data must point to an `F`.
unsafe extern "C" fn confirm<F: Filter>(arguments: *const sys::RTCFilterFunctionNArguments) {
    // SAFETY: the caller guarantees valid arguments. The lanes belong to this call; the filter is shared with other
    // threads.
    let (arguments, filter, lanes) = unsafe {
        let arguments = &*arguments;
        let lanes = std::slice::from_raw_parts_mut(arguments.valid, arguments.N as usize);
        (arguments, &*arguments.geometryUserPtr.cast::<F>(), lanes)
    };
    for lane in 0..lanes.len() {
        let at = |field: usize| field * lanes.len() + lane;
        // SAFETY: hits are arrays with one value per lane: normal (3), u, v, primitive. Inactive lanes are not read.
        let accepts = |hit: *mut c_void| unsafe {
            let (u, v) = (*hit.cast::<f32>().add(at(3)), *hit.cast::<f32>().add(at(4)));
            filter.accepts(*hit.cast::<u32>().add(at(5)), u, v)
        };
        if lanes[lane] == -1 && !accepts(arguments.hit) {
            lanes[lane] = 0;
        }
    }
}

impl<F> Scene<F> {
    /// Returns the nearest hit.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut query = sys::RTCRayHit { ray: single(ray), hit: NO_HIT };
        // SAFETY: a `Scene` is committed and immutable. The same holds below.
        unsafe { query::intersect1(self.handle, &mut query) };
        let sys::RTCRayHit { ray, hit } = query;
        found([hit.instID[0], hit.geomID, hit.primID], hit.u, hit.v, ray.tfar)
    }

    /// Returns `true` if the ray hits anything.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        let mut ray = single(ray);
        unsafe { query::occluded1(self.handle, &mut ray) };
        ray.tfar == f32::NEG_INFINITY
    }

    /// Returns the nearest hit of each ray of a coherent packet; `None` for lanes without a ray.
    #[inline]
    pub fn closest_packet(&self, rays: &[Option<Ray>; PACKET]) -> [Option<Hit>; PACKET] {
        let (ray, lanes) = packet(rays);
        let mut query = sys::RTCRayHit8 { ray, hit: NO_HITS };
        unsafe { query::intersect8(self.handle, &lanes, &mut query) };
        let sys::RTCRayHit8 { ray, hit } = query;
        std::array::from_fn(|i| {
            found([hit.instID[0][i], hit.geomID[i], hit.primID[i]], hit.u[i], hit.v[i], ray.tfar[i])
        })
    }

    /// Returns for each ray of a coherent packet whether it hits anything; `false` for lanes without a ray.
    #[inline]
    pub fn occluded_packet(&self, rays: &[Option<Ray>; PACKET]) -> [bool; PACKET] {
        let (mut ray, lanes) = packet(rays);
        unsafe { query::occluded8(self.handle, &lanes, &mut ray) };
        ray.tfar.map(|far| far == f32::NEG_INFINITY)
    }
}

/// Initial value of a query: no hit.
const NO_HIT: sys::RTCHit = sys::RTCHit {
    Ng: [0.0; 3],
    u: 0.0,
    v: 0.0,
    primID: RTC_INVALID_GEOMETRY_ID,
    geomID: RTC_INVALID_GEOMETRY_ID,
    instID: [RTC_INVALID_GEOMETRY_ID; 2],
};

/// Initial value of a query of eight rays.
const NO_HITS: sys::RTCHit8 = sys::RTCHit8 {
    Ng: [[0.0; 8]; 3],
    u: [0.0; 8],
    v: [0.0; 8],
    primID: [RTC_INVALID_GEOMETRY_ID; 8],
    geomID: [RTC_INVALID_GEOMETRY_ID; 8],
    instID: [[RTC_INVALID_GEOMETRY_ID; 8]; 2],
};

/// Converts ids to a hit; `None` if the geometry id is invalid.
#[inline]
fn found([instance, geometry, primitive]: [u32; 3], u: f32, v: f32, t: f32) -> Option<Hit> {
    let instance = (instance != RTC_INVALID_GEOMETRY_ID).then_some(instance);
    (geometry != RTC_INVALID_GEOMETRY_ID).then_some(Hit { instance, geometry, primitive, u, v, t })
}

#[inline]
fn single(ray: &Ray) -> sys::RTCRay {
    sys::RTCRay {
        org: ray.origin,
        tnear: 0.0,
        dir: ray.direction,
        time: 0.0,
        tfar: ray.t_max,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}

/// Converts rays to Embree's structure of arrays, with the mask of lanes that have a ray.
#[inline]
fn packet(rays: &[Option<Ray>; PACKET]) -> (sys::RTCRay8, Lanes) {
    // Placeholder for lanes without a ray, which are masked and not traced.
    let idle = Ray { origin: [0.0; 3], direction: [0.0, 0.0, 1.0], t_max: 0.0 };
    let lane = |i: usize| rays[i].as_ref().unwrap_or(&idle);
    let each = |value: fn(&Ray) -> f32| std::array::from_fn(|i| value(lane(i)));
    let packet = sys::RTCRay8 {
        org: [each(|r| r.origin[0]), each(|r| r.origin[1]), each(|r| r.origin[2])],
        tnear: [0.0; 8],
        dir: [each(|r| r.direction[0]), each(|r| r.direction[1]), each(|r| r.direction[2])],
        time: [0.0; 8],
        tfar: each(|r| r.t_max),
        mask: [u32::MAX; 8],
        id: [0; 8],
        flags: [0; 8],
    };
    (packet, Lanes(rays.map(|ray| if ray.is_some() { -1 } else { 0 })))
}
