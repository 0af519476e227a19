//! How much of the ground a camera sees, and how much of that is planted.
//!
//! A camera that looks down sees a piece of ground with an end, all of which is planted up to the scene file's `reach_m` from the point below it.
//! One that sees the horizon, or ground further away, gets bare ground there: its pixels are then labelled soil, so the field says
//! so in its warnings, with the share of the ground in view that this is. Where it is more than half, the scene is refused.

use super::builder::{Builder, FARTHEST};
use super::ground_view::{GroundView, Onlooker};
use super::terrain::{Look, Near, Reach, Seen};
use crate::math::{Vec2, Vec3, vec2};
use crate::ron_file::Step;
use crate::scene::desc::Detail;
use crate::scene::drive::{Capture, FIRST};
use crate::sensor::Camera;
use crate::soil::Rect;
use crate::{Error, Result};

/// The longest reach of a field, metres.
pub(super) const LONGEST_REACH: f32 = 100.0;
/// Below this sine of the angle under the horizon a ray is said to see the horizon.
const HORIZON: f32 = 0.05;
/// Sides of the raster of rays by which the share of bare ground is estimated.
const RAYS: usize = 24;
/// Share of bare ground from which on a scene is refused.
const TOO_BARE: f32 = 0.5;
/// Where detail is by pixel, how many times as far as the nearest ground in an image the ground is made of even cells; they grow beyond. Pixels there are
/// as many times as large, and clods of some centimetres a few of them long.
const NEAR: f32 = 4.5;
/// Where detail is by pixel, how far beside what is seen plants are grown, metres: as far as a plant of 0.5 m throws its shadow, with the room in which
/// others lean in.
const SIDEWAYS: f32 = 1.75;

/// The ground that a camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    /// What of it is planted, metres: about what is seen of the plane z = 0, and of the ground where it lies lower or higher.
    pub(super) area: Rect,
    /// What of that has ground of even cells, and things on it: all, unless detail is by pixel and much of it is far away.
    pub(super) near: Rect,
    /// Whether the camera sees ground beyond it.
    pub(super) open: bool,
}

impl View {
    /// That of a scene in which nothing grows.
    pub(super) const NONE: Self = Self::even(Rect::new(-0.5, -0.5, 0.5, 0.5), false);

    /// A view whose ground is made of even cells.
    const fn even(area: Rect, open: bool) -> Self {
        Self { area, near: area, open }
    }

    /// Whether cells of the ground grow with the distance.
    pub(super) fn is_graded(&self) -> bool {
        self.near != self.area
    }

    /// The least rectangle that holds both.
    pub(super) fn join(self, other: Self) -> Self {
        let (area, near) = (around(self.area, other.area), around(self.near, other.near));
        Self { area, near, open: self.open || other.open }
    }
}

/// The least rectangle that holds both.
fn around(a: Rect, b: Rect) -> Rect {
    let ([lo, hi], [c, d]) = (a.corners(), b.corners());
    let (lo, hi) = (lo.min(c), hi.max(d));
    Rect::new(lo.x, lo.y, hi.x, hi.y)
}

/// Where a ray meets the plane z = 0: at a place, or where it says that it sees the horizon; `None` for a ray above it.
pub(super) fn meets(origin: Vec3, direction: Vec3) -> Option<Vec2> {
    (direction.z < 0.0 && origin.z > 0.0).then(|| (origin + direction * (origin.z / -direction.z)).truncate())
}

