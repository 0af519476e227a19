//! Meshes as binary, little-endian PLY: vertex positions, normals, texture coordinates, and optional colours.
//!
//! Mitsuba reads `r g b` as the attribute `vertex_color` and `nir_x` as `vertex_nir`. There are [`SCALE`] length units
//! per metre.

use super::files::SCALE;
use furrow_base::geometry::Mesh;
use furrow_base::math::Spectrum;
use std::fmt::Write;

/// Encodes a PLY file; `colors` has one entry per vertex if the surface has vertex colours.
pub(super) fn encode(mesh: &Mesh, colors: Option<&[Spectrum]>) -> Vec<u8> {
    let mut names = vec!["x", "y", "z", "nx", "ny", "nz", "u", "v"];
    if colors.is_some() {
        names.extend(["r", "g", "b", "nir_x"]);
    }
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.positions.len());
    for name in &names {
        let _ = writeln!(header, "property float {name}");
    }
    let faces = mesh.triangles.len();
    let _ = write!(header, "element face {faces}\nproperty list uchar int vertex_indices\nend_header\n");
    let mut out = header.into_bytes();
    out.reserve(mesh.positions.len() * names.len() * 4 + faces * 13);
    for (i, ((p, n), t)) in mesh.positions.iter().zip(&mesh.normals).zip(&mesh.uvs).enumerate() {
        let p = *p * SCALE;
        for value in [p.x, p.y, p.z, n.x, n.y, n.z, t.x, t.y] {
            out.extend(value.to_le_bytes());
        }
        if let Some(color) = colors.map(|c| c[i]) {
            out.extend(color.to_array().iter().flat_map(|v| v.to_le_bytes()));
        }
    }
    for triangle in &mesh.triangles {
        out.push(3);
        out.extend(triangle.iter().flat_map(|i| i.to_le_bytes()));
    }
    out
}
