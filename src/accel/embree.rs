//! The accelerator over Embree, version 3 or 4.
//!
//! What stands by itself lies flat in one hierarchy: measured on fields like ours, instancing traces 1.4–2.1 times slower. Plants whose
//! meshes others share are instances of a hierarchy of their own, which is built once for all of them. Each part becomes up to two
//! geometries: the triangles that are opaque all over, which nobody asks about, and those that the mask cuts, whose hits
//! a filter confirms. ROBUST traversal closes the crack pixels that the fast mode leaks; colour and label share it, since
//! both must see one geometry. The instruction set is pinned: hits differ in the last bits between instruction sets.

use super::{Surface, rtc};
use crate::geometry::alpha::{Sorted, sort};
use crate::geometry::{AlphaMask, Hit, Intersect, PACKET, Placement, Ray};
use crate::math::Vec2;
use crate::{Error, Result};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Instruction set of the traversal kernels.
const ISA: &str = "avx2";

/// A committed Embree scene and the way back from its ids to parts and triangles.
pub struct EmbreeAccel {
    scene: rtc::Scene<Cut>,
    slots: Vec<Slot>,
    /// The geometries behind those of the slots.
    instances: Vec<Instance>,
    /// For each part the first of its slots, and the number of all.
    firsts: Vec<usize>,
}

/// An Embree geometry's part, and its triangles where they are not simply all of them in order.
struct Slot {
    part: u32,
    triangles: Option<Arc<[u32]>>,
}

/// An instance's first part, and the geometries of its scene, whose parts are counted from there.
struct Instance {
    first: u32,
    slots: Arc<[Slot]>,
}

/// Neighbours with one placement: the first of them, all of them, and where they stand.
type Group<'a> = (u32, &'a [Surface<'a>], &'a Placement);

/// Geometries of a scene in the order of their numbers.
type Geometries = Vec<Arc<rtc::Geometry<Cut>>>;

/// A scene of parts that several plants share, and its slots, whose parts are counted from the first.
type Shared = (Arc<rtc::Scene<Cut>>, Arc<[Slot]>);

/// One geometry of a part, and its triangles as in [`Slot`].
type Piece = (Arc<rtc::Geometry<Cut>>, Option<Arc<[u32]>>);

/// Where a build begins that is not the first: what was built before, and for each surface its place among those of before if it is the very
/// same mesh with the very same mask.
pub struct Before<'a> {
    /// What was built.
    pub accel: &'a EmbreeAccel,
    /// One place for each surface.
    pub places: &'a [Option<usize>],
}

/// What the filter of a masked geometry asks: the corners' texture coordinates by primitive, and the mask.
struct Cut {
    uvs: Box<[[Vec2; 3]]>,
    mask: Arc<AlphaMask>,
}

impl rtc::Filter for Cut {
    fn keeps(&self, primitive: u32, u: f32, v: f32) -> bool {
        let [a, b, c] = self.uvs[primitive as usize];
        self.mask.opaque_at(a * (1.0 - u - v) + b * u + c * v)
    }
}

/// Makes this thread flush denormals as Embree's own threads do; without it bits differ from thread to thread.
pub fn prepare_thread() {
    rtc::prepare_thread();
}

/// Version and instruction set, for headers and manifests.
pub fn version() -> Result<String> {
    let number = rtc::Device::new(ISA, 1)?.version();
    Ok(format!("Embree {}.{}.{} {ISA}", number / 10000, number / 100 % 100, number % 100))
}

