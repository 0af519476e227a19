//! LiDAR of a scanned field: its pose at each frame, and the ground that it sees, which the field is built for.

use super::drawn::{Drawn, FARTHEST, PLANT_MARGIN};
use super::ground_view::GroundView;
use super::options::Scanner;
use super::terrain::{Seen, ViewLimits, ViewRay};
use super::view::{LONGEST_REACH, View, VisibleGround, meets};
use super::{ground, view};
use crate::desc::Detail;
use crate::desc::FieldDesc;
use crate::drive::{Capture, FIRST};
use furrow_base::math::{Vec2, Vec3};
use furrow_base::ron_file::{RonFile, Step};
use furrow_base::sampling::{Purpose, Stream};
use furrow_base::{Error, Result};
use furrow_grow::soil::Rect;
use furrow_optics::sensor::{Camera, LIDARS, Lidar, LidarDesc};
use std::borrow::Cow;

/// Random stream address of the LiDAR, beyond those of cameras and drives.
const LIDAR: u64 = 5 << 32;
/// Number of columns of a turn that are sampled to find the ground in view.
const LOOKED_AT: u32 = 120;

/// Field of the scene file that errors about the LiDAR point at.
const AT: [Step<'static>; 1] = [Step::Field("lidar")];

/// Returns the description that a field is built from: for a scan, `detail: Full` is replaced by `ByPixel`, with the spacing of the
/// LiDAR's rays as pixel size.
pub(super) fn grown<'a>(desc: &'a FieldDesc, scan: Option<&Scanner>) -> Cow<'a, FieldDesc> {
    match desc.detail {
        Detail::Full if scan.is_some() => Cow::Owned(FieldDesc { detail: Detail::ByPixel, ..desc.clone() }),
        _ => Cow::Borrowed(desc),
    }
}

/// Returns the LiDAR at each frame of a field's drive; empty unless the field is scanned. `first` is the first camera at the start pose.
pub(super) fn at_frames(
    page: &RonFile,
    desc: &FieldDesc,
    scan: Option<&Scanner>,
    (first, captures): (&Camera, &[Capture]),
    (seed, index): (u64, u64),
) -> Result<Vec<Lidar>> {
    let own = match (scan, &desc.lidar) {
        (None, _) => return Ok(Vec::new()),
        (Some(Scanner::OfScene), Some(own)) => own.clone(),
        (Some(Scanner::AtCamera(of)), None) => LidarDesc::clone(of).at(first.pose().position),
        (Some(Scanner::OfScene), None) => {
            let help = format!(
                "add `lidar: Vlp16(position_m: (0, 0, 1.5))` to it, or scan from its first camera with --lidar {}",
                LIDARS.join(" or --lidar ")
            );
            return Err(Error::input("the scene file has no LiDAR").help(help).in_file(&page.path));
        }
        (Some(Scanner::AtCamera(_)), Some(_)) => {
            let error = Error::misuse("the scene file has a LiDAR of its own").help("leave --lidar out");
            return Err(page.blame(&AT, error));
        }
    };
    let blame = |e| page.blame(&AT, e);
    let lidar = own.build(&mut Stream::of(seed, index, Purpose::Page, LIDAR)).map_err(blame)?;
    let frames = captures.iter().filter(|capture| capture.name == FIRST);
    let carried = |capture: &Capture| {
        let lidar = capture.vehicle.carry_lidar(&lidar);
        // Positions at the start and at the end of the turn.
        let way = [lidar.position, lidar.pulse(lidar.columns() - 1, 0).origin];
        if way.iter().any(|at| !(at.z > 0.0 && at.abs().max_element() <= FARTHEST)) {
            let words = format!("the LiDAR is below the ground or more than {FARTHEST} m from the field's origin");
            let frame = format!("in frame {}: {}", capture.frame, lidar.position);
            return Err(blame(Error::input(format!("{words}, {frame}")).help("lengths are in metres")));
        }
        Ok(lidar)
    };
    frames.map(carried).collect()
}

/// Returns the minimum spacing of LiDAR rays on the ground, metres; `None` if the field is not scanned.
pub(super) fn scanned_ground(drawn: &Drawn<'_>) -> Option<f32> {
    let least = |lidar: &Lidar| {
        let far = view_rays(lidar).filter_map(|(origin, direction)| slant(origin, direction));
        lidar.spacing(far.fold(f32::INFINITY, f32::min).min(lidar.range[1]).max(lidar.range[0]))
    };
    drawn.scanners.iter().map(least).reduce(f32::min)
}

/// Returns the minimum spacing of LiDAR rays on a plant at `at`, metres; `None` if the field is not scanned.
pub(super) fn scanned_at(drawn: &Drawn<'_>, at: Vec2) -> Option<f32> {
    let on = |lidar: &Lidar| {
        let distance = lidar.position.distance(at.extend(0.0)) - PLANT_MARGIN;
        lidar.spacing(distance.max(lidar.range[0]))
    };
    drawn.scanners.iter().map(on).reduce(f32::min)
}

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
        let words = format!("the drive sees {:.0} m² of ground, more than {most} m²", whole.area.area());
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
    let Seen { area, near, met, .. } = Seen::of(ground::envelope(drawn), area, near, &down, &far);
    each.push(GroundView::around(seen.into_iter().chain(met)));
    let open = bare.count(lidar, area.grown(1e-3));
    View { area, near, open }
}

/// Returns origin and direction of the pulses of all beams, for columns that are evenly spaced over the turn.
fn view_rays(lidar: &Lidar) -> impl Iterator<Item = ViewRay> {
    let columns = lidar.columns();
    let some = columns.min(LOOKED_AT);
    let column = move |k: u32| (u64::from(k) * u64::from(columns - 1) / u64::from((some - 1).max(1))) as u32;
    (0..some).flat_map(move |k| (0..lidar.beams()).map(move |beam| lidar.pulse(column(k), beam))).map(|pulse| {
        let furrow_optics::sensor::Pulse { origin, direction, .. } = pulse;
        (origin, direction)
    })
}

/// Returns the distance along a ray to the plane z = 0; `None` if it does not meet the plane.
fn slant(origin: Vec3, direction: Vec3) -> Option<f32> {
    meets(origin, direction).map(|_| origin.z / -direction.z)
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
