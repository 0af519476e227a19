//! Mesh primitives of flowers: bent sheets (petals), solids of elliptic rings (ovaries, spikelets, pods) and strands
//! (stalks, awns).
//!
//! A flower has many small parts, so all parts of a plant with the same kind and material are merged into one mesh: one
//! organ, one label.

use crate::plant::axis;
use crate::plant::blade::RestMesh;
use crate::plant::flower_desc::LOBE_SIDES;
use crate::plant::organ::{Organ, OrganKind, StemLine, StemPosition, StemVertices};
use crate::plant::skeleton::Weights;
use crate::plant::tube::{self, Profile};
use furrow_base::geometry::Mesh;
use furrow_base::geometry::outline::{self, Outline};
use furrow_base::math::{Frame, RoundTo, ToFloat, ToInt, Vec3, vec2};
use std::f32::consts::TAU;

/// Builder of the meshes of a plant's flowers.
pub(in crate::plant) struct FlowerMesher {
    organs: Vec<Organ>,
    /// Position on the plant's stems of the flower that is being built.
    on: StemPosition,
    /// Shortest cell of its meshes, metres.
    pub(in crate::plant) cell: f32,
}

/// Sheet that starts at a base and bends along its length and across it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheet {
    /// Position of its base, metres.
    pub(super) base: Vec3,
    /// Direction outwards, perpendicular to the flower's axis, unit vector.
    pub(super) out: Vec3,
    /// Direction of the flower's axis, unit vector.
    pub(super) up: Vec3,
    /// Length, metres.
    pub(super) length: f32,
    /// Width, metres.
    pub(super) width: f32,
    /// Width profile along it.
    pub(super) outline: Outline,
    /// Depth of the notch at its tip, as a fraction of its length.
    pub(super) notch: f32,
    /// Angles above the plane perpendicular to the axis, at its base and its tip, radians.
    pub(super) rise: (f32, f32),
    /// Height of its margins towards the axis, as a fraction of its half-width.
    pub(super) hollow: f32,
}

impl Sheet {
    /// Returns the point on its midline at the fraction `t` of its length, and the normal of its inner side there.
    fn middle(&self, t: f32) -> (Vec3, Vec3) {
        let (from, to) = self.rise;
        let (now, turn) = (from + (to - from) * t, to - from);
        // Integral of (cos, sin) of an angle that increases linearly.
        let (x, z) = if turn.abs() < 1e-3 {
            (t * now.cos(), t * now.sin())
        } else {
            ((now.sin() - from.sin()) / turn, (from.cos() - now.cos()) / turn)
        };
        let place = self.base + (self.out * x + self.up * z) * self.length;
        (place, self.up * now.cos() - self.out * now.sin())
    }
}

/// Closed body of elliptic rings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    /// Position of its base, metres.
    pub(super) base: Vec3,
    /// Frame: z along it, x across its width.
    pub(super) frame: Frame,
    /// Length, metres.
    pub(super) length: f32,
    /// Width, metres.
    pub(super) width: f32,
    /// Ratio of thickness to width.
    pub(super) flat: f32,
    /// Width profile along it.
    pub(super) outline: Outline,
    /// Depth of the notch at its tip, as a fraction of its length.
    pub(super) notch: f32,
}

/// Outline of an ellipsoid.
pub(super) const ROUND: Outline = Outline::Power { a: 0.5, b: 0.5 };

impl FlowerMesher {
    /// Returns an empty builder whose meshes have no cells shorter than `cell` metres.
    pub(in crate::plant) fn new(cell: f32) -> Self {
        Self { organs: Vec::new(), on: StemPosition { line: 0, at: 0.0 }, cell }
    }

    /// Sets the position on the plant's stems of the flowers that are built from now on.
    pub(in crate::plant) fn stand(&mut self, on: StemPosition) {
        self.on = on;
    }

    /// Returns the organs that were built.
    pub(in crate::plant) fn finish(self) -> Vec<Organ> {
        self.organs
    }

    /// Adds a mesh to the organ of this kind and material.
    pub(in crate::plant) fn add(&mut self, kind: OrganKind, material: &str, mesh: &Mesh) {
        let carried = StemVertices { corners: mesh.positions.len(), line: self.on.line, at: Some(self.on.at) };
        self.add_carried(kind, material, mesh, carried, None);
    }

    /// Adds a mesh to the organ of this kind and material, with the stem that carries it. `line` is the centre line if
    /// the mesh is a stem itself.
    fn add_carried(
        &mut self,
        kind: OrganKind,
        material: &str,
        mesh: &Mesh,
        carried: StemVertices,
        line: Option<StemLine>,
    ) {
        if mesh.triangles.is_empty() {
            return;
        }
        if let Some(organ) = self.organs.iter_mut().find(|o| o.kind == kind && o.material == material) {
            organ.mesh.append(mesh);
            organ.lines.extend(line);
            organ.carried.push(carried);
        } else {
            let (material, mesh, lines) = (material.to_owned(), mesh.clone(), line.into_iter().collect());
            let carried = vec![carried];
            self.organs.push(Organ { kind, leaf: 0, material, senescence: 0.0, mesh, axis: None, lines, carried });
        }
    }

    /// Returns the number of cells along `length`, between `least` and `most`.
    fn cells(&self, length: f32, least: f32, most: f32) -> u32 {
        (length / self.cell).round().clamp(least, most).trunc_to::<u32>()
    }

