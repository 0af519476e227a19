//! Choice of the texture resolution for a program without mip maps: for each organ, the mip level that the camera sees.
//!
//! Rays of this renderer read a texture on the level of their own footprint. Relief is smoother on a coarser level, and
//! a smoother leaf has another gloss: when the small and the large leaves of a beet shared one level, single leaves
//! were 5 % too dark in blue. With one level per organ, only the variation within an organ is ignored.

use furrow_base::geometry::Mesh;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec3};
use furrow_optics::sensor::Camera;
use furrow_render::material::{Material, Varies};
use furrow_render::scene::Scene;
use std::collections::BTreeMap;

/// Materials of a scene with each texture fixed to one level, and a separate material for each tint.
pub struct Leveled {
    /// One material for each material, tint and level in use.
    pub materials: Vec<Material>,
    /// Material index of each part.
    pub of_parts: Vec<u32>,
}

impl Leveled {
    /// Creates the materials of a scene.
    pub fn of(scene: &Scene) -> Self {
        let mut known: BTreeMap<(u32, [u32; 3], Option<u32>), u32> = BTreeMap::new();
        let mut materials = Vec::new();
        let of_parts = scene.parts.iter().map(|part| {
            let material = &scene.materials[part.material.to_usize()];
            let level = match material.varies() {
                Varies::Texture(w, h) => Some(level(&part.in_world(), w.max(h), &scene.camera)),
                Varies::Nowhere | Varies::Raster(..) | Varies::Place => None,
            };
            let tint = part.tint();
            *known.entry((part.material, tint.to_array().map(f32::to_bits), level)).or_insert_with(|| {
                let own = material.tinted(tint);
                materials.push(match level {
                    Some(level) => own.on_level(level),
                    None => own,
                });
                materials.len().to_u32() - 1
            })
        });
        let of_parts = of_parts.collect();
        Self { materials, of_parts }
    }
}

/// Fixes the textures of `scene` to the levels that [`super::write`] exports, for rays of any footprint, so that both
/// programs render the same data. An export of the scene does not change.
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

/// Returns the mip level on which `camera` sees a texture of `size` texels on a mesh: the area-weighted mean, rounded.
fn level(mesh: &Mesh, size: u32, camera: &Camera) -> u32 {
    let eye = camera.pose().position;
    let (mut sum, mut areas) = (0.0_f64, 0.0_f64);
    for t in &mesh.triangles {
        let [a, b, c] = t.map(ToInt::to_usize);
        let (e1, e2) = (mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
        let (t1, t2) = (mesh.uvs[b] - mesh.uvs[a], mesh.uvs[c] - mesh.uvs[a]);
        let determinant = t1.perp_dot(t2);
        if determinant.abs() > 1e-20 {
            // ∂p/∂v: the image's height on the surface, metres.
            let metres = ((e2 * t1.x - e1 * t2.x) / determinant).length();
            let pixel = camera.pixel_angle() * eye.distance(mesh.positions[a] + (e1 + e2) / 3.0);
            let area = f64::from(e1.cross(e2).length());
            sum += area * f64::from((pixel / metres * size.to_f32()).max(1.0).log2());
            areas += area;
        }
    }
    if areas > 0.0 { (sum / areas).round_to::<u32>() } else { 0 }
}
