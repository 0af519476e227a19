//! Small scenes built in code.

use furrow_base::geometry::{Mesh, Window};
use furrow_base::math::{Vec2, Vec3, vec2, vec3};
use furrow_base::sampling::{Points, Stream};
use furrow_optics::bsdf::Bsdf;
use furrow_optics::light::Light;
use furrow_optics::sensor::{Camera, Distortion, Pose};
use furrow_render::accel::EmbreeAccel;
use furrow_render::film::{Film, Filter};
use furrow_render::integrator::{Integrator, World};
use furrow_render::material::Material;
use furrow_render::render::{self, RenderMonitor, Settings};
use furrow_render::scene::tag::Tag;
use furrow_render::scene::{Part, Scene};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Builds a square with side length `side` around `centre`, facing up.
pub fn square(centre: Vec3, side: f32) -> Mesh {
    let h = side / 2.0;
    let at = |x: f32, y: f32| centre + vec3(x * h, y * h, 0.0);
    Mesh::smooth(
        vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)],
        vec![vec2(0.0, 1.0), vec2(1.0, 1.0), vec2(1.0, 0.0), vec2(0.0, 0.0)],
        vec![[0, 1, 2], [0, 2, 3]],
    )
}

/// Builds a sphere with exact normals and `n` latitude bands.
pub fn sphere(centre: Vec3, radius: f32, n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..=n {
        for j in 0..=2 * n {
            let (theta, phi) = (std::f32::consts::PI * i as f32 / n as f32, std::f32::consts::PI * j as f32 / n as f32);
            let d = vec3(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            mesh.positions.push(centre + d * radius);
            mesh.normals.push(d);
            mesh.uvs.push(vec2(j as f32 / (2 * n) as f32, i as f32 / n as f32));
            if i < n && j < 2 * n {
                let (a, b) = (i * (2 * n + 1) + j, (i + 1) * (2 * n + 1) + j);
                mesh.triangles.extend([[a, b, a + 1], [a + 1, b, b + 1]]);
            }
        }
    }
    mesh
}

/// Builds a camera of `size` pixels at `position` that looks at `target`; `fov_deg` is its horizontal field of view in
/// degrees.
pub fn camera(size: (u32, u32), position: Vec3, target: Vec3, fov_deg: f64) -> Camera {
    let focal = f64::from(size.0) / 2.0 / (fov_deg.to_radians() / 2.0).tan();
    let centre = [f64::from(size.0) / 2.0, f64::from(size.1) / 2.0];
    let pose = Pose::look_at(position, target).expect("a direction");
    Camera::new(size, [focal; 2], centre, Distortion::default(), pose).expect("a camera")
}

/// Builds a scene of meshes without masks, each with one BSDF.
#[allow(clippy::large_types_passed_by_value, reason = "the scene takes the camera")]
pub fn scene(parts: Vec<(Mesh, Bsdf)>, lights: Vec<Light>, camera: Camera) -> Scene {
    let materials = parts.iter().map(|(_, b)| Material::Plain(*b)).collect();
    let part = |(i, (mesh, _)): (usize, (Mesh, Bsdf))| Part {
        mesh: Arc::new(mesh),
        mask: None,
        material: i as u32,
        tag: Tag::default(),
        instance: None,
    };
    let parts = parts.into_iter().enumerate().map(part).collect();
    Scene { parts, materials, lights, camera, haze: None, filter: Filter::Box.footprint() }
}

/// Renders a whole scene on two threads with Sobol points.
pub fn shoot(scene: &Scene, integrator: &dyn Integrator, spp: u32, seed: u64) -> Film {
    shoot_with(scene, integrator, Points::Sobol, spp, seed)
}

/// Renders a whole scene on two threads with the given kind of sample points.
pub fn shoot_with(scene: &Scene, integrator: &dyn Integrator, points: Points, spp: u32, seed: u64) -> Film {
    with_world(scene, 2, |world, watch| {
        let window = Window::full(scene.camera.width(), scene.camera.height());
        let settings = Settings { spp, seed, window, points };
        render::render(world, integrator, &settings, watch).expect("a film")
    })
}

/// Calls `f` in a thread pool with a scene whose acceleration structure is built.
pub fn with_world<T: Send>(
    scene: &Scene,
    threads: usize,
    f: impl FnOnce(&World<'_>, &RenderMonitor<'_>) -> T + Send,
) -> T {
    render::pool(threads).expect("a pool").install(|| {
        let accel = EmbreeAccel::build(&scene.surfaces(), 1).expect("an accelerator");
        let stop = AtomicBool::new(false);
        f(&World::new(scene, &accel), &RenderMonitor { done: &|_| (), stop: &stop })
    })
}

/// Returns the centre of the film, in pixels.
pub fn middle(film: &Film) -> Vec2 {
    vec2(film.window.width() as f32 / 2.0, film.window.height() as f32 / 2.0)
}

/// Returns a random direction, uniform on the sphere.
pub fn unit(s: &mut Stream) -> Vec3 {
    vec3(s.normal() as f32, s.normal() as f32, s.normal() as f32).normalize()
}

/// Returns a random point of the cube [−reach, reach]³.
pub fn point(s: &mut Stream, reach: f32) -> Vec3 {
    vec3(s.range32(-reach, reach), s.range32(-reach, reach), s.range32(-reach, reach))
}
