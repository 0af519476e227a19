//! Broad-leaved trees and shrubs for distant views: crowns of leaf clusters on a trunk.
//!
//! A crown is a union of spherical lobes within an ellipsoid. Leaf clusters are flat rhombs near the surfaces of the lobes, turned outwards
//! with a random tilt. From a hundred metres, a cluster is two or three pixels long, and sky shows through the gaps at the rim of the crown.
//! Shapes and densities are estimates from photographs of hedges, not measurements.

use furrow_base::geometry::Mesh;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, Vec3, vec2, vec3};
use furrow_base::sampling::Stream;
use std::f32::consts::TAU;

/// Kind of a woody plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Woody {
    /// A tree with a free trunk.
    Tree,
    /// A shrub with branches down to the ground.
    Shrub,
}

/// Shape of a kind; lengths are relative to the height.
struct Shape {
    /// Height of the crown's centre.
    centre: f32,
    /// Horizontal and vertical semi-axis of the crown.
    semi: (f32, f32),
    /// Smallest and largest radius of a lobe.
    lobe: (f32, f32),
    lobes: u32,
    clusters: u32,
    /// Length of a cluster.
    cluster: f32,
}

impl Woody {
    fn shape(self) -> Shape {
        match self {
            Self::Tree => {
                Shape { centre: 0.6, semi: (0.31, 0.38), lobe: (0.1, 0.19), lobes: 26, clusters: 2600, cluster: 0.036 }
            }
            Self::Shrub => {
                Shape { centre: 0.45, semi: (0.55, 0.5), lobe: (0.16, 0.3), lobes: 14, clusters: 900, cluster: 0.08 }
            }
        }
    }
}

/// Meshes of a woody plant of height 1 that stands on the origin.
#[derive(Clone, Debug)]
pub struct WoodyPlant {
    /// Leaf clusters.
    pub foliage: Mesh,
    /// Trunk; empty for a shrub.
    pub wood: Mesh,
}

/// Returns a random unit vector, uniform on the sphere.
fn direction(stream: &mut Stream) -> Vec3 {
    let z = stream.range32(-1.0, 1.0);
    let ring = Vec2::from_angle(stream.range32(0.0, TAU)) * (1.0 - z * z).max(0.0).sqrt();
    ring.extend(z)
}

/// Grows a woody plant of height 1 from a random stream.
pub fn woody(kind: Woody, stream: &mut Stream) -> WoodyPlant {
    let shape = kind.shape();
    let semi = vec3(shape.semi.0, shape.semi.0, shape.semi.1);
    let lobe = |stream: &mut Stream| {
        let radius = stream.range32(shape.lobe.0, shape.lobe.1);
        // The cube root makes the centres uniform in the volume; a lobe stays within the crown.
        let place = direction(stream) * stream.uniform32().cbrt() * (semi - radius).max(Vec3::ZERO);
        (vec3(0.0, 0.0, shape.centre) + place, radius)
    };
    let lobes: Vec<(Vec3, f32)> = (0..shape.lobes).map(|_| lobe(stream)).collect();
    let foliage = foliage(&shape, &lobes, stream);
    let wood = if kind == Woody::Tree { trunk(shape.centre) } else { Mesh::default() };
    WoodyPlant { foliage, wood }
}

/// Returns the leaf clusters on the lobes of a crown.
fn foliage(shape: &Shape, lobes: &[(Vec3, f32)], stream: &mut Stream) -> Mesh {
    let surface: f32 = lobes.iter().map(|(_, radius)| radius * radius).sum();
    let (mut positions, mut uvs, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for (centre, radius) in lobes {
        let count = shape.clusters.to_f32() * radius * radius / surface;
        for _ in 0..count.round_to::<u32>() {
            let out = direction(stream);
            let at = *centre + out * *radius * stream.range32(0.75, 1.05);
            let length = shape.cluster * stream.range32(0.6, 1.3);
            if at.z < 0.5 * length {
                continue;
            }
            let normal = (out + 0.9 * direction(stream) + vec3(0.0, 0.0, 0.4)).normalize_or(Vec3::Z);
            let (a, b) = normal.any_orthonormal_pair();
            let turn = Vec2::from_angle(stream.range32(0.0, TAU));
            let (along, across) = ((a * turn.x + b * turn.y) * 0.5 * length, (b * turn.x - a * turn.y) * 0.3 * length);
            let first = positions.len().to_u32();
            positions.extend([at - along, at - across, at + along, at + across]);
            uvs.extend([vec2(0.5, 1.0), vec2(1.0, 0.5), vec2(0.5, 0.0), vec2(0.0, 0.5)]);
            triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    Mesh::smooth(positions, uvs, triangles)
}

/// Returns a tapered trunk with six sides from the ground to `top`.
fn trunk(top: f32) -> Mesh {
    const SIDES: u32 = 6;
    let (mut positions, mut uvs, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..SIDES {
        let around = k.to_f32() / SIDES.to_f32();
        let ring = Vec2::from_angle(around * TAU);
        positions.extend([(ring * 0.025).extend(-0.02), (ring * 0.012).extend(top)]);
        uvs.extend([vec2(around, 1.0), vec2(around, 0.0)]);
        let (own, next) = (2 * k, 2 * ((k + 1) % SIDES));
        triangles.extend([[own, next, next + 1], [own, next + 1, own + 1]]);
    }
    Mesh::smooth(positions, uvs, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::Purpose;

    /// Expected: valid meshes of about height 1 that stand on the ground, within the crown's semi-axes; a shrub has no trunk; another
    /// stream gives another crown, the same stream the same.
    #[test]
    fn woody_plants_have_the_size_of_their_kind() {
        for kind in [Woody::Tree, Woody::Shrub] {
            let grow = |k| woody(kind, &mut Stream::of(1, 0, Purpose::Test, k));
            let plant = grow(0);
            assert_eq!((plant.foliage.fault(), plant.wood.fault()), (None, None));
            let (lo, hi) = plant.foliage.bounds().unwrap();
            assert!(lo.z >= -0.01 && (0.8..1.15).contains(&hi.z), "{kind:?}: {lo} {hi}");
            let wide = kind.shape().semi.0 + kind.shape().cluster + 0.05;
            assert!(lo.truncate().abs().max(hi.truncate()).max_element() < wide, "{kind:?}: {lo} {hi}");
            assert_eq!(plant.wood.triangles.is_empty(), kind == Woody::Shrub);
            assert_eq!(plant.foliage, grow(0).foliage);
            assert_ne!(plant.foliage, grow(1).foliage);
        }
    }
}
