//! Clods: soil aggregates as separate bodies.
//!
//! Clods are placed on the [`Pile`], largest first, so that small ones roll into the gaps between large ones or rest on
//! them, as on a seedbed. Some lie on top and some are mostly buried. Triangles that face down into
//! the ground, about half of them, are left out because no ray can reach them.

use super::body::{self, LEVELS, Placed, Pose, Shape, ShapeParameters};
use super::crumb::{LOOSE_GAIN, Local, loose_gain, sink};
use super::pigments::{Pigments, quantile, rank};
use super::{Canopy, Ground, InView, MOISTURE_LEVELS, Pile, Rect};
use furrow_base::geometry::{Cost, Mesh};
use furrow_base::math::{RoundTo, Spectrum, ToFloat, ToInt, Vec2, Vec3, vec2, vec3};
use furrow_base::sampling::{Purpose, Stream};

/// Shape parameters of broken aggregates.
pub(super) const CUT: ShapeParameters =
    ShapeParameters { planes: (7, 12), distance: (0.5, 0.86), sharpness: (16.0, 60.0), lumps: 0.26, rough: 0.3 };

/// Number of different shapes; each clod rotates and stretches one of them.
const SHAPES: usize = 24;

/// Number of brightness groups.
const TONES: usize = 7;

/// Number of hues of the material of one ground's clods.
const HUES: usize = 6;

/// Ratio of the middle and the short axis to the long one. Source: Aubertot et al. 1999.
const AXES: (f32, f32) = (0.77, 0.55);

/// Fractions of the dry clods that have kept at least one third and at least two thirds of the moisture that others have
/// lost.
const HALF_DRY: [f32; 2] = [0.22, 0.06];
/// Relative heights below which a clod is one level moister, and the length above which a clod has such a base and is
/// joined to the ground, mm.
const MOIST_BELOW: [f32; 2] = [0.05, 0.14];
const GRADED_MM: f32 = 5.0;
/// Excess of fine aggregates on the ground, as [`Ground::fines`]. Above the first, a base is at most one level moister;
/// above the second it is as dry as the clod.
const DRY_FINES: [f32; MOIST_BELOW.len()] = [0.0, 0.25];
/// Buried fraction of the height above which a clod is one level moister.
const MOIST_SUNK: f32 = 0.6;
/// Height of the soil washed against a welded clod, relative to half of its own, and its widening at the ground.
const FILLET: f32 = 0.6;
const FLARE: f32 = 0.2;

/// Length of the clods of which 37 % are gone from a fully slaked surface, mm: e^(−L / 7 mm).
const SLAKED_MM: f32 = 7.0;
/// Fractions of the roughness below which a pressed clod is one and two levels moister.
const PRESSED_LEFT: [f32; 2] = [0.5, 0.2];
/// Buried fraction of the height of a clod that is pressed flat, and fraction of the way to it by soil that rain has washed in.
const FLUSH: f32 = 0.88;
const SILTED: f32 = 0.4;

/// Growth of the buried fraction, relative to its distance from [`FLUSH`], if fine earth fills all joints and pores.
const FILLED_SINK: f32 = 0.35;
/// Height of that earth against a clod, relative to the clod's visible height.
const HEAPED: f32 = 0.6;
/// Horizontal over vertical extent of the earth's slope: the cotangent of its angle of repose, 35°.
const REPOSE: f32 = 1.4;
/// Fraction of the bodies' roughness that the earth removes.
const SMOOTHED: f32 = 0.4;

/// Grid spacing for which the levels of detail are designed, metres: about four pixels of 0.25 mm.
const FINE_M: f32 = 0.0009;
/// Shortest clod of each level of detail on a grid of [`FINE_M`], mm; on a coarser grid, for larger pixels,
/// proportionally longer.
const FROM_MM: [f32; LEVELS] = [0.0, 3.6, 6.5, 13.0, 28.0];

/// Clearance between a clod and the leaf above it, metres. A clod that would then protrude by less than this is left
/// out.
const UNDER_LEAF_M: f32 = 0.0008;

/// Fraction of the small clods falling on a larger one that stay there; the others are shaken off.
const STAY: f32 = 0.05;

/// Number of length bins in [`cost`].
const BINS: i32 = 24;

/// Fraction of a clod's triangles that do not face down into the ground.
const VISIBLE: f64 = 0.6;

/// Memory in bytes and time in core seconds for each candidate clod.
const BYTES_EACH: f64 = 24.0;
const SECONDS_EACH: f64 = 1e-6;

