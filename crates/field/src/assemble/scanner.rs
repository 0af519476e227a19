//! Ground that the LiDAR of a scanned field sees.

use super::drawn::Drawn;
use super::extent::LONGEST_REACH;
use super::ground_view::{GroundView, meets};
use super::lidar::{slant, view_rays};
use super::terrain::{Seen, ViewLimits, ViewRay};
use super::view::{self, View, VisibleGround};
use furrow_base::math::Vec2;
use furrow_base::ron_file::Step;
use furrow_base::{Error, Result};
use furrow_grow::soil::Rect;
use furrow_optics::sensor::Lidar;

/// Returns the ground that the LiDAR sees in all frames. Adds a warning if some of it is not planted.
pub(super) fn scanned(drawn: &Drawn<'_>, warnings: &mut Vec<String>) -> Result<VisibleGround> {
    let reach = view::reach(drawn)?;
    let mut each = Vec::new();
    let mut whole: Option<View> = None;
    let mut bare = PulseCounts::default();
    for lidar in &drawn.scanners {
        let view = view_of_lidar(drawn, lidar, reach, &mut bare, &mut each);
        whole = Some(whole.map_or(view, |before| before.join(view)));
    }
    let whole = whole.unwrap_or(View::NONE);
    let most = 4.0 * LONGEST_REACH.powi(2);
    if whole.area.area() > most {
        let area = view::above(whole.area.area(), most);
        let words = format!("the drive sees {area} m² of ground, more than {} m²", view::three_digits(most));
        let help = "use fewer frames, or lower reach_m";
        return Err(drawn.page.blame(&[Step::Field("drive")], Error::input(words).help(help)));
    }
    warnings.extend(bare.warning(reach));
    Ok(VisibleGround { view: whole, each })
}

fn view_of_lidar(
    drawn: &Drawn<'_>,
    lidar: &Lidar,
    reach: f32,
    bare: &mut PulseCounts,
    each: &mut Vec<GroundView>,
) -> View {
    let below = lidar.position.truncate();
    let mut seen = vec![below];
    for (origin, direction) in view_rays(lidar) {
        let ahead = direction.truncate();
        // The ray ends at the ground, at the maximum range, or at the reach.
        let ground = meets(origin, direction).map_or(f32::INFINITY, |at| at.distance(below));
        let far = ground.min(lidar.range[1] * ahead.length());
        let along = ahead.normalize_or_zero();
        seen.push(below + along * far.min(reach / along.abs().max_element().max(f32::MIN_POSITIVE)));
    }
    let (lo, hi) = seen.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    let area = Rect::new(lo.x, lo.y, hi.x, hi.y);
    let near = view::nearest(drawn, view_rays(lidar), area);
    let down = view_rays(lidar).filter(|(_, direction)| direction.z < 0.0);
    let down: Vec<ViewRay> = down.map(|(_, direction)| (lidar.position, direction)).collect();
    let far = ViewLimits { field_m: reach, ray_m: lidar.range[1], travel_m: 0.0 };
    let Seen { area, near, met, .. } = Seen::of(drawn.envelope(), area, near, &down, &far);
    each.push(GroundView::around(seen.into_iter().chain(met)));
    let open = bare.count(lidar, area.grown(1e-3));
    View { area, near, open }
}

/// Numbers of pulses that meet the ground within range, and of those that meet it beyond the planted area.
#[derive(Default)]
struct PulseCounts {
    ground: f32,
    beyond: f32,
    farthest: f32,
}

impl PulseCounts {
    /// Counts the pulses of a LiDAR. Returns `true` if any of them meets the ground outside `area`.
    fn count(&mut self, lidar: &Lidar, area: Rect) -> bool {
        let before = self.beyond;
        for (origin, direction) in view_rays(lidar) {
            let (Some(at), Some(range)) = (meets(origin, direction), slant(origin, direction)) else { continue };
            if range > lidar.range[1] {
                continue;
            }
            self.ground += 1.0;
            if !area.contains(at) {
                self.beyond += 1.0;
                self.farthest = self.farthest.max(at.distance(lidar.position.truncate()));
            }
        }
        self.beyond > before
    }

    fn warning(&self, reach: f32) -> Option<String> {
        (self.beyond > 0.0).then(|| {
            format!(
                "the LiDAR reaches ground {:.0} m away, but plants grow only up to {reach} m east, north, west and south of the point below it: \
                 {:.0} % of its pulses that meet the ground hit bare ground; raise reach_m, lower the beams, or lower max_m",
                self.farthest,
                (100.0 * self.beyond / self.ground).ceil()
            )
        })
    }
}
