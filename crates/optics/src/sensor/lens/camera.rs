//! Camera with a pose: the ray of a pixel, the pixel of a point.

use super::aperture::Aperture;
use super::fisheye::WIDEST;
use super::model::Lens;
use super::motion::Motion;
use super::pose::Pose;
use furrow_base::math::{ToFloat, Vec2, Vec3, vec2, vec3};
use furrow_base::sampling::warp;
use furrow_base::{Error, Result};

/// Camera with a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    pub(super) width: u32,
    pub(super) height: u32,
    /// Image width divided by the sensor's width in pixels; below 1 the image is binned.
    scale: f32,
    /// fx, fy: pixels per unit of x/z, y/z.
    pub(super) focal: [f64; 2],
    /// cx, cy: optical axis, pixels.
    pub(super) centre: [f64; 2],
    pub(super) distortion: Lens,
    /// Limit of r² in the pinhole image beyond which nothing is projected, because the polynomial may fold back into
    /// the image.
    pub(super) horizon: f64,
    /// Upper bounds of the lens's first and second derivatives within the horizon.
    pub(super) bend: [f64; 2],
    aperture: Option<Aperture>,
    /// Focal length in millimetres, if the scene file gives it.
    focal_mm: Option<f64>,
    pub(super) pose: Pose,
    pub(super) motion: Motion,
}

impl Camera {
    /// Creates a camera of `size` pixels with intrinsics in pixels. Returns a
    /// [`Kind::Input`](furrow_base::error::Kind::Input) error if the size or the focal length is not above zero, or if
    /// the distortion folds the image over within its corners.
    pub fn new(
        size: (u32, u32),
        focal: [f64; 2],
        centre: [f64; 2],
        distortion: impl Into<Lens>,
        pose: Pose,
    ) -> Result<Self> {
        let (width, height) = size;
        if width == 0 || height == 0 || focal.iter().any(|f| !(f.is_finite() && *f > 0.0)) {
            return Err(Error::input(format!(
                "a camera of {width} × {height} pixels and focal lengths {focal:?} is not valid"
            ))
            .help("all values must be above 0"));
        }
        let distortion = distortion.into();
        let (horizon, bend, aperture, motion) = (f64::INFINITY, [1.0, 0.0], None, Motion::default());
        let (scale, focal_mm) = (1.0, None);
        let mut camera =
            Self { width, height, scale, focal, centre, distortion, horizon, bend, aperture, focal_mm, pose, motion };
        if !distortion.is_none() {
            camera.horizon = camera.check_distortion()?;
            camera.bend = distortion.bend(camera.horizon.sqrt());
        }
        Ok(camera)
    }

    /// Returns the camera with a thin lens instead of a pinhole.
    #[must_use]
    pub fn with_aperture(mut self, aperture: Option<Aperture>) -> Self {
        self.aperture = aperture;
        self
    }

    /// Returns the camera with a focal length in millimetres, which changes no ray.
    #[must_use]
    pub fn with_focal_mm(mut self, focal_mm: Option<f64>) -> Self {
        self.focal_mm = focal_mm;
        self
    }

    /// Returns the camera with another number of pixels and the same field of view.
    #[must_use]
    pub fn with_size(mut self, width: u32, height: u32) -> Self {
        let scale = [f64::from(width) / f64::from(self.width), f64::from(height) / f64::from(self.height)];
        for (axis, scale) in scale.into_iter().enumerate() {
            self.focal[axis] *= scale;
            self.centre[axis] *= scale;
        }
        self.scale *= width.to_f32() / self.width.to_f32();
        self.width = width;
        self.height = height;
        self
    }

    /// Returns the image width divided by the sensor's width in pixels: 1 unless the image has another size than the
    /// camera's own.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// Returns the width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Returns the height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Returns fx, fy, cx, cy in pixels.
    pub fn intrinsics(&self) -> [f64; 4] {
        [self.focal[0], self.focal[1], self.centre[0], self.centre[1]]
    }

    /// Returns the lens distortion.
    pub fn distortion(&self) -> Lens {
        self.distortion
    }

    /// Returns position and orientation; for a moving camera, those in the middle of the image's readout.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Returns the thin lens; `None` for a pinhole.
    pub fn aperture(&self) -> Option<Aperture> {
        self.aperture
    }

