//! Vehicle that carries the cameras through a field: its pose at each image, and its vibration.
//!
//! A scene file gives camera poses for the vehicle's start pose: at the world's origin, heading north. A camera whose image top points
//! north (yaw 0) therefore has the driving direction at the top of its image wherever the vehicle turns.
//!
//! The vibration is an Ornstein–Uhlenbeck process: normally distributed deflections from the path, with an autocorrelation of exp(−t / τ).
//! Source: Uhlenbeck & Ornstein 1930, "On the theory of the Brownian motion"; the exact discretisation, Gillespie 1996.

use furrow_base::math::{Mat3, RoundTo, ToFloat, ToInt, Vec2, Vec3, vec2};
use furrow_base::ron_file::{NonNegative, Num, Positive, PositiveCount, Signed, Vary};
use furrow_base::sampling::Stream;
use furrow_base::{Error, Result};
use furrow_optics::sensor::{Camera, Lidar, Pose};
use serde::{Deserialize, Serialize};

/// A vehicle that drives through the field and takes images. A dataset of such a scene file contains all images of one field, then
/// those of the next.
///
/// ```
/// use furrow_field::drive::DriveDesc;
/// for text in [
///     "(frames: 20, path: AlongRows(speed_m_s: 0.5))",
///     "(frames: 100, rate_hz: 15, path: Straight(heading_deg: Uniform(0, 360)), shake: (height_mm: 4, roll_deg: 0.5))",
///     "(frames: 30, path: Polyline(points_m: [(0, 0), (0, 1), (0.4, 1.5)], speed_m_s: 0.8))",
///     r#"(frames: 12, path: Poses("flight.tum"))"#,
/// ] {
///     ron::from_str::<DriveDesc>(text).unwrap();
/// }
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Drive")]
pub struct DriveDesc {
    /// Number of images that each camera takes.
    #[schemars(extend("x-example" = "20"))]
    pub frames: Num<PositiveCount>,
    /// Frame rate, images per second.
    #[serde(default = "ten")]
    pub rate_hz: Num<Positive<100_000>>,
    /// Path of the vehicle.
    #[serde(default)]
    pub path: PathDesc,
    /// Vibration of the vehicle; none by default.
    #[serde(default)]
    pub shake: ShakeDesc,
}

/// Path of a vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum PathDesc {
    /// A straight line from the world's origin.
    Straight {
        /// Heading, degrees clockwise from north; default 0.
        #[serde(default = "north")]
        heading_deg: Vary<Signed<360>>,
        /// Speed over the ground, m/s; default 0.5.
        #[serde(default = "walk")]
        speed_m_s: Vary<Positive<100>>,
    },
    /// A straight line from the world's origin, parallel to the rows of the field's first crop, or else of its first model in rows.
    AlongRows {
        /// Speed over the ground, m/s; default 0.5.
        #[serde(default = "walk")]
        speed_m_s: Vary<Positive<100>>,
    },
    /// Straight legs from point to point. The vehicle changes heading at each point and stops at the last.
    Polyline {
        /// Points of the path, metres east and north; at least two.
        #[schemars(extend("x-example" = "[(0, 0), (0, 1), (0.4, 1.5)]"))]
        points_m: Vec<(Num<Signed<1000>>, Num<Signed<1000>>)>,
        /// Speed over the ground, m/s; default 0.5.
        #[serde(default = "walk")]
        speed_m_s: Vary<Positive<100>>,
    },
    /// Poses of the first camera from a file, one image per line: time (s), position (m), quaternion x y z w that maps the camera's axes
    /// (right, down, forward) to the world, separated by blanks or commas. This is the format of the TUM RGB-D benchmark, and of
    /// `--format tum`. If the first line names the columns, they may be in another order.
    #[schemars(extend("x-example" = "(\"flight.tum\")"))]
    Poses(String),
}

/// Drives straight to the north.
impl Default for PathDesc {
    fn default() -> Self {
        Self::Straight { heading_deg: north(), speed_m_s: walk() }
    }
}

fn ten() -> Num<Positive<100_000>> {
    Num::new(10.0)
}

fn north() -> Vary<Signed<360>> {
    Vary::fixed(0.0)
}

fn walk() -> Vary<Positive<100>> {
    Vary::fixed(0.5)
}

