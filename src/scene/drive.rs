//! A vehicle that carries the cameras through a field: where it is at each of its images, and how it shakes.
//!
//! A scene file writes cameras where they are before the vehicle sets out: it stands at the world's origin and looks north. So a camera
//! with its image's top to the north (yaw 0) has it ahead wherever the vehicle turns.
//!
//! The vehicle shakes as an Ornstein–Uhlenbeck process: normally distributed about its path, with correlations that fall as exp(−t / τ).
//! Source: Uhlenbeck & Ornstein 1930, "On the theory of the Brownian motion"; the exact discretisation, Gillespie 1996.

use crate::math::{Mat3, Vec2, Vec3, vec2};
use crate::ron_file::{Finite, NonNegative, Num, Positive, PositiveCount, Vary};
use crate::sampling::Stream;
use crate::sensor::{Camera, Lidar, Pose};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// A vehicle that drives through the field and takes images: a dataset of such a scene file holds all images of a field one after another.
///
/// ```
/// use furrow::scene::drive::DriveDesc;
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
    /// How many images each camera takes.
    #[schemars(extend("x-example" = "20"))]
    pub frames: Num<PositiveCount>,
    /// Images a second.
    #[serde(default = "ten")]
    pub rate_hz: Num<Positive>,
    /// Where it goes.
    #[serde(default)]
    pub path: PathDesc,
    /// How it shakes; not at all unless given.
    #[serde(default)]
    pub shake: ShakeDesc,
}

/// Where a vehicle goes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum PathDesc {
    /// From the world's origin straight on.
    Straight {
        /// Where to, degrees clockwise from north; default 0.
        #[serde(default = "north")]
        heading_deg: Vary<Finite>,
        /// Speed over the ground, m/s; default 0.5.
        #[serde(default = "walk")]
        speed_m_s: Vary<Positive>,
    },
    /// From the world's origin along the rows of the field's first crop.
    AlongRows {
        /// Speed over the ground, m/s; default 0.5.
        #[serde(default = "walk")]
        speed_m_s: Vary<Positive>,
    },
    /// From point to point; it turns where it reaches one, and stops at the last.
    Polyline {
        /// The points, metres east and north; two at least.
        #[schemars(extend("x-example" = "[(0, 0), (0, 1), (0.4, 1.5)]"))]
        points_m: Vec<(Num<Finite>, Num<Finite>)>,
        /// Speed over the ground, m/s; default 0.5.
        #[serde(default = "walk")]
        speed_m_s: Vary<Positive>,
    },
    /// As a file tells of the first camera, one image a line: time (s), position (m), quaternion x y z w of the camera's axes (right, down,
    /// forward) in the world; between blanks or commas. That is the format of the TUM RGB-D benchmark, and what `--format tum` writes. A first
    /// line that names the columns may give another order.
    #[schemars(extend("x-example" = "(\"flight.tum\")"))]
    Poses(String),
}

/// Straight on to the north.
impl Default for PathDesc {
    fn default() -> Self {
        Self::Straight { heading_deg: north(), speed_m_s: walk() }
    }
}

fn ten() -> Num<Positive> {
    Num::new(10.0)
}

fn north() -> Vary<Finite> {
    Vary::fixed(0.0)
}

fn walk() -> Vary<Positive> {
    Vary::fixed(0.5)
}

/// How a vehicle shakes: standard deviations about its path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ShakeDesc {
    /// Up and down.
    pub height_mm: Num<NonNegative>,
    /// To the sides.
    pub across_mm: Num<NonNegative>,
    /// About the direction ahead.
    pub roll_deg: Num<NonNegative>,
    /// Nose up and down.
    pub pitch_deg: Num<NonNegative>,
    /// To the left and right.
    pub yaw_deg: Num<NonNegative>,
    /// Time after which 1/e of a deflection is left, seconds.
    pub correlation_s: Num<Positive>,
}

impl Default for ShakeDesc {
    fn default() -> Self {
        let none = Num::new(0.0);
        let correlation_s = Num::new(0.3);
        Self { height_mm: none, across_mm: none, roll_deg: none, pitch_deg: none, yaw_deg: none, correlation_s }
    }
}

