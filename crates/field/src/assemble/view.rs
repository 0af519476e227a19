//! Computes the ground that cameras see, and the part of it that is planted.
//!
//! A camera that looks down sees a bounded area. It is planted up to the scene file's `reach_m` from the point below the camera. A
//! camera that sees the horizon, or ground farther away, gets bare ground there, with pixels labelled soil. The field then has a
//! warning with the bare share of the ground in view. If that share is more than half, the scene is refused.

use super::detail::MeshDetail;
use super::drawn::Drawn;
use super::extent::{FARTHEST, LONGEST_REACH};
use super::footprint::{Footprint, HORIZON};
use super::ground_view::{GroundView, Viewpoint, meets};
use super::terrain::{Near, Seen, ViewLimits, ViewRay};
use crate::desc::Detail;
use crate::drive::{Capture, FIRST};
use furrow_base::math::{RoundTo, ToFloat, Vec2, vec2};
use furrow_base::ron_file::Step;
use furrow_base::{Error, Result};
use furrow_grow::soil::Rect;
use furrow_optics::sensor::Camera;

/// Number of intervals per side of the raster of rays that estimates the share of bare ground.
const RAYS: usize = 24;
/// Share of bare ground above which a scene is refused.
const TOO_BARE: f32 = 0.5;
/// With `detail: ByPixel`, the ground has uniform cells up to this multiple of the distance to the nearest ground in the image; farther
/// away, cells grow. Pixels there cover 4.5 times the length on the ground, and clods of some centimetres are a few pixels long.
const NEAR: f32 = 4.5;
/// With `detail: ByPixel`, the width of the planted margin around the view, metres: the shadow length of a plant of 0.5 m, plus
/// [`PLANT_MARGIN`](super::extent::PLANT_MARGIN).
const SIDEWAYS: f32 = 1.75;

/// Ground that the images or scans of a field see.
pub(super) struct VisibleGround {
    /// All of it.
    pub(super) view: View,
    /// Its outline in each image or scan; empty for a scene of single plants and models.
    pub(super) each: Vec<GroundView>,
}

impl VisibleGround {
    /// Returns the area that plants or their shadows must reach to be part of the scene; `None` if all are.
    pub(super) fn shown(&self, drawn: &Drawn<'_>) -> Option<Rect> {
        drawn.desc.has_ground().then_some(self.view.area)
    }
}

/// The extent of ground that cameras see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    /// Planted area: what is seen of the plane z = 0, extended where the ground is lower or higher.
    pub(super) area: Rect,
    /// Part of the area with uniform ground cells, clods and debris. All of it, unless detail is by pixel and much of the area is far away.
    pub(super) near: Rect,
    /// Whether a camera sees ground beyond the area, or the horizon.
    pub(super) open: bool,
}

impl View {
    /// View of a scene without ground, crops and weeds.
    pub(super) const NONE: Self = Self::even(Rect::new(-0.5, -0.5, 0.5, 0.5), false);

    /// Creates a view with uniform ground cells.
    const fn even(area: Rect, open: bool) -> Self {
        Self { area, near: area, open }
    }

    /// Returns `true` if the cells of the ground grow with the distance.
    pub(super) fn is_graded(&self) -> bool {
        self.near != self.area
    }

    /// Returns a view whose rectangles enclose those of both views.
    pub(super) fn join(self, other: Self) -> Self {
        let (area, near) = (around(self.area, other.area), around(self.near, other.near));
        Self { area, near, open: self.open || other.open }
    }
}

/// Returns the smallest rectangle that encloses both.
fn around(a: Rect, b: Rect) -> Rect {
    let ([lo, hi], [c, d]) = (a.corners(), b.corners());
    let (lo, hi) = (lo.min(c), hi.max(d));
    Rect::new(lo.x, lo.y, hi.x, hi.y)
}

/// Returns the ground that all images see together. Adds a warning if some of it is not planted.
pub(super) fn by_cameras(drawn: &Drawn<'_>, warnings: &mut Vec<String>) -> Result<VisibleGround> {
    let mut whole: Option<View> = None;
    let mut each = Vec::new();
    for capture in &drawn.captures {
        let view = view_of(drawn, capture, whole.is_some_and(|before| before.open), &mut each, warnings)?;
        whole = Some(whole.map_or(view, |before| before.join(view)));
    }
    let whole = whole.unwrap_or(View::NONE);
    let area = whole.area.area();
    // Area of the square that a camera sees if it sees up to the reach on all sides.
    let most = 4.0 * reach(drawn)?.powi(2);
    // The area of a single camera is already bounded by the reach and by the distance travelled during the exposure.
    if drawn.captures.len() > 1 && area > most {
        let words = format!(
            "the drive sees {} m² of ground, more than the {} m² of one field",
            above(area, most),
            three_digits(most)
        );
        let help =
            "use fewer frames, drive along a row to the north or east, drive through several fields, or raise reach_m";
        return Err(drawn.page.blame(&[Step::Field("drive")], Error::input(words).help(help)));
    }
    Ok(VisibleGround { view: whole, each })
}

