//! Where rays meet the ground of a field that is not made yet.
//!
//! What an image shows is first reckoned on the plane z = 0. The ground slopes and is rough, so an image shows it farther out where it lies lower, and nearer
//! where it lies higher: the more so the flatter it looks. Under a ray 8° below the horizon a centimetre of height is 7 cm of ground. Where that leaves the
//! room about the plane's view, the ground is made as far as it is seen.

use crate::math::{Vec2, Vec3};
use crate::soil::{Envelope, Rect};

/// Room around the view with fine ground, metres.
pub(super) const GROUND_MARGIN: f32 = 0.04;
/// Halvings by which the end of a ray is found.
const HALVINGS: u32 = 32;

/// Start and direction of a ray.
pub(super) type Look = (Vec3, Vec3);

/// How far from the world's origin a ground may be tilted whose even cells end at this rectangle, metres.
pub(super) fn tilted_to(near: Rect) -> f32 {
    near.corners().map(Vec2::length).into_iter().fold(0.0, f32::max)
}

/// The planes between which a ground lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Terrain {
    envelope: Envelope,
    /// How far from the world's origin they are tilted, metres.
    level_m: f32,
}

impl Terrain {
    /// Height of the plane through the world's origin at a place, metres.
    fn height(&self, p: Vec2) -> f32 {
        let tilted = p * (self.level_m / p.length().max(f32::MIN_POSITIVE)).min(1.0);
        self.envelope.tilt.dot(tilted)
    }

    /// Where a ray meets the plane that lies so much `higher` than that through the world's origin, metres; `None` where it runs on. It is met at once by a
    /// ray that starts below it.
    pub(super) fn meets(&self, (origin, direction): Look, higher: f32) -> Option<Vec2> {
        if direction.z >= 0.0 {
            return None;
        }
        let at = |t: f32| (origin + direction * t).truncate();
        let over = |t: f32| origin.z + direction.z * t - self.height(at(t)) - higher;
        if over(0.0) <= 0.0 {
            return Some(origin.truncate());
        }
        let tilt = self.envelope.tilt;
        let sinks = tilt.dot(direction.truncate()) - direction.z;
        let end = (origin.z - tilt.dot(origin.truncate()) - higher) / sinks;
        if sinks > 0.0 && end >= 0.0 && at(end).length() <= self.level_m {
            return Some(at(end));
        }
        if self.level_m.is_infinite() {
            return None;
        }
        // It passes the slope, and sinks below all that is level beyond.
        let lowest = higher - tilt.length() * self.level_m;
        let (mut before, mut behind) = (0.0, (origin.z - lowest) / -direction.z);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (before + behind);
            if over(middle) > 0.0 {
                before = middle;
            } else {
                behind = middle;
            }
        }
        Some(at(behind))
    }
}

/// What of a view has even cells, where not all of it has.
#[derive(Clone, Debug)]
pub(super) struct Near {
    /// On the plane z = 0.
    pub(super) area: Rect,
    /// The rays that end there, and how long the longest of them may be, metres.
    pub(super) looks: Vec<Look>,
    pub(super) ray_m: f32,
}

/// How far something sees.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::struct_field_names, reason = "lengths carry their unit")]
pub(super) struct Reach {
    /// How far to the east, north, west and south the field is grown, metres.
    pub(super) field_m: f32,
    /// The longest of its rays, metres.
    pub(super) ray_m: f32,
    /// How far it moves while it looks, metres.
    pub(super) travel_m: f32,
}

impl Reach {
    /// The end of a ray that meets the ground there, or nowhere, and whether it would be farther than the field is grown.
    fn end(&self, (origin, direction): Look, at: Option<Vec2>) -> (Vec2, bool) {
        let (from, ahead) = (origin.truncate(), direction.truncate());
        let longest = if self.ray_m.is_finite() { self.ray_m * ahead.length() } else { f32::INFINITY };
        let along = ahead.normalize_or_zero();
        let far = at.map_or(f32::INFINITY, |at| at.distance(from)).min(longest);
        let grown = self.field_m / along.abs().max_element().max(f32::MIN_POSITIVE);
        (from + along * far.min(grown), far > grown)
    }
}

/// What is seen of a ground as it slopes and as rough as it is.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    /// What of it is planted.
    pub(super) area: Rect,
    /// What of that has even cells.
    pub(super) near: Rect,
    /// Where rays meet it at its lowest and at its highest; nothing where that leaves the area as it is.
    pub(super) met: Vec<Vec2>,
    /// Whether some meet it farther away than the field is grown.
    pub(super) beyond: bool,
    pub(super) terrain: Terrain,
}

