//! How much of the ground a camera sees, and how much of that is planted.
//!
//! A camera that looks down sees a piece of ground with an end, all of which is planted up to the scene file's `reach_m` from the point below it.
//! One that sees the horizon, or ground further away, gets bare ground there: its pixels are then labelled soil, so the field says
//! so in its warnings, with the share of the ground in view that this is. Where it is more than half, the scene is refused.

use super::builder::{Builder, FARTHEST};
use crate::math::{Vec2, Vec3, vec2};
use crate::ron_file::Step;
use crate::sensor::Camera;
use crate::soil::Rect;
use crate::{Error, Result};

/// The longest reach of a field, metres.
const LONGEST_REACH: f32 = 100.0;
/// Below this sine of the angle under the horizon a ray is said to see the horizon.
const HORIZON: f32 = 0.05;
/// Sides of the raster of rays by which the share of bare ground is estimated.
const RAYS: usize = 24;
/// Share of bare ground from which on a scene is refused.
const TOO_BARE: f32 = 0.5;

/// The ground that a camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    /// What of it is planted, about the plane z = 0, metres.
    pub(super) area: Rect,
    /// Whether the camera sees ground beyond it.
    pub(super) open: bool,
}

impl View {
    /// That of a scene in which nothing grows.
    pub(super) const NONE: Self = Self { area: Rect::new(-0.5, -0.5, 0.5, 0.5), open: false };

    /// The least rectangle that holds both.
    fn join(self, other: Self) -> Self {
        let ([lo, hi], [a, b]) = (self.area.corners(), other.area.corners());
        let (lo, hi) = (lo.min(a), hi.max(b));
        Self { area: Rect::new(lo.x, lo.y, hi.x, hi.y), open: self.open || other.open }
    }
}

/// Where a ray meets the plane z = 0: at a place, or where it says that it sees the horizon; `None` for a ray above it.
fn meets(origin: Vec3, direction: Vec3) -> Option<Vec2> {
    (direction.z < 0.0 && origin.z > 0.0).then(|| (origin + direction * (origin.z / -direction.z)).truncate())
}

impl Builder<'_> {
    /// The ground that all images see together, with a warning where some of it is not planted.
    pub(super) fn view(&mut self) -> Result<View> {
        let cameras: Vec<Camera> = self.captures.iter().map(|capture| capture.camera).collect();
        let mut whole: Option<View> = None;
        for camera in &cameras {
            let view = self.view_of(camera, whole.is_some_and(|before| before.open))?;
            whole = Some(whole.map_or(view, |before| before.join(view)));
        }
        let whole = whole.unwrap_or(View::NONE);
        let area = whole.area.area();
        // That of a camera which sees as far as the reach on all sides.
        let most = 4.0 * self.reach()?.powi(2);
        // A single camera is bounded by its reach, and by what its shutter travels.
        if cameras.len() > 1 && area > most {
            let words = format!("the drive sees {area:.0} m² of ground, more than the {most} m² of one field");
            let help = "take fewer frames, drive along a row to the north or east, or drive through several fields, or raise reach_m";
            return Err(self.page.blame(&[Step::Field("drive")], Error::input(words).help(help)));
        }
        Ok(whole)
    }

    /// How far from the point below a camera the field is grown, metres.
    fn reach(&self) -> Result<f32> {
        let reach = self.desc.reach_m.f32();
        if reach > LONGEST_REACH {
            let error = Error::input(format!("reach_m is {reach}, more than {LONGEST_REACH}")).help("lower it");
            return Err(self.page.blame(&[Step::Field("reach_m")], error));
        }
        Ok(reach)
    }

    /// The ground that one camera sees; with a warning where some of it is not planted, unless that was `told`.
    fn view_of(&mut self, camera: &Camera, told: bool) -> Result<View> {
        let reach = self.reach()?;
        let (w, h) = (camera.width() as f32, camera.height() as f32);
        let below = camera.pose().position.truncate();
        if camera.pose().position.abs().max_element() > FARTHEST {
            let words = format!("the camera stands more than {FARTHEST} m from the field's origin");
            let error = Error::input(words)
                .help("move it near the origin: a field has no end, and is as good there; heights are in metres");
            return Err(self.page.blame(&[Step::Field("camera")], error));
        }
        let mut seen: Vec<Vec2> = Vec::new();
        let mut level: Vec<Vec2> = Vec::new();
        // The corners and the middles of the sides: a barrel distortion bulges between corners.
        for (x, y) in [(0, 0), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2)] {
            let (origin, direction) = camera.ray(vec2(w * x as f32 / 2.0, h * y as f32 / 2.0), [0.5; 2]);
            if direction.z < -HORIZON && origin.z > 0.0 {
                seen.extend(meets(origin, direction));
            } else {
                level.push(below + direction.truncate().normalize_or_zero() * reach);
            }
        }
        if seen.is_empty() {
            let error = Error::input("the camera does not look at the ground")
                .help("turn it down; its height is counted from the ground");
            return Err(self.page.blame(&[Step::Field("camera")], error));
        }
        // Some of the view is of the horizon: the ground is seen as far as it is planted.
        let hull = seen.iter().chain(&level).copied();
        let all = [hull.clone().fold(Vec2::INFINITY, Vec2::min), hull.fold(Vec2::NEG_INFINITY, Vec2::max)];
        let (lo, hi) = (all[0].max(below - Vec2::splat(reach)), all[1].min(below + Vec2::splat(reach)));
        // Rows' corners are seen in the middle of their exposures.
        let area = Rect::new(lo.x, lo.y, hi.x, hi.y).grown(camera.travel());
        if level.is_empty() && [lo, hi] == all {
            return Ok(View { area, open: false });
        }
        let (bare, farthest) = beyond(camera, area, below);
        if bare <= 0.0 {
            return Ok(View { area, open: false });
        }
        let far = if level.is_empty() { format!("{farthest:.0} m away") } else { "to the horizon".into() };
        let words = format!(
            "the camera sees ground {far}, and plants are grown up to {reach} m east, north, west and south of the point below it: \
             {:.0} % of the ground in the image stays bare and its labels call it soil",
            (100.0 * bare).ceil()
        );
        let help = "lower the camera, turn it down, narrow its angle of view, or raise reach_m";
        if bare > TOO_BARE {
            return Err(self.page.blame(&[Step::Field("camera")], Error::input(words).help(help)));
        }
        if !told {
            self.warnings.push(format!("{words}; {help}"));
        }
        Ok(View { area, open: true })
    }
}

/// Share of an image's ground that lies beyond an area, and how far from `below` the farthest of it is, metres.
fn beyond(camera: &Camera, area: Rect, below: Vec2) -> (f32, f32) {
    let size = vec2(camera.width() as f32, camera.height() as f32);
    let area = area.grown(1e-3);
    let (mut ground, mut bare, mut farthest) = (0.0_f32, 0.0_f32, 0.0_f32);
    for k in 0..=RAYS {
        for i in 0..=RAYS {
            let (origin, direction) = camera.ray(size * vec2(i as f32, k as f32) / RAYS as f32, [0.5; 2]);
            let Some(at) = meets(origin, direction) else { continue };
            ground += 1.0;
            if !area.contains(at) {
                bare += 1.0;
                farthest = farthest.max(at.distance(below));
            }
        }
    }
    (bare / ground.max(1.0), farthest)
}
