//! The accelerator over Embree, version 3 or 4.
//!
//! The scene is flat: measured on fields like ours, instancing traces 1.4–2.1 times slower. Each part becomes up to two
//! geometries: the triangles that are opaque all over, which nobody asks about, and those that the mask cuts, whose hits
//! a filter confirms. ROBUST traversal closes the crack pixels that the fast mode leaks; colour and label share it, since
//! both must see one geometry. The instruction set is pinned: hits differ in the last bits between instruction sets.

use super::{Surface, rtc};
use crate::Result;
use crate::geometry::alpha::{Sorted, sort};
use crate::geometry::{AlphaMask, Hit, Intersect, PACKET, Ray};
use crate::math::Vec2;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Instruction set of the traversal kernels.
const ISA: &str = "avx2";

/// A committed Embree scene and the way back from its ids to parts and triangles.
pub struct EmbreeAccel {
    scene: rtc::Scene<Cut>,
    slots: Vec<Slot>,
}

/// An Embree geometry's part, and its triangles where they are not simply all of them in order.
struct Slot {
    part: u32,
    triangles: Option<Box<[u32]>>,
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
        Self::build_until(surfaces, threads, None)
    }

    /// The same; an interruption where the flag is raised before it is built.
    pub fn build_until(surfaces: &[Surface<'_>], threads: u32, outdated: Option<&AtomicBool>) -> Result<Self> {
        let mut scene = rtc::Builder::new(rtc::Device::new(ISA, threads)?)?;
        let mut slots = Vec::with_capacity(surfaces.len());
        let cut = |surface: &Surface<'_>| surface.mask.map(|mask| sort(surface.mesh, Some(mask)));
        let sorted: Vec<Option<Sorted>> = surfaces.par_iter().map(cut).collect();
        for (part, (Surface { mesh, mask }, sorted)) in surfaces.iter().zip(sorted).enumerate() {
            let part = part as u32;
            let (Some(mask), Some(sorted)) = (mask, sorted) else {
                scene.attach(&mesh.positions, mesh.triangles.iter().copied(), None)?;
                slots.push(Slot { part, triangles: None });
                continue;
            };
            let only = |i: &u32| mesh.triangles[*i as usize];
            if !sorted.opaque.is_empty() {
                scene.attach(&mesh.positions, sorted.opaque.iter().map(only), None)?;
                slots.push(Slot { part, triangles: Some(sorted.opaque.into()) });
            }
            if !sorted.mixed.is_empty() {
                let uvs = sorted.mixed.iter().map(|i| only(i).map(|k| mesh.uvs[k as usize])).collect();
                let cut = Cut { uvs, mask: Arc::clone(mask) };
                scene.attach(&mesh.positions, sorted.mixed.iter().map(only), Some(cut))?;
                slots.push(Slot { part, triangles: Some(sorted.mixed.into()) });
            }
        }
        Ok(Self { scene: scene.commit(outdated)?, slots })
    }

    /// Embree's hit as a hit on a part.
    #[inline]
    fn hit(&self, rtc::Hit { geometry, primitive, u, v, t }: rtc::Hit) -> Hit {
        let slot = &self.slots[geometry as usize];
        let triangle = slot.triangles.as_ref().map_or(primitive, |t| t[primitive as usize]);
        Hit { part: slot.part, triangle, u, v, t }
    }
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