impl Builder<'_> {
    /// The ground that all images see together, with a warning where some of it is not planted.
    pub(super) fn view(&mut self) -> Result<View> {
        if !self.scanners.is_empty() {
            return self.scanned();
        }
        let captures: Vec<Capture> = self.captures.clone();
        let mut whole: Option<View> = None;
        self.seen.clear();
        for capture in &captures {
            let view = self.view_of(capture, whole.is_some_and(|before| before.open))?;
            whole = Some(whole.map_or(view, |before| before.join(view)));
        }
        let whole = whole.unwrap_or(View::NONE);
        let area = whole.area.area();
        // That of a camera which sees as far as the reach on all sides.
        let most = 4.0 * self.reach()?.powi(2);
        // A single camera is bounded by its reach, and by what its shutter travels.
        if captures.len() > 1 && area > most {
            let words = format!("the drive sees {area:.0} m² of ground, more than the {most} m² of one field");
            let help = "take fewer frames, drive along a row to the north or east, or drive through several fields, or raise reach_m";
            return Err(self.page.blame(&[Step::Field("drive")], Error::input(words).help(help)));
        }
        Ok(whole)
    }

    /// The cameras of a drive in all their places, where the ground is made near what they see alone. None where all of it is: for single images
    /// and scans, and where a camera sees more of it than is planted.
    pub(super) fn onlookers(&self, view: View) -> Vec<Onlooker> {
        let drives = self.captures.last().is_some_and(|last| last.frame > 0);
        if !drives || view.open || !self.scanners.is_empty() {
            return Vec::new();
        }
        let mut captures: Vec<&Capture> = self.captures.iter().collect();
        captures.sort_by(|a, b| a.name.cmp(&b.name));
        let all: Option<Vec<Onlooker>> = captures.iter().map(|capture| Onlooker::of(&capture.camera)).collect();
        let mut all = all.unwrap_or_default();
        all.dedup_by(|next, kept| next.like(kept));
        all
    }

    /// A capture in the words of an error: its camera, and its frame on a drive.
    fn which(&self, capture: &Capture) -> String {
        let Capture { name, frame, .. } = capture;
        let camera = if name == FIRST { "the camera".into() } else { format!("camera `{name}`") };
        if self.desc.drive.is_some() { format!("{camera} in frame {frame}") } else { camera }
    }

    /// An error about a capture, where it stands in the scene file: at the drive once it has moved, else at its camera.
    fn blame_capture(&self, capture: &Capture, error: Error) -> Error {
        let place = self.desc.cameras.iter().position(|mounted| mounted.name == capture.name);
        match place {
            _ if capture.frame > 0 => self.page.blame(&[Step::Field("drive")], error),
            Some(k) => self.page.blame(&[Step::Field("cameras"), Step::Item(k)], error),
            None => self.page.blame(&[Step::Field("camera")], error),
        }
    }

    /// How far from the point below a camera the field is grown, metres.
    pub(super) fn reach(&self) -> Result<f32> {
        let reach = self.desc.reach_m.f32();
        if reach > LONGEST_REACH {
            let error = Error::input(format!("reach_m is {reach}, more than {LONGEST_REACH}")).help("lower it");
            return Err(self.page.blame(&[Step::Field("reach_m")], error));
        }
        Ok(reach)
    }

    /// The ground that one camera sees; with a warning where some of it is not planted, unless that was `told`.
    fn view_of(&mut self, capture: &Capture, told: bool) -> Result<View> {
        let (camera, reach) = (&capture.camera, self.reach()?);
        let (w, h) = (camera.width() as f32, camera.height() as f32);
        let below = camera.pose().position.truncate();
        if camera.pose().position.abs().max_element() > FARTHEST {
            let words = format!("{} stands more than {FARTHEST} m from the field's origin", self.which(capture));
            let error = Error::input(words)
                .help("move it near the origin: a field has no end, and is as good there; heights are in metres");
            return Err(self.blame_capture(capture, error));
        }
        let mut seen: Vec<Vec2> = Vec::new();
        let mut level: Vec<Vec2> = Vec::new();
        let mut looks: Vec<Look> = Vec::new();
        // The corners and the middles of the sides: a barrel distortion bulges between corners.
        for (x, y) in [(0, 0), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2)] {
            let (origin, direction) = camera.ray(vec2(w * x as f32 / 2.0, h * y as f32 / 2.0), [0.5; 2]);
            if direction.z < -HORIZON && origin.z > 0.0 {
                seen.extend(meets(origin, direction));
                looks.push((origin, direction));
            } else {
                level.push(below + direction.truncate().normalize_or_zero() * reach);
            }
        }
        if seen.is_empty() {
            return Err(self.blame_capture(capture, blind(&self.which(capture), camera)));
        }
        // Some of the view is of the horizon: the ground is seen as far as it is planted.
        let hull = seen.iter().chain(&level).copied();
        let all = [hull.clone().fold(Vec2::INFINITY, Vec2::min), hull.fold(Vec2::NEG_INFINITY, Vec2::max)];
        let (lo, hi) = (all[0].max(below - Vec2::splat(reach)), all[1].min(below + Vec2::splat(reach)));
        // Rows' corners are seen in the middle of their exposures.
        let area = Rect::new(lo.x, lo.y, hi.x, hi.y).grown(camera.travel());
        let near = self.nearest(raster(camera), area);
        let far = Reach { field_m: reach, ray_m: f32::INFINITY, travel_m: camera.travel() };
        let Seen { area, near, met, beyond: farther, terrain } = Seen::of(self.envelope(), area, near, &looks, &far);
        // What stands between the camera and the nearest ground that it sees may be tall.
        let points = seen.iter().chain(&level).chain(&met).copied();
        self.seen.push(GroundView::around(points.chain([below])));
        if level.is_empty() && [lo, hi] == all && !farther {
            return Ok(View { area, near, open: false });
        }
        let (bare, farthest) = beyond(raster(camera).filter_map(|look| terrain.meets(look, 0.0)), area, below);
        if bare <= 0.0 {
            return Ok(View { area, near, open: false });
        }
        let far = if level.is_empty() { format!("{farthest:.0} m away") } else { "to the horizon".into() };
        let words = format!(
            "{} sees ground {far}, and plants are grown up to {reach} m east, north, west and south of the point below it: \
             {:.0} % of the ground in the image stays bare and its labels call it soil",
            self.which(capture),
            (100.0 * bare).ceil()
        );
        let help = "lower the camera, turn it down, narrow its angle of view, or raise reach_m";
        if self.desc.detail == Detail::Full && !told {
            self.warnings.push(format!(
                "{} sees ground {far}, and detail is Full: all of it is made as fine as the nearest; detail: ByPixel makes each place as \
                 fine as its pixels, in a fraction of the time and memory",
                self.which(capture)
            ));
        }
        if bare > TOO_BARE {
            return Err(self.blame_capture(capture, Error::input(words).help(help)));
        }
        if !told {
            self.warnings.push(format!("{words}; {help}"));
        }
        Ok(View { area, near, open: true })
    }
}

