//! Computes where rays meet the ground before the ground is built.
//!
//! The view is first computed on the plane z = 0. The real ground slopes and is rough, so rays meet it farther away where it is lower
//! and nearer where it is higher; the effect grows as rays get flatter. For a ray 8° below the horizontal, one centimetre of height
//! shifts the hit by 7 cm. If a hit is outside the margin around the view on the plane, the built area is extended to it.

use furrow_base::math::{Vec2, Vec3};
use furrow_grow::soil::{Envelope, Rect};

/// Margin of fine ground around the view, metres.
pub(super) const GROUND_MARGIN: f32 = 0.04;
/// Number of bisection steps that find the end of a ray.
const HALVINGS: u32 = 32;

/// Origin and direction of a ray.
pub(super) type ViewRay = (Vec3, Vec3);

/// Returns the radius around the world's origin within which the ground is tilted, metres; beyond it is level. It encloses `near`, the
/// rectangle of uniform cells.
pub(super) fn tilted_to(near: Rect) -> f32 {
    near.corners().map(Vec2::length).into_iter().fold(0.0, f32::max)
}

/// Lower and upper bounding surface of the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Terrain {
    envelope: Envelope,
    /// Radius around the world's origin within which the surfaces are tilted, metres; beyond it they are level.
    level_m: f32,
}

impl Terrain {
    /// Returns the height at `p` of the surface through the world's origin, metres.
    fn height(&self, p: Vec2) -> f32 {
        let tilted = p * (self.level_m / p.length().max(f32::MIN_POSITIVE)).min(1.0);
        self.envelope.tilt.dot(tilted)
    }

