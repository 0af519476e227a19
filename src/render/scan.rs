//! What a LiDAR measures of a field: echoes with ranges, intensities and exact labels.
//!
//! The pulse of a beam is a bundle of rays, each with a share w of its energy ([`Lidar::rays`]). A ray that meets a surface at the range r brings back
//!
//! ```text
//! w π f cos θ / r²
//! ```
//!
//! where f is the surface's BSDF in near infrared for light that leaves as it came, and cos θ that of the ray to the normal: the LiDAR equation of targets that
//! are larger than the beam, without what air takes, with 1 for a white, matt surface met squarely at 1 m. Rays whose ranges differ by less than half the
//! length of the pulse make one echo: its intensity is their sum, its range their mean, weighed by what they bring, and its labels are those of the leaf, or
//! whatever else has a label of its own, that brings most of it; normal and reflectance are those where that is brightest. Neighbouring rays on one leaf, or
//! both on the soil, may lie as much farther apart as that surface stretches along them between their distances across, d tan θ: a slope is one long echo.
//! The range of each echo errs by a normal number of its own; what is then out of the range that the LiDAR tells is not told.
//!
//! Sources: Wagner, Ullrich, Ducic, Melzer & Studnicka 2006, "Gaussian decomposition and calibration of a novel small-footprint full-waveform digitising airborne
//! laser scanner", ISPRS Journal 60; Jelalian 1992, "Laser Radar Systems".

use super::label::normal;
use crate::geometry::{PACKET, Ray};
use crate::integrator::World;
use crate::math::{Spectrum, Vec3};
use crate::sampling::{Purpose, Stream};
use crate::scene::Part;
use crate::sensor::{BeamRay, Lidar, Pulse};
use rayon::prelude::*;

/// Least cosine by which a surface is taken to stretch along a ray.
const LEAST_COS: f32 = 5e-3;

/// One echo of one pulse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Echo {
    /// The pulse.
    pub pulse: Pulse,
    /// As it was measured, metres.
    pub range: f32,
    /// Of the LiDAR equation: 1 for a white, matt surface met squarely at 1 m.
    pub intensity: f32,
    /// Its place among the pulse's echoes that were detected, from 1 for the nearest, and their number.
    pub number: u8,
    /// Number of echoes that were detected of the pulse, told or not.
    pub count: u8,
    /// Index of the part with its label, that of what brings most of it; the part that shows the brightest of that.
    pub part: u32,
    /// Unit shading normal of its mesh there, on the side that the LiDAR sees.
    pub normal: Vec3,
    /// Its reflectance there.
    pub reflectance: Spectrum,
}

impl Echo {
    /// Where the LiDAR finds it: on the pulse's axis.
    pub fn at(&self) -> Vec3 {
        self.pulse.origin + self.pulse.direction * self.range
    }
}

/// What one ray of a pulse brings back.
struct Glint {
    range: f32,
    /// How much deeper than it is wide: range over which the surface stretches within the width of the ray, metres.
    depth: f32,
    energy: f32,
    part: u32,
    normal: Vec3,
    reflectance: Spectrum,
}

/// The echoes of one turn of a LiDAR, column by column and beam by beam. Ranges err by numbers of `stream`. Call it inside a pool.
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

/// The echoes that a LiDAR tells of one pulse, by rising range.
fn echoes(world: &World<'_>, lidar: &Lidar, pulse: Pulse, errors: &mut Stream) -> Vec<Echo> {
    let parts = &world.scene.parts;
    let mut glints = glints(world, lidar, &lidar.rays(&pulse));
    glints.sort_by(|a, b| a.range.total_cmp(&b.range));
    let clusters = glints.chunk_by(|near, far| {
        let same = parts[near.part as usize].tag == parts[far.part as usize].tag;
        let stretched = if same { 0.5 * (near.depth + far.depth) } else { 0.0 };
        far.range - near.range <= lidar.separation + stretched
    });
    let mut all: Vec<Echo> = clusters.filter_map(|cluster| echo(parts, lidar, pulse, cluster)).collect();
    for echo in &mut all {
        echo.range += (lidar.noise * errors.normal()) as f32;
    }
    // What is told is what was measured: its order too, and none beyond the range.
    all.retain(|echo| lidar.tells(echo.range));
    all.sort_by(|a, b| a.range.total_cmp(&b.range));
    let count = all.len() as u8;
    for (number, echo) in (1..).zip(&mut all) {
        (echo.number, echo.count) = (number, count);
    }
    let intensities: Vec<f32> = all.iter().map(|echo| echo.intensity).collect();
    lidar.returns.told(&intensities).into_iter().map(|k| all[k]).collect()
}

/// What a pulse's rays bring back, in their order.
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
            let normal = normal(&world.scene.parts[hit.part as usize], &hit, asked.direction);
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

/// The echo of what comes back at about one time; `None` where it is not detected.
fn echo(parts: &[Part], lidar: &Lidar, pulse: Pulse, cluster: &[Glint]) -> Option<Echo> {
    let energy: f32 = cluster.iter().map(|glint| glint.energy).sum();
    let range = cluster.iter().map(|glint| glint.energy * glint.range).sum::<f32>() / energy;
    // Nothing comes back of what is black, and then there is no range.
    if !(energy > 0.0 && energy >= lidar.least && lidar.tells(range)) {
        return None;
    }
    let tag = |glint: &Glint| parts[glint.part as usize].tag;
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