impl Seen {
    /// That of a ground between these planes of which `area` is seen if it is the plane z = 0; `looks` are the rays to the area's border, and `near` is what
    /// of it has even cells, with the rays there, unless all of it has.
    pub(super) fn of(envelope: Envelope, area: Rect, near: Option<Near>, looks: &[Look], reach: &Reach) -> Self {
        let heights = [-envelope.below_m, envelope.above_m];
        let ends = |terrain: &Terrain, looks: &[Look], reach: &Reach| -> (Vec<Vec2>, Vec<bool>) {
            let of = |look: &Look| heights.map(|higher| reach.end(*look, terrain.meets(*look, higher)));
            looks.iter().flat_map(of).unzip()
        };
        let sloping = Terrain { envelope, level_m: f32::INFINITY };
        let (terrain, fine) = match near {
            None => (sloping, None),
            Some(Near { area: near, looks, ray_m }) => {
                let reach = Reach { ray_m: ray_m.min(reach.ray_m), ..*reach };
                let near = widened(near, &ends(&sloping, &looks, &reach).0, 0.0);
                (Terrain { envelope, level_m: tilted_to(near) }, Some(near))
            }
        };
        let (mut met, farther) = ends(&terrain, looks, reach);
        let mut wide = widened(area, &met, reach.travel_m);
        if let Some(near) = fine {
            wide = widened(wide, &near.corners(), 0.0);
        }
        if wide == area {
            met.clear();
        }
        Self { area: wide, near: fine.unwrap_or(wide), met, beyond: farther.contains(&true), terrain }
    }
}

/// A rectangle whose sides go out to those of these places that lie beyond the room about it; to all that is seen from places `travel` metres away.
fn widened(area: Rect, places: &[Vec2], travel: f32) -> Rect {
    let room = area.grown(GROUND_MARGIN);
    let mut wide = area;
    for p in places {
        let ([west, south], [east, north]) = ((*p - travel).to_array(), (*p + travel).to_array());
        wide.x0 = if west < room.x0 { wide.x0.min(west) } else { wide.x0 };
        wide.y0 = if south < room.y0 { wide.y0.min(south) } else { wide.y0 };
        wide.x1 = if east > room.x1 { wide.x1.max(east) } else { wide.x1 };
        wide.y1 = if north > room.y1 { wide.y1.max(north) } else { wide.y1 };
    }
    wide
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{vec2, vec3};

    const SLOPE: Envelope = Envelope { tilt: Vec2::new(0.0, -0.05), below_m: 0.02, above_m: 0.03 };

    /// A ray from a metre above the origin to the north that sinks by so many metres on each metre.
    fn look(sinks: f32) -> Look {
        (vec3(0.0, 0.0, 1.0), vec3(0.0, 1.0, -sinks).normalize())
    }

    /// Expected: on ground that falls by 5 cm a metre a ray that sinks by 10 cm ends 20 m away, and one that sinks by 4 cm never does; where the ground is
    /// level from 8 m on, 14 m and 35 m away; 2 cm lower still, 40 cm farther on the slope. Source: similar triangles.
    #[test]
    fn rays_end_where_the_slope_is() {
        let far = |terrain: Terrain, sinks, higher| terrain.meets(look(sinks), higher).map(|at| at.y);
        let sloping = Terrain { envelope: SLOPE, level_m: f32::INFINITY };
        let ends = Terrain { level_m: 8.0, ..sloping };
        for (terrain, sinks, higher, expected) in [
            (sloping, 0.1, 0.0, 20.0),
            (sloping, 0.1, -0.02, 20.4),
            (ends, 0.1, 0.0, 14.0),
            (ends, 0.04, 0.0, 35.0),
            (ends, 0.5, 0.0, 1.0 / 0.45),
            (ends, 0.5, 2.0, 0.0),
        ] {
            let found = far(terrain, sinks, higher).unwrap();
            assert!((found - expected).abs() < 1e-3, "{sinks} {higher}: {found}, not {expected}");
        }
        assert!(far(sloping, 0.04, 0.0).is_none() && far(ends, -0.1, 0.0).is_none());
    }

    /// Expected: where the ground is the plane z = 0 nothing changes, nor where what is seen of it stays within the room; on the slope the northern side goes
    /// out to the lower plane's 20.4 m, and the ground's even cells as far as their longest ray; no side goes beyond the field.
    #[test]
    fn a_view_is_as_wide_as_the_slope_needs() {
        let area = Rect::new(-1.0, 2.0, 1.0, 10.0);
        let looks = [look(0.5), look(0.1)];
        let reach = Reach { field_m: 60.0, ray_m: f32::INFINITY, travel_m: 0.0 };
        let low = Envelope { below_m: 0.003, ..Envelope::LEVEL };
        for envelope in [Envelope::LEVEL, low] {
            let seen = Seen::of(envelope, area, None, &looks, &reach);
            assert!((seen.area, seen.near) == (area, area) && seen.met.is_empty() && !seen.beyond, "{seen:?}");
        }
        let seen = Seen::of(SLOPE, area, None, &looks, &reach);
        assert!((seen.area.y1 - 20.4).abs() < 1e-3 && seen.near == seen.area && !seen.beyond, "{seen:?}");
        assert_eq!((seen.area.x0, seen.area.y0, seen.area.x1), (-1.0, 2.0, 1.0));
        assert!(seen.met.iter().any(|at| at.distance(vec2(0.0, seen.area.y1)) < 1e-3));
        let near = Near { area: Rect::new(-1.0, 2.0, 1.0, 2.1), looks: vec![look(0.5), look(0.1)], ray_m: 4.0 };
        let graded = Seen::of(SLOPE, area, Some(near), &looks, &reach);
        assert!((graded.near.y1 - 4.0).abs() < 0.03, "{graded:?}");
        // Level from there on.
        assert!((10.0..13.0).contains(&graded.area.y1), "{graded:?}");
        let short = Seen::of(SLOPE, area, None, &looks, &Reach { field_m: 12.0, ..reach });
        assert!((short.area.y1 - 12.0).abs() < 1e-4 && short.beyond, "{short:?}");
    }
}