/// A further camera on the vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Mounted")]
pub struct MountedDesc {
    /// Its name in files: letters, digits, `-` and `_`. The first camera's is `camera`.
    #[schemars(extend("x-example" = "\"right\""))]
    pub name: String,
    /// What it is and where it hangs. Its images get the first camera's size, so it must have the same shape.
    #[schemars(extend("x-example" = "JaiAd130(at_m: (0.12, 0))"))]
    pub camera: crate::sensor::CameraDesc,
}

/// Name of a scene file's first camera.
pub const FIRST: &str = "camera";

/// One image that a field's vehicle takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Capture {
    /// Which camera, by its name.
    pub name: String,
    /// How many images it took before.
    pub frame: u32,
    /// When, seconds after the first.
    pub time_s: f64,
    /// The camera at its place.
    pub camera: Camera,
    /// The vehicle that carries it.
    pub vehicle: Moment,
}

/// Where a vehicle is, at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    time_s: f64,
    /// From where it set out to where it is: first this turn, then this way.
    turn: Mat3,
    way: Vec3,
    /// m/s, world.
    velocity: Vec3,
}

/// What a drive is drawn with beyond its description.
#[derive(Clone, Debug, Default)]
pub(super) struct Around {
    /// Direction of the crop's rows, radians clockwise from north; none where nothing stands in rows.
    pub(super) rows: Option<f32>,
    /// What [`PathDesc::Poses`] names: times and poses.
    pub(super) poses: Vec<(f64, Pose)>,
}

/// All images of a vehicle with these cameras, which are written as they are before it sets out: all cameras of its first moment, then of the
/// next.
pub(super) fn captures(
    desc: Option<&DriveDesc>,
    cameras: &[(String, Camera)],
    around: &Around,
    stream: &mut Stream,
) -> Result<Vec<Capture>> {
    let still = Moment { time_s: 0.0, turn: Mat3::IDENTITY, way: Vec3::ZERO, velocity: Vec3::ZERO };
    let moments = match desc {
        None => vec![still],
        Some(desc) => {
            if cameras.iter().any(|(_, camera)| camera.motion().velocity != Vec3::ZERO) {
                return Err(Error::input("a camera on a vehicle has no speed of its own")
                    .help("leave `speed_m_s` out of its `motion`; the path of `drive` says how fast it goes"));
            }
            moments(desc, cameras.first().map(|(_, camera)| camera.pose()), around, stream)?
        }
    };
    let taken = |(frame, at): (usize, Moment)| {
        cameras.iter().map(move |(name, camera)| {
            let camera = if desc.is_some() { at.carry(camera) } else { *camera };
            Capture { name: name.clone(), frame: frame as u32, time_s: at.time_s, camera, vehicle: at }
        })
    };
    Ok(moments.into_iter().enumerate().flat_map(taken).collect())
}

impl Moment {
    /// A camera of the vehicle, wherever it was written, at this moment.
    fn carry(&self, camera: &Camera) -> Camera {
        let Pose { position, axes } = *camera.pose();
        let pose = Pose { position: self.turn * position + self.way, axes: self.turn * axes };
        camera.with_pose(pose).with_velocity(self.velocity)
    }

    /// The same of a LiDAR.
    pub(super) fn carry_lidar(&self, lidar: &Lidar) -> Lidar {
        lidar.carried(self.turn, self.way, self.velocity)
    }
}

