//! Moving camera: its position while a row is exposed.
//!
//! It moves in a straight line at constant speed and does not rotate. Its pose is that at the middle of the image's
//! readout. Row coordinate y of an image of h rows is in the middle of its exposure at t = (y/h − ½) · readout, and
//! every row is exposed for the same time. A global shutter has a readout of 0.
//!
//! Labels, projected points and bounds are those at the middle of each row's exposure. They are skewed like the image
//! but not blurred; the path tracer distributes its samples over the exposure.

use super::camera::Camera;
use super::motion::Motion;
use super::pose::Pose;
use furrow_base::math::{ToFloat, Vec3};

/// Largest number of secant steps to find the row that sees a point.
const STEPS: usize = 24;

impl Camera {
    /// Returns the camera with this motion.
    #[must_use]
    pub fn with_motion(mut self, motion: Motion) -> Self {
        self.motion = motion;
        self
    }

    /// Returns the camera with another pose.
    #[must_use]
    pub fn with_pose(mut self, pose: Pose) -> Self {
        self.pose = pose;
        self
    }

    /// Returns the camera with another velocity, m/s in world space.
    #[must_use]
    pub fn with_velocity(mut self, velocity: Vec3) -> Self {
        self.motion.velocity = velocity;
        self
    }

    /// Returns the camera with this exposure time for its motion blur, seconds, unless its scene file sets one.
    #[must_use]
    pub fn with_metered(mut self, exposure: f32) -> Self {
        if self.motion.shutter.is_none() && self.blurs() {
            self.motion.exposure = exposure;
        }
        self
    }

    /// Returns the motion.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Returns the exposure time of a row, seconds.
    pub fn exposure(&self) -> f32 {
        self.motion.exposure
    }

    /// Returns `true` if static objects are motion-blurred in the image.
    pub fn blurs(&self) -> bool {
        self.motion.moves() && self.motion.exposure > 0.0
    }

    /// Returns `true` if a rolling shutter lets rows see from different positions.
    pub fn rolls(&self) -> bool {
        self.motion.moves() && self.motion.readout > 0.0
    }

    /// Returns `true` if straight lines may look bent, by lens distortion or by a rolling shutter.
    pub fn bends_lines(&self) -> bool {
        !self.distortion.is_none() || self.rolls()
    }

    /// Returns the distance travelled while one image is taken, metres.
    pub fn travel(&self) -> f32 {
        self.motion.velocity.length() * (self.motion.exposure + self.motion.readout)
    }

    /// Returns the time of the middle of the exposure of row coordinate `y`, in seconds from the middle of the readout.
    pub(super) fn time(&self, y: f64) -> f64 {
        (y / f64::from(self.height) - 0.5) * f64::from(self.motion.readout)
    }

    /// Returns the lens's centre in world space for row coordinate `y`, `after` seconds from the middle of its
    /// exposure.
    #[inline]
    pub(super) fn position(&self, y: f64, after: f32) -> Vec3 {
        if !self.motion.moves() {
            return self.pose.position;
        }
        self.pose.position + self.motion.velocity * (self.time(y).to_f32() + after)
    }

    /// Converts a point (x, y, z) of the camera's frame to its frame at another time.
    pub(super) fn seen_at(&self, p: [f64; 3], time: f64) -> [f64; 3] {
        let axes = self.pose.axes;
        let along = |axis: Vec3| f64::from(axis.dot(self.motion.velocity)) * time;
        [p[0] - along(axes.x_axis), p[1] - along(axes.y_axis), p[2] - along(axes.z_axis)]
    }

