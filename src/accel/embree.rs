//! The door to Embree 3, the only file that knows its names.
//!
//! The scene is flat: measured on fields like ours, instancing traces 1.4–2.1 times slower. Each part becomes up to two
//! geometries: the triangles that are opaque all over, which nobody asks about, and those that the mask cuts, whose hits
//! a filter confirms. ROBUST traversal closes the crack pixels that the fast mode leaks; colour and label share it, since
//! both must see one geometry. The instruction set is pinned: hits differ in the last bits between instruction sets.

use super::Surface;
use crate::geometry::alpha::sort;
use crate::geometry::{AlphaMask, Hit, Intersect, PACKET, Ray};
use crate::math::{Vec2, Vec3};
use crate::{Error, Result};
use embree3 as rtc;
use embree3::SoAHit;
use std::sync::Arc;

/// Instruction set of the traversal kernels.
const ISA: rtc::Isa = rtc::Isa::Avx2;

/// A committed Embree scene and the way back from its ids to parts and triangles.
pub struct EmbreeAccel {
    scene: rtc::Scene<'static>,
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

impl Cut {
    fn opaque(&self, primitive: u32, u: f32, v: f32) -> bool {
        let [a, b, c] = self.uvs[primitive as usize];
        self.mask.opaque_at(a * (1.0 - u - v) + b * u + c * v)
    }
}

/// Makes this thread flush denormals as Embree's own threads do; without it bits differ from thread to thread.
pub fn prepare_thread() {
    rtc::enable_ftz_and_daz();
}

/// Version and instruction set, for headers and manifests.
pub fn version() -> Result<String> {
    let device = device(1)?;
    let number = device.get_property(rtc::DeviceProperty::VERSION).map_err(refused)?;
    Ok(format!("Embree {}.{}.{} {ISA}", number / 10000, number / 100 % 100, number % 100))
}

fn device(threads: u32) -> Result<rtc::Device> {
    let config = rtc::Config { threads, isa: Some(ISA), max_isa: ISA, ..rtc::Config::default() };
    rtc::Device::with_config(config).map_err(refused)
}

fn refused(error: rtc::Error) -> Error {
    Error::failed(format!("{error:?}"))
}

impl EmbreeAccel {
    /// Builds the hierarchy over all surfaces with `threads` threads (0: all there are).
    pub fn build(surfaces: &[Surface<'_>], threads: u32) -> Result<Self> {
        let device = device(threads)?;
        let mut scene = device.create_scene().map_err(refused)?;
        scene.set_flags(rtc::SceneFlags::ROBUST);
        scene.set_build_quality(rtc::BuildQuality::MEDIUM);
        let mut slots = Vec::with_capacity(surfaces.len());
        for (part, surface) in surfaces.iter().enumerate() {
            let part = part as u32;
            let Some(mask) = surface.mask else {
                attach(&device, &mut scene, surface, None, None)?;
                slots.push(Slot { part, triangles: None });
                continue;
            };
            let sorted = sort(surface.mesh, Some(mask));
            if !sorted.opaque.is_empty() {
                attach(&device, &mut scene, surface, Some(&sorted.opaque), None)?;
                slots.push(Slot { part, triangles: Some(sorted.opaque.into()) });
            }
            if !sorted.mixed.is_empty() {
                let uvs = sorted.mixed.iter();
                let uvs =
                    uvs.map(|i| surface.mesh.triangles[*i as usize].map(|k| surface.mesh.uvs[k as usize])).collect();
                attach(&device, &mut scene, surface, Some(&sorted.mixed), Some(Cut { uvs, mask: mask.clone() }))?;
                slots.push(Slot { part, triangles: Some(sorted.mixed.into()) });
            }
        }
        scene.commit();
        Ok(Self { scene, slots })
    }
}

/// Attaches one geometry; ids follow the order of calls. An empty surface keeps its id by a degenerate triangle.
fn attach(
    device: &rtc::Device,
    scene: &mut rtc::Scene<'static>,
    surface: &Surface<'_>,
    only: Option<&[u32]>,
    cut: Option<Cut>,
) -> Result<()> {
    let mesh = surface.mesh;
    let mut geometry = device.create_geometry(rtc::GeometryKind::TRIANGLE).map_err(refused)?;
    let count = only.map_or(mesh.triangles.len(), <[u32]>::len);
    {
        let corners = mesh.positions.len().max(1);
        let mut to = geometry
            .set_new_buffer::<[f32; 3]>(rtc::BufferUsage::VERTEX, 0, rtc::Format::FLOAT3, 12, corners)
            .map_err(refused)?;
        to[0] = [0.0; 3];
        for (to, p) in to.iter_mut().zip(&mesh.positions) {
            *to = p.to_array();
        }
    }
    {
        let mut to = geometry
            .set_new_buffer::<[u32; 3]>(rtc::BufferUsage::INDEX, 0, rtc::Format::UINT3, 12, count.max(1))
            .map_err(refused)?;
        to[0] = [0; 3];
        match only {
            None => to.iter_mut().zip(&mesh.triangles).for_each(|(to, t)| *to = *t),
            Some(only) => to.iter_mut().zip(only).for_each(|(to, i)| *to = mesh.triangles[*i as usize]),
        }
    }
    geometry.set_build_quality(rtc::BuildQuality::MEDIUM);
    if let Some(cut) = cut {
        let cut = Arc::new(cut);
        let shared = cut.clone();
        geometry.set_intersect_filter_function::<_, ()>(move |_, hits, valid, _, _| confirm(&cut, &hits, valid));
        geometry.set_occluded_filter_function::<_, ()>(move |_, hits, valid, _, _| confirm(&shared, &hits, valid));
    }
    scene.attach_geometry(&geometry.commit());
    Ok(())
}

/// Clears the lanes whose hit lies on a transparent texel.
fn confirm(cut: &Cut, hits: &rtc::HitN<'_>, mut valid: rtc::ValidityN<'_>) {
    for lane in 0..hits.len() {
        if valid[lane] == rtc::ValidMask::Valid as i32 && !cut.opaque(hits.prim_id(lane), hits.u(lane), hits.v(lane)) {
            valid[lane] = rtc::ValidMask::Invalid as i32;
        }
    }
}

fn ray(r: &Ray) -> rtc::Ray {
    rtc::Ray::segment(r.origin.to_array(), r.direction.to_array(), 0.0, r.t_max)
}

/// Which lanes of a packet hold a ray. Embree reads it in one aligned load of 32 bytes; the binding promises 16.
#[repr(align(32))]
struct Lanes(rtc::ValidMaskN<PACKET>);

/// Embree's packet of rays, and which lanes hold one.
fn packet(rays: &[Option<Ray>; PACKET]) -> (rtc::Ray8, Lanes) {
    // A lane without a ray is not looked at.
    let idle = Ray::until(Vec3::ZERO, Vec3::Z, 0.0);
    let lane = |i: usize| rays[i].as_ref().unwrap_or(&idle);
    let packet = rtc::Ray8::segment(
        std::array::from_fn(|i| lane(i).origin.to_array()),
        std::array::from_fn(|i| lane(i).direction.to_array()),
        [0.0; PACKET],
        std::array::from_fn(|i| lane(i).t_max),
    );
    let valid = rays.map(|ray| if ray.is_some() { rtc::ValidMask::Valid } else { rtc::ValidMask::Invalid });
    (packet, Lanes(valid.into()))
}

impl EmbreeAccel {
    /// The hit on a primitive of a geometry; `None` for Embree's mark of a miss.
    #[inline]
    fn hit(&self, geometry: u32, primitive: u32, u: f32, v: f32, t: f32) -> Option<Hit> {
        if geometry == rtc::INVALID_ID {
            return None;
        }
        let slot = &self.slots[geometry as usize];
        let triangle = slot.triangles.as_ref().map_or(primitive, |t| t[primitive as usize]);
        Some(Hit { part: slot.part, triangle, u, v, t })
    }
}

impl Intersect for EmbreeAccel {
    fn closest(&self, r: &Ray) -> Option<Hit> {
        let mut context = rtc::IntersectContext::incoherent();
        let mut query = rtc::RayHit::from_ray(ray(r));
        self.scene.intersect(&mut context, &mut query);
        self.hit(query.hit.geomID, query.hit.primID, query.hit.u, query.hit.v, query.ray.tfar)
    }

    fn closest_packet(&self, rays: &[Option<Ray>; PACKET]) -> [Option<Hit>; PACKET] {
        let mut context = rtc::IntersectContext::coherent();
        let (ray, valid) = packet(rays);
        let mut query = rtc::RayHit8 { ray, hit: rtc::Hit8::new() };
        self.scene.intersect8(&mut context, &mut query, &valid.0);
        let rtc::RayHit8 { ray, hit } = query;
        std::array::from_fn(|i| self.hit(hit.geomID[i], hit.primID[i], hit.u[i], hit.v[i], ray.tfar[i]))
    }

    fn occluded_packet(&self, rays: &[Option<Ray>; PACKET]) -> [bool; PACKET] {
        let mut context = rtc::IntersectContext::coherent();
        let (mut ray, valid) = packet(rays);
        self.scene.occluded8(&mut context, &mut ray, &valid.0);
        ray.tfar.map(|far| far == f32::NEG_INFINITY)
    }

    fn occluded(&self, r: &Ray) -> bool {
        let mut context = rtc::IntersectContext::incoherent();
        self.scene.occluded(&mut context, &mut ray(r))
    }
}
