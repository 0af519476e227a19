//! Ray traces a sphere, instanced on a grid, to a portable graymap on standard output: `… --example spheres >
//! spheres.pgm`.

#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "the numbers of an example are small"
)]

use furrow_embree::{Device, Error, Everything, Geometry, Ray, Scene};
use std::io::Write;
use std::sync::Arc;

const SIZE: usize = 400;
/// Number of segments around the sphere's axis, and between its poles.
const SEGMENTS: u32 = 64;

/// Returns vertices and triangles of a sphere of radius 0.45.
fn sphere() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let (mut corners, mut triangles) = (Vec::new(), Vec::new());
    let step = |i: u32| std::f32::consts::PI * i as f32 / SEGMENTS as f32;
    for i in 0..=SEGMENTS {
        for j in 0..SEGMENTS {
            let (polar, azimuth) = (step(i), 2.0 * step(j));
            corners.push([polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()].map(|x| 0.45 * x));
            if i < SEGMENTS {
                let next = (j + 1) % SEGMENTS;
                let [a, b] = [i * SEGMENTS + j, i * SEGMENTS + next];
                triangles.extend([[a, a + SEGMENTS, b], [b, a + SEGMENTS, b + SEGMENTS]]);
            }
        }
    }
    (corners, triangles)
}

fn main() -> Result<(), Error> {
    let device = Arc::new(Device::new("avx2", 0)?);
    let (corners, triangles) = sphere();
    let mesh = Geometry::new(&device, corners.into_iter(), triangles.into_iter(), None::<Everything>)?;
    let shared = Arc::new(Scene::build(&device, vec![Arc::new(mesh)], false, None)?);
    let places = (0..16_u8).map(|i| [f32::from(i % 4) - 1.5, f32::from(i / 4) - 1.5, 0.0]);
    let instance = |at| Geometry::instance(&shared, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], at]);
    let instances = places.map(|at| instance(at).map(Arc::new)).collect::<Result<Vec<_>, _>>()?;
    let scene = Scene::build(&device, instances, false, None)?;

    let mut image = Vec::with_capacity(SIZE * SIZE);
    for y in 0..SIZE {
        for x in 0..SIZE {
            let at = |pixel: usize| (pixel as f32 + 0.5) / SIZE as f32 * 4.0 - 2.0;
            let ray = Ray { origin: [at(x), -at(y), 2.0], direction: [0.0, 0.0, -1.0], t_max: f32::INFINITY };
            // Brightness decreases with distance, from 1.55 at the nearest point of a sphere to 2 at its equator.
            image.push(scene.closest(&ray).map_or(0, |hit| (255.0 * (2.1 - hit.t) / 0.55) as u8));
        }
    }
    let mut out = std::io::stdout().lock();
    let written = writeln!(out, "P5 {SIZE} {SIZE} 255").and_then(|()| out.write_all(&image));
    written.map_err(|_| Error::Unknown)
}