    /// Returns the pixel that sees a point of the camera's frame under a rolling shutter. The row determines the time,
    /// and the time determines the row. Solved by the secant method, which is exact in one step where the image moves
    /// uniformly.
    pub(super) fn project_rolling(&self, p: [f64; 3]) -> Option<[f64; 2]> {
        // Intermediate steps may be outside the image; the lens model is evaluated there too.
        let off = |row: f64| {
            let [x, y, z] = self.seen_at(p, self.time(row));
            (z > 0.0).then(|| self.image([x / z, y / z])[1] - row)
        };
        let mut row = f64::from(self.height) / 2.0;
        let mut before = (row, off(row)?);
        row += before.1;
        for _ in 0..STEPS {
            let off = off(row)?;
            if off.abs() < 1e-9 {
                return self.project_still(self.seen_at(p, self.time(row)));
            }
            let next = row - off * (row - before.0) / (off - before.1);
            before = (row, off);
            row = next;
        }
        // The image moves as fast as its rows are read, so no single row sees the point.
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CameraDesc, Distortion, Pose};
    use super::*;
    use furrow_base::math::{Vec2, vec2, vec3};
    use furrow_base::sampling::{Purpose, Stream};

    fn camera(page: &str) -> Camera {
        ron::from_str::<CameraDesc>(page).unwrap().build(&mut Stream::of(1, 0, Purpose::Test, 0)).unwrap()
    }

    const DRIVING: &str =
        "JaiAd130(height_m: 1, motion: (speed_m_s: 0.5, heading_deg: 90, exposure_ms: 4, readout_ms: 30))";

    /// Expected: a static object leaves a trail of speed × exposure × pixels per metre: 0.5 m/s · 4 ms · 4000 px/m = 8
    /// pixels, uniform in time and against the heading; without speed the rays are bit-identical.
    #[test]
    fn a_trail_is_as_long_as_the_way_driven() {
        let camera = camera(DRIVING);
        let ground = |shutter: f32| {
            let (origin, dir) = camera.ray_during(vec2(700.0, 483.0), [0.5; 2], shutter);
            (origin - dir * (origin.z / dir.z)).x
        };
        // Ground position seen by a pixel early and late in the exposure; their distance is the length of the trail.
        assert!(((ground(1.0) - ground(0.0)) * 4000.0 - 8.0).abs() < 0.01, "{}", (ground(1.0) - ground(0.0)) * 4000.0);
        assert!((ground(0.5) - 0.5 * (ground(0.25) + ground(0.75))).abs() < 1e-7);
        let still = self::camera("JaiAd130(height_m: 1, motion: (exposure_ms: 4, readout_ms: 30))");
        let plain = self::camera("JaiAd130(height_m: 1)");
        for shutter in [0.0, 0.3, 1.0] {
            let px = vec2(20.3, 900.1);
            assert_eq!(still.ray_during(px, [0.2, 0.9], shutter), plain.ray(px, [0.2, 0.9]));
        }
        assert!(!still.blurs() && !still.rolls() && camera.blurs() && camera.rolls());
    }

    /// Expected: an upright line on the ground is skewed by speed × row time × pixels per metre: 0.5 m/s · 30 ms · 4000
    /// px/m = 60 pixels from the first row to the last, both in projections and in label rays.
    #[test]
    fn a_rolling_shutter_leans_the_image_and_its_labels() {
        let camera = camera(DRIVING);
        let at = |y: f32| camera.project(vec3(0.0, y, 0.0)).unwrap();
        let (top, bottom) = (at(0.1), at(-0.1));
        let lean = (bottom.x - top.x) / (bottom.y - top.y) * 966.0;
        // East is right, and later rows see from further east.
        assert!((lean + 60.0).abs() < 0.02, "{lean}");
        let (first, last) = (camera.centre_ray(600, 0).0, camera.centre_ray(600, 965).0);
        assert!(((last.x - first.x) / 965.0 * 966.0 - 0.015).abs() < 1e-6 && (first.y - last.y).abs() < 1e-6);
    }

