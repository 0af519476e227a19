//! Visible extent of plants and leaves: how much of each is occluded by others, and how much is outside the frame.
//!
//! Each leaf is rasterized by itself, as if nothing else existed: for each of its triangles, rays of the labels are
//! traced in double precision, masks included, for the few pixel centres in its bounds. This needs no BVH and no depth
//! peeling, and geometry outside the image costs only the pixels it covers. Pixels labelled as the leaf always count as
//! hit, so that rounding at an outline can never make the visible count exceed the total.

use super::LabelMap;
use crate::accel::BruteForce;
use crate::scene::tag::Tag;
use crate::scene::{Part, Scene};
use furrow_base::geometry::{Ray, Window};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec3, vec3};
use furrow_optics::sensor::{Camera, PixelBox};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Numbers of pixel centres covered by a plant or leaf: `visible` ≤ `unoccluded` ≤ `whole`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extent {
    /// Pixels with its label.
    pub visible: u32,
    /// Pixels within the labels' window that it would cover without any other plant, leaf or soil.
    pub unoccluded: u32,
    /// The same including pixels outside the window, as if the image continued: by the image size to each side, within
    /// the domain of the lens model.
    pub whole: u32,
}

impl Extent {
    /// Visible fraction of the part inside the window, 0 to 1.
    pub fn visible_fraction(&self) -> f32 {
        self.visible.to_f32() / self.unoccluded.max(1).to_f32()
    }

    /// Fraction of the whole that is inside the window, 0 to 1.
    pub fn inside_fraction(&self) -> f32 {
        self.unoccluded.to_f32() / self.whole.max(1).to_f32()
    }
}

/// Returns the extents of all plants in the labels' window, by (plant, leaf). Leaf 0 is the whole plant including its
/// leaves. Plants that would cover no pixel centre of the window even without occlusion are left out, and so are leaves
/// that cover no pixel centre at all. Call it inside a pool.
pub fn extents(scene: &Scene, labels: &LabelMap) -> BTreeMap<(u32, u16), Extent> {
    measure(scene, labels, |_, _| {})
}

/// Extents of plants and leaves, and the pixels that each plant would cover without occlusion.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WholePlants {
    /// Extents by (plant, leaf), see [`extents`].
    pub extents: BTreeMap<(u32, u16), Extent>,
    /// Masks of the same plants.
    pub masks: BTreeMap<u32, WholeMask>,
}

/// The pixels of the labels' window that a plant would cover without any other plant or soil: [`Extent::unoccluded`] of
/// them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WholeMask {
    /// Area that contains them.
    pub window: Window,
    /// Whether each pixel of the area is covered, row by row.
    pub covered: Vec<bool>,
    /// Left, top, width and height of the box around all pixels of the plant, those outside the window included: by the
    /// image size to each side.
    pub bounds: [i32; 4],
}

impl WholeMask {
    /// Returns whether the plant would cover the pixel (x, y) of the image.
    pub fn contains(&self, x: u32, y: u32) -> bool {
        let Window { x0, y0, x1, y1 } = self.window;
        let inside = (x0..x1).contains(&x) && (y0..y1).contains(&y);
        inside && self.covered[((y - y0) * (x1 - x0) + x - x0).to_usize()]
    }

    /// Returns the pixels (x, y) of the image that the plant would cover, row by row.
    pub fn pixels(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let Window { x0, y0, x1, y1 } = self.window;
        let all = (y0..y1).flat_map(move |y| (x0..x1).map(move |x| (x, y)));
        all.zip(&self.covered).filter_map(|(pixel, covered)| covered.then_some(pixel))
    }
}

/// Returns the [`extents`] of all plants together with their masks. Call it inside a pool.
pub fn whole_plants(scene: &Scene, labels: &LabelMap) -> WholePlants {
    let window = Area::of(labels.window);
    let mut masks = BTreeMap::new();
    let extents = measure(scene, labels, |plant, mask| {
        masks.insert(plant, mask.within(window));
    });
    WholePlants { extents, masks }
}

