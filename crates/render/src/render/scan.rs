//! LiDAR simulation: echoes of a field with ranges, intensities and exact labels.
//!
//! The pulse of a beam is a bundle of rays, each with a fraction w of its energy ([`Lidar::rays`]). A ray that hits a
//! surface at range r returns
//!
//! ```text
//! w π f cos θ / r²
//! ```
//!
//! where f is the near-infrared BSDF of the surface for retroreflection and θ the angle between ray and normal: the
//! LiDAR equation for targets larger than the beam, without atmospheric loss, normalised to 1 for a white Lambertian
//! surface at normal incidence and 1 m.
//!
//! Rays whose ranges differ by less than half the pulse length form one echo. Its intensity is their sum, its range
//! their energy-weighted mean. Its label is that of the leaf, or other labelled object, that returns most of the
//! energy; normal and reflectance are taken at the brightest ray of that object.
//!
//! Neighbouring rays on the same leaf, or both on the soil, may be further apart by the extent of that surface along
//! them over their lateral distance d, d tan θ: a slope gives one long echo. A normally distributed error is added to
//! the range of each echo. Echoes that are then outside the reported range are dropped.
//!
//! Sources: Wagner, Ullrich, Ducic, Melzer & Studnicka 2006, "Gaussian decomposition and calibration of a novel
//! small-footprint full-waveform digitising airborne laser scanner", ISPRS Journal 60; Jelalian 1992, "Laser Radar
//! Systems".

use super::label::normal;
use crate::integrator::World;
use crate::scene::Part;
use furrow_base::geometry::{PACKET, Ray};
use furrow_base::math::{Spectrum, ToFloat, ToInt, Vec3};
use furrow_base::sampling::{Purpose, Stream};
use furrow_optics::sensor::{BeamRay, Lidar, Pulse};
use rayon::prelude::*;

/// Minimum cosine used for the extent of a surface along a ray.
const LEAST_COS: f32 = 5e-3;

/// One echo of one pulse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Echo {
    /// The pulse.
    pub pulse: Pulse,
    /// Measured range, metres.
    pub range: f32,
    /// Intensity by the LiDAR equation: 1 for a white Lambertian surface at normal incidence and 1 m.
    pub intensity: f32,
    /// Number of the echo among the detected echoes of the pulse, from 1 for the nearest.
    pub number: u8,
    /// Number of detected echoes of the pulse, reported or not.
    pub count: u8,
    /// Index of the labelled part that returns most of the energy: the part with the brightest ray of that label.
    pub part: u32,
    /// Unit shading normal of its mesh there, facing the LiDAR.
    pub normal: Vec3,
    /// Its reflectance there.
    pub reflectance: Spectrum,
}

impl Echo {
    /// Measured position, on the axis of the pulse.
    pub fn at(&self) -> Vec3 {
        self.pulse.origin + self.pulse.direction * self.range
    }

    /// Apparent reflectance: that of a white Lambertian surface at normal incidence is 1.
    pub fn apparent_reflectance(&self) -> f32 {
        self.intensity * self.range * self.range
    }
}

/// Energy returned by one ray of a pulse.
struct Glint {
    range: f32,
    /// Extent of the surface along the ray within the ray's width, metres.
    depth: f32,
    energy: f32,
    part: u32,
    normal: Vec3,
    reflectance: Spectrum,
}

/// Simulates one revolution of a LiDAR. Returns the echoes ordered by column, then beam. Range errors are sampled from
/// `stream`. Call it inside a pool.
pub fn scan(world: &World<'_>, lidar: &Lidar, stream: &Stream) -> Vec<Echo> {
    let beams = u64::from(lidar.beams());
    let column = |column: u32| {
        (0..lidar.beams()).flat_map(move |beam| {
            let address = u64::from(column) * beams + u64::from(beam);
            let mut errors = stream.child(Purpose::Lidar, address);
            echoes(world, lidar, lidar.pulse(column, beam), &mut errors)
        })
    };
    (0..lidar.columns()).into_par_iter().flat_map_iter(column).collect()
}