    /// Expected: for any motion and orientation, a pixel's ray passes through the points that project to that pixel.
    #[test]
    fn projection_and_rays_agree_while_driving() {
        let pages = [
            DRIVING,
            "JaiAd130(height_m: 0.6, yaw_deg: 30, pitch_deg: 8, roll_deg: -4, distortion: (k1: -0.1, p1: 0.002), \
             motion: (speed_m_s: 1.5, heading_deg: 200, readout_ms: 40))",
            "Phone(height_m: 0.5, pitch_deg: 20, motion: (speed_m_s: 2, heading_deg: 20))",
        ];
        let mut s = Stream::of(2, 0, Purpose::Test, 0);
        for page in pages {
            let camera = camera(page).with_size(640, 480);
            for _ in 0..500 {
                let px = vec2(s.range32(0.0, 640.0), s.range32(0.0, 480.0));
                let (origin, dir) = camera.ray(px, [0.5; 2]);
                let back = camera.project(origin + dir * s.range32(0.3, 0.9)).unwrap();
                assert!((back - px).length() < 0.01, "{page}: {px} {back}");
            }
        }
    }

    /// Rationale: a pixel outside the bounds is not tested and becomes a hole. Expected: points of triangles are inside
    /// their bounds, including under a rolling shutter.
    #[test]
    fn bounds_hold_what_a_rolling_shutter_sees() {
        let lens = Distortion { k1: -0.2, k2: 0.05, p1: 1e-3, ..Distortion::default() };
        let pose = Pose::look_at(vec3(0.1, -0.6, 0.9), Vec3::ZERO).unwrap();
        let motion = Motion { velocity: vec3(1.0, 1.5, 0.0), readout: 0.05, ..Motion::default() };
        let mut s = Stream::of(11, 0, Purpose::Test, 0);
        let (mut inside, mut small, mut loose) = (0, 0, 0);
        for lens in [Distortion::default(), lens] {
            let camera = Camera::new((160, 120), [150.0, 148.0], [82.3, 58.9], lens, pose).unwrap().with_motion(motion);
            for round in 0..2000 {
                let size = [0.01, 0.1, 0.4][round % 3];
                let mut near = |r: f32| vec3(s.range32(-r, r), s.range32(-r, r), s.range32(-0.2, 0.2) * r);
                let middle = near(0.5);
                let corners = [(); 3].map(|()| middle + near(size));
                let Some([lo, hi]) = camera.triangle_outline(corners).map(|outline| outline.bounds) else { continue };
                let mut hull = [f64::INFINITY, f64::NEG_INFINITY];
                let before = inside;
                for _ in 0..60 {
                    let (mut u, mut v) = (s.range32(0.0, 1.0), s.range32(0.0, 1.0));
                    if u + v > 1.0 {
                        (u, v) = (1.0 - u, 1.0 - v);
                    }
                    let p = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
                    let Some(px) = camera.project(p).filter(|px| camera.contains(*px)) else { continue };
                    let px = [f64::from(px.x), f64::from(px.y)];
                    for axis in 0..2 {
                        assert!(px[axis] > lo[axis] - 1e-3 && px[axis] < hi[axis] + 1e-3, "{px:?} {lo:?} {hi:?}");
                    }
                    hull = [hull[0].min(px[0]), hull[1].max(px[0])];
                    inside += 1;
                }
                let width = hull[1] - hull[0];
                if size > 0.01 || inside < before + 60 {
                    continue;
                }
                small += 1;
                loose += u32::from(hi[0] - lo[0] >= 2.0 * width + 0.5);
            }
        }
        assert!(inside > 10_000, "{inside}");
        // Sixty points miss the ends of some slivers.
        assert!(small > 100 && loose * 100 <= small, "{loose} of {small} have bounds twice as wide as they are");
    }

    #[test]
    fn where_it_drives_is_counted_from_north() {
        let velocity = |heading: u32| {
            camera(&format!("JaiAd130(motion: (speed_m_s: 2, heading_deg: {heading}))")).motion().velocity
        };
        assert!((velocity(0) - vec3(0.0, 2.0, 0.0)).length() < 1e-6);
        assert!((velocity(90) - vec3(2.0, 0.0, 0.0)).length() < 1e-6);
        let image: Vec2 = camera("Phone()").project(vec3(0.0, 0.0, 0.0)).unwrap();
        assert!((image - vec2(2016.0, 1512.0)).length() < 1e-2);
    }
}