/// Returns the [`extents`] of all plants. Calls `keep` with the number and mask of each.
fn measure(scene: &Scene, labels: &LabelMap, mut keep: impl FnMut(u32, &Mask)) -> BTreeMap<(u32, u16), Extent> {
    let window = Area::of(labels.window);
    let seen = visible(labels);
    let reach = reach(&scene.camera);
    let organs: Vec<_> = (0..).zip(&scene.parts).filter(|(_, part)| part.tag.plant > 0).collect();
    let area = |(_, part): &(u32, &Part)| image_of(part.bounds(), &scene.camera).meet(reach);
    let areas: Vec<Area> = organs.par_iter().map(area).collect();
    let mut things: BTreeMap<(u32, u16), LabelledObject> = BTreeMap::new();
    for ((i, part), area) in organs.into_iter().zip(areas) {
        things.entry((part.tag.plant, part.tag.leaf)).or_default().add(i, area);
    }
    for (key, (_, area)) in &seen {
        // Everything visible has a part.
        if let Some(thing) = things.get_mut(key) {
            thing.area = thing.area.join(*area);
        }
    }
    let mut plants: BTreeMap<u32, Area> = BTreeMap::new();
    for ((plant, _), thing) in &things {
        let area = plants.entry(*plant).or_default();
        *area = area.join(thing.area);
    }
    let near: Vec<_> = things.iter().filter(|((plant, _), _)| !plants[plant].meet(window).is_empty()).collect();
    let surfaces = scene.surfaces();
    let brute = BruteForce::new(&surfaces);
    let masks: Vec<Mask> = near.par_iter().map(|(key, thing)| thing.mask(**key, scene, &brute, labels)).collect();

    let visible = |key| seen.get(&key).map_or(0, |(count, _)| *count);
    let mut extents = BTreeMap::new();
    for group in near.iter().zip(&masks).collect::<Vec<_>>().chunk_by(|a, b| a.0.0.0 == b.0.0.0) {
        let plant = group[0].0.0.0;
        let mut all = Mask::new(plants[&plant]);
        let mut leaves = Vec::new();
        let mut shown = 0;
        for ((key, _), mask) in group {
            let extent = Extent { visible: visible(**key), ..mask.count(window) };
            shown += extent.visible;
            all.add(mask);
            if key.1 > 0 && extent.whole > 0 {
                leaves.push((**key, extent));
            }
        }
        let extent = Extent { visible: shown, ..all.count(window) };
        if extent.unoccluded > 0 {
            extents.insert((plant, 0), extent);
            extents.extend(leaves);
            keep(plant, &all);
        }
    }
    extents
}

/// Returns the number of pixels of each (plant, leaf), where leaf 0 is everything of the plant that is not a leaf, and
/// the area containing them.
fn visible(labels: &LabelMap) -> BTreeMap<(u32, u16), (u32, Area)> {
    let mut seen: BTreeMap<(u32, u16), (u32, Area)> = BTreeMap::new();
    let Window { x0, y0, .. } = labels.window;
    for (row, y) in labels.tags.chunks(labels.window.width().to_usize()).zip(y0.to_i32()..) {
        let mut x = x0.to_i32();
        for run in row.chunk_by(|a, b| a == b) {
            let Tag { plant, leaf, .. } = run[0];
            let end = x + run.len().to_i32();
            if plant > 0 {
                let (count, area) = seen.entry((plant, leaf)).or_default();
                *count += run.len().to_u32();
                *area = area.join(Area { x0: x, y0: y, x1: end, y1: y + 1 });
            }
            x = end;
        }
    }
    seen
}

/// Rectangle of pixels inside or outside the image: columns `x0..x1`, rows `y0..y1`. Empty by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Area {
    x0: i32,
    y0: i32,
    x1: i32,
    y1: i32,
}

impl Area {
    fn of(window: Window) -> Self {
        let Window { x0, y0, x1, y1 } = window;
        Self { x0: x0.to_i32(), y0: y0.to_i32(), x1: x1.to_i32(), y1: y1.to_i32() }
    }

    /// Returns the pixels whose centres are in a box. 0.01 pixel covers the rounding of rays to single precision.
    fn within([lo, hi]: PixelBox) -> Self {
        let [x0, y0] = lo.map(|v| (v - 0.51).ceil_to::<i32>());
        let [x1, y1] = hi.map(|v| (v - 0.49).floor_to::<i32>().saturating_add(1));
        Self { x0, y0, x1, y1 }
    }

    fn is_empty(self) -> bool {
        self.x0 >= self.x1 || self.y0 >= self.y1
    }

    fn width(self) -> usize {
        (self.x1 - self.x0).max(0).to_usize()
    }

    /// Intersection of two areas.
    fn meet(self, o: Self) -> Self {
        let (x0, y0, x1, y1) = (self.x0.max(o.x0), self.y0.max(o.y0), self.x1.min(o.x1), self.y1.min(o.y1));
        Self { x0, y0, x1, y1 }
    }

    /// Smallest area that contains both.
    fn join(self, o: Self) -> Self {
        if self.is_empty() || o.is_empty() {
            return if self.is_empty() { o } else { self };
        }
        let (x0, y0, x1, y1) = (self.x0.min(o.x0), self.y0.min(o.y0), self.x1.max(o.x1), self.y1.max(o.y1));
        Self { x0, y0, x1, y1 }
    }
}

/// Area by which the image is extended: its own size to each side.
fn reach(camera: &Camera) -> Area {
    let (w, h) = (camera.width().to_i32(), camera.height().to_i32());
    Area { x0: -w, y0: -h, x1: 2 * w, y1: 2 * h }
}

/// Area of the image covered by an axis-aligned box, given by its minimum and maximum corner.
fn image_of(bounds: Option<(Vec3, Vec3)>, camera: &Camera) -> Area {
    /// Corners of the faces of a box; the bits of each number select its end on x, y and z.
    const FACES: [[u8; 4]; 6] = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let Some((lo, hi)) = bounds else { return Area::default() };
    let corner = |bits: u8| {
        let end = |axis: usize| if bits >> axis & 1 == 0 { lo[axis] } else { hi[axis] };
        vec3(end(0), end(1), end(2))
    };
    let halves = FACES.iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let outlines = halves.filter_map(|half| camera.triangle_outline(half.map(|k| corner(*k))));
    outlines.map(|outline| Area::within(outline.bounds)).fold(Area::default(), Area::join)
}