/// Returns the reported echoes of one pulse, sorted by range.
fn echoes(world: &World<'_>, lidar: &Lidar, pulse: Pulse, errors: &mut Stream) -> Vec<Echo> {
    let parts = &world.scene.parts;
    let mut glints = glints(world, lidar, &lidar.rays(&pulse));
    glints.sort_by(|a, b| a.range.total_cmp(&b.range));
    let clusters = glints.chunk_by(|near, far| {
        let same = parts[near.part.to_usize()].tag == parts[far.part.to_usize()].tag;
        let stretched = if same { 0.5 * (near.depth + far.depth) } else { 0.0 };
        far.range - near.range <= lidar.separation + stretched
    });
    let mut all: Vec<Echo> = clusters.filter_map(|cluster| echo(parts, lidar, pulse, cluster)).collect();
    for echo in &mut all {
        echo.range += (lidar.noise * errors.normal()).to_f32();
    }
    // The LiDAR reports measured values: their order, and only those within its range.
    all.retain(|echo| lidar.in_range(echo.range));
    all.sort_by(|a, b| a.range.total_cmp(&b.range));
    let count = all.len().to_u8();
    for (number, echo) in (1..).zip(&mut all) {
        (echo.number, echo.count) = (number, count);
    }
    let intensities: Vec<f32> = all.iter().map(|echo| echo.intensity).collect();
    lidar.returns.reported(&intensities).into_iter().map(|k| all[k]).collect()
}

/// Traces the rays of a pulse and returns their glints in order.
fn glints(world: &World<'_>, lidar: &Lidar, rays: &[BeamRay]) -> Vec<Glint> {
    let mut all = Vec::with_capacity(rays.len());
    for some in rays.chunks(PACKET) {
        let mut asked = [None; PACKET];
        for (ray, asked) in some.iter().zip(&mut asked) {
            *asked = Some(Ray::until(ray.origin, ray.direction, lidar.range[1]));
        }
        let hits = world.geometry.closest_packet(&asked);
        for ((beam, asked), hit) in some.iter().zip(&asked).zip(hits) {
            let (Some(hit), Some(asked)) = (hit, asked) else { continue };
            let width = lidar.spacing(hit.t);
            let (back, reflectance) = world.backscatter(asked, &hit, width);
            let [.., nir] = back.to_array();
            let normal = normal(&world.scene.parts[hit.part.to_usize()], &hit, asked.direction);
            let cos = normal.dot(asked.direction).abs().clamp(LEAST_COS, 1.0);
            all.push(Glint {
                range: hit.t,
                depth: width * (1.0 - cos * cos).sqrt() / cos,
                energy: beam.share * nir / (hit.t * hit.t),
                part: hit.part,
                normal,
                reflectance,
            });
        }
    }
    all
}

/// Combines rays with nearly equal ranges into an echo; `None` if it is not detected.
fn echo(parts: &[Part], lidar: &Lidar, pulse: Pulse, cluster: &[Glint]) -> Option<Echo> {
    let energy: f32 = cluster.iter().map(|glint| glint.energy).sum();
    let range = cluster.iter().map(|glint| glint.energy * glint.range).sum::<f32>() / energy;
    // A black surface returns nothing, so there is no range.
    if !(energy > 0.0 && energy >= lidar.least && lidar.in_range(range)) {
        return None;
    }
    let tag = |glint: &Glint| parts[glint.part.to_usize()].tag;
    let of_its_kind = |glint: &Glint| cluster.iter().filter(|g| tag(g) == tag(glint)).map(|g| g.energy).sum::<f32>();
    let rank = |glint: &Glint| (of_its_kind(glint), glint.energy);
    let most = cluster.iter().reduce(|a, b| if rank(b) > rank(a) { b } else { a })?;
    Some(Echo {
        pulse,
        range,
        intensity: energy,
        number: 1,
        count: 1,
        part: most.part,
        normal: most.normal,
        reflectance: most.reflectance,
    })
}
