//! What both formats need: meshes that can be rendered, and words for what is wrong.

use super::parts::MOST_TRIANGLES;
use crate::geometry::Mesh;
use crate::math::{DMat4, Vec2, Vec3};

/// Held to 0..1; what is not a number is 0.
pub(super) fn fraction(x: f32) -> f32 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

/// Brings a part into the model's frame and checks it; in words what is wrong.
pub(super) fn settle(mesh: &mut Mesh, to: &DMat4, name: &str) -> Result<(), String> {
    // Exact: what the program exported comes back bit for bit.
    if *to != DMat4::IDENTITY {
        let mirrored = to.determinant() < 0.0;
        let normals = to.inverse().transpose();
        for p in &mut mesh.positions {
            *p = to.transform_point3(p.as_dvec3()).as_vec3();
        }
        for n in &mut mesh.normals {
            *n = normals.transform_vector3(n.as_dvec3()).as_vec3();
        }
        if mirrored {
            for t in &mut mesh.triangles {
                t.swap(1, 2);
            }
        }
    }
    if let Some(i) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return Err(format!("corner {i} of `{name}` is not a finite number"));
    }
    let unit = |n: &Vec3| (n.length_squared() - 1.0).abs() <= 1e-3;
    if !mesh.normals.iter().all(unit) {
        for n in &mut mesh.normals {
            *n = n.normalize_or_zero();
        }
        // Scans hold corners without a normal.
        if !mesh.normals.iter().all(unit) {
            mesh.recompute_normals();
        }
    }
    mesh.fault().map_or(Ok(()), |fault| Err(format!("`{name}`: {fault}")))
}

/// A mesh without normals is faceted: every triangle gets corners of its own.
pub(super) fn faceted(mesh: &mut Mesh) {
    let corners: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    mesh.positions = corners.iter().map(|i| mesh.positions[*i as usize]).collect();
    mesh.uvs = corners.iter().map(|i| mesh.uvs[*i as usize]).collect();
    mesh.triangles = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    mesh.recompute_normals();
}

/// Moves the coordinates of a cut-out surface whose picture repeats into the one tile that its mask covers; in words where
/// they reach over several.
pub(super) fn into_one_tile(uvs: &mut [Vec2], name: &str) -> Result<(), String> {
    let Some(low) = uvs.iter().copied().reduce(Vec2::min) else { return Ok(()) };
    let high = uvs.iter().copied().fold(low, Vec2::max);
    // A thousandth for writers that round.
    let tile = (low + 1e-3).floor();
    if (high - tile).max_element() > 1.001 {
        return Err(format!(
            "the texture coordinates of `{name}`, which a picture's opacity cuts, run from {:.2}, {:.2} to {:.2}, {:.2}: they must lie within one tile",
            low.x, low.y, high.x, high.y
        ));
    }
    if tile != Vec2::ZERO {
        for uv in uvs {
            *uv -= tile;
        }
    }
    Ok(())
}

/// What is wrong with a file, in words.
pub(super) struct Wrong {
    pub(super) what: String,
    /// What to do; empty where a fresh export is all that helps.
    pub(super) help: &'static str,
}

impl From<String> for Wrong {
    fn from(what: String) -> Self {
        Self { what, help: "" }
    }
}

/// What is wrong with a file of too many triangles.
pub(super) fn too_many_triangles() -> Wrong {
    Wrong { what: format!("it has more than {MOST_TRIANGLES} triangles"), help: "reduce it in your program" }
}