/// A leaf with its petiole, or the parts of a plant that are not leaves.
#[derive(Default)]
struct LabelledObject {
    parts: Vec<u32>,
    /// Pixels that it may cover.
    area: Area,
}

impl LabelledObject {
    fn add(&mut self, part: u32, area: Area) {
        self.parts.push(part);
        self.area = self.area.join(area);
    }

    /// Returns the pixels whose centres it covers.
    fn mask(&self, key: (u32, u16), scene: &Scene, brute: &BruteForce<'_>, labels: &LabelMap) -> Mask {
        let mut mask = Mask::new(self.area);
        let window = Area::of(labels.window);
        mask.fill(self.area.meet(window), |x, y| {
            let tag = labels.tags[(y - window.y0).to_usize() * window.width() + (x - window.x0).to_usize()];
            (tag.plant, tag.leaf) == key
        });
        for part in &self.parts {
            let it = &scene.parts[part.to_usize()];
            for triangle in 0..it.mesh.triangles.len().to_u32() {
                let Some(outline) = scene.camera.triangle_outline(it.corners(triangle)) else { continue };
                mask.fill(Area::within(outline.bounds).meet(self.area), |x, y| {
                    // Most pixels in the bounds of a small triangle are rejected by its edges, which is cheaper than a
                    // ray.
                    if !outline.may_hold([f64::from(x) + 0.5, f64::from(y) + 0.5]) {
                        return false;
                    }
                    let ray = scene.camera.ray_beyond(x, y);
                    ray.is_some_and(|(o, d)| brute.triangle(&Ray::new(o, d), *part, triangle).is_some())
                });
            }
        }
        mask
    }
}

/// A set of pixels within an area.
struct Mask {
    area: Area,
    set: Vec<bool>,
}

impl Mask {
    fn new(area: Area) -> Self {
        let height = (area.y1 - area.y0).max(0).to_usize();
        Self { area, set: vec![false; area.width() * height] }
    }

    /// Adds the pixels of a part of the area that pass a test. Pixels already in the set are not tested.
    fn fill(&mut self, part: Area, test: impl Fn(i32, i32) -> bool) {
        for y in part.y0..part.y1 {
            let row = (y - self.area.y0).to_usize() * self.area.width();
            for x in part.x0..part.x1 {
                let set = &mut self.set[row + (x - self.area.x0).to_usize()];
                *set = *set || test(x, y);
            }
        }
    }

    /// Adds the pixels of another mask, whose area must be inside this one's.
    fn add(&mut self, other: &Self) {
        let area = other.area;
        for (row, y) in other.set.chunks(area.width().max(1)).zip(area.y0..) {
            let from = (y - self.area.y0).to_usize() * self.area.width() + (area.x0 - self.area.x0).to_usize();
            for (to, set) in self.set[from..].iter_mut().zip(row) {
                *to |= *set;
            }
        }
    }

    /// Returns the part of the mask inside the window.
    fn within(&self, window: Area) -> WholeMask {
        let part = self.area.meet(window);
        let row = |y: i32| {
            let from = (y - self.area.y0).to_usize() * self.area.width() + (part.x0 - self.area.x0).to_usize();
            &self.set[from..from + part.width()]
        };
        let covered = (part.y0..part.y1).flat_map(row).copied().collect();
        let [x0, y0, x1, y1] = [part.x0, part.y0, part.x1, part.y1].map(ToInt::to_u32);
        let around = self.bounds();
        let bounds = [around.x0, around.y0, around.x1 - around.x0, around.y1 - around.y0];
        WholeMask { window: Window { x0, y0, x1, y1 }, covered, bounds }
    }

    /// Returns the smallest area that contains the set.
    fn bounds(&self) -> Area {
        let mut bounds = Area::default();
        for (row, y) in self.set.chunks(self.area.width().max(1)).zip(self.area.y0..) {
            let first = row.iter().position(|set| *set);
            if let Some((first, last)) = first.zip(row.iter().rposition(|set| *set)) {
                let x = |column: usize| self.area.x0 + column.to_i32();
                bounds = bounds.join(Area { x0: x(first), y0: y, x1: x(last) + 1, y1: y + 1 });
            }
        }
        bounds
    }

    /// Counts the pixels inside the window and in total.
    fn count(&self, window: Area) -> Extent {
        let mut extent = Extent::default();
        for (row, y) in self.set.chunks(self.area.width().max(1)).zip(self.area.y0..) {
            let count = |row: &[bool]| row.iter().filter(|set| **set).count().to_u32();
            extent.whole += count(row);
            if (window.y0..window.y1).contains(&y) {
                let column = |x: i32| (x.clamp(self.area.x0, self.area.x1) - self.area.x0).to_usize();
                extent.unoccluded += count(&row[column(window.x0)..column(window.x1)]);
            }
        }
        extent
    }
}