    /// Returns the focal length in millimetres; `None` if only its ratio to the pixels is known.
    pub fn focal_mm(&self) -> Option<f64> {
        self.focal_mm
    }

    /// Returns the f-number of the lens; `None` for a pinhole.
    pub fn f_number(&self) -> Option<f32> {
        self.aperture.map(|aperture| aperture.f_number)
    }

    /// Returns origin and unit direction, in world space, of the ray through continuous pixel coordinates `px` ((0.5,
    /// 0.5) is the first pixel's centre) and the lens point chosen by two numbers in [0, 1), which a pinhole ignores.
    /// The time is the middle of the exposure.
    #[inline]
    pub fn ray(&self, px: Vec2, lens_u: [f32; 2]) -> (Vec3, Vec3) {
        self.ray_during(px, lens_u, 0.5)
    }

    /// Like [`Camera::ray`], at a time of the exposure from 0 to 1, which a camera at rest ignores.
    #[inline]
    pub fn ray_during(&self, px: Vec2, lens_u: [f32; 2], shutter_u: f32) -> (Vec3, Vec3) {
        let [x, y] = self.unproject([f64::from(px.x), f64::from(px.y)]);
        let position = self.position(f64::from(px.y), (shutter_u - 0.5) * self.motion.exposure);
        let through = vec3(x.to_f32(), y.to_f32(), 1.0);
        let Some(Aperture { radius, focus, .. }) = self.aperture else {
            return (position, self.pose.to_world(through).normalize());
        };
        let pupil = warp::disc(lens_u) * radius;
        let start = vec3(pupil.x, pupil.y, 0.0);
        (position + self.pose.to_world(start), self.pose.to_world(through * focus - start).normalize())
    }

    /// Returns the ray through the centre of pixel (x, y) and the lens's centre, which is used for labels.
    #[inline]
    pub fn centre_ray(&self, x: u32, y: u32) -> (Vec3, Vec3) {
        let px = [f64::from(x) + 0.5, f64::from(y) + 0.5];
        self.through(self.unproject(px), px[1])
    }

    /// Returns the ray through the lens's centre and a point of the plane at unit distance, for row coordinate `row`.
    #[inline]
    pub(super) fn through(&self, [x, y]: [f64; 2], row: f64) -> (Vec3, Vec3) {
        (self.position(row, 0.0), self.pose.to_world(vec3(x.to_f32(), y.to_f32(), 1.0)).normalize())
    }

    /// Returns the point at unit distance along the optical axis, in the camera frame (x/z, y/z), that a pixel sees.
    #[inline]
    pub fn unproject(&self, px: [f64; 2]) -> [f64; 2] {
        self.distortion.undistort([(px[0] - self.centre[0]) / self.focal[0], (px[1] - self.centre[1]) / self.focal[1]])
    }

    /// Returns the pixel that sees the point (x, y, z) of the camera frame. `None` behind the lens and, with
    /// distortion, far outside the image.
    pub fn project_camera(&self, p: [f64; 3]) -> Option<[f64; 2]> {
        if self.rolls() { self.project_rolling(p) } else { self.project_still(p) }
    }

