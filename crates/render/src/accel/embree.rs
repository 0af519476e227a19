//! Accelerator based on Embree, version 3 or 4.
//!
//! Unique meshes are in one flat BVH: on typical fields, instancing everything traces 1.4–2.1 times slower. Plants with
//! shared meshes are instances of a BVH of their own, built once for all of them.
//!
//! Each part becomes up to two geometries: fully opaque triangles, which need no filter, and triangles cut by the mask,
//! whose hits are confirmed by a filter function. ROBUST traversal avoids the cracks along shared edges that the fast
//! mode leaves. Colour and labels use the same mode, because both must see the same geometry. The instruction set is
//! fixed, because hits differ in the last bits between instruction sets.

use super::Surface;
use furrow_base::geometry::alpha::{Sorted, sort};
use furrow_base::geometry::{AlphaMask, Hit, Intersect, Mesh, PACKET, Placement, Ray};
use furrow_base::math::{ToInt, Vec2, Vec3};
use furrow_base::{Error, Result};
use furrow_embree as embree;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Instruction set of the traversal kernels.
const ISA: &str = "avx2";

/// A committed Embree scene, and the mapping from its ids back to parts and triangles.
pub struct EmbreeAccel {
    scene: embree::Scene<AlphaTest>,
    slots: Vec<Slot>,
    /// Instances; their geometry ids follow those of the slots.
    instances: Vec<Instance>,
    /// Index of the first slot of each part, followed by the total number of slots.
    firsts: Vec<usize>,
}

/// Part of an Embree geometry, and the triangle index of each primitive; `None` if they are all of the part's triangles
/// in order.
struct Slot {
    part: u32,
    triangles: Option<Arc<[u32]>>,
}

/// First part of an instance, and the slots of its scene, whose part numbers are relative to that part.
struct Instance {
    first: u32,
    slots: Arc<[Slot]>,
}

/// Consecutive surfaces with one placement: index of the first one, the surfaces, their placement.
type Group<'a> = (u32, &'a [Surface<'a>], &'a Placement);

/// Geometries of a scene, ordered by geometry id.
type Geometries = Vec<Arc<embree::Geometry<AlphaTest>>>;

/// Scene of parts shared by several plants, and its slots, with part numbers relative to the first part.
type Shared = (Arc<embree::Scene<AlphaTest>>, Arc<[Slot]>);

/// One geometry of a part, and its triangle indices as in [`Slot`].
type Piece = (Arc<embree::Geometry<AlphaTest>>, Option<Arc<[u32]>>);

/// Previous build to reuse. For each surface, the index of the previous surface with the very same mesh and mask, if
/// there is one.
pub struct PreviousBuild<'a> {
    /// The previous accelerator.
    pub accel: &'a EmbreeAccel,
    /// Index of the matching previous surface, one entry per surface.
    pub places: &'a [Option<usize>],
}

/// Data of the alpha test of a masked geometry: texture coordinates of the vertices by primitive, and the mask.
struct AlphaTest {
    uvs: Box<[[Vec2; 3]]>,
    mask: Arc<AlphaMask>,
}

impl embree::Filter for AlphaTest {
    fn accepts(&self, primitive: u32, u: f32, v: f32) -> bool {
        let [a, b, c] = self.uvs[primitive.to_usize()];
        self.mask.opaque_at(a * (1.0 - u - v) + b * u + c * v)
    }
}

/// Converts an Embree error; a cancelled build is an interruption.
fn failed(error: embree::Error) -> Error {
    match error {
        embree::Error::Cancelled => Error::interrupted(),
        other => Error::failed(other.to_string()),
    }
}

/// Vertex positions of a mesh in Embree's format.
fn positions(mesh: &Mesh) -> impl ExactSizeIterator<Item = [f32; 3]> + '_ {
    mesh.positions.iter().map(Vec3::to_array)
}

#[inline]
fn converted(ray: &Ray) -> embree::Ray {
    embree::Ray { origin: ray.origin.to_array(), direction: ray.direction.to_array(), t_max: ray.t_max }
}

#[inline]
fn packet(rays: &[Option<Ray>; PACKET]) -> [Option<embree::Ray>; PACKET] {
    std::array::from_fn(|i| rays[i].as_ref().map(converted))
}

/// Enables flush-to-zero for denormals on this thread, as on Embree's own threads; otherwise results differ in the last
/// bits between threads.
pub fn prepare_thread() {
    embree::prepare_thread();
}

/// Embree version and instruction set, for image headers and manifests.
pub fn version() -> Result<String> {
    let number = embree::Device::new(ISA, 1).map_err(failed)?.version();
    Ok(format!("Embree {}.{}.{} {ISA}", number / 10000, number / 100 % 100, number % 100))
}

