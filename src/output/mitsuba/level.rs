//! Which mip level a program without mip levels is given of a picture: the one that the camera sees, for each organ by itself.
//!
//! Our rays read a picture on the level of their own width. Relief is smoother on a coarser level, and a smoother leaf has
//! another gloss: where the small and the large leaves of a beet shared one level, single leaves came out 5 % too dark in blue.
//! One level for each organ leaves what varies within an organ.

use crate::geometry::Mesh;
use crate::material::{Material, Varies};
use crate::math::Vec3;
use crate::scene::Scene;
use crate::sensor::Camera;
use std::collections::BTreeMap;

/// The materials of a scene, each picture on one level, and each tint a material of its own.
pub(super) struct Leveled {
    /// One for each material, tint and level that is in use.
    pub(super) materials: Vec<Material>,
    /// For each part the index of its material among them.
    pub(super) of_parts: Vec<u32>,
}

impl Leveled {
    /// Those of a scene.
    pub(super) fn of(scene: &Scene) -> Self {
        let mut known: BTreeMap<(u32, [u32; 3], Option<u32>), u32> = BTreeMap::new();
        let mut materials = Vec::new();
        let of_parts = scene.parts.iter().map(|part| {
            let material = &scene.materials[part.material as usize];
            let level = match material.varies() {
                Varies::Picture(w, h) => Some(level(&part.in_world(), w.max(h), &scene.camera)),
                Varies::Nowhere | Varies::Raster(..) | Varies::Place => None,
            };
            let tint = part.tint();
            *known.entry((part.material, tint.to_array().map(f32::to_bits), level)).or_insert_with(|| {
                let own = material.tinted(tint);
                materials.push(match level {
                    Some(level) => own.on_level(level),
                    None => own,
                });
                materials.len() as u32 - 1
            })
        });
        let of_parts = of_parts.collect();
        Self { materials, of_parts }
    }
}

/// Makes every ray read the pictures of `scene` on the level that [`super::write`] writes them on, whatever its width: the scene
/// is then shown by both programs from the same numbers. What is written of it stays as it was.
pub fn fix_levels(scene: &mut Scene) {
    let Leveled { materials, of_parts } = Leveled::of(scene);
    scene.materials = materials;
    for (part, material) in scene.parts.iter_mut().zip(of_parts) {
        part.material = material;
        if let Some(instance) = &mut part.instance {
            instance.tint = Vec3::ONE;
        }
    }
}

/// The level on which `camera` sees a picture of `size` texels on a mesh: the mean over its area, rounded.
fn level(mesh: &Mesh, size: u32, camera: &Camera) -> u32 {
    let eye = camera.pose().position;
    let (mut sum, mut areas) = (0.0_f64, 0.0_f64);
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| i as usize);
        let (e1, e2) = (mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
        let (t1, t2) = (mesh.uvs[b] - mesh.uvs[a], mesh.uvs[c] - mesh.uvs[a]);
        let determinant = t1.perp_dot(t2);
        if determinant.abs() > 1e-20 {
            // ∂p/∂v: the image's height on the surface, metres.
            let metres = ((e2 * t1.x - e1 * t2.x) / determinant).length();
            let pixel = camera.pixel_angle() * eye.distance(mesh.positions[a] + (e1 + e2) / 3.0);
            let area = f64::from(e1.cross(e2).length());
            sum += area * f64::from((pixel / metres * size as f32).max(1.0).log2());
            areas += area;
        }
    }
    if areas > 0.0 { (sum / areas).round() as u32 } else { 0 }
}