/// Returns the level of detail of a clod; `scale` is the ratio of [`FINE_M`] to the grid's spacing.
fn level(mm: f32, scale: f32) -> usize {
    FROM_MM.iter().rposition(|from| mm * scale >= *from).unwrap_or(0)
}

/// Clod before it is placed.
struct Candidate {
    at: Vec2,
    mm: f32,
    key: u32,
}

/// Group of clods with the same appearance.
#[derive(Clone, Debug, PartialEq)]
pub struct Clods {
    /// Factor on the reflectance of the ground's material.
    pub tint: Spectrum,
    /// Level of their moisture: 0 for dry clods, the last of [`MOISTURE_LEVELS`] for those as moist as the ground.
    pub moisture: usize,
    /// Mesh of the bodies, with texture coordinates of [`Ground::fabrics`].
    pub mesh: Mesh,
}

/// Builds the visible clods of a ground, in groups of similar brightness, hue and moisture.
///
/// No clod pierces the `canopy`. Clods out of view are placed too, because others rest on them. About 1.2 million
/// triangles and 0.5 core seconds for a third of a square metre with clods from 2.5 mm.
pub fn clods(ground: &Ground, pile: &mut Pile, canopy: &Canopy, seen: &InView) -> Vec<Clods> {
    let stream = ground.stream.child(Purpose::Debris, 101);
    let own = stream.child(Purpose::Page, 0);
    let scale = (FINE_M / ground.step()).min(1.0);
    let filled = ground.law.filled;
    let cut = ShapeParameters { rough: CUT.rough * (1.0 - SMOOTHED * filled), ..CUT };
    let mut shapes: Vec<Vec<Option<Shape>>> = vec![vec![None; SHAPES]; LEVELS];
    let mut groups: Vec<Mesh> = vec![Mesh::default(); MOISTURE_LEVELS * HUES * TONES];
    for clod in candidates(ground, &stream) {
        if pile.given_up() {
            break;
        }
        let mut s = own.child(Purpose::Debris, u64::from(clod.key));
        let level = level(clod.mm, scale);
        let k = s.index(SHAPES);
        let shape = shapes[level][k]
            .get_or_insert_with(|| Shape::new(level, cut, &mut stream.child(Purpose::Texture, k.to_u64())));
        let half = 0.5e-3 * clod.mm;
        let mut vary = |mean: f32| (mean * (1.0 + 0.2 * s.normal().to_f32())).clamp(0.5 * mean, 1.0);
        let axes = vec3(1.0, vary(AXES.0), vary(AXES.1)) * half;
        let pose = Pose::lying(shape, axes, 0.3, &mut s);
        let sink = sink(s.uniform32());
        if s.child(Purpose::Page, 0).uniform32() < ground.slaked * (-clod.mm / SLAKED_MM).exp() {
            continue;
        }
        let tint = ground.law.tint_sigma * s.normal().to_f32() + loose_gain(sink);
        let sink = flush(sink * (1.0 - ground.law.loose), ground.slaked, ground.shape.left(clod.at));
        let sunk = usize::from(sink > MOIST_SUNK) + pressed(ground.shape.left(clod.at));
        let sink = sink + FILLED_SINK * filled * (FLUSH - sink).max(0.0);
        let stays = s.uniform32();
        let damp = s.uniform32() < ground.law.damp;
        let from = vec2(s.uniform32(), s.uniform32());
        let iron = ground.pigments.clod(clod.at, s.normal().to_f32());
        let hue = (rank(iron) * HUES.to_f32()).trunc_to::<usize>().min(HUES - 1);
        let moisture = if damp { MOISTURE_LEVELS - 1 } else { (sunk + kept(s.uniform32())).min(MOISTURE_LEVELS - 2) };

        let radius = 0.5 * (axes.x + axes.y);
        let at = if clod.mm < 15.0 { pile.settle(clod.at, radius, 0.75) } else { Some(clod.at) };
        let Some(at) = at.filter(|at| pile.area().contains(*at)) else { continue };
        let (support, _) = pile.support(at, radius);
        let height = pose.high - pose.low;
        if stays > STAY && support - ground.height(at.x, at.y) > 0.6 * height {
            continue;
        }
        let free = canopy.over(at, axes.x.max(axes.y)) - UNDER_LEAF_M - support;
        if free < UNDER_LEAF_M {
            continue;
        }
        // Leaves push down the clods below them.
        let centre = at.extend(support - (sink * height).max(height - free) - pose.low);
        if seen.holds(at, half) {
            let mut body = Placed::new(shape, &pose, centre);
            let graded = clod.mm > GRADED_MM;
            let (slack, top) = (0.06 * height, centre.z + pose.high - support);
            if graded || filled > 0.0 {
                let welded = if graded { 1.0 - ground.law.loose } else { 0.0 };
                let joint = Joint { welded, heap: HEAPED * filled * top.max(0.0) };
                joint.make(&mut body, centre, (pose.low, pose.high), |p| pile.at(p));
            }
            let hidden = |corners: [Vec3; 3], up: f32| {
                if up < 0.0 {
                    corners.iter().all(|c| c.z < pile.at(c.truncate()) + slack)
                } else {
                    corners.iter().all(|c| c.z < ground.height(c.x, c.y) - 3e-4)
                }
            };
            // The base is as moist as the ground around it.
            let fines = ground.fines(at);
            let bases = DRY_FINES.iter().filter(|dry| graded && fines < **dry).count();
            let moister = |corners: [Vec3; 3]| {
                let relative = (corners.iter().map(|c| c.z).sum::<f32>() / 3.0 - support) / top;
                let steps = MOIST_BELOW.iter().filter(|below| relative < **below).count();
                (moisture + steps.min(bases)).min(MOISTURE_LEVELS - 1)
            };
            for level in moisture..MOISTURE_LEVELS.min(moisture + bases + 1) {
                body.emit(
                    &mut groups[(level * HUES + hue) * TONES + tone(tint, ground.law.tint_sigma)],
                    shape,
                    |corners, up| (!graded || moister(corners) == level) && !hidden(corners, up),
                    |_, p| Ground::fabric_uv(from, p - at.extend(0.0)),
                );
            }
        }
        pile.heap(at, pose.turn, 0.92 * axes.x, 0.92 * axes.y, support, centre.z + 0.95 * pose.high);
    }
    let hues = hues(ground.law.hue_sigma, &ground.pigments, &mut stream.child(Purpose::Page, 1));
    let brightness = |g: usize| tone_tint(g % TONES, ground.law.tint_sigma);
    (groups.into_iter().enumerate().filter(|(_, mesh)| !mesh.triangles.is_empty()))
        .map(|(g, mesh)| Clods { tint: hues[g / TONES % HUES] * brightness(g), moisture: g / (HUES * TONES), mesh })
        .collect()
}