    /// Adds a sheet. Its texture coordinates are those of a leaf's texture.
    pub(super) fn sheet(&mut self, kind: OrganKind, material: &str, sheet: &Sheet) {
        let rows = self.cells(sheet.length, 4.0, 10.0);
        // A notch needs vertices on either side of its lowest point.
        let columns = if sheet.notch > 0.0 || sheet.width > 4.0 * self.cell { 8 } else { 4 };
        let side = sheet.out.cross(sheet.up);
        let mut rest = RestMesh::default();
        let mut near = None;
        for i in 0..=rows {
            let t = 0.02 + 0.965 * i.to_f32() / rows.to_f32();
            let half = (sheet.outline.half_width(t) * sheet.width).max(0.04 * sheet.width);
            let first = rest.positions.len().to_u32();
            for j in 0..=columns {
                let q = 2.0 * j.to_f32() / columns.to_f32() - 1.0;
                let reach = t * (1.0 - sheet.notch * notch(q));
                let (place, normal) = sheet.middle(reach);
                let p = place + side * (q * half) + normal * (sheet.hollow * q * q * half);
                rest.corner(p, outline::uv(q * half / sheet.width, t), Weights::default());
            }
            if let Some(near) = near {
                rest.stitch(near, first, columns);
            }
            near = Some(first);
        }
        self.add(kind, material, &Mesh::smooth(rest.positions, rest.uvs, rest.triangles));
    }

    /// Adds a solid.
    pub(super) fn solid(&mut self, kind: OrganKind, material: &str, solid: &Solid) {
        let sides = self.cells(3.0 * solid.width, 5.0, 12.0);
        self.turned(kind, material, solid, sides, |_| 1.0);
    }

    /// Adds a solid with `lobes` rounded lobes. `deep` is the depth of the gaps between them as a fraction of the
    /// half-width, `first` the angle of the first lobe from the x axis, radians.
    pub(super) fn lobed(
        &mut self,
        kind: OrganKind,
        material: &str,
        solid: &Solid,
        lobes: u32,
        (deep, first): (f32, f32),
    ) {
        let lobe = |turn: f32| 1.0 - deep * (1.0 - (0.5 * lobes.to_f32() * (turn - first)).cos().abs());
        self.turned(kind, material, solid, LOBE_SIDES * lobes, lobe);
    }

    /// Adds a solid with `sides` vertices around it. `factor` scales its half-width depending on the angle from its x
    /// axis.
    fn turned(&mut self, kind: OrganKind, material: &str, solid: &Solid, sides: u32, factor: impl Fn(f32) -> f32) {
        let rows = self.cells(solid.length, 3.0, 10.0);
        let mut rest = RestMesh::default();
        let mut near = None;
        for i in 0..=rows {
            let t = 0.5 - 0.5 * (std::f32::consts::PI * i.to_f32() / rows.to_f32()).cos();
            let half = (solid.outline.half_width(t) * solid.width).max(0.01 * solid.width);
            let first = rest.positions.len().to_u32();
            for k in 0..=sides {
                let turn = TAU * k.to_f32() / sides.to_f32();
                let (sin, cos) = turn.sin_cos();
                let half = half * factor(turn);
                let across = cos * 2.0 * solid.outline.half_width(t);
                let along = solid.length * t * (1.0 - solid.notch * notch(across) * t);
                let f = &solid.frame;
                let p = solid.base + f.z * along + f.x * (half * cos) + f.y * (half * solid.flat * sin);
                rest.corner(p, vec2(k.to_f32() / sides.to_f32(), 1.0 - t), Weights::default());
            }
            if let Some(near) = near {
                rest.stitch(near, first, sides);
            }
            near = Some(first);
        }
        let mut mesh = Mesh::smooth(rest.positions, rest.uvs, rest.triangles);
        tube::close_seams(&mut mesh, sides, 0);
        self.add(kind, material, &mesh);
    }

    /// Adds a round strand through `points`, with these radii at its base and tip, metres.
    pub(in crate::plant) fn strand(&mut self, kind: OrganKind, material: &str, points: &[Vec3], radii: (f32, f32)) {
        let mesh = self.tube(points, radii);
        self.add(kind, material, &mesh);
    }

    /// Adds a stem: a strand with joints for animation.
    pub(in crate::plant) fn stem(&mut self, material: &str, line: StemLine, radii: (f32, f32)) {
        let mesh = self.tube(&line.points, radii);
        let carried = StemVertices { corners: mesh.positions.len(), line: line.number, at: None };
        self.add_carried(OrganKind::Stem, material, &mesh, carried, Some(line));
    }

    fn tube(&self, points: &[Vec3], radii: (f32, f32)) -> Mesh {
        let sides = self.cells(6.0 * radii.0, 3.0, 10.0);
        let last = points.len().saturating_sub(1).max(1).to_f32();
        let mut rings = Vec::with_capacity(points.len() + 3);
        let mut along = Vec3::Z;
        for (i, point) in points.iter().enumerate() {
            let (before, after) = (points[i.saturating_sub(1)], points[(i + 1).min(points.len() - 1)]);
            along = (after - before).normalize_or(along);
            let radius = radii.0 + (radii.1 - radii.0) * i.to_f32() / last;
            rings.push(axis::ring(*point, along, radius, Profile::Channelled(1.0)));
        }
        axis::dome(&mut rings, along, radii.1, 1.0);
        tube::rigid(&rings, sides)
    }
}

/// Returns the depth of the notch at the lateral position `q`, relative to its centre: 1 in the middle of the tip, 0 at
/// both sides.
fn notch(q: f32) -> f32 {
    (1.0 - q.abs()).max(0.0).powf(1.5)
}
