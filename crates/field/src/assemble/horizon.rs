//! Plants the hedge, its trees and the woods behind it around a field.
//!
//! Both are rings of slots around the world's origin. The plant of a slot follows from the slot's own random stream, so it does not depend
//! on the camera; plants that no camera sees are left out. All are instances of a few shapes.

use super::contents::Contents;
use super::drawn::Drawn;
use crate::PartKind;
use crate::horizon::{BAY_DEPTH, HorizonRecord};
use furrow_base::Result;
use furrow_base::geometry::{Mesh, Placement};
use furrow_base::math::{Mat3, RoundTo, Spectrum, ToFloat, Vec2, Vec3};
use furrow_base::sampling::{Purpose, Stream};
use furrow_grow::tree::{Woody, WoodyPlant, woody};
use furrow_optics::sensor::Camera;
use furrow_optics::texture::noise::Perlin;
use furrow_render::material::{LeafDesc, LeafMaterial, Material, Solid};
use furrow_render::scene::tag::Tag;
use furrow_render::scene::{Instance, Part};
use std::f32::consts::TAU;
use std::sync::Arc;

/// Number of bays of a ring around the field.
const BAYS: f32 = 5.0;
/// Distance of the woods relative to that of the hedge.
const WOODS: f32 = 1.8;
/// Spacing of plants in a ring relative to their mean height: shrubs touch, crowns of trees overlap.
const SHRUBS_APART: f32 = 0.4;
const TREES_APART: f32 = 0.5;
const WOODS_APART: f32 = 0.3;
/// Length of a group of trees or of a gap between groups, metres.
const GROUP_M: f32 = 45.0;
/// Number of different trees, and of different shrubs.
const SHAPES: u64 = 6;
/// Chlorophyll content of their leaves, µg/cm², and its range of factors from plant to plant.
const CHLOROPHYLL: f32 = 45.0;
const GREENER: (f32, f32) = (0.65, 1.5);
/// Reflectance of bark: R, G, B, NIR.
const BARK: [f32; 4] = [0.13, 0.11, 0.09, 0.28];

/// Returns the stream of the field's horizon.
fn stream(drawn: &Drawn<'_>) -> Stream {
    drawn.stream(Purpose::Horizon, 0)
}

/// Returns the drawn values of the horizon; `None` if the scene file has none.
pub(super) fn drawn_of(drawn: &Drawn<'_>) -> Option<HorizonRecord> {
    Some(drawn.desc.horizon.as_ref()?.draw(&stream(drawn)))
}

/// Returns the distance from the world's origin beyond which nothing stands, metres; `None` without a horizon.
pub(super) fn reach(drawn: &Drawn<'_>) -> Option<f32> {
    drawn_of(drawn).map(|horizon| 1.1 * WOODS * (1.0 + BAY_DEPTH) * horizon.distance_m.to_f32())
}

/// A ring of plants of one kind.
struct Ring {
    number: u64,
    kind: Woody,
    /// Mean radius, metres.
    radius: f32,
    /// Mean distance between plants, metres.
    apart: f32,
    /// Fraction of the slots that are planted, in groups.
    cover: f32,
}

/// Adds hedge, trees and woods to the parts. `height` returns the height of the ground.
pub(super) fn plant(drawn: &Drawn<'_>, parts: &mut Contents, height: impl Fn(Vec2) -> f32) -> Result<()> {
    let Some((desc, horizon)) = drawn.desc.horizon.as_ref().zip(drawn_of(drawn)) else { return Ok(()) };
    let distance = horizon.distance_m.to_f32();
    let (shrub, tree) = (middle(desc.hedge_m.usual()), middle(desc.tree_m.usual()));
    let ring = |number, kind, radius, apart, cover| Ring { number, kind, radius, apart, cover };
    let rings = [
        ring(0, Woody::Shrub, distance, SHRUBS_APART * shrub, 1.0),
        ring(1, Woody::Tree, distance + 2.0, TREES_APART * tree, desc.cover.f32()),
        ring(2, Woody::Tree, WOODS * distance, WOODS_APART * tree, desc.cover.f32()),
    ];
    let views: Vec<Cone> = drawn.captures.iter().map(|capture| Cone::of(&capture.camera)).collect();
    let leaf = LeafMaterial::new(&LeafDesc::default(), None);
    let foliage = parts.material(Material::Leaf(leaf.clone()));
    let bark = parts.material(Material::Solid(Solid::new(Spectrum::from(BARK), 0.5)));
    for ring in rings {
        let sizes = if ring.kind == Woody::Shrub { &desc.hedge_m } else { &desc.tree_m };
        let of = stream(drawn).child(Purpose::Scatter, ring.number);
        let shapes = shapes(&of, ring.kind);
        for Slot { at, of } in slots(&ring, &of) {
            drawn.options.wanted()?;
            let own = |k| of.child(Purpose::Horizon, k);
            let tall = sizes.draw32(&mut own(0));
            let offset = at.extend(height(at));
            if drawn.scanners.is_empty() && !views.iter().any(|view| view.sees(offset, tall)) {
                continue;
            }
            let rotation = Mat3::from_rotation_z(own(1).range32(0.0, TAU));
            let placement = Placement { rotation, scale: tall, offset };
            let greener = own(2).range32(GREENER.0, GREENER.1);
            let tint = leaf.chlorophyll_tint(CHLOROPHYLL, CHLOROPHYLL * greener);
            let [leaves, wood] = &shapes[own(3).index(shapes.len())];
            let placed = Placed { placement: Arc::new(placement), instanced: drawn.options.preview.is_none() };
            parts.push(placed.part(leaves, foliage, tint), PartKind::Backdrop);
            if !wood.triangles.is_empty() {
                parts.push(placed.part(wood, bark, Vec3::ONE), PartKind::Backdrop);
            }
        }
    }
    Ok(())
}