/// Returns the buried fraction of a clod's height after rain and under tools and wheels, which have left a fraction `left`
/// of the roughness: washed-in soil covers more of it, and pressed clods are level with the ground.
fn flush(sink: f32, slaked: f32, left: f32) -> f32 {
    let washed = sink + SILTED * slaked * (FLUSH - sink).max(0.0);
    washed + (1.0 - left) * (FLUSH - washed).max(0.0)
}

/// Returns the number of levels of moisture that a clod gains where tools and wheels have pressed it into the moist ground and left
/// a fraction `left` of the roughness.
fn pressed(left: f32) -> usize {
    PRESSED_LEFT.iter().filter(|most| left < **most).count()
}

/// Returns the level of moisture of a dry clod, from u in 0..1.
fn kept(u: f32) -> usize {
    HALF_DRY.iter().filter(|share| u < **share).count()
}

/// Draws factors on the reflectance in R, G, B; near infrared has no hue.
///
/// Most material has one hue and a small part is much greener or yellower: green over red and blue over green are at
/// the midpoints of equal parts of an exponential distribution. They are ordered by iron, the most reddish last, and in
/// random order by humus and by blue.
fn hues(sigma: f32, pigments: &Pigments, stream: &mut Stream) -> [Spectrum; HUES] {
    let part = |k: usize| (k.to_f32() + 0.5) / HUES.to_f32();
    let beyond_mean = |k: usize| -(1.0 - part(k)).ln() - 1.0;
    let [blues, humus] = std::array::from_fn(|_| {
        let mut order: [usize; HUES] = std::array::from_fn(|k| k);
        for k in (1..HUES).rev() {
            order.swap(k, stream.index(k + 1));
        }
        order
    });
    std::array::from_fn(|k| {
        let (green, blue) = (sigma * beyond_mean(HUES - 1 - k), -sigma * beyond_mean(blues[k]));
        let hue = Spectrum::new((-0.5 * green).exp(), (0.5 * green).exp(), (0.5 * green + blue).exp(), 1.0);
        hue * pigments.aggregate(quantile(part(k)), quantile(part(humus[k])))
    })
}

/// Joint of a body with the surface below it.
#[derive(Clone, Copy, Debug)]
struct Joint {
    /// Strength of the welding: 0 for loose bodies, 1 for welded ones.
    welded: f32,
    /// Height of the fine earth that lies against the body, metres.
    heap: f32,
}