impl Builder<'_> {
    /// What of the ground that rays see is made of even cells; `None` where all of it is.
    pub(super) fn nearest(&self, rays: impl Iterator<Item = Look>, area: Rect) -> Option<Near> {
        if self.desc.detail == Detail::Full {
            return None;
        }
        let seen: Vec<(Vec2, f32, Look)> = rays
            .filter_map(|look @ (origin, direction)| Some((meets(origin, direction)?, origin.z / -direction.z, look)))
            .filter(|(at, ..)| area.contains(*at))
            .collect();
        let ray_m = NEAR * seen.iter().map(|(_, distance, _)| *distance).fold(f32::INFINITY, f32::min);
        let (near, far): (Vec<_>, Vec<_>) = seen.into_iter().partition(|(_, distance, _)| *distance <= ray_m);
        if far.is_empty() {
            return None;
        }
        let (lo, hi) = near.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(l, h), (p, ..)| (l.min(*p), h.max(*p)));
        let looks = near.into_iter().map(|(_, _, look)| look).collect();
        Some(Near { area: Rect::new(lo.x, lo.y, hi.x, hi.y), looks, ray_m })
    }

    /// Whether a plant at a place may be seen, or may throw a shadow on what is; with `detail: Full`, whether it stands in the rectangle about the view is asked elsewhere.
    pub(super) fn may_be_seen(&self, at: Vec2) -> bool {
        self.desc.detail == Detail::Full
            || self.seen.is_empty()
            || self.seen.iter().any(|view| view.distance(at) <= SIDEWAYS)
    }
}

/// The error about a camera, called `which`, none of whose image's edges meets the ground: it looks elsewhere, or its lens does.
fn blind(which: &str, camera: &Camera) -> Error {
    let pose = camera.pose();
    if pose.axes.z_axis.z >= -HORIZON || pose.position.z <= 0.0 {
        return Error::input(format!("{which} does not look at the ground"))
            .help("turn it down; its height is counted from the ground");
    }
    let [_, _, cx, cy] = camera.intrinsics();
    let (width, height) = (f64::from(camera.width()), f64::from(camera.height()));
    if !((0.0..=width).contains(&cx) && (0.0..=height).contains(&cy)) {
        // In the pixels that the scene file counts.
        let [width, height, cx, cy] = [width, height, cx, cy].map(|pixels| pixels / f64::from(camera.scale()));
        let words = format!(
            "{which} points at the ground, and its image shows none: the principal point, cx {cx:.0} and cy {cy:.0}, lies beyond its \
             {width:.0} × {height:.0} pixels"
        );
        let (cx, cy) = (0.5 * width, 0.5 * height);
        return Error::input(words)
            .help(format!("write cx and cy in pixels from the top left corner, about {cx:.0} and {cy:.0}"));
    }
    let angle = |axis: usize, from: [f64; 2], to: [f64; 2]| {
        (camera.unproject(to)[axis].atan() - camera.unproject(from)[axis].atan()).to_degrees()
    };
    let words = format!(
        "{which} points at the ground, and all edges of its image lie about the horizon: its angle of view is {:.1}° by {:.1}°",
        angle(0, [0.0, 0.5 * height], [width, 0.5 * height]),
        angle(1, [0.5 * width, 0.0], [0.5 * width, height])
    );
    Error::input(words).help("narrow it: write horizontal_deg: 60, or a focal length of about the image's width")
}

/// Rays through an even raster of an image's points, from corner to corner.
fn raster(camera: &Camera) -> impl Iterator<Item = Look> {
    let size = vec2(camera.width() as f32, camera.height() as f32);
    (0..=RAYS * (RAYS + 2))
        .map(|n| vec2((n % (RAYS + 1)) as f32, (n / (RAYS + 1)) as f32))
        .map(move |at| camera.ray(size * at / RAYS as f32, [0.5; 2]))
}

/// Share of an image's ground that lies beyond an area, and how far from `below` the farthest of it is, metres; by places all over the image.
fn beyond(places: impl Iterator<Item = Vec2>, area: Rect, below: Vec2) -> (f32, f32) {
    let area = area.grown(1e-3);
    let (mut ground, mut bare, mut farthest) = (0.0_f32, 0.0_f32, 0.0_f32);
    for at in places {
        ground += 1.0;
        if !area.contains(at) {
            bare += 1.0;
            farthest = farthest.max(at.distance(below));
        }
    }
    (bare / ground.max(1.0), farthest)
}
