//! Code shared by both formats: validation and normalisation of meshes, and error messages.

use super::notes::Notes;
use super::parts::MOST_TRIANGLES;
use furrow_base::geometry::Mesh;
use furrow_base::math::{DMat4, ToInt, Vec2, Vec3};
use furrow_optics::texture::Wrap;

/// Largest distance of texture coordinates from an alpha mask, in tiles.
const FAR_TILES: f32 = 100.0;

/// Clamps to 0..1; NaN becomes 0.
pub(super) fn fraction(x: f32) -> f32 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

/// Warns of a colour with numbers that are not reflectances, such as those from 0 to 255.
pub(super) fn warn_of_color(color: [f32; 3], material: &str, notes: &mut Notes) {
    if !color.iter().all(|share| (0.0..=1.0).contains(share)) {
        notes.about("colours that are not between 0 and 1, cut to them", material);
    }
}

/// Transforms a part into the model's frame and checks it. Returns an error message for an invalid mesh.
pub(super) fn settle(mesh: &mut Mesh, to: &DMat4, name: &str) -> Result<(), String> {
    // Exact, so that meshes exported by this program are read back bit-identically.
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
        return Err(format!("vertex {i} of `{name}` is not a finite number"));
    }
    let unit = |n: &Vec3| (n.length_squared() - 1.0).abs() <= 1e-3;
    if !mesh.normals.iter().all(unit) {
        for n in &mut mesh.normals {
            *n = n.normalize_or_zero();
        }
        // Scans contain vertices without a normal.
        if !mesh.normals.iter().all(unit) {
            mesh.recompute_normals();
        }
    }
    mesh.fault().map_or(Ok(()), |fault| Err(format!("`{name}`: {fault}")))
}

/// Makes a mesh without normals faceted: every triangle gets its own vertices.
pub(super) fn faceted(mesh: &mut Mesh) {
    let corners: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    mesh.positions = corners.iter().map(|i| mesh.positions[i.to_usize()]).collect();
    mesh.uvs = corners.iter().map(|i| mesh.uvs[i.to_usize()]).collect();
    mesh.triangles = (0..corners.len().to_u32() / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    mesh.recompute_normals();
}

/// Shifts the texture coordinates of an alpha-masked surface into the one tile that its mask covers, for the wrap modes
/// of its texture. Returns an error message if they span several tiles. Coordinates beyond the edge of a texture that is
/// clamped are cut away, which adds a warning.
pub(super) fn into_one_tile(uvs: &mut [Vec2], wrap: [Wrap; 2], name: &str, notes: &mut Notes) -> Result<(), String> {
    let Some(low) = uvs.iter().copied().reduce(Vec2::min) else { return Ok(()) };
    let high = uvs.iter().copied().fold(low, Vec2::max);
    for (k, wrap) in wrap.into_iter().enumerate() {
        // Tolerance of 10⁻³ for writers that round.
        let tile = (low[k] + 1e-3).floor();
        let inside = high[k] - tile <= 1.001;
        let near = low[k] >= -FAR_TILES && high[k] <= FAR_TILES;
        match wrap {
            _ if inside && tile == 0.0 => {}
            Wrap::Clamp if near => {
                notes.about(
                    "it is cut away where its texture coordinates are beyond the edge of a clamped picture",
                    name,
                );
            }
            Wrap::Repeat if inside => uvs.iter_mut().for_each(|uv| uv[k] -= tile),
            Wrap::Mirror if inside && tile.rem_euclid(2.0) == 0.0 => uvs.iter_mut().for_each(|uv| uv[k] -= tile),
            Wrap::Mirror if inside => uvs.iter_mut().for_each(|uv| uv[k] = 1.0 - (uv[k] - tile)),
            _ => {
                return Err(format!(
                    "the texture coordinates of `{name}`, which has an alpha mask, run from {:.2}, {:.2} to {:.2}, {:.2}: they must be within one tile",
                    low.x, low.y, high.x, high.y
                ));
            }
        }
    }
    Ok(())
}

/// Error in a file.
pub(super) struct ModelError {
    pub(super) what: String,
    /// Advice; empty if only a new export helps.
    pub(super) help: &'static str,
}

impl From<String> for ModelError {
    fn from(what: String) -> Self {
        Self { what, help: "" }
    }
}

/// Returns the error for a file with too many triangles.
pub(super) fn too_many_triangles() -> ModelError {
    ModelError { what: format!("it has more than {MOST_TRIANGLES} triangles"), help: "simplify it in your program" }
}