impl EmbreeAccel {
    /// Builds the BVH over all surfaces with `threads` threads (0: all cores). Masks are classified in the caller's
    /// thread pool.
    pub fn build(surfaces: &[Surface<'_>], threads: u32) -> Result<Self> {
        Self::build_until(surfaces, threads, None, None)
    }

    /// Like [`Self::build`], reusing a previous build. Returns an interruption if `outdated` is set before the build is
    /// finished.
    pub fn build_until(
        surfaces: &[Surface<'_>],
        threads: u32,
        outdated: Option<&AtomicBool>,
        before: Option<&PreviousBuild<'_>>,
    ) -> Result<Self> {
        Self::built(surfaces, threads, outdated, before, false)
    }

    /// Fast build for few rays, by Morton codes: takes a fraction of the time, but traces slower. The hits are the
    /// same.
    pub fn build_quickly(surfaces: &[Surface<'_>], threads: u32, outdated: Option<&AtomicBool>) -> Result<Self> {
        Self::built(surfaces, threads, outdated, None, true)
    }

    fn built(
        surfaces: &[Surface<'_>],
        threads: u32,
        outdated: Option<&AtomicBool>,
        before: Option<&PreviousBuild<'_>>,
        quick: bool,
    ) -> Result<Self> {
        let device = match before {
            Some(before) => before.accel.scene.device().clone(),
            None => Arc::new(embree::Device::new(ISA, threads).map_err(failed)?),
        };
        let made = |(i, surface): (usize, &Surface<'_>)| match before.and_then(|b| Some((b.accel, b.places[i]?))) {
            // Geometries of instances are built once per shared scene, below.
            _ if surface.instance.is_some() => Ok(Vec::new()),
            Some((accel, place)) => Ok(accel.pieces(place)),
            None => pieces(&device, surface),
        };
        let made: Vec<Vec<Piece>> = surfaces.par_iter().enumerate().map(made).collect::<Result<_>>()?;
        let Flat { slots, mut geometries, firsts } = Flat::of(made);
        let (instances, placed) = instances(&device, surfaces, quick)?;
        geometries.extend(placed);
        let scene = embree::Scene::build(&device, geometries, quick, outdated).map_err(failed)?;
        Ok(Self { scene, slots, instances, firsts })
    }

    /// Returns the geometries of a part, for reuse.
    fn pieces(&self, part: usize) -> Vec<Piece> {
        let range = self.firsts[part]..self.firsts[part + 1];
        let geometries = self.scene.geometries()[range.clone()].iter();
        geometries.zip(&self.slots[range]).map(|(g, slot)| (g.clone(), slot.triangles.clone())).collect()
    }

    /// Converts Embree's hit to a hit on a part.
    #[inline]
    fn hit(&self, embree::Hit { instance, geometry, primitive, u, v, t }: embree::Hit) -> Hit {
        let (first, slots) = match instance {
            None => (0, &self.slots[..]),
            Some(number) => {
                let instance = &self.instances[number.to_usize() - self.slots.len()];
                (instance.first, &instance.slots[..])
            }
        };
        let slot = &slots[geometry.to_usize()];
        let triangle = slot.triangles.as_ref().map_or(primitive, |t| t[primitive.to_usize()]);
        Hit { part: first + slot.part, triangle, u, v, t }
    }
}

/// Geometries of several parts in one flat scene.
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

/// Builds the instances among the surfaces and their geometries. Consecutive surfaces with one placement become one
/// instance; groups with the same meshes and masks share one scene.
fn instances(
    device: &Arc<embree::Device>,
    surfaces: &[Surface<'_>],
    quick: bool,
) -> Result<(Vec<Instance>, Geometries)> {
    let mut groups: Vec<Group<'_>> = Vec::new();
    let mut first = 0;
    for group in surfaces.chunk_by(|a, b| a.instance.map(Arc::as_ptr) == b.instance.map(Arc::as_ptr)) {
        groups.extend(group[0].instance.map(|placement| (first, group, &**placement)));
        first += group.len().to_u32();
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
        Ok((Arc::new(embree::Scene::build(device, geometries, quick, None).map_err(failed)?), slots.into()))
    };
    let shared: Vec<Shared> = distinct.par_iter().map(share).collect::<Result<_>>()?;
    let place = |(first, group, at): &Group<'_>| {
        let (scene, slots) = &shared[numbers[&key(group)]];
        let turned = at.matrix();
        let columns = [turned.x_axis, turned.y_axis, turned.z_axis, at.offset];
        let geometry = embree::Geometry::instance(scene, columns.map(|column| column.to_array())).map_err(failed)?;
        Ok((Instance { first: *first, slots: slots.clone() }, Arc::new(geometry)))
    };
    groups.iter().map(place).collect::<Result<Vec<_>>>().map(|all| all.into_iter().unzip())
}

/// Builds the geometries of a surface: its fully opaque triangles, and those cut by its mask.
fn pieces(device: &Arc<embree::Device>, Surface { mesh, mask, .. }: &Surface<'_>) -> Result<Vec<Piece>> {
    let new = |triangles: &[u32], cut| {
        let corners = triangles.iter().map(|i| mesh.triangles[i.to_usize()]);
        let geometry = embree::Geometry::new(device, positions(mesh), corners, cut).map_err(failed)?;
        Ok::<_, Error>((Arc::new(geometry), Some(triangles.into())))
    };
    let Some(mask) = mask else {
        let geometry =
            embree::Geometry::new(device, positions(mesh), mesh.triangles.iter().copied(), None).map_err(failed)?;
        return Ok(vec![(Arc::new(geometry), None)]);
    };
    let Sorted { opaque, mixed } = sort(mesh, Some(mask));
    let mut pieces = Vec::with_capacity(2);
    if !opaque.is_empty() {
        pieces.push(new(&opaque, None)?);
    }
    if !mixed.is_empty() {
        let uvs = mixed.iter().map(|i| mesh.triangles[i.to_usize()].map(|k| mesh.uvs[k.to_usize()])).collect();
        pieces.push(new(&mixed, Some(AlphaTest { uvs, mask: Arc::clone(mask) }))?);
    }
    Ok(pieces)
}

impl Intersect for EmbreeAccel {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.scene.closest(&converted(ray)).map(|hit| self.hit(hit))
    }

    fn closest_packet(&self, rays: &[Option<Ray>; PACKET]) -> [Option<Hit>; PACKET] {
        self.scene.closest_packet(&packet(rays)).map(|hit| hit.map(|hit| self.hit(hit)))
    }

    fn occluded_packet(&self, rays: &[Option<Ray>; PACKET]) -> [bool; PACKET] {
        self.scene.occluded_packet(&packet(rays))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.scene.occluded(&converted(ray))
    }
}