/// Writes a positive number with three significant digits, or all digits before the point.
pub(super) fn three_digits(value: f32) -> String {
    let whole = f64::from(value).log10().floor().clamp(-6.0, 2.0);
    format!("{value:.0$}", (2.0 - whole).trunc_to::<usize>())
}

/// Writes `value` with three significant digits, or with more if it would read as `less`, which is smaller.
pub(super) fn above(value: f32, less: f32) -> String {
    let short = three_digits(value);
    if short == three_digits(less) { value.to_string() } else { short }
}

/// Returns the distinct camera poses of a drive; the ground is then built only near their views. Returns an empty list if all of the
/// ground is to be built: for single images, for scans, and if a camera sees ground beyond the planted area.
pub(super) fn viewpoints(drawn: &Drawn<'_>, view: View) -> Vec<Viewpoint> {
    let drives = drawn.captures.last().is_some_and(|last| last.frame > 0);
    if !drives || view.open || !drawn.scanners.is_empty() {
        return Vec::new();
    }
    let mut captures: Vec<&Capture> = drawn.captures.iter().collect();
    captures.sort_by(|a, b| a.name.cmp(&b.name));
    let all: Option<Vec<Viewpoint>> = captures.iter().map(|capture| Viewpoint::of(&capture.camera)).collect();
    let mut all = all.unwrap_or_default();
    all.dedup_by(|next, kept| next.like(kept));
    all
}

/// Returns the name of a capture for error messages: its camera and, on a drive, its frame.
fn which(drawn: &Drawn<'_>, capture: &Capture) -> String {
    let Capture { name, frame, .. } = capture;
    let camera = if name == FIRST { "the camera".into() } else { format!("camera `{name}`") };
    if drawn.desc.drive.is_some() { format!("{camera} in frame {frame}") } else { camera }
}

/// Points an error about a capture into the scene file: at `drive` if the vehicle has moved, otherwise at the camera.
fn blame_capture(drawn: &Drawn<'_>, capture: &Capture, error: Error) -> Error {
    let place = drawn.desc.cameras.iter().position(|mounted| mounted.name == capture.name);
    match place {
        _ if capture.frame > 0 => drawn.page.blame(&[Step::Field("drive")], error),
        Some(k) => drawn.page.blame(&[Step::Field("cameras"), Step::Item(k)], error),
        None => drawn.page.blame(&[Step::Field("camera")], error),
    }
}

/// Returns `reach_m`, the planted distance from the point below a camera, metres.
pub(super) fn reach(drawn: &Drawn<'_>) -> Result<f32> {
    let reach = drawn.desc.reach_m.f32();
    if reach > LONGEST_REACH {
        let error = Error::input(format!("reach_m is {reach}, more than {LONGEST_REACH}")).help("lower it");
        return Err(drawn.page.blame(&[Step::Field("reach_m")], error));
    }
    Ok(reach)
}

/// Returns the ground that one camera sees, and adds its outline to `each`. Adds a warning if some of it is not planted, unless `already_warned` is `true`:
/// an earlier capture has added it.
fn view_of(
    drawn: &Drawn<'_>,
    capture: &Capture,
    already_warned: bool,
    each: &mut Vec<GroundView>,
    warnings: &mut Vec<String>,
) -> Result<View> {
    let (camera, reach) = (&capture.camera, reach(drawn)?);
    let below = camera.pose().position.truncate();
    if camera.pose().position.abs().max_element() > FARTHEST {
        let words = format!("{} is more than {FARTHEST} m from the field's origin", which(drawn, capture));
        let error = Error::input(words)
            .help("move it near the origin: the field is unbounded and alike everywhere; heights are in metres");
        return Err(blame_capture(drawn, capture, error));
    }
    let Footprint { seen, level, view_rays, whole, planted: [lo, hi] } = Footprint::of(camera, reach);
    if seen.is_empty() {
        return Err(blame_capture(drawn, capture, blind(&which(drawn, capture), camera)));
    }
    // Rays are those of the middle of each row's exposure, so widen the area by the distance travelled.
    let area = Rect::new(lo.x, lo.y, hi.x, hi.y).grown(camera.travel());
    let near = nearest(drawn, raster(camera), area);
    let far = ViewLimits { field_m: reach, ray_m: f32::INFINITY, travel_m: camera.travel() };
    let Seen { area, near, met, beyond: farther, terrain } = Seen::of(drawn.envelope(), area, near, &view_rays, &far);
    // Include the point below the camera: tall plants in front of the nearest visible ground may be in the image.
    let points = seen.iter().chain(&level).chain(&met).copied();
    each.push(GroundView::around(points.chain([below])));
    // The horizon is built if a camera looks above it.
    let open = drawn.desc.horizon.is_some() && !level.is_empty();
    if level.is_empty() && [lo, hi] == whole && !farther {
        return Ok(View { area, near, open });
    }
    let (bare, farthest) = beyond(raster(camera).filter_map(|look| terrain.meets(look, 0.0)), area, below);
    if bare <= 0.0 {
        return Ok(View { area, near, open });
    }
    let far = if level.is_empty() { format!("{farthest:.0} m away") } else { "to the horizon".into() };
    let words = format!(
        "{} sees ground {far}, but plants grow only up to {reach} m east, north, west and south of the point below it: \
         {:.0} % of the ground in the image stays bare and is labelled soil",
        which(drawn, capture),
        (100.0 * bare).ceil()
    );
    let help = "lower the camera, turn it down, narrow its angle of view, or raise reach_m";
    if drawn.desc.detail == Detail::Full && !already_warned {
        warnings.push(format!(
            "{} sees ground {far}, and detail is Full: all of it is built as fine as the nearest; detail: ByPixel builds each place \
             only as fine as its pixels, in a fraction of the time and memory",
            which(drawn, capture)
        ));
    }
    if bare > TOO_BARE {
        return Err(blame_capture(drawn, capture, Error::input(words).help(help)));
    }
    if !already_warned {
        warnings.push(format!("{words}; {help}"));
    }
    Ok(View { area, near, open: true })
}