    /// Like [`Camera::project_camera`], for a camera at rest.
    pub(super) fn project_still(&self, [x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
        if z <= 0.0 {
            return None;
        }
        let at = [x / z, y / z];
        if at[0] * at[0] + at[1] * at[1] > self.horizon {
            return None;
        }
        Some(self.image(at))
    }

    /// Returns the pixel to which the lens maps the point (x/z, y/z).
    pub(super) fn image(&self, at: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.distortion.distort(at);
        [x * self.focal[0] + self.centre[0], y * self.focal[1] + self.centre[1]]
    }

    /// Returns the continuous pixel coordinates of a world point, inside the image or not. `None` behind the lens and,
    /// with distortion, far outside the image.
    pub fn project(&self, p: Vec3) -> Option<Vec2> {
        let [x, y] = self.project_camera(self.pose.point_to_camera(p))?;
        Some(vec2(x.to_f32(), y.to_f32()))
    }

    /// Returns the position of the lens's centre, in world space, while the row at coordinate `row` is exposed.
    pub fn eye(&self, row: f32) -> Vec3 {
        self.position(f64::from(row), 0.0)
    }

    /// Returns `true` if pixel coordinates are inside the image.
    pub fn contains(&self, px: Vec2) -> bool {
        px.x >= 0.0 && px.y >= 0.0 && px.x < self.width.to_f32() && px.y < self.height.to_f32()
    }

    /// Returns the angle in radians that a pixel covers at the optical axis. Multiplied by the distance, it is the
    /// footprint of a pixel.
    pub fn pixel_angle(&self) -> f32 {
        (1.0 / (self.focal[0] * self.focal[1]).sqrt()).to_f32()
    }

    /// Returns the points of the plane z = `ground` (metres) seen along the image's border, clockwise from the top left
    /// corner, with `points` points per side. `None` if one of them sees no ground. Lens distortion and rolling
    /// shutters bend the sides.
    pub fn outline(&self, ground: f32, points: u32) -> Option<Vec<Vec2>> {
        let corners = self.corners();
        let side = |k: usize| {
            let (from, to) = (corners[k], corners[(k + 1) % 4]);
            (0..points).map(move |i| from + (to - from) * (i.to_f32() / points.to_f32()))
        };
        (0..4).flat_map(side).map(|px| self.on_ground(px, ground)).collect()
    }

    /// Returns the image's corners, clockwise from the top left.
    fn corners(&self) -> [Vec2; 4] {
        let (w, h) = (self.width.to_f32(), self.height.to_f32());
        [vec2(0.0, 0.0), vec2(w, 0.0), vec2(w, h), vec2(0.0, h)]
    }

    /// Returns the point of the plane z = `ground` (metres) seen at a position of the image; `None` if the ray does not
    /// hit it.
    fn on_ground(&self, px: Vec2, ground: f32) -> Option<Vec2> {
        let [x, y] = self.unproject([f64::from(px.x), f64::from(px.y)]);
        let dir = self.pose.to_world(vec3(x.to_f32(), y.to_f32(), 1.0));
        let position = self.position(f64::from(px.y), 0.0);
        let t = (ground - position.z) / dir.z;
        (t.is_finite() && t > 0.0).then(|| (position + dir * t).truncate())
    }

    /// Returns the cosine of the angle between the optical axis and a pixel's ray.
    pub fn axis_cosine(&self, px: [f64; 2]) -> f32 {
        let [x, y] = self.unproject(px);
        (1.0 / (1.0 + x * x + y * y).sqrt()).to_f32()
    }

    /// Checks that the lens mapping is one-to-one on the image's border and from the centre to it. Returns the r² up to
    /// which it is used.
    fn check_distortion(&self) -> Result<f64> {
        const STEPS: u32 = 32;
        let (w, h) = (f64::from(self.width), f64::from(self.height));
        let mut horizon = 0.0_f64;
        for k in 0..=STEPS {
            let t = f64::from(k) / f64::from(STEPS);
            for px in [[t * w, 0.0], [t * w, h], [0.0, t * h], [w, t * h]] {
                let at = self.unproject(px);
                if matches!(self.distortion, Lens::Fisheye(_)) && at[0].is_nan() {
                    let words = format!(
                        "the fisheye lens sees more than {:.0}° from its axis at the border of the image",
                        WIDEST.to_degrees()
                    );
                    return Err(Error::input(words).help(
                        "crop the images of this calibration: a smaller size, and cx and cy less by the pixels cut off",
                    ));
                }
                let back = self.project_still([at[0], at[1], 1.0]).unwrap_or([f64::NAN; 2]);
                let error = (back[0] - px[0]).abs().max((back[1] - px[1]).abs());
                let folds = (0..=STEPS).any(|j| {
                    let s = f64::from(j) / f64::from(STEPS);
                    self.distortion.stretch([at[0] * s, at[1] * s]) <= 0.0
                });
                if error.is_nan() || error > 1e-6 || folds {
                    return Err(Error::input("the lens distortion folds the image over before its corners").help(
                        "check the coefficients' signs and \
                         that they belong to this focal length",
                    ));
                }
                horizon = horizon.max(at[0] * at[0] + at[1] * at[1]);
            }
        }
        // A margin of a tenth of the radius, for objects that extend beyond the image.
        Ok(horizon * 1.21)
    }
}