/// Vibration of a vehicle: standard deviations from its path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ShakeDesc {
    /// Vertical deflection.
    pub height_mm: Num<NonNegative<10_000>>,
    /// Sideways deflection.
    pub across_mm: Num<NonNegative<10_000>>,
    /// Roll about the driving direction.
    pub roll_deg: Num<NonNegative<360>>,
    /// Pitch: nose up and down.
    pub pitch_deg: Num<NonNegative<360>>,
    /// Yaw: nose left and right.
    pub yaw_deg: Num<NonNegative<360>>,
    /// Correlation time τ, seconds: the autocorrelation of a deflection falls to 1/e in this time.
    pub correlation_s: Num<Positive<10_000>>,
}

impl Default for ShakeDesc {
    fn default() -> Self {
        let (still, straight) = (Num::new(0.0), Num::new(0.0));
        let correlation_s = Num::new(0.3);
        Self {
            height_mm: still,
            across_mm: still,
            roll_deg: straight,
            pitch_deg: straight,
            yaw_deg: straight,
            correlation_s,
        }
    }
}

/// An additional camera on the vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Mounted")]
pub struct MountedDesc {
    /// Name of the camera in file names: letters, digits, `-` and `_`. The first camera is named `camera`.
    #[schemars(extend("x-example" = "\"right\""))]
    pub name: String,
    /// Camera and its mounting pose. Its images get the size of the first camera's images, so its aspect ratio must be the same.
    #[schemars(extend("x-example" = "JaiAd130(at_m: (0.12, 0))"))]
    pub camera: furrow_optics::sensor::CameraDesc,
}

/// Name of a scene file's first camera.
pub const FIRST: &str = "camera";

/// One image taken of a field: the camera, its pose and the time.
#[derive(Clone, Debug, PartialEq)]
pub struct Capture {
    /// Name of the camera.
    pub name: String,
    /// Frame number, from 0: number of images that this camera took before.
    pub frame: u32,
    /// Time since the first frame, seconds.
    pub time_s: f64,
    /// Camera at its pose in the world.
    pub camera: Camera,
    /// Pose and velocity of the vehicle.
    pub vehicle: Moment,
}

/// Pose and velocity of a vehicle at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    time_s: f64,
    /// Rigid motion from the start pose to the current pose: first this rotation, then the translation `way`, metres.
    turn: Mat3,
    way: Vec3,
    /// Velocity in world space, m/s.
    velocity: Vec3,
}

/// Inputs of a drive that are not in its description.
#[derive(Clone, Debug, Default)]
pub(super) struct DriveInputs {
    /// Direction of the crop rows, radians clockwise from north; `None` if the field has no rows.
    pub(super) rows: Option<f32>,
    /// Times (s) and poses read from the file that [`PathDesc::Poses`] names.
    pub(super) poses: Vec<(f64, Pose)>,
}

/// Returns all captures of a drive: all cameras of the first frame, then all cameras of the next. `cameras` have their poses for the
/// vehicle's start pose. Without a drive, each camera takes one image where it is.
pub(super) fn captures(
    desc: Option<&DriveDesc>,
    cameras: &[(String, Camera)],
    around: &DriveInputs,
    stream: &mut Stream,
) -> Result<Vec<Capture>> {
    let still = Moment { time_s: 0.0, turn: Mat3::IDENTITY, way: Vec3::ZERO, velocity: Vec3::ZERO };
    let moments = match desc {
        None => vec![still],
        Some(desc) => {
            if cameras.iter().any(|(_, camera)| camera.motion().velocity != Vec3::ZERO) {
                return Err(Error::input("a camera on a vehicle has no speed of its own")
                    .help("leave `speed_m_s` out of its `motion`; the path of `drive` sets the speed"));
            }
            moments(desc, cameras.first().map(|(_, camera)| camera.pose()), around, stream)?
        }
    };
    let taken = |(frame, at): (usize, Moment)| {
        cameras.iter().map(move |(name, camera)| {
            let camera = if desc.is_some() { at.carry(camera) } else { *camera };
            Capture { name: name.clone(), frame: frame.to_u32(), time_s: at.time_s, camera, vehicle: at }
        })
    };
    Ok(moments.into_iter().enumerate().flat_map(taken).collect())
}

impl Moment {
    /// Moves a camera from its pose on the vehicle at the start to its pose at this moment.
    fn carry(&self, camera: &Camera) -> Camera {
        let Pose { position, axes } = *camera.pose();
        let pose = Pose { position: self.turn * position + self.way, axes: self.turn * axes };
        camera.with_pose(pose).with_velocity(self.velocity)
    }

