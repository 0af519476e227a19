//! Phenotyping traits of a field: areas, lengths and angles of leaves; cover and leaf area of plants; leaf area index.
//!
//! Areas are one-sided and respect opacity masks, so eaten parts do not count. Lengths are those of the flat, complete leaf; bending
//! does not change them. Angles are those of the bent leaf in its pose.

use super::Field;
use furrow_base::geometry::{AlphaMask, Coverage};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, Vec3, vec2};
use furrow_grow::plant::{LeafAxis, OrganKind};
use furrow_render::scene::Part;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Traits of a leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LeafTraits {
    /// One-sided area of the blade, m². For a divided leaf, the sum over all segments, including where they overlap.
    pub area_m2: f32,
    /// Length of the blade along its midrib, metres; for a compound leaf, along its rachis.
    pub length_m: f32,
    /// Maximum width of the flat blade, metres; for a divided leaf, of the outline that its segments fill.
    pub width_m: f32,
    /// Length of the petiole, metres; for a grass leaf, of the sheath; 0 for a sessile leaf.
    pub petiole_m: f32,
    /// Angle between the blade and the horizontal, averaged over the blade's area, degrees: 0 is horizontal, 90 vertical.
    pub inclination_deg: f32,
    /// Direction from the blade's base to its tip, degrees clockwise from north (+y), 0 to 360.
    pub azimuth_deg: f32,
    /// Height of the leaf's highest point above the foot of the plant, metres.
    pub top_m: f32,
}

/// Traits of a plant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlantTraits {
    /// One-sided area of all leaf blades, m².
    pub leaf_area_m2: f32,
    /// Ground area covered when seen from directly above, m². Petioles and stems count; overlapping parts count once.
    pub cover_m2: f32,
    /// Height of the plant's highest point above its foot, in its pose, metres.
    pub top_m: f32,
}

/// Leaf area above the ground that an image shows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Canopy {
    /// Area of the plane z = 0 inside the image border, m².
    pub ground_m2: f32,
    /// One-sided area of the blades above that ground, m². `None` if a plant of the field is a model from disk, whose blades are not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leaf_area_m2: Option<f32>,
    /// Leaf area index: `leaf_area_m2` / `ground_m2`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lai: Option<f32>,
}

/// Traits of all plants and leaves of a field. Models from disk are left out, because their organs are not known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Traits {
    /// Traits of plants, by the plant's number.
    pub plants: BTreeMap<u32, PlantTraits>,
    /// Traits of leaves, by the numbers of plant and leaf.
    pub leaves: BTreeMap<(u32, u16), LeafTraits>,
    /// Canopy above the ground in the image; `None` if the camera sees the horizon.
    pub canopy: Option<Canopy>,
}

/// An organ: its scene part, the mask coverage of each triangle, and for a blade the opaque area of each triangle, m².
struct Organ<'a> {
    part: &'a Part,
    shown: &'a [TriangleCoverage],
    areas: Vec<f64>,
}

/// Mask coverage of a triangle, and the opaque share of its area.
type TriangleCoverage = (Coverage, f64);

/// Addresses of a mesh and its mask; they identify parts that are instances of the same mesh.
type MeshKey = (usize, Option<usize>);

fn sheet(part: &Part) -> MeshKey {
    (Arc::as_ptr(&part.mesh).addr(), part.mask.as_ref().map(|mask| Arc::as_ptr(mask).addr()))
}

impl Traits {
    /// Measures a field and all of its plants. Call it inside a thread pool.
    pub fn of(field: &Field) -> Self {
        Self::default().of_next_image(field, |_| true)
    }

