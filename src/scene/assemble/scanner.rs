//! The LiDAR of a field that is scanned: where it is at each frame, and the ground that it sees, which is grown for it.

use super::builder::{Builder, FARTHEST, PLANT_MARGIN};
use super::ground_view::GroundView;
use super::options::Scanner;
use super::terrain::{Look, Reach, Seen};
use super::view::{LONGEST_REACH, View, meets};
use crate::math::{Vec2, Vec3};
use crate::ron_file::{RonFile, Step};
use crate::sampling::{Purpose, Stream};
use crate::scene::desc::Detail;
use crate::scene::desc::FieldDesc;
use crate::scene::drive::{Capture, FIRST};
use crate::sensor::{Camera, LIDARS, Lidar, LidarDesc};
use crate::soil::Rect;
use crate::{Error, Result};
use std::borrow::Cow;

/// Address of the stream from which the LiDAR is drawn, behind those of cameras and drives.
const LIDAR: u64 = 5 << 32;
/// Columns of a turn by which its ground is found.
const LOOKED_AT: u32 = 120;

/// The field at which an error about the LiDAR points.
const AT: [Step<'static>; 1] = [Step::Field("lidar")];

/// A scene file as it is grown: for a scan as finely as the LiDAR's beams are wide where it says nothing of detail.
pub(super) fn grown<'a>(desc: &'a FieldDesc, scan: Option<&Scanner>) -> Cow<'a, FieldDesc> {
    match desc.detail {
        Detail::Full if scan.is_some() => Cow::Owned(FieldDesc { detail: Detail::ByPixel, ..desc.clone() }),
        _ => Cow::Borrowed(desc),
    }
}

/// The LiDAR at each frame of a field's drive; none unless it is scanned. `first` is the first camera as it is written.
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
                "write `lidar: Vlp16(position_m: (0, 0, 1.5))` into it, or scan from its first camera with --lidar {}",
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
        // Where the turn begins, and where it ends.
        let way = [lidar.position, lidar.pulse(lidar.columns() - 1, 0).origin];
        if way.iter().any(|at| !(at.z > 0.0 && at.abs().max_element() <= FARTHEST)) {
            let words = format!("the LiDAR lies under the ground or more than {FARTHEST} m from the field's origin");
            let frame = format!("in frame {}: {}", capture.frame, lidar.position);
            return Err(blame(Error::input(format!("{words}, {frame}")).help("lengths are in metres")));
        }
        Ok(lidar)
    };
    frames.map(carried).collect()
}

impl Builder<'_> {
    /// Least distance of a pulse's rays on the ground, metres; `None` where cameras look.
    pub(super) fn scanned_ground(&self) -> Option<f32> {
        let least = |lidar: &Lidar| {
            let far = looks(lidar).filter_map(|(origin, direction)| slant(origin, direction));
            lidar.spacing(far.fold(f32::INFINITY, f32::min).min(lidar.range[1]).max(lidar.range[0]))
        };
        self.scanners.iter().map(least).reduce(f32::min)
    }

    /// The same on a plant at a place.
    pub(super) fn scanned_at(&self, at: Vec2) -> Option<f32> {
        let on = |lidar: &Lidar| {
            let distance = lidar.position.distance(at.extend(0.0)) - PLANT_MARGIN;
            lidar.spacing(distance.max(lidar.range[0]))
        };
        self.scanners.iter().map(on).reduce(f32::min)
    }

    /// The ground that the LiDAR sees in all frames, with a warning where some of it is not planted.
    pub(super) fn scanned(&mut self) -> Result<View> {
        let reach = self.reach()?;
        self.seen.clear();
        let mut whole: Option<View> = None;
        let mut bare = Bare::default();
        for lidar in std::mem::take(&mut self.scanners) {
            let view = self.view_of_lidar(&lidar, reach, &mut bare);
            whole = Some(whole.map_or(view, |before| before.join(view)));
            self.scanners.push(lidar);
        }
        let whole = whole.unwrap_or(View::NONE);
        let most = 4.0 * LONGEST_REACH.powi(2);
        if whole.area.area() > most {
            let words = format!("the drive sees {:.0} m² of ground, more than {most} m²", whole.area.area());
            let help = "take fewer frames, or lower reach_m";
            return Err(self.page.blame(&[Step::Field("drive")], Error::input(words).help(help)));
        }
        self.warnings.extend(bare.warning(reach));
        Ok(whole)
    }

    fn view_of_lidar(&mut self, lidar: &Lidar, reach: f32, bare: &mut Bare) -> View {
        let below = lidar.position.truncate();
        let mut seen = vec![below];
        for (origin, direction) in looks(lidar) {
            let ahead = direction.truncate();
            // As far as it sees, the ground, or a plant before it.
            let ground = meets(origin, direction).map_or(f32::INFINITY, |at| at.distance(below));
            let far = ground.min(lidar.range[1] * ahead.length());
            let along = ahead.normalize_or_zero();
            seen.push(below + along * far.min(reach / along.abs().max_element().max(f32::MIN_POSITIVE)));
        }
        let (lo, hi) = seen.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        let area = Rect::new(lo.x, lo.y, hi.x, hi.y);
        let near = self.nearest(looks(lidar), area);
        let down = looks(lidar).filter(|(_, direction)| direction.z < 0.0);
        let down: Vec<Look> = down.map(|(_, direction)| (lidar.position, direction)).collect();
        let far = Reach { field_m: reach, ray_m: lidar.range[1], travel_m: 0.0 };
        let Seen { area, near, met, .. } = Seen::of(self.envelope(), area, near, &down, &far);
        self.seen.push(GroundView::around(seen.into_iter().chain(met)));
        let open = bare.count(lidar, area.grown(1e-3));
        View { area, near, open }
    }
}

/// Pulses of all beams in some columns, evenly over the turn: where they start and where to.
fn looks(lidar: &Lidar) -> impl Iterator<Item = Look> {
    let columns = lidar.columns();
    let some = columns.min(LOOKED_AT);
    let column = move |k: u32| (u64::from(k) * u64::from(columns - 1) / u64::from((some - 1).max(1))) as u32;
    (0..some).flat_map(move |k| (0..lidar.beams()).map(move |beam| lidar.pulse(column(k), beam))).map(|pulse| {
        let crate::sensor::Pulse { origin, direction, .. } = pulse;
        (origin, direction)
    })
}

/// How far a ray goes to the plane z = 0.
fn slant(origin: Vec3, direction: Vec3) -> Option<f32> {
    meets(origin, direction).map(|_| origin.z / -direction.z)
}

/// Pulses that meet the ground within range, and those of them that meet it beyond what is planted.
#[derive(Default)]
struct Bare {
    ground: f32,
    beyond: f32,
    farthest: f32,
}

impl Bare {
    /// Counts those of a LiDAR; whether any goes beyond the area.
    fn count(&mut self, lidar: &Lidar, area: Rect) -> bool {
        let before = self.beyond;
        for (origin, direction) in looks(lidar) {
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
                "the LiDAR reaches ground {:.0} m away, and plants are grown up to {reach} m east, north, west and south of the point below it: \
                 {:.0} % of its pulses that meet the ground meet it where it stays bare; raise reach_m, lower the beams, or lower max_m",
                self.farthest,
                (100.0 * self.beyond / self.ground).ceil()
            )
        })
    }
}