    /// Moves a LiDAR from its position at the start to its position at this moment.
    pub(super) fn carry_lidar(&self, lidar: &Lidar) -> Lidar {
        lidar.carried(self.turn, self.way, self.velocity)
    }
}

/// Returns the vehicle's pose and velocity at each frame.
fn moments(desc: &DriveDesc, first: Option<&Pose>, around: &DriveInputs, stream: &mut Stream) -> Result<Vec<Moment>> {
    let frames = desc.frames.get().trunc_to::<usize>();
    let path = match &desc.path {
        PathDesc::Poses(file) => {
            if around.poses.len() < frames {
                let words = format!("{file} holds {} poses, fewer than the {frames} frames", around.poses.len());
                let help = match around.poses.len() {
                    0 => "write one pose per line: time x y z qx qy qz qw, separated by blanks or commas".to_owned(),
                    most => format!("set `frames` to {most} or less"),
                };
                return Err(Error::input(words).help(help));
            }
            return Ok(flown(&around.poses[..frames], first.copied().unwrap_or_default()));
        }
        PathDesc::Straight { heading_deg, speed_m_s } => {
            DrivenPath::straight(heading_deg.draw32(stream).to_radians(), speed_m_s.draw32(stream))
        }
        PathDesc::AlongRows { speed_m_s } => {
            let rows = around.rows.ok_or_else(|| {
                Error::input("the field has no rows to drive along")
                    .help("give the field a crop, or write path: Straight(heading_deg: …)")
            })?;
            DrivenPath::straight(rows, speed_m_s.draw32(stream))
        }
        PathDesc::Polyline { points_m, speed_m_s } => {
            let points: Vec<Vec2> = points_m.iter().map(|(x, y)| vec2(x.f32(), y.f32())).collect();
            if points.len() < 2 || points.windows(2).any(|leg| leg[0] == leg[1]) {
                return Err(Error::input("a path needs at least two points, and no point twice in a row")
                    .help("write points_m: [(0, 0), (0, 2)] for two metres to the north"));
            }
            DrivenPath { points, speed: speed_m_s.draw32(stream) }
        }
    };
    let rate = desc.rate_hz.get();
    let mut shake = Shake::start(&desc.shake, 1.0 / rate, stream);
    let moment = |frame: usize| {
        let time_s = frame.to_f64() / rate;
        let (place, ahead, speed) = path.at(time_s.to_f32());
        let [height, across, roll, pitch, yaw] = shake.next();
        let heading = Mat3::from_rotation_z(-(ahead.x.atan2(ahead.y) + yaw));
        let turn = heading * Mat3::from_rotation_x(pitch) * Mat3::from_rotation_y(roll);
        let right = vec2(ahead.y, -ahead.x);
        let way = (place + right * across).extend(height);
        Moment { time_s, turn, way, velocity: (ahead * speed).extend(0.0) }
    };
    Ok((0..frames).map(moment).collect())
}

/// A path driven at constant speed.
struct DrivenPath {
    points: Vec<Vec2>,
    speed: f32,
}

impl DrivenPath {
    /// Creates a straight path from the origin, practically endless (1000 km). `heading` is in radians clockwise from north.
    fn straight(heading: f32, speed: f32) -> Self {
        let ahead = vec2(heading.sin(), heading.cos());
        Self { points: vec![Vec2::ZERO, ahead * 1e6], speed }
    }

    /// Returns position, unit direction and speed after `time` seconds. Past the last point the speed is 0.
    fn at(&self, time: f32) -> (Vec2, Vec2, f32) {
        let mut left = self.speed * time;
        let mut end = (Vec2::ZERO, Vec2::Y, 0.0);
        for leg in self.points.windows(2) {
            let (ahead, length) = ((leg[1] - leg[0]).normalize(), leg[0].distance(leg[1]));
            if left < length {
                return (leg[0] + ahead * left, ahead, self.speed);
            }
            left -= length;
            end = (leg[1], ahead, 0.0);
        }
        end
    }
}

/// Five independent deflections: up and right in metres; roll, pitch and yaw in radians.
struct Shake<'a> {
    sd: [f32; 5],
    now: [f32; 5],
    /// Correlation of a deflection from one image to the next.
    kept: f32,
    stream: &'a mut Stream,
    begun: bool,
}