    /// Returns the traits for another image of the same field: the canopy is measured again, and so are the plants whose numbers `wanted`
    /// accepts, unless they are measured already.
    #[must_use]
    pub fn of_next_image(mut self, field: &Field, wanted: impl Fn(u32) -> bool + Sync) -> Self {
        let view = View::of(field);
        let is_new = |plant: u32| wanted(plant) && !self.plants.contains_key(&plant);
        // The canopy consists of blades alone.
        let of_canopy =
            |part: &Part, kind: OrganKind| is_blade(kind) && view.as_ref().is_some_and(|view| view.may_hold(part));
        let parts: Vec<(&Part, OrganKind)> = (field.scene.parts.par_iter().zip(&field.kinds))
            .filter_map(|(part, kind)| Some((part, kind.organ()?)))
            .filter(|(part, kind)| is_new(part.tag.plant) || of_canopy(part, *kind))
            .collect();
        // Evaluate the mask once per mesh, however many instances it has: a lookup for each triangle is expensive.
        let sheets: BTreeMap<MeshKey, &Part> = parts.iter().map(|(part, _)| (sheet(part), *part)).collect();
        let sheets: Vec<&Part> = sheets.into_values().collect();
        let looked: Vec<Vec<TriangleCoverage>> = sheets.par_iter().map(|part| shown(part)).collect();
        let shown: BTreeMap<MeshKey, &[TriangleCoverage]> =
            sheets.iter().map(|part| sheet(part)).zip(looked.iter().map(Vec::as_slice)).collect();
        let organs: Vec<Organ<'_>> =
            parts.into_par_iter().map(|(part, kind)| Organ::new(part, kind, shown[&sheet(part)])).collect();
        let mut by_plant: BTreeMap<u32, Vec<&Organ<'_>>> = BTreeMap::new();
        for organ in &organs {
            by_plant.entry(organ.part.tag.plant).or_default().push(organ);
        }
        let new = field.plants.iter().filter(|plant| is_new(plant.number));
        let grown: Vec<_> = new.filter_map(|plant| Some((plant, by_plant.get(&plant.number)?))).collect();
        let measured: Vec<_> = (grown.par_iter())
            .map(|(plant, organs)| (plant.number, measure(organs, &plant.leaf_axes, plant.position)))
            .collect();
        for (number, (plant, leaves)) in measured {
            self.plants.insert(number, plant);
            self.leaves.extend(leaves.into_iter().map(|(leaf, traits)| ((number, leaf), traits)));
        }
        self.canopy = view.as_ref().and_then(|view| Canopy::of(field, view, &organs));
        self
    }
}

/// Returns the numbers of the plants that may be above the ground that the field's camera sees, by the bounding boxes of their parts; of all
/// plants if it sees the horizon.
pub fn near_view(field: &Field) -> BTreeSet<u32> {
    let view = View::of(field);
    let near = |part: &&Part| view.as_ref().is_none_or(|view| view.may_hold(part));
    field.scene.parts.iter().filter(near).map(|part| part.tag.plant).collect()
}

fn is_blade(kind: OrganKind) -> bool {
    matches!(kind, OrganKind::Blade | OrganKind::Cotyledon)
}

/// The part of the plane z = 0 that a camera sees.
struct View {
    border: Vec<Vec2>,
    /// South-west and north-east corner of the bounding rectangle.
    corners: [Vec2; 2],
}

impl View {
    /// Returns the view of the field's camera; `None` if it sees the horizon.
    fn of(field: &Field) -> Option<Self> {
        let border = field.scene.camera.outline(0.0, BORDER)?;
        let corners = border.iter().fold(None, |corners: Option<[Vec2; 2]>, p| {
            Some(corners.map_or([*p; 2], |[lo, hi]| [lo.min(*p), hi.max(*p)]))
        })?;
        Some(Self { border, corners })
    }

    /// Returns `true` if a part may be above the view, by its bounding box. Never misses a part that is.
    fn may_hold(&self, part: &Part) -> bool {
        let [lo, hi] = self.corners;
        part.bounds().is_some_and(|(low, high)| low.truncate().cmple(hi).all() && high.truncate().cmpge(lo).all())
    }
}

impl Canopy {
    /// Measures the canopy above the ground that the field's camera sees.
    fn of(field: &Field, view: &View, organs: &[Organ<'_>]) -> Option<Self> {
        let ground = polygon_area(&view.border);
        let unknown =
            field.scene.parts.iter().zip(&field.kinds).any(|(part, kind)| part.tag.plant > 0 && kind.organ().is_none());
        let over = |organ: &Organ<'_>| {
            if !view.may_hold(organ.part) {
                return 0.0;
            }
            let middle = |i: u32| organ.part.corners(i).into_iter().sum::<Vec3>() / 3.0;
            (0..).zip(&organ.areas).filter(|(i, _)| within(&view.border, middle(*i))).map(|(_, area)| area).sum()
        };
        let areas: Vec<f64> = organs.par_iter().map(over).collect();
        // Start from 0.0: the sum of an empty iterator is −0.0.
        let leaves = areas.iter().fold(0.0, |sum, area| sum + area);
        let known = (!unknown).then_some(leaves);
        let canopy = Self {
            ground_m2: ground.to_f32(),
            leaf_area_m2: known.map(ToFloat::to_f32),
            lai: known.map(|leaves| (leaves / ground).to_f32()),
        };
        (ground > 0.0).then_some(canopy)
    }
}