fn middle((lo, hi): (f64, f64)) -> f32 {
    (0.5 * (lo + hi)).to_f32()
}

/// Place of one plant.
struct Placed {
    placement: Arc<Placement>,
    /// Whether it shares its mesh; a preview, which finds changed parts by their meshes, needs one for each.
    instanced: bool,
}

impl Placed {
    fn part(&self, mesh: &Arc<Mesh>, material: u32, tint: Vec3) -> Part {
        let (mesh, instance) = if self.instanced {
            (mesh.clone(), Some(Instance { placement: self.placement.clone(), tint }))
        } else {
            let mut own = Mesh::clone(mesh);
            own.transform(self.placement.matrix(), self.placement.offset);
            (Arc::new(own), None)
        };
        Part { mesh, mask: None, material, tag: Tag::default(), instance }
    }
}

/// Returns foliage and wood of each shape of a ring.
fn shapes(of: &Stream, kind: Woody) -> Vec<[Arc<Mesh>; 2]> {
    let shape = |k| {
        let WoodyPlant { foliage, wood } = woody(kind, &mut of.child(Purpose::Plant, k));
        [Arc::new(foliage), Arc::new(wood)]
    };
    (0..SHAPES).map(shape).collect()
}

/// Position of a plant, and its random stream.
struct Slot {
    at: Vec2,
    of: Stream,
}

/// Returns the planted slots of a ring.
fn slots(ring: &Ring, of: &Stream) -> Vec<Slot> {
    let mut own = of.child(Purpose::Texture, 0);
    let (bays, groups) = (Perlin::new(own.seed32()), Perlin::new(own.seed32()));
    let count = (TAU * ring.radius / ring.apart).round_to::<u32>();
    // Noise on a circle, whose ends meet.
    let circle = |noise: &Perlin, around: f32, radius: f32| {
        let p = Vec2::from_angle(around) * radius;
        noise.at2(f64::from(p.x) + 0.37, f64::from(p.y) + 0.61).to_f32()
    };
    let slot = |k: u32| {
        let of = of.child(Purpose::Plant, (u64::from(k) << 8) | 0xff);
        let around = (k.to_f32() + of.child(Purpose::Scatter, 0).uniform32()) * TAU / count.to_f32();
        let depth = of.child(Purpose::Scatter, 1).range32(-0.5, 0.5) * ring.apart;
        let radius = ring.radius * (1.0 + BAY_DEPTH * circle(&bays, around, BAYS / TAU)) + depth;
        (circle(&groups, around, ring.radius / GROUP_M), Slot { at: Vec2::from_angle(around) * radius, of })
    };
    let mut slots: Vec<(f32, Slot)> = (0..count).map(slot).collect();
    // The slots of largest noise are planted: their fraction is exact, and they are in groups.
    slots.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    slots.truncate((ring.cover * count.to_f32()).round_to::<usize>());
    slots.into_iter().map(|(_, slot)| slot).collect()
}

/// Cone around all rays of a camera.
struct Cone {
    apex: Vec3,
    axis: Vec3,
    /// Half of the apex angle, radians.
    half: f32,
}

impl Cone {
    fn of(camera: &Camera) -> Self {
        let (w, h) = (camera.width(), camera.height());
        let (apex, axis) = camera.centre_ray(w / 2, h / 2);
        let corners = [(0, 0), (w - 1, 0), (0, h - 1), (w - 1, h - 1)];
        let angles = corners.map(|(x, y)| camera.centre_ray(x, y).1.angle_between(axis));
        Self { apex, axis, half: angles.into_iter().fold(0.0, f32::max) }
    }

    /// Returns `true` if a plant of height `tall` at `foot` may be in the cone.
    fn sees(&self, foot: Vec3, tall: f32) -> bool {
        let to = foot + Vec3::Z * (0.5 * tall) - self.apex;
        to.angle_between(self.axis) <= self.half + (tall / to.length().max(tall)).asin() + 0.02
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: the planted fraction is that asked for, within the variation of the radius; a full ring is evenly spaced; planted slots of
    /// a covered half are in groups, far fewer than by chance.
    #[test]
    fn slots_are_planted_in_groups_around_the_field() {
        let of = Stream::of(3, 0, Purpose::Test, 0);
        let ring = |cover| Ring { number: 0, kind: Woody::Tree, radius: 300.0, apart: 4.0, cover };
        let all = slots(&ring(1.0), &of).len();
        assert_eq!(all, 471);
        let half = slots(&ring(0.5), &of);
        assert_eq!(half.len(), 236);
        let around = |slot: &Slot| (slot.at.to_angle().rem_euclid(TAU) / TAU * all.to_f32()).trunc_to::<u32>();
        let mut planted: Vec<u32> = half.iter().map(around).collect();
        planted.sort_unstable();
        let gaps = planted.windows(2).filter(|pair| pair[1] - pair[0] > 2).count();
        assert!((3..60).contains(&gaps), "{gaps} gaps");
        assert!(half.iter().all(|slot| (235.0..365.0).contains(&slot.at.length())));
    }

    /// Expected: a cone of 45° sees a plant ahead and one half across its rim, but neither one behind nor one far to the side.
    #[test]
    fn what_a_camera_may_see_is_kept() {
        let cone = Cone { apex: Vec3::new(0.0, 0.0, 1.0), axis: Vec3::Y, half: 0.785 };
        let sees = |x: f32, y: f32| cone.sees(Vec3::new(x, y, 0.0), 10.0);
        assert!(sees(0.0, 200.0) && sees(204.0, 200.0) && !sees(0.0, -200.0) && !sees(300.0, 200.0));
    }
}
