//! LiDAR of a scanned field: its pose at each frame, and the spacing of its rays.

use super::extent::{FARTHEST, PLANT_MARGIN};
use super::ground_view::meets;
use super::options::Scanner;
use super::terrain::ViewRay;
use crate::desc::FieldDesc;
use crate::drive::{Capture, FIRST};
use furrow_base::math::{ToInt, Vec2, Vec3};
use furrow_base::ron_file::{RonFile, Step};
use furrow_base::sampling::{Purpose, Stream};
use furrow_base::{Error, Result};
use furrow_optics::sensor::{Camera, LIDARS, Lidar, LidarDesc};

/// Random stream address of the LiDAR, beyond those of cameras and drives.
const LIDAR: u64 = 5 << 32;
/// Number of columns of a turn that are sampled to find the ground in view.
const LOOKED_AT: u32 = 120;
/// The same for a beam behind prisms, whose columns cover a circle instead of a line.
const LOOKED_AT_WITH_PRISMS: u32 = 4000;

/// Field of the scene file that errors about the LiDAR point at.
const AT: [Step<'static>; 1] = [Step::Field("lidar")];

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
pub(super) fn spacing_on_ground(lidars: &[Lidar]) -> Option<f32> {
    let least = |lidar: &Lidar| {
        let far = view_rays(lidar).filter_map(|(origin, direction)| slant(origin, direction));
        lidar.spacing(far.fold(f32::INFINITY, f32::min).min(lidar.range[1]).max(lidar.range[0]))
    };
    lidars.iter().map(least).reduce(f32::min)
}

/// Returns the minimum spacing of LiDAR rays on a plant at `at`, metres; `None` if the field is not scanned.
pub(super) fn spacing_at(lidars: &[Lidar], at: Vec2) -> Option<f32> {
    let on = |lidar: &Lidar| {
        let distance = lidar.position.distance(at.extend(0.0)) - PLANT_MARGIN;
        lidar.spacing(distance.max(lidar.range[0]))
    };
    lidars.iter().map(on).reduce(f32::min)
}

/// Returns origin and direction of the pulses of all beams, for columns that are evenly spaced over the turn.
pub(super) fn view_rays(lidar: &Lidar) -> impl Iterator<Item = ViewRay> {
    let columns = lidar.columns();
    let some = columns.min(if lidar.has_prisms() { LOOKED_AT_WITH_PRISMS } else { LOOKED_AT });
    let column = move |k: u32| (u64::from(k) * u64::from(columns - 1) / u64::from((some - 1).max(1))).to_u32();
    (0..some).flat_map(move |k| (0..lidar.beams()).map(move |beam| lidar.pulse(column(k), beam))).map(|pulse| {
        let furrow_optics::sensor::Pulse { origin, direction, .. } = pulse;
        (origin, direction)
    })
}

/// Returns the distance along a ray to the plane z = 0; `None` if it does not meet the plane.
pub(super) fn slant(origin: Vec3, direction: Vec3) -> Option<f32> {
    meets(origin, direction).map(|_| origin.z / -direction.z)
}