impl<'a> Shake<'a> {
    fn start(desc: &ShakeDesc, step_s: f64, stream: &'a mut Stream) -> Self {
        let ShakeDesc { height_mm, across_mm, roll_deg, pitch_deg, yaw_deg, correlation_s } = desc;
        let (metres, radians) = (|of: &Num<_>| of.f32() * 1e-3, |of: &Num<_>| of.f32().to_radians());
        let sd = [metres(height_mm), metres(across_mm), radians(roll_deg), radians(pitch_deg), radians(yaw_deg)];
        let kept = (-step_s / correlation_s.get()).exp().to_f32();
        Self { sd, now: [0.0; 5], kept, stream, begun: false }
    }

    fn next(&mut self) -> [f32; 5] {
        let kept = if std::mem::replace(&mut self.begun, true) { self.kept } else { 0.0 };
        let new = (1.0 - kept * kept).sqrt();
        for (now, sd) in self.now.iter_mut().zip(self.sd) {
            *now = kept * *now + new * sd * self.stream.normal().to_f32();
        }
        self.now
    }
}

/// Returns the vehicle's poses for which the first camera, mounted at `first`, has the given poses. Velocities are finite differences.
fn flown(poses: &[(f64, Pose)], first: Pose) -> Vec<Moment> {
    let begin = poses.first().map_or(0.0, |(time, _)| *time);
    let velocity = |k: usize| {
        let ((t0, a), (t1, b)) = (poses[k.saturating_sub(1)], poses[(k + 1).min(poses.len() - 1)]);
        if t1 > t0 { (b.position - a.position) / (t1 - t0).to_f32() } else { Vec3::ZERO }
    };
    let moment = |(k, (time, pose)): (usize, &(f64, Pose))| {
        let turn = pose.axes * first.axes.transpose();
        let way = pose.position - turn * first.position;
        Moment { time_s: time - begin, turn, way, velocity: velocity(k) }
    };
    poses.iter().enumerate().map(moment).collect()
}

#[cfg(test)]
mod tests {
    use super::super::poses;
    use super::*;
    use furrow_base::math::vec3;
    use furrow_base::ron_file::RonFile;
    use furrow_base::sampling::Purpose;
    use furrow_optics::sensor::CameraDesc;

    fn stream() -> Stream {
        Stream::of(3, 0, Purpose::Test, 0)
    }

    fn camera(text: &str) -> Camera {
        RonFile::of(text).parse::<CameraDesc>().unwrap().build(&mut stream()).unwrap()
    }

    fn drive(text: &str, around: &DriveInputs) -> Result<Vec<Capture>> {
        let desc: DriveDesc = RonFile::of(text).parse().unwrap();
        let cameras = [("camera", "JaiAd130(height_m: 1)"), ("right", "JaiAd130(height_m: 1, at_m: (0.12, 0))")];
        let cameras = cameras.map(|(name, text)| (name.to_owned(), camera(text)));
        captures(Some(&desc), &cameras, around, &mut stream())
    }

    fn close(a: Vec3, b: Vec3) {
        assert!((a - b).length() < 1e-5, "{a} {b}");
    }

    /// Expected: at 0.5 m/s and 10 Hz to the east, 50 mm per image; the vehicle's right is then south, and the top of the image east.
    #[test]
    fn a_vehicle_carries_its_cameras_along() {
        let all = drive("(frames: 4, path: Straight(heading_deg: 90))", &DriveInputs::default()).unwrap();
        assert_eq!(all.len(), 8);
        let [left, right] = [&all[6], &all[7]];
        assert_eq!((left.name.as_str(), right.name.as_str(), left.frame), ("camera", "right", 3));
        assert!((left.time_s - 0.3).abs() < 1e-12);
        close(left.camera.pose().position, vec3(0.15, 0.0, 1.0));
        close(right.camera.pose().position, vec3(0.15, -0.12, 1.0));
        // The camera's y axis points down in the image, so −y is the driving direction.
        close(left.camera.pose().axes.y_axis, Vec3::NEG_X);
        close(left.camera.motion().velocity, vec3(0.5, 0.0, 0.0));
        let rows = DriveInputs { rows: Some(90.0_f32.to_radians()), ..DriveInputs::default() };
        let along = drive("(frames: 4, path: AlongRows())", &rows).unwrap();
        close(along[6].camera.pose().position, left.camera.pose().position);
    }