impl EmbreeAccel {
    /// Builds the hierarchy over all surfaces with `threads` threads (0: all there are); masks are looked at in the pool that it is called in.
    pub fn build(surfaces: &[Surface<'_>], threads: u32) -> Result<Self> {
        Self::build_until(surfaces, threads, None, None)
    }

    /// The same from what was built before; an interruption where the flag is raised before it is built.
    pub fn build_until(
        surfaces: &[Surface<'_>],
        threads: u32,
        outdated: Option<&AtomicBool>,
        before: Option<&Before<'_>>,
    ) -> Result<Self> {
        Self::built(surfaces, threads, outdated, before, false)
    }

    /// The same for few rays: built by Morton codes, in a fraction of the time, and slower to ask. What a ray hits is the same.
    pub fn build_quickly(surfaces: &[Surface<'_>], threads: u32, outdated: Option<&AtomicBool>) -> Result<Self> {
        Self::built(surfaces, threads, outdated, None, true)
    }

    fn built(
        surfaces: &[Surface<'_>],
        threads: u32,
        outdated: Option<&AtomicBool>,
        before: Option<&Before<'_>>,
        quick: bool,
    ) -> Result<Self> {
        let device = match before {
            Some(before) => before.accel.scene.device().clone(),
            None => Arc::new(rtc::Device::new(ISA, threads)?),
        };
        let made = |(i, surface): (usize, &Surface<'_>)| match before.and_then(|b| Some((b.accel, b.places[i]?))) {
            // Those of an instance are made once for all of it.
            _ if surface.instance.is_some() => Ok(Vec::new()),
            Some((accel, place)) => Ok(accel.pieces(place)),
            None => pieces(&device, surface),
        };
        let made: Vec<Vec<Piece>> = surfaces.par_iter().enumerate().map(made).collect::<Result<_>>()?;
        let Flat { slots, mut geometries, firsts } = Flat::of(made);
        let (instances, placed) = instances(&device, surfaces, quick)?;
        geometries.extend(placed);
        Ok(Self { scene: rtc::Scene::build(&device, geometries, quick, outdated)?, slots, instances, firsts })
    }

    /// The geometries of a part.
    fn pieces(&self, part: usize) -> Vec<Piece> {
        let range = self.firsts[part]..self.firsts[part + 1];
        let geometries = self.scene.geometries()[range.clone()].iter();
        geometries.zip(&self.slots[range]).map(|(g, slot)| (g.clone(), slot.triangles.clone())).collect()
    }

    /// Embree's hit as a hit on a part.
    #[inline]
    fn hit(&self, rtc::Hit { instance, geometry, primitive, u, v, t }: rtc::Hit) -> Hit {
        let (first, slots) = match instance {
            None => (0, &self.slots[..]),
            Some(number) => {
                let instance = &self.instances[number as usize - self.slots.len()];
                (instance.first, &instance.slots[..])
            }
        };
        let slot = &slots[geometry as usize];
        let triangle = slot.triangles.as_ref().map_or(primitive, |t| t[primitive as usize]);
        Hit { part: first + slot.part, triangle, u, v, t }
    }
}

/// The geometries of parts one after another.
struct Flat {
    slots: Vec<Slot>,
    geometries: Geometries,
    /// See [`EmbreeAccel::firsts`].
    firsts: Vec<usize>,
}

impl Flat {
    fn of(made: Vec<Vec<Piece>>) -> Self {
        let (mut slots, mut geometries) = (Vec::with_capacity(made.len()), Vec::with_capacity(made.len()));
        let mut firsts = Vec::with_capacity(made.len() + 1);
        for (part, pieces) in (0..).zip(made) {
            firsts.push(slots.len());
            for (geometry, triangles) in pieces {
                slots.push(Slot { part, triangles });
                geometries.push(geometry);
            }
        }
        firsts.push(slots.len());
        Self { slots, geometries, firsts }
    }
}

/// The instances among the surfaces, and their geometries: neighbours with one placement are one. What has the same meshes and masks is
/// built once.
fn instances(device: &Arc<rtc::Device>, surfaces: &[Surface<'_>], quick: bool) -> Result<(Vec<Instance>, Geometries)> {
    let mut groups: Vec<Group<'_>> = Vec::new();
    let mut first = 0;
    for group in surfaces.chunk_by(|a, b| a.instance.map(Arc::as_ptr) == b.instance.map(Arc::as_ptr)) {
        groups.extend(group[0].instance.map(|placement| (first, group, &**placement)));
        first += group.len() as u32;
    }
    let address = |surface: &Surface<'_>| (std::ptr::from_ref(surface.mesh), surface.mask.map(Arc::as_ptr));
    let key = |group: &[Surface<'_>]| -> Vec<_> { group.iter().map(address).collect() };
    let (mut numbers, mut distinct) = (HashMap::new(), Vec::new());
    for (_, group, _) in &groups {
        numbers.entry(key(group)).or_insert_with(|| {
            distinct.push(*group);
            distinct.len() - 1
        });
    }
    let share = |group: &&[Surface<'_>]| -> Result<Shared> {
        let made = group.iter().map(|surface| pieces(device, surface)).collect::<Result<Vec<_>>>()?;
        let Flat { slots, geometries, .. } = Flat::of(made);
        Ok((Arc::new(rtc::Scene::build(device, geometries, quick, None)?), slots.into()))
    };
    let shared: Vec<Shared> = distinct.par_iter().map(share).collect::<Result<_>>()?;
    let place = |(first, group, at): &Group<'_>| {
        let (scene, slots) = &shared[numbers[&key(group)]];
        let (turned, offset) = (at.matrix(), at.offset);
        let geometry = rtc::Geometry::instance(scene, [turned.x_axis, turned.y_axis, turned.z_axis, offset])?;
        Ok((Instance { first: *first, slots: slots.clone() }, Arc::new(geometry)))
    };
    groups.iter().map(place).collect::<Result<Vec<_>>>().map(|all| all.into_iter().unzip())
}

/// The geometries of a surface: what is opaque all over, and what its mask cuts.
fn pieces(device: &Arc<rtc::Device>, Surface { mesh, mask, .. }: &Surface<'_>) -> Result<Vec<Piece>> {
    let new = |triangles: &[u32], cut| {
        let corners = triangles.iter().map(|i| mesh.triangles[*i as usize]);
        let geometry = rtc::Geometry::new(device, &mesh.positions, corners, cut)?;
        Ok::<_, Error>((Arc::new(geometry), Some(triangles.into())))
    };
    let Some(mask) = mask else {
        let geometry = rtc::Geometry::new(device, &mesh.positions, mesh.triangles.iter().copied(), None)?;
        return Ok(vec![(Arc::new(geometry), None)]);
    };
    let Sorted { opaque, mixed } = sort(mesh, Some(mask));
    let mut pieces = Vec::with_capacity(2);
    if !opaque.is_empty() {
        pieces.push(new(&opaque, None)?);
    }
    if !mixed.is_empty() {
        let uvs = mixed.iter().map(|i| mesh.triangles[*i as usize].map(|k| mesh.uvs[k as usize])).collect();
        pieces.push(new(&mixed, Some(Cut { uvs, mask: Arc::clone(mask) }))?);
    }
    Ok(pieces)
}

impl Intersect for EmbreeAccel {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.scene.closest(ray).map(|hit| self.hit(hit))
    }

    fn closest_packet(&self, rays: &[Option<Ray>; PACKET]) -> [Option<Hit>; PACKET] {
        self.scene.closest_packet(rays).map(|hit| hit.map(|hit| self.hit(hit)))
    }

    fn occluded_packet(&self, rays: &[Option<Ray>; PACKET]) -> [bool; PACKET] {
        self.scene.occluded_packet(rays)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.scene.occluded(ray)
    }
}