impl Joint {
    /// Joins a body to the surface below it. Between its equator and the surface a welded body does not taper but widens
    /// towards the surface, as where rain has washed soil against it. Up to [`Self::heap`] above the surface it widens
    /// further, at the angle of repose of the fine earth. `reach` is its lowest and highest point relative to `centre`,
    /// `height` the height of the surface.
    fn make(self, body: &mut Placed, centre: Vec3, reach: (f32, f32), height: impl Fn(Vec2) -> f32) {
        let (equator, half) = (centre.z + 0.5 * (reach.0 + reach.1), 0.5 * (reach.1 - reach.0));
        body.raised = Vec::with_capacity(body.positions.len());
        for p in &mut body.positions {
            let above = p.z - height(p.truncate());
            let near = 1.0 - (above / (FILLET * half)).clamp(0.0, 1.0);
            // Profile of an ellipsoid below its equator.
            let below = ((equator - p.z) / half).clamp(0.0, 0.85);
            let upright = 1.0 / (1.0 - below * below).sqrt();
            let wider = 1.0 + self.welded * (upright * (1.0 + FLARE * near * near) - 1.0);
            let aside = (*p - centre).truncate();
            let buried = (self.heap - above).clamp(0.0, self.heap);
            *p = centre + (aside * wider + aside.normalize_or_zero() * (REPOSE * buried)).extend(p.z - centre.z);
            let slope = if self.heap > 0.0 { REPOSE * (buried / self.heap).sqrt() } else { 0.0 };
            body.raised.push((self.welded * near * near).max(slope));
        }
    }
}

/// Estimates the cost of the clods of a ground. `places` are samples of the local size distribution, `mm` the range of
/// lengths, `step` the grid's spacing; a fraction `made` of `area` is in view and gets meshes.
pub(super) fn cost(places: &[Local], mm: (f32, f32), step: f32, (area, made): (Rect, f64)) -> Cost {
    let scale = (FINE_M / step).min(1.0);
    let share = f64::from(area.area()) / places.len().max(1).to_f64();
    let ratio = (mm.1 / mm.0).powf(1.0 / BINS.to_f32());
    // Largest first, as they are placed: clods that fall on another are shaken off, so fewer stay as more is covered.
    places
        .iter()
        .map(|law| {
            let (mut covered, mut cost) = (0.0_f64, Cost::default());
            for bin in (0..BINS).rev() {
                let (lo, hi) = (mm.0 * ratio.powi(bin), mm.0 * ratio.powi(bin + 1));
                let (number, middle) = (f64::from(law.number(lo, hi)), (lo * hi).sqrt());
                let free = (-covered).exp();
                let stay = free + f64::from(STAY) * (1.0 - free);
                let each = Cost::of(VISIBLE * body::triangles(level(middle, scale)).to_f64(), 0.0);
                cost = cost + each * (number * stay * made);
                cost = cost + Cost::work(number * BYTES_EACH, number * SECONDS_EACH);
                covered +=
                    number * f64::from(AXES.0) * std::f64::consts::FRAC_PI_4 * (f64::from(middle) * 1e-3).powi(2);
            }
            cost * share
        })
        .sum()
}

/// Returns all candidate clods, largest first.
fn candidates(ground: &Ground, stream: &Stream) -> Vec<Candidate> {
    let mut all = Vec::new();
    ground.law.scatter(
        ground.area(),
        ground.sizes.clods,
        stream,
        |p| ground.share(p),
        |at, mm, s| {
            let key = s.seed32();
            if mm > 0.0 {
                all.push(Candidate { at, mm, key });
            }
        },
    );
    all.sort_by(|a, b| b.mm.total_cmp(&a.mm).then(a.key.cmp(&b.key)));
    all
}

/// Returns the brightness group of a logarithm of relative brightness: even steps over ±2.2 standard deviations.
fn tone(tint: f32, sigma: f32) -> usize {
    let reach = 2.2 * (sigma * sigma + LOOSE_GAIN * LOOSE_GAIN * 0.25).sqrt();
    let t = (tint / reach.max(1e-6)).clamp(-1.0, 1.0) * 0.5 + 0.5;
    (t * TONES.to_f32()).trunc_to::<usize>().min(TONES - 1)
}

fn tone_tint(tone: usize, sigma: f32) -> f32 {
    let reach = 2.2 * (sigma * sigma + LOOSE_GAIN * LOOSE_GAIN * 0.25).sqrt();
    (((tone.to_f32() + 0.5) / TONES.to_f32() * 2.0 - 1.0) * reach).exp()
}