    /// Expected: the vehicle turns at a point and stops at the last.
    #[test]
    fn a_polyline_turns_and_ends() {
        let path = "(frames: 30, path: Polyline(points_m: [(0, 0), (0, 0.5), (0.5, 0.5)]))";
        let all = drive(path, &DriveInputs::default()).unwrap();
        let at = |frame: usize| all[2 * frame].camera;
        close(at(5).pose().position, vec3(0.0, 0.25, 1.0));
        close(at(15).pose().position, vec3(0.25, 0.5, 1.0));
        close(at(15).pose().axes.y_axis, Vec3::NEG_X);
        close(at(29).pose().position, vec3(0.5, 0.5, 1.0));
        assert_eq!(at(29).motion().velocity, Vec3::ZERO);
        let wrong = drive("(frames: 3, path: Polyline(points_m: [(0, 0), (0, 0)]))", &DriveInputs::default());
        assert!(wrong.unwrap_err().to_string().contains("no point twice"));
    }

    /// Expected, by the process's definition: deviation σ at every time, and correlation exp(−Δt/τ) from image to image. Margins: four
    /// standard errors with an effective number of samples of n (1 − ρ²) / (1 + ρ²).
    #[test]
    fn shaking_has_the_deviation_and_correlation_that_were_written() {
        let desc: ShakeDesc = RonFile::of("(height_mm: 4, roll_deg: 1, correlation_s: 0.2)").parse().unwrap();
        let mut stream = stream();
        let mut shake = Shake::start(&desc, 0.1, &mut stream);
        let n = 20_000;
        let all: Vec<[f32; 5]> = (0..n).map(|_| shake.next()).collect();
        let rho = (-0.5_f64).exp();
        let error = 4.0 * ((1.0 + rho * rho) / (1.0 - rho * rho) / f64::from(n)).sqrt();
        for (place, sd) in [(0, 0.004), (2, 1.0_f64.to_radians())] {
            let of = |k: usize| f64::from(all[k][place]) / sd;
            let variance = (0..all.len()).map(|k| of(k).powi(2)).sum::<f64>() / f64::from(n);
            let lagged = (1..all.len()).map(|k| of(k) * of(k - 1)).sum::<f64>() / f64::from(n);
            assert!((variance - 1.0).abs() < 2.0 * error, "{variance}");
            assert!((lagged - rho).abs() < 2.0 * error, "{lagged} {rho}");
        }
        assert!(all.iter().all(|v| v[1] == 0.0 && v[3] == 0.0 && v[4] == 0.0));
    }

    /// Expected: the first camera has the poses from the file; the second camera keeps its position relative to the first.
    #[test]
    fn poses_are_those_of_the_first_camera() {
        let turned = Pose::nadir(vec3(0.3, -0.2, 1.4), 30.0, 8.0, -5.0);
        let q = furrow_base::math::Quat::from_mat3(&turned.axes).to_array();
        let text = format!(
            "timestamp,tx,ty,tz,qx,qy,qz,qw\n5.0,0,0,1,1,0,0,0 # looking down\n5.2,0.3,-0.2,1.4,{},{},{},{}\n",
            q[0], q[1], q[2], q[3]
        );
        let around = DriveInputs { poses: poses::read(text.as_bytes()).unwrap(), ..DriveInputs::default() };
        let all = drive(r#"(frames: 2, path: Poses("x"))"#, &around).unwrap();
        close(all[0].camera.pose().position, vec3(0.0, 0.0, 1.0));
        close(all[2].camera.pose().position, turned.position);
        for axis in 0..3 {
            close(all[2].camera.pose().axes.col(axis), turned.axes.col(axis));
        }
        assert!((all[2].time_s - 0.2).abs() < 1e-9);
        let beside = |k: usize| all[k + 1].camera.pose().position - all[k].camera.pose().position;
        close(beside(2), turned.axes * vec3(0.12, 0.0, 0.0));
        close(all[0].camera.motion().velocity, vec3(1.5, -1.0, 2.0));
        let fewer = drive(r#"(frames: 3, path: Poses("x"))"#, &around).unwrap_err().to_string();
        assert!(fewer.contains("2 poses, fewer than the 3 frames"), "{fewer}");
    }

    #[test]
    fn cameras_that_move_by_themselves_and_fields_without_rows_are_refused() {
        let desc: DriveDesc = RonFile::of("(frames: 2, path: AlongRows())").parse().unwrap();
        let moving = camera("JaiAd130(motion: (speed_m_s: 1))");
        let refused = |camera| {
            let cameras = [("camera".to_owned(), camera)];
            captures(Some(&desc), &cameras, &DriveInputs::default(), &mut stream()).unwrap_err().to_string()
        };
        assert!(refused(moving).contains("no speed of its own"));
        assert!(refused(camera("JaiAd130()")).contains("no rows"));
    }
}