/// Where the vehicle is at each image.
fn moments(desc: &DriveDesc, first: Option<&Pose>, around: &Around, stream: &mut Stream) -> Result<Vec<Moment>> {
    let frames = desc.frames.get() as usize;
    let path = match &desc.path {
        PathDesc::Poses(file) => {
            if around.poses.len() < frames {
                let words = format!("{file} holds {} poses, fewer than the {frames} frames", around.poses.len());
                let help = match around.poses.len() {
                    0 => "write a pose on each line: time x y z qx qy qz qw, with blanks or commas between".to_owned(),
                    most => format!("set `frames` to {most} or less"),
                };
                return Err(Error::input(words).help(help));
            }
            return Ok(flown(&around.poses[..frames], first.copied().unwrap_or_default()));
        }
        PathDesc::Straight { heading_deg, speed_m_s } => {
            Way::straight(heading_deg.draw32(stream).to_radians(), speed_m_s.draw32(stream))
        }
        PathDesc::AlongRows { speed_m_s } => {
            let rows = around.rows.ok_or_else(|| {
                Error::input("there are no rows to drive along")
                    .help("give the field a crop, or write path: Straight(heading_deg: …)")
            })?;
            Way::straight(rows, speed_m_s.draw32(stream))
        }
        PathDesc::Polyline { points_m, speed_m_s } => {
            let points: Vec<Vec2> = points_m.iter().map(|(x, y)| vec2(x.f32(), y.f32())).collect();
            if points.len() < 2 || points.windows(2).any(|leg| leg[0] == leg[1]) {
                return Err(Error::input("a path needs two points at least, and no point twice in a row")
                    .help("write points_m: [(0, 0), (0, 2)] for two metres to the north"));
            }
            Way { points, speed: speed_m_s.draw32(stream) }
        }
    };
    let rate = desc.rate_hz.get();
    let mut shake = Shake::start(&desc.shake, 1.0 / rate, stream);
    let moment = |frame: usize| {
        let time_s = frame as f64 / rate;
        let (place, ahead, speed) = path.at(time_s as f32);
        let [height, across, roll, pitch, yaw] = shake.next();
        let heading = Mat3::from_rotation_z(-(ahead.x.atan2(ahead.y) + yaw));
        let turn = heading * Mat3::from_rotation_x(pitch) * Mat3::from_rotation_y(roll);
        let right = vec2(ahead.y, -ahead.x);
        let way = (place + right * across).extend(height);
        Moment { time_s, turn, way, velocity: (ahead * speed).extend(0.0) }
    };
    Ok((0..frames).map(moment).collect())
}

/// A path at an even speed.
struct Way {
    points: Vec<Vec2>,
    speed: f32,
}

impl Way {
    /// From the origin on and on; `heading` in radians clockwise from north.
    fn straight(heading: f32, speed: f32) -> Self {
        let ahead = vec2(heading.sin(), heading.cos());
        Self { points: vec![Vec2::ZERO, ahead * 1e6], speed }
    }

    /// Place, direction and speed after so many seconds.
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

/// Five independent deflections: metres up and to the right, radians of roll, pitch and yaw.
struct Shake<'a> {
    sd: [f32; 5],
    now: [f32; 5],
    /// Correlation from one image to the next.
    kept: f32,
    stream: &'a mut Stream,
    begun: bool,
}

impl<'a> Shake<'a> {
    fn start(desc: &ShakeDesc, step_s: f64, stream: &'a mut Stream) -> Self {
        let ShakeDesc { height_mm, across_mm, roll_deg, pitch_deg, yaw_deg, correlation_s } = desc;
        let (metres, radians) = (|of: &Num<_>| of.f32() * 1e-3, |of: &Num<_>| of.f32().to_radians());
        let sd = [metres(height_mm), metres(across_mm), radians(roll_deg), radians(pitch_deg), radians(yaw_deg)];
        let kept = (-step_s / correlation_s.get()).exp() as f32;
        Self { sd, now: [0.0; 5], kept, stream, begun: false }
    }

    fn next(&mut self) -> [f32; 5] {
        let kept = if std::mem::replace(&mut self.begun, true) { self.kept } else { 0.0 };
        let new = (1.0 - kept * kept).sqrt();
        for (now, sd) in self.now.iter_mut().zip(self.sd) {
            *now = kept * *now + new * sd * self.stream.normal() as f32;
        }
        self.now
    }
}