    /// Returns the point where a ray meets the surface that is `higher` metres above the one through the world's origin; `None` if it
    /// never does. A ray that starts below the surface meets it at its origin.
    pub(super) fn meets(&self, (origin, direction): ViewRay, higher: f32) -> Option<Vec2> {
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
        // The ray passes the tilted part and meets the level part beyond; bisect.
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

/// The part of a view that gets uniform cells, if not all of it does.
#[derive(Clone, Debug)]
pub(super) struct Near {
    /// Area on the plane z = 0.
    pub(super) area: Rect,
    /// Rays that end in the area.
    pub(super) view_rays: Vec<ViewRay>,
    /// Maximum length of these rays, metres.
    pub(super) ray_m: f32,
}

/// Limits of the view of a camera or LiDAR.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::struct_field_names, reason = "lengths carry their unit")]
pub(super) struct ViewLimits {
    /// Reach of the planted area to the east, north, west and south, metres.
    pub(super) field_m: f32,
    /// Maximum length of a ray, metres.
    pub(super) ray_m: f32,
    /// Distance travelled during the exposure, metres.
    pub(super) travel_m: f32,
}

impl ViewLimits {
    /// Clips a ray that meets the ground at `at` (or nowhere) to the limits. Returns its end, and whether the end was beyond the planted
    /// area.
    fn end(&self, (origin, direction): ViewRay, at: Option<Vec2>) -> (Vec2, bool) {
        let (from, ahead) = (origin.truncate(), direction.truncate());
        let longest = if self.ray_m.is_finite() { self.ray_m * ahead.length() } else { f32::INFINITY };
        let along = ahead.normalize_or_zero();
        let far = at.map_or(f32::INFINITY, |at| at.distance(from)).min(longest);
        let grown = self.field_m / along.abs().max_element().max(f32::MIN_POSITIVE);
        (from + along * far.min(grown), far > grown)
    }
}

/// The view of a sloping, rough ground.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    /// Area in view.
    pub(super) area: Rect,
    /// Part of the area with uniform cells.
    pub(super) near: Rect,
    /// Points where rays meet the lower and the upper bounding surface; empty if they do not extend the area.
    pub(super) met: Vec<Vec2>,
    /// Whether any ray meets the ground beyond the planted area.
    pub(super) beyond: bool,
    pub(super) terrain: Terrain,
}

impl Seen {
    /// Extends a view from the plane z = 0 to a ground within `envelope`. `area` is the area seen on the plane, `view_rays` are the rays to
    /// its border. `near` is the part with uniform cells; `None` if that is all of it.
    pub(super) fn of(
        envelope: Envelope,
        area: Rect,
        near: Option<Near>,
        view_rays: &[ViewRay],
        reach: &ViewLimits,
    ) -> Self {
        let heights = [-envelope.below_m, envelope.above_m];
        let ends = |terrain: &Terrain, view_rays: &[ViewRay], reach: &ViewLimits| -> (Vec<Vec2>, Vec<bool>) {
            let of = |look: &ViewRay| heights.map(|higher| reach.end(*look, terrain.meets(*look, higher)));
            view_rays.iter().flat_map(of).unzip()
        };
        let sloping = Terrain { envelope, level_m: f32::INFINITY };
        let (terrain, fine) = match near {
            None => (sloping, None),
            Some(Near { area: near, view_rays, ray_m }) => {
                let reach = ViewLimits { ray_m: ray_m.min(reach.ray_m), ..*reach };
                let near = widened(near, &ends(&sloping, &view_rays, &reach).0, 0.0);
                (Terrain { envelope, level_m: tilted_to(near) }, Some(near))
            }
        };
        let (mut met, farther) = ends(&terrain, view_rays, reach);
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

/// Extends the sides of a rectangle to those of `places` that are outside the margin around it. Each place is widened by `travel` metres.
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
    use furrow_base::math::{vec2, vec3};

    const SLOPE: Envelope = Envelope { tilt: Vec2::new(0.0, -0.05), below_m: 0.02, above_m: 0.03 };

    /// Returns a ray that starts 1 m above the origin and heads north, descending by `sinks` metres per metre.
    fn look(sinks: f32) -> ViewRay {
        (vec3(0.0, 0.0, 1.0), vec3(0.0, 1.0, -sinks).normalize())
    }

    /// Expected: on ground that falls by 5 cm per metre, a ray that descends by 10 cm per metre ends after 20 m, and one that descends by
    /// 4 cm never ends. If the ground is level beyond 8 m, they end after 14 m and 35 m. On the slope 2 cm lower, the first ends 40 cm
    /// farther away. Source: similar triangles.
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

    /// Expected: no change if the ground is the plane z = 0 or if all hits stay within the margin. On the slope, the northern side moves
    /// to 20.4 m, the hit on the lower surface, and the area of uniform cells ends at the length of its longest ray. No side goes beyond
    /// the planted area.
    #[test]
    fn a_view_is_as_wide_as_the_slope_needs() {
        let area = Rect::new(-1.0, 2.0, 1.0, 10.0);
        let view_rays = [look(0.5), look(0.1)];
        let reach = ViewLimits { field_m: 60.0, ray_m: f32::INFINITY, travel_m: 0.0 };
        let low = Envelope { below_m: 0.003, ..Envelope::LEVEL };
        for envelope in [Envelope::LEVEL, low] {
            let seen = Seen::of(envelope, area, None, &view_rays, &reach);
            assert!((seen.area, seen.near) == (area, area) && seen.met.is_empty() && !seen.beyond, "{seen:?}");
        }
        let seen = Seen::of(SLOPE, area, None, &view_rays, &reach);
        assert!((seen.area.y1 - 20.4).abs() < 1e-3 && seen.near == seen.area && !seen.beyond, "{seen:?}");
        assert_eq!((seen.area.x0, seen.area.y0, seen.area.x1), (-1.0, 2.0, 1.0));
        assert!(seen.met.iter().any(|at| at.distance(vec2(0.0, seen.area.y1)) < 1e-3));
        let near = Near { area: Rect::new(-1.0, 2.0, 1.0, 2.1), view_rays: vec![look(0.5), look(0.1)], ray_m: 4.0 };
        let graded = Seen::of(SLOPE, area, Some(near), &view_rays, &reach);
        assert!((graded.near.y1 - 4.0).abs() < 0.03, "{graded:?}");
        // The ground is level beyond the uniform cells.
        assert!((10.0..13.0).contains(&graded.area.y1), "{graded:?}");
        let short = Seen::of(SLOPE, area, None, &view_rays, &ViewLimits { field_m: 12.0, ..reach });
        assert!((short.area.y1 - 12.0).abs() < 1e-4 && short.beyond, "{short:?}");
    }
}
