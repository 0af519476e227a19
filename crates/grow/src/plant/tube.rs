//! Tubes: stems, hypocotyls, sheaths and stalks as rings of vertices. Texture coordinate u runs around the tube, v
//! along it from base to tip.

use super::blade::RestMesh;
use super::growth::CELL;
use super::skeleton::Weights;
use furrow_base::geometry::Mesh;
use furrow_base::math::{ToFloat, ToInt, Vec3, vec2};
use std::f32::consts::{FRAC_1_SQRT_2, TAU};

/// Number of vertices around a tube in meshes coarser than usual.
const FEW_SIDES: u32 = 5;
/// The same for tubes with a radius below a quarter of the mesh's cell.
const FEWEST_SIDES: u32 = 3;

/// Shape of a cross-section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Profile {
    /// Ellipse whose upper half is scaled by this factor: 1 is an ellipse, 0 flat on top, negative a channel as in the
    /// stalks of beet.
    Channelled(f32),
    /// Square with rounded edges, as in bedstraws.
    Square,
}

/// One ring of a tube.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring {
    /// Centre, metres.
    pub(super) centre: Vec3,
    /// Direction to the right, unit vector.
    pub(super) right: Vec3,
    /// Direction upwards (of a leaf: out of the upper side), unit vector.
    pub(super) up: Vec3,
    /// Half of the width and half of the height, metres.
    pub(super) radii: (f32, f32),
    /// Shape of the cross-section.
    pub(super) profile: Profile,
}

/// Returns the number of vertices around a tube of `radius` metres; `usual` if the mesh's cells are no longer than
/// usual.
pub(super) fn sides(radius: f32, usual: u32, cell: f32) -> u32 {
    match cell {
        cell if cell <= CELL => usual,
        cell if radius < 0.25 * cell => FEWEST_SIDES,
        _ => FEW_SIDES,
    }
}

/// Adds the tube through the rings to a rest mesh. up × right of the rings must point along the tube.
pub(super) fn sweep(rest: &mut RestMesh, rings: &[Ring], sides: u32, mut weights: impl FnMut(Vec3) -> Weights) {
    let mut previous = None;
    let length = rings.windows(2).map(|w| w[0].centre.distance(w[1].centre)).sum::<f32>().max(1e-9);
    let mut along = 0.0;
    for (i, ring) in rings.iter().enumerate() {
        if i > 0 {
            along += ring.centre.distance(rings[i - 1].centre);
        }
        let tie = weights(ring.centre);
        let first = rest.positions.len().to_u32();
        for k in 0..=sides {
            // Clockwise when looking against the tube's direction, so that the stitched triangles face outward.
            let u = k.to_f32() / sides.to_f32();
            let (sin, cos) = (TAU * (u - 0.25)).sin_cos();
            let (x, z) = match ring.profile {
                Profile::Channelled(top) => (-cos, if sin > 0.0 { top * sin } else { sin }),
                Profile::Square => {
                    let r = (cos.powi(4) + sin.powi(4)).powf(-0.25);
                    let (x, z) = (r * cos, r * sin);
                    (FRAC_1_SQRT_2 * (z - x), FRAC_1_SQRT_2 * (x + z))
                }
            };
            let p = ring.centre + ring.right * (ring.radii.0 * x) + ring.up * (ring.radii.1 * z);
            rest.corner(p, vec2(u, along / length), tie);
        }
        if let Some(near) = previous {
            rest.stitch(near, first, sides);
        }
        previous = Some(first);
    }
}

/// Builds the tube as a rigid mesh. The first and the last vertex of each ring share their normal.
pub(super) fn rigid(rings: &[Ring], sides: u32) -> Mesh {
    let mut rest = RestMesh::default();
    sweep(&mut rest, rings, sides, |_| Weights::default());
    let mut mesh = Mesh::smooth(rest.positions, rest.uvs, rest.triangles);
    let corners = mesh.normals.len();
    close_seams(&mut mesh, sides, corners);
    mesh
}

/// Averages the normals of the first and the last vertex of each ring, which coincide. The first `corners` vertices
/// belong to rings.
pub(super) fn close_seams(mesh: &mut Mesh, sides: u32, corners: usize) {
    let stride = sides.to_usize() + 1;
    for ring in mesh.normals[..corners].chunks_exact_mut(stride) {
        let normal = (ring[0] + ring[stride - 1]).normalize_or(Vec3::Z);
        ring[0] = normal;
        ring[stride - 1] = normal;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tubes_face_outward() {
        for profile in [Profile::Channelled(1.0), Profile::Square] {
            let ring = |z: f32| Ring {
                centre: Vec3::Z * z,
                right: Vec3::X,
                // up × right = z
                up: -Vec3::Y,
                radii: (0.01, 0.01),
                profile,
            };
            let mesh = rigid(&[ring(0.0), ring(0.05), ring(0.1)], 12);
            assert!(mesh.fault().is_none());
            for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
                assert!(p.with_z(0.0).normalize().dot(*n) > 0.7, "{profile:?} {p} {n}");
            }
        }
    }
}