/// Moments at which the first camera, which was written at `first`, has these poses.
fn flown(poses: &[(f64, Pose)], first: Pose) -> Vec<Moment> {
    let begin = poses.first().map_or(0.0, |(time, _)| *time);
    let velocity = |k: usize| {
        let ((t0, a), (t1, b)) = (poses[k.saturating_sub(1)], poses[(k + 1).min(poses.len() - 1)]);
        if t1 > t0 { (b.position - a.position) / (t1 - t0) as f32 } else { Vec3::ZERO }
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
    use crate::math::vec3;
    use crate::ron_file::RonFile;
    use crate::sampling::Purpose;
    use crate::sensor::CameraDesc;

    fn stream() -> Stream {
        Stream::of(3, 0, Purpose::Test, 0)
    }

    fn camera(text: &str) -> Camera {
        RonFile::of(text).parse::<CameraDesc>().unwrap().build(&mut stream()).unwrap()
    }

    fn drive(text: &str, around: &Around) -> Result<Vec<Capture>> {
        let desc: DriveDesc = RonFile::of(text).parse().unwrap();
        let cameras = [("camera", "JaiAd130(height_m: 1)"), ("right", "JaiAd130(height_m: 1, at_m: (0.12, 0))")];
        let cameras = cameras.map(|(name, text)| (name.to_owned(), camera(text)));
        captures(Some(&desc), &cameras, around, &mut stream())
    }

    fn close(a: Vec3, b: Vec3) {
        assert!((a - b).length() < 1e-5, "{a} {b}");
    }

    /// Expected: at 0.5 m/s and 10 Hz to the east, 50 mm an image; the vehicle's right is then the south, and the image's top the east.
    #[test]
    fn a_vehicle_carries_its_cameras_along() {
        let all = drive("(frames: 4, path: Straight(heading_deg: 90))", &Around::default()).unwrap();
        assert_eq!(all.len(), 8);
        let [left, right] = [&all[6], &all[7]];
        assert_eq!((left.name.as_str(), right.name.as_str(), left.frame), ("camera", "right", 3));
        assert!((left.time_s - 0.3).abs() < 1e-12);
        close(left.camera.pose().position, vec3(0.15, 0.0, 1.0));
        close(right.camera.pose().position, vec3(0.15, -0.12, 1.0));
        // Camera y is down in the image: its top is where the vehicle goes.
        close(left.camera.pose().axes.y_axis, Vec3::NEG_X);
        close(left.camera.motion().velocity, vec3(0.5, 0.0, 0.0));
        let rows = Around { rows: Some(90.0_f32.to_radians()), ..Around::default() };
        let along = drive("(frames: 4, path: AlongRows())", &rows).unwrap();
        close(along[6].camera.pose().position, left.camera.pose().position);
    }

    /// Expected: it turns at a point and stands still at the last.
    #[test]
    fn a_polyline_turns_and_ends() {
        let path = "(frames: 30, path: Polyline(points_m: [(0, 0), (0, 0.5), (0.5, 0.5)]))";
        let all = drive(path, &Around::default()).unwrap();
        let at = |frame: usize| all[2 * frame].camera;
        close(at(5).pose().position, vec3(0.0, 0.25, 1.0));
        close(at(15).pose().position, vec3(0.25, 0.5, 1.0));
        close(at(15).pose().axes.y_axis, Vec3::NEG_X);
        close(at(29).pose().position, vec3(0.5, 0.5, 1.0));
        assert_eq!(at(29).motion().velocity, Vec3::ZERO);
        let wrong = drive("(frames: 3, path: Polyline(points_m: [(0, 0), (0, 0)]))", &Around::default());
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

    /// Expected: the first camera has the poses that were read, another one keeps its place beside it.
    #[test]
    fn poses_are_those_of_the_first_camera() {
        let turned = Pose::nadir(vec3(0.3, -0.2, 1.4), 30.0, 8.0, -5.0);
        let q = crate::math::Quat::from_mat3(&turned.axes).to_array();
        let text = format!(
            "timestamp,tx,ty,tz,qx,qy,qz,qw\n5.0,0,0,1,1,0,0,0 # looking down\n5.2,0.3,-0.2,1.4,{},{},{},{}\n",
            q[0], q[1], q[2], q[3]
        );
        let around = Around { poses: poses::read(text.as_bytes()).unwrap(), ..Around::default() };
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
            captures(Some(&desc), &cameras, &Around::default(), &mut stream()).unwrap_err().to_string()
        };
        assert!(refused(moving).contains("no speed of its own"));
        assert!(refused(camera("JaiAd130()")).contains("no rows"));
    }
}