/// Returns the mask coverage of each triangle of a part.
fn shown(part: &Part) -> Vec<TriangleCoverage> {
    let of = |corners: &[u32; 3]| match &part.mask {
        Some(mask) => mask.share(corners.map(|k| part.mesh.uvs[k.to_usize()])),
        None => (Coverage::Opaque, 1.0),
    };
    part.mesh.triangles.iter().map(of).collect()
}

impl<'a> Organ<'a> {
    /// Creates the organ of a scene part.
    fn new(part: &'a Part, kind: OrganKind, shown: &'a [TriangleCoverage]) -> Self {
        let area =
            |(i, (_, share)): (u32, &TriangleCoverage)| 0.5 * f64::from(normal(part.corners(i)).length()) * share;
        let areas = if is_blade(kind) { (0..).zip(shown).map(area).collect() } else { Vec::new() };
        Self { part, shown, areas }
    }
}

/// Returns the normal of a triangle; its length is twice the triangle's area.
fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}

/// Measures a plant with these organs and its foot at `foot`, and its leaves by their numbers.
fn measure(organs: &[&Organ<'_>], axes: &[LeafAxis], foot: Vec3) -> (PlantTraits, BTreeMap<u16, LeafTraits>) {
    let mut leaves = BTreeMap::new();
    let mut total = 0.0;
    for axis in axes {
        let (mut area, mut tilted, mut top) = (0.0, 0.0, f32::MIN);
        for Organ { part, areas, .. } in organs.iter().filter(|organ| organ.part.tag.leaf == axis.leaf) {
            top = part.positions().fold(top, |top, p| top.max(p.z));
            for (i, piece) in (0..).zip(areas) {
                let normal = normal(part.corners(i)).normalize_or_zero();
                area += piece;
                tilted += piece * f64::from(normal.z.abs().clamp(0.0, 1.0).acos());
            }
        }
        let ahead = axis.tip - axis.base;
        let leaf = LeafTraits {
            area_m2: area.to_f32(),
            length_m: axis.size.length,
            width_m: axis.size.width,
            petiole_m: axis.size.petiole,
            inclination_deg: if area > 0.0 { (tilted / area).to_degrees().to_f32() } else { 0.0 },
            azimuth_deg: ahead.x.atan2(ahead.y).to_degrees().rem_euclid(360.0),
            top_m: top - foot.z,
        };
        total += area;
        leaves.insert(axis.leaf, leaf);
    }
    let corners = organs.iter().flat_map(|organ| organ.part.positions());
    let top = corners.fold(foot.z, |top, p| top.max(p.z));
    let plant = PlantTraits { leaf_area_m2: total.to_f32(), cover_m2: cover(organs).to_f32(), top_m: top - foot.z };
    (plant, leaves)
}

/// Number of points on each side of the image border that define the polygon of ground in view.
const BORDER: u32 = 32;
/// Number of cells along the longer side of the raster on which a plant's cover is counted: for a plant with its own meshes, and for
/// an instance. Instances get fewer, because they are many and their meshes are only as fine as the pixels that show them.
const CELLS: [f32; 2] = [512.0, 128.0];

/// Returns the ground area below the organs, m²: the cells whose centre is below one of them.
fn cover(organs: &[&Organ<'_>]) -> f64 {
    let corners = || organs.iter().flat_map(|organ| organ.part.positions()).map(Vec3::truncate);
    let Some(first) = corners().next() else { return 0.0 };
    let (lo, hi) = corners().fold((first, first), |(lo, hi), p| (lo.min(p), hi.max(p)));
    let shared = organs.iter().any(|organ| organ.part.instance.is_some());
    let side = ((hi - lo).max_element() / CELLS[usize::from(shared)]).max(1e-5);
    let columns = ((hi.x - lo.x) / side).trunc_to::<usize>() + 1;
    let rows = ((hi.y - lo.y) / side).trunc_to::<usize>() + 1;
    let mut covered = vec![false; columns * rows];
    for Organ { part, shown, .. } in organs {
        for ((i, corners), (coverage, _)) in (0..).zip(&part.mesh.triangles).zip(*shown) {
            // Only triangles that are partly opaque need a mask lookup for each cell.
            let mask = match coverage {
                Coverage::Transparent => continue,
                Coverage::Opaque => None,
                Coverage::Mixed => {
                    part.mask.as_deref().map(|mask| (mask, corners.map(|k| part.mesh.uvs[k.to_usize()])))
                }
            };
            let triangle = part.corners(i).map(|p| (p.truncate() - lo) / side);
            shade(&mut covered, (columns, rows), triangle, mask);
        }
    }
    covered.iter().filter(|cell| **cell).count().to_f64() * f64::from(side) * f64::from(side)
}

/// Marks the unit cells whose centres are inside a triangle and where its mask is opaque.
fn shade(
    covered: &mut [bool],
    (columns, rows): (usize, usize),
    [a, b, c]: [Vec2; 3],
    mask: Option<(&AlphaMask, [Vec2; 3])>,
) {
    let double = (b - a).perp_dot(c - a);
    if double == 0.0 {
        return;
    }
    let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
    let cells = |lo: f32, hi: f32, most: usize| {
        (lo - 0.5).ceil().max(0.0).trunc_to::<usize>()..(hi + 0.5).floor_to::<usize>().min(most)
    };
    for row in cells(lo.y, hi.y, rows) {
        let (west, east) = span([a, b, c], row.to_f32() + 0.5);
        for column in cells(lo.x.max(west - 1.0), hi.x.min(east + 1.0), columns) {
            let cell = &mut covered[row * columns + column];
            if *cell {
                continue;
            }
            let p = vec2(column.to_f32() + 0.5, row.to_f32() + 0.5);
            let (u, v) = ((p - a).perp_dot(c - a) / double, (b - a).perp_dot(p - a) / double);
            let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
            let there =
                |(mask, uv): (&AlphaMask, [Vec2; 3])| mask.opaque_at(uv[0] * (1.0 - u - v) + uv[1] * u + uv[2] * v);
            *cell = inside && mask.is_none_or(there);
        }
    }
}

/// Returns the interval of x that a triangle covers on the horizontal line at `y`, up to rounding. If the triangle does not reach
/// the line, the interval is empty: its first end is the greater.
fn span([a, b, c]: [Vec2; 3], y: f32) -> (f32, f32) {
    let crossing = |(p, q): (Vec2, Vec2)| {
        let (below, above) = (y - p.y, q.y - y);
        (below * above >= 0.0).then(|| {
            if p.y == q.y { (p.x.min(q.x), p.x.max(q.x)) } else { [p.x + below / (q.y - p.y) * (q.x - p.x); 2].into() }
        })
    };
    [(a, b), (b, c), (c, a)]
        .into_iter()
        .filter_map(crossing)
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(lo, hi), (west, east)| (lo.min(west), hi.max(east)))
}

/// Returns the area of a polygon that does not intersect itself.
fn polygon_area(corners: &[Vec2]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    0.5 * corners.iter().zip(next).map(|(a, b)| f64::from(a.perp_dot(*b))).sum::<f64>().abs()
}

/// Returns `true` if a point, projected along z, is inside a polygon: a ray to the east crosses the border an odd number of times.
fn within(corners: &[Vec2], point: Vec3) -> bool {
    let next = corners.iter().cycle().skip(1);
    let crosses = |(a, b): (&Vec2, &Vec2)| {
        (a.y > point.y) != (b.y > point.y) && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x)
    };
    corners.iter().zip(next).filter(|side| crosses(*side)).count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::geometry::{Mesh, Placement};
    use furrow_base::math::{Mat3, vec3};
    use furrow_grow::plant::LeafSize;
    use furrow_render::scene::Instance;
    use furrow_render::scene::tag::{Class, Tag};
    use std::f32::consts::PI;

    /// Builds a leaf of 0.1 m by 0.04 m with its midrib bent to an arc of this angle, radians. It points north; its base is at the origin.
    fn leaf(arc: f32, mask: Option<AlphaMask>) -> Part {
        let (rows, columns) = (64, 8);
        let place = |s: f32| match arc {
            0.0 => vec3(0.0, s, 0.0),
            _ => vec3(0.0, (arc * s / 0.1).sin(), 1.0 - (arc * s / 0.1).cos()) * (0.1 / arc),
        };
        let (mut positions, mut uvs, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..=rows {
            for j in 0..=columns {
                let (t, x) = (i.to_f32() / rows.to_f32(), j.to_f32() / columns.to_f32());
                positions.push(place(0.1 * t) + vec3(0.04 * (x - 0.5), 0.0, 0.0));
                uvs.push(vec2(x, 1.0 - t));
                if i < rows && j < columns {
                    let a = i * (columns + 1) + j;
                    triangles.push([a, a + 1, a + columns + 2]);
                    triangles.push([a, a + columns + 2, a + columns + 1]);
                }
            }
        }
        let mesh = Mesh::smooth(positions, uvs, triangles);
        let tag = Tag { class: Class::Crop, plant: 1, leaf: 1 };
        Part { mesh: Arc::new(mesh), mask: mask.map(Arc::new), material: 0, tag, instance: None }
    }

    fn axis(part: &Part) -> LeafAxis {
        let size = LeafSize { length: 0.1, width: 0.04, petiole: 0.02 };
        LeafAxis {
            leaf: 1,
            base: part.mesh.positions[4],
            tip: part.mesh.positions[64 * 9 + 4],
            size,
            joints: Vec::new(),
            rig: Vec::new(),
            on: None,
            bearer: None,
        }
    }

    /// Creates an organ; its coverage is leaked, because it must outlive the tests.
    fn blade(part: &Part) -> Organ<'_> {
        Organ::new(part, OrganKind::Blade, shown(part).leak())
    }

    fn measured(part: &Part) -> (PlantTraits, LeafTraits) {
        let (plant, leaves) = measure(&[&blade(part)], &[axis(part)], vec3(0.0, 0.0, -0.05));
        (plant, leaves[&1])
    }

    #[test]
    fn a_flat_rectangle_has_its_area_its_cover_and_no_inclination() {
        let part = leaf(0.0, None);
        let (plant, leaf) = measured(&part);
        assert!((leaf.area_m2 / 0.004 - 1.0).abs() < 1e-4, "{leaf:?}");
        assert!((plant.cover_m2 / 0.004 - 1.0).abs() < 0.01, "{plant:?}");
        assert_eq!((plant.leaf_area_m2, plant.top_m), (leaf.area_m2, leaf.top_m));
        assert!(leaf.inclination_deg < 0.01 && leaf.azimuth_deg < 0.01);
        assert!((leaf.top_m - 0.05).abs() < 1e-6);
        assert_eq!((leaf.length_m, leaf.width_m, leaf.petiole_m), (0.1, 0.04, 0.02));
    }

    /// Expected: an arc of angle φ and length L is inclined by 0 to φ, on average φ/2, and covers L sin φ / φ.
    #[test]
    fn a_bent_leaf_keeps_its_area_and_covers_less() {
        for arc in [0.5_f32, 1.0, PI / 2.0] {
            let (plant, leaf) = measured(&leaf(arc, None));
            assert!((leaf.area_m2 / 0.004 - 1.0).abs() < 0.005, "{arc}: {leaf:?}");
            assert!((leaf.inclination_deg - 0.5 * arc.to_degrees()).abs() < 0.2, "{arc}: {leaf:?}");
            let expected = 0.004 * arc.sin() / arc;
            assert!((plant.cover_m2 / expected - 1.0).abs() < 0.01, "{arc}: {plant:?}");
        }
    }

    #[test]
    fn a_turned_leaf_leads_where_it_was_turned() {
        for degrees in [30.0_f32, 135.0, 260.0] {
            let mut part = leaf(0.3, None);
            Arc::make_mut(&mut part.mesh).transform(Mat3::from_rotation_z(-degrees.to_radians()), Vec3::ZERO);
            let (plant, leaf) = measured(&part);
            assert!((leaf.azimuth_deg - degrees).abs() < 0.1, "{degrees}: {leaf:?}");
            let expected = 0.004 * 0.3_f32.sin() / 0.3;
            assert!((plant.cover_m2 / expected - 1.0).abs() < 0.02, "{degrees}: {plant:?}");
        }
    }

    /// Rationale: eaten parts of a leaf do not count. Expected: a disc-shaped mask leaves the area of a disc, including the triangles
    /// that its outline crosses.
    #[test]
    fn what_a_mask_leaves_is_what_counts() {
        let disc = AlphaMask::new(200, 500, |x, y| vec2(x.to_f32() - 99.5, (y.to_f32() - 249.5) * 0.4).length() < 80.0);
        let (plant, leaf) = measured(&leaf(0.0, Some(disc)));
        // An ellipse with 0.8 of the width and 0.8 of the length.
        let expected = PI / 4.0 * 0.032 * 0.08;
        assert!((leaf.area_m2 / expected - 1.0).abs() < 0.005, "{leaf:?} for {expected}");
        assert!((plant.cover_m2 / expected - 1.0).abs() < 0.01, "{plant:?} for {expected}");
    }

    /// Rationale: the cover of instances is counted on fewer cells. Expected: within 1 % the cover of the same leaf with its own mesh,
    /// and the same area.
    #[test]
    fn an_instance_has_the_traits_of_its_leaf() {
        let disc = AlphaMask::new(200, 500, |x, y| vec2(x.to_f32() - 99.5, (y.to_f32() - 249.5) * 0.4).length() < 80.0);
        let own = leaf(0.8, Some(disc));
        let mut instance = Part { mesh: own.mesh.clone(), mask: own.mask.clone(), ..leaf(0.8, None) };
        let placement = Arc::new(Placement { rotation: Mat3::IDENTITY, scale: 1.0, offset: Vec3::ZERO });
        instance.instance = Some(Instance { placement, tint: Vec3::ONE });
        let ((whole, blade), (plant, leaf)) = (measured(&own), measured(&instance));
        assert!((plant.cover_m2 / whole.cover_m2 - 1.0).abs() < 0.01, "{} {}", plant.cover_m2, whole.cover_m2);
        assert!((leaf.area_m2 / blade.area_m2 - 1.0).abs() < 1e-5, "{leaf:?} {blade:?}");
    }

    proptest::proptest! {
        /// Expected: exactly the cells whose centres are inside the triangle, tested one by one, for any shape.
        #[test]
        fn a_triangle_shades_the_cells_within_it(c in proptest::array::uniform6(-3.0_f32..35.0), flat: bool) {
            let (columns, rows) = (32_usize, 30_usize);
            let [a, b, mut d] = [vec2(c[0], c[1]), vec2(c[2], c[3]), vec2(c[4], c[5])];
            if flat {
                d.y = b.y;
            }
            let mut covered = vec![false; columns * rows];
            shade(&mut covered, (columns, rows), [a, b, d], None);
            let double = (b - a).perp_dot(d - a);
            for (k, cell) in covered.iter().enumerate() {
                let p = vec2((k % columns).to_f32() + 0.5, (k / columns).to_f32() + 0.5);
                let (u, v) = ((p - a).perp_dot(d - a) / double, (b - a).perp_dot(p - a) / double);
                proptest::prop_assert_eq!(*cell, double != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0, "{}", p);
            }
        }
    }

    #[test]
    fn leaves_over_each_other_cover_once() {
        let (below, mut above) = (leaf(0.0, None), leaf(0.0, None));
        Arc::make_mut(&mut above.mesh).transform(Mat3::IDENTITY, vec3(0.02, 0.0, 0.01));
        let (below, above) = (blade(&below), blade(&above));
        let covered = cover(&[&below, &above]);
        assert!((covered / 0.006 - 1.0).abs() < 0.01, "{covered}");
    }

    #[test]
    fn polygons_have_their_areas_and_insides() {
        let corners = [vec2(0.0, 0.0), vec2(2.0, 0.0), vec2(3.0, 1.0), vec2(0.0, 1.0)];
        assert!((polygon_area(&corners) - 2.5).abs() < 1e-9);
        assert!(within(&corners, vec3(2.4, 0.9, 7.0)) && !within(&corners, vec3(2.4, 0.1, 0.0)));
        let mut reversed = corners;
        reversed.reverse();
        let notched = [vec2(0.0, 0.0), vec2(1.0, 0.5), vec2(2.0, 0.0), vec2(2.0, 2.0), vec2(0.0, 2.0)];
        assert!(!within(&notched, vec3(1.0, 0.2, 0.0)) && within(&notched, vec3(1.0, 0.8, 0.0)));
        assert!(within(&reversed, vec3(1.0, 0.5, 0.0)) && !within(&reversed, vec3(-0.1, 0.5, 0.0)));
    }
}