/// Returns the part of the ground in view that gets uniform cells; `None` if all of it does.
pub(super) fn nearest(drawn: &Drawn<'_>, rays: impl Iterator<Item = ViewRay>, area: Rect) -> Option<Near> {
    if drawn.detail == MeshDetail::Full {
        return None;
    }
    let seen: Vec<(Vec2, f32, ViewRay)> = rays
        .filter_map(|look @ (origin, direction)| Some((meets(origin, direction)?, origin.z / -direction.z, look)))
        .filter(|(at, ..)| area.contains(*at))
        .collect();
    let ray_m = NEAR * seen.iter().map(|(_, distance, _)| *distance).fold(f32::INFINITY, f32::min);
    let (near, far): (Vec<_>, Vec<_>) = seen.into_iter().partition(|(_, distance, _)| *distance <= ray_m);
    if far.is_empty() {
        return None;
    }
    let (lo, hi) = near.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(l, h), (p, ..)| (l.min(*p), h.max(*p)));
    let view_rays = near.into_iter().map(|(_, _, look)| look).collect();
    Some(Near { area: Rect::new(lo.x, lo.y, hi.x, hi.y), view_rays, ray_m })
}

/// Returns `true` if a plant at `at` may be visible or cast a shadow into the view. Always `true` with `detail: Full`, where only
/// the rectangle around the view limits the plants.
pub(super) fn may_be_seen(drawn: &Drawn<'_>, sight: &VisibleGround, at: Vec2) -> bool {
    drawn.detail == MeshDetail::Full
        || sight.each.is_empty()
        || sight.each.iter().any(|view| view.distance(at) <= SIDEWAYS)
}

/// Returns the error about a camera (named `which`) if no edge of its image meets the ground, because of its pose or its lens.
fn blind(which: &str, camera: &Camera) -> Error {
    let pose = camera.pose();
    if pose.axes.z_axis.z >= -HORIZON || pose.position.z <= 0.0 {
        return Error::input(format!("{which} does not look at the ground"))
            .help("point it downwards; its height is measured from the ground");
    }
    let [_, _, cx, cy] = camera.intrinsics();
    let (width, height) = (f64::from(camera.width()), f64::from(camera.height()));
    if !((0.0..=width).contains(&cx) && (0.0..=height).contains(&cy)) {
        // Convert to pixels at the size given in the scene file.
        let [width, height, cx, cy] = [width, height, cx, cy].map(|pixels| pixels / f64::from(camera.scale()));
        let words = format!(
            "{which} points at the ground, but its image shows none: the principal point, cx {cx:.0} and cy {cy:.0}, is outside its \
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
        "{which} points at the ground, but all edges of its image are near the horizon: its angle of view is {:.1}° by {:.1}°",
        angle(0, [0.0, 0.5 * height], [width, 0.5 * height]),
        angle(1, [0.5 * width, 0.0], [0.5 * width, height])
    );
    Error::input(words).help("narrow it: write horizontal_deg: 60, or a focal length of about the image's width")
}

/// Returns rays through a uniform raster of image points, from corner to corner.
fn raster(camera: &Camera) -> impl Iterator<Item = ViewRay> {
    let size = vec2(camera.width().to_f32(), camera.height().to_f32());
    (0..=RAYS * (RAYS + 2))
        .map(|n| vec2((n % (RAYS + 1)).to_f32(), (n / (RAYS + 1)).to_f32()))
        .map(move |at| camera.ray(size * at / RAYS.to_f32(), [0.5; 2]))
}

/// Returns the share of the ground points `places` that are outside `area`, and the distance of the farthest of them from `below`, metres.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: "0 m², more than the 0.36 m²" is a contradiction. Expected: both numbers with three significant digits, and
    /// the larger one never reads as the smaller.
    #[test]
    fn areas_are_written_so_that_they_differ() {
        for (value, words) in [(0.36, "0.360"), (0.0071, "0.00710"), (4.0, "4.00"), (25.55, "25.5"), (1600.2, "1600")] {
            assert_eq!(three_digits(value), words);
        }
        assert_eq!(above(0.42, 0.36), "0.420");
        assert_eq!(above(0.360_02, 0.36), "0.36002");
    }
}
