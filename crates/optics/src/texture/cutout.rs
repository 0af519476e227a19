//! Extraction of a leaf from a photograph on paper or soil, in any orientation.
//!
//! Green is separated from the background by the excess green of chromaticities, 2g − r − b (Woebbecke et al. 1995),
//! with the threshold of Otsu 1979. The largest connected component is the leaf. The image is rotated so that the leaf is
//! upright, with its base at the bottom and its foot in the middle column, as species files expect. The petiole shows
//! where the base is. Without one, the narrower end is the base, on the long axis from the second moments, or on the
//! axis of symmetry if the leaf is about as wide as long.

use super::draw::GeneratedTexture;
use super::grid::{flood, middle};
use super::petiole::{self, Petiole};
use super::srgb::{ColorSpace, decode};
use furrow_base::error::{Error, Result};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, vec2};

/// Smallest fraction of the photograph that is accepted as a leaf.
const LEAST: f64 = 0.002;
/// Fraction of the leaf's length at each end whose pixel counts distinguish the petiole from the tip.
const END: f32 = 0.12;
/// Ratio of the standard deviations along and across the long axis below which a leaf is about as wide as long.
const ROUND: f32 = 1.2;
/// Cosine of the angle between the long axis and the direction from the petiole to the blade's centre above which they
/// are the same axis.
const ALONG: f32 = 0.87;
/// Padding around the leaf, relative to its length.
const ROOM: f32 = 0.02;

/// Options for extracting a leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CutoutOptions {
    /// Whether the base is at the other end than the one found.
    pub flip: bool,
    /// Whether the petiole is kept. A species file generates its own petiole, so its textures show the blade alone.
    pub stalk: bool,
    /// Whether holes are kept. Photographs of glossy leaves have false holes at specular reflections.
    pub holes: bool,
    /// Height of the result in pixels; by default the leaf's height in the photograph.
    pub height: Option<u32>,
    /// Rectangle (x, y, width, height in pixels) of a grey or white reference in the photograph, and its reflectance, 0
    /// to 1. If given, the resulting colours are reflectances.
    pub grey: Option<([u32; 4], f32)>,
}

/// A second component larger than this fraction of the first is reported as another leaf; a smaller one is a weed or a
/// reflection.
const ANOTHER: f64 = 0.15;
/// Fraction of a leaf's pixels on the photograph's border above which the leaf is reported as cut off.
const CUT: f64 = 0.002;

/// Returns warnings about a photograph, one sentence each, for problems that `cut_out` does not return as errors. `flip`
/// is that of [`CutoutOptions`].
pub fn doubts(width: u32, height: u32, rgb: &[[u8; 3]], flip: bool) -> Vec<String> {
    let (width, height) = (width.to_usize(), height.to_usize());
    let mut green = green(rgb);
    let first = largest(&green, width, height);
    let count = |piece: &[bool]| piece.iter().filter(|inside| **inside).count().to_f64();
    green.iter_mut().zip(&first).for_each(|(green, taken)| *green &= !taken);
    let mut all = Vec::new();
    if count(&largest(&green, width, height)) > ANOTHER * count(&first) {
        all.push("there is more than one leaf: only the largest is extracted; photograph one at a time".to_owned());
    }
    let border = |i: &usize| [0, width - 1].contains(&(i % width)) || [0, height - 1].contains(&(i / width));
    let beyond = (0..first.len()).filter(|i| first[*i] && border(i)).count().to_f64();
    if beyond > (CUT * count(&first)).max(4.0) {
        all.push(
            "the leaf reaches the photograph's border, so a part of it is missing: leave room around it".to_owned(),
        );
    }
    if !flip && petiole::find(rgb, &first, width, height).is_none() {
        all.push("no petiole is seen: the narrower end is taken as the base; if it is the tip, give --flip".to_owned());
    }
    all
}

/// Extracts the leaf of a photograph, upright and with opacity, in sRGB.
pub fn cut_out(width: u32, height: u32, rgb: &[[u8; 3]], cutting: &CutoutOptions) -> Result<GeneratedTexture> {
    let mut leaf = largest(&green(rgb), width.to_usize(), height.to_usize());
    let count = leaf.iter().filter(|in_it| **in_it).count();
    if count.to_f64() < LEAST * rgb.len().to_f64() {
        return Err(Error::input("no leaf was found: no green area stands out from the background")
            .help("photograph one leaf on white paper or on soil, filling at least a twentieth of the image"));
    }
    if !cutting.holes {
        fill(&mut leaf, width.to_usize(), height.to_usize());
    }
    let gain = gain(width, height, rgb, cutting)?;
    let petiole = petiole::find(rgb, &leaf, width.to_usize(), height.to_usize());
    for i in petiole.iter().flat_map(|petiole| &petiole.pixels) {
        leaf[*i] = false;
    }
    let up = upward(&leaf, width.to_usize(), petiole.as_ref(), cutting.flip);
    let mut foot = petiole.as_ref().map(|petiole| petiole.foot);
    if cutting.stalk {
        for i in petiole.iter().flat_map(|petiole| &petiole.pixels) {
            leaf[*i] = true;
        }
        foot = None;
    }
    let stance = LeafPose::of(&leaf, width.to_usize(), up, foot);
    let leaf = leaf;
    let there = |x: i64, y: i64| {
        (0..i64::from(width)).contains(&x)
            && (0..i64::from(height)).contains(&y)
            && leaf[(y * i64::from(width) + x).to_usize()]
    };
    let scale = cutting.height.map_or(1.0, |h| (h.to_f32() - 1.0) / ((1.0 + 2.0 * ROOM) * stance.length));
    let side = |length: f32| ((length * scale).ceil_to::<u32>() + 1).max(2);
    let (w, h) = (side(2.0 * stance.reach + 2.0 * ROOM * stance.length), side((1.0 + 2.0 * ROOM) * stance.length));
    if u64::from(w) * u64::from(h) > 1 << 26 {
        return Err(Error::misuse(format!("an image of {w} × {h} pixels is too large")).help("use a smaller --height"));
    }
    let mut rgba = Vec::with_capacity(4 * w.to_usize() * h.to_usize());
    for y in 0..h {
        for x in 0..w {
            let across = (x.to_f32() + 0.5 - 0.5 * w.to_f32()) / scale;
            let up = (h.to_f32() - (y.to_f32() + 0.5)) / scale - ROOM * stance.length;
            let at = stance.place(across, up);
            rgba.extend(sample(rgb, width, at, &there, gain));
        }
    }
    Ok(GeneratedTexture { width: w, height: h, rgba, opaque: false, relief: None })
}

/// Returns the bilinear colour and the opacity at a point of the photograph. Texels outside the leaf do not contribute,
/// so the background colour does not bleed in.
fn sample(rgb: &[[u8; 3]], width: u32, at: Vec2, there: &dyn Fn(i64, i64) -> bool, gain: [f32; 3]) -> [u8; 4] {
    let corner = (at - 0.5).floor();
    let part = at - 0.5 - corner;
    let (mut sum, mut weight) = ([0.0_f32; 3], 0.0_f32);
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let (x, y) = (corner.x.trunc_to::<i64>() + dx, corner.y.trunc_to::<i64>() + dy);
        let share = |d: i64, t: f32| if d == 1 { t } else { 1.0 - t };
        if there(x, y) {
            let own = share(dx, part.x) * share(dy, part.y);
            let texel = rgb[(y * i64::from(width) + x).to_usize()];
            for k in 0..3 {
                sum[k] += own * decode(f32::from(texel[k]) / 255.0);
            }
            weight += own;
        }
    }
    if weight <= 1e-4 {
        return [0; 4];
    }
    let color = |k: usize| ColorSpace::Srgb.encode((sum[k] / weight * gain[k]).min(1.0));
    [color(0), color(1), color(2), (weight.min(1.0) * 255.0 + 0.5).trunc_to::<u8>()]
}

/// Returns the factors on linear R, G, B that map the grey reference to its reflectance.
fn gain(width: u32, height: u32, rgb: &[[u8; 3]], cutting: &CutoutOptions) -> Result<[f32; 3]> {
    let Some(([x, y, w, h], reflectance)) = cutting.grey else { return Ok([1.0; 3]) };
    if w == 0 || h == 0 || x.saturating_add(w) > width || y.saturating_add(h) > height {
        return Err(Error::misuse(format!("the grey area is not inside the photograph of {width} × {height} pixels"))
            .help("write it as x,y,width,height in pixels"));
    }
    let mut sum = [0.0_f64; 3];
    for row in y..y + h {
        for column in x..x + w {
            let texel = rgb[(row * width + column).to_usize()];
            for k in 0..3 {
                sum[k] += f64::from(decode(f32::from(texel[k]) / 255.0));
            }
        }
    }
    let mean = sum.map(|s| (s / (f64::from(w) * f64::from(h))).to_f32());
    if mean.iter().any(|m| *m < 0.01) {
        return Err(Error::input("the grey area is black").help("choose an area of the paper or of a grey card"));
    }
    Ok(mean.map(|m| reflectance / m))
}

/// Classifies pixels as green, by Otsu's threshold on 2g − r − b.
fn green(rgb: &[[u8; 3]]) -> Vec<bool> {
    let excess: Vec<u8> = rgb
        .iter()
        .map(|p| {
            let [r, g, b] = p.map(f32::from);
            let sum = (r + g + b).max(24.0);
            (((2.0 * g - r - b) / sum + 1.0) / 3.0 * 255.0).trunc_to::<u8>()
        })
        .collect();
    let mut counts = [0_u64; 256];
    for v in &excess {
        counts[usize::from(*v)] += 1;
    }
    let threshold = otsu(&counts);
    // A pixel is never green if 2g − r − b is about zero or negative, whatever the threshold is.
    let grey = (255.0 / 3.0).trunc_to::<u8>() + 3;
    excess.into_iter().map(|v| v > threshold.max(grey)).collect()
}

/// Returns the value that splits a histogram into two classes with the largest between-class variance (Otsu 1979).
fn otsu(counts: &[u64; 256]) -> u8 {
    let total: f64 = counts.iter().map(|n| n.to_f64()).sum();
    let all: f64 = counts.iter().enumerate().map(|(v, n)| v.to_f64() * n.to_f64()).sum();
    let (mut below, mut sum, mut best, mut at) = (0.0, 0.0, -1.0, 0);
    for (v, n) in counts.iter().enumerate() {
        below += n.to_f64();
        sum += v.to_f64() * n.to_f64();
        let above = total - below;
        if below > 0.0 && above > 0.0 {
            let apart = sum / below - (all - sum) / above;
            let between = below * above * apart * apart;
            if between > best {
                (best, at) = (between, v.to_u8());
            }
        }
    }
    at
}

/// Returns the largest 4-connected component.
fn largest(of: &[bool], width: usize, height: usize) -> Vec<bool> {
    let mut piece = vec![0_u32; of.len()];
    let (mut number, mut most, mut best) = (0, 0, 0);
    for start in 0..of.len() {
        if !of[start] || piece[start] > 0 {
            continue;
        }
        number += 1;
        let count = flood(start, width, height, |i| {
            of[i] && piece[i] == 0 && {
                piece[i] = number;
                true
            }
        });
        if count > most {
            (most, best) = (count, number);
        }
    }
    piece.into_iter().map(|n| n == best && n > 0).collect()
}

/// Fills holes: everything not connected to the image border.
fn fill(leaf: &mut [bool], width: usize, height: usize) {
    let mut outside = vec![false; leaf.len()];
    let edge = (0..width).flat_map(|x| [x, (height - 1) * width + x]);
    let edge = edge.chain((0..height).flat_map(|y| [y * width, y * width + width - 1]));
    for start in edge {
        flood(start, width, height, |i| {
            !leaf[i] && !outside[i] && {
                outside[i] = true;
                true
            }
        });
    }
    leaf.iter_mut().zip(outside).for_each(|(in_it, out)| *in_it = !out);
}

/// Position and orientation of a leaf in its photograph, in pixels.
struct LeafPose {
    foot: Vec2,
    /// Unit vector from the foot to the tip.
    up: Vec2,
    length: f32,
    /// Largest distance of the leaf's pixels from the line through the foot along `up`.
    reach: f32,
}

/// Returns the unit vector from the base to the tip of a blade without its petiole.
fn upward(blade: &[bool], width: usize, petiole: Option<&Petiole>, flip: bool) -> Vec2 {
    let points = || blade.iter().enumerate().filter(|(_, in_it)| **in_it).map(|(i, _)| middle(i, width));
    let count = points().count().max(1).to_f64();
    let (sx, sy) = points().fold((0.0, 0.0), |(x, y), p| (x + f64::from(p.x), y + f64::from(p.y)));
    let centre = vec2((sx / count).to_f32(), (sy / count).to_f32());
    let (mut xx, mut xy, mut yy) = (0.0_f64, 0.0, 0.0);
    for p in points() {
        let d = p - centre;
        xx += f64::from(d.x * d.x);
        xy += f64::from(d.x * d.y);
        yy += f64::from(d.y * d.y);
    }
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let mut axis = vec2(angle.cos().to_f32(), angle.sin().to_f32());
    if let Some(petiole) = petiole {
        let ahead = (centre - petiole.foot).normalize_or(axis);
        let along = axis.dot(ahead);
        let up = if along.abs() > ALONG { axis * along.signum() } else { ahead };
        return if flip { -up } else { up };
    }
    let apart = (4.0 * xy * xy + (xx - yy) * (xx - yy)).sqrt();
    let ratio = ((xx + yy + apart) / (xx + yy - apart).max(1.0)).sqrt().to_f32();
    if ratio < ROUND {
        axis = symmetry(blade, width, centre);
    }
    let (lo, hi) = points().fold((f32::MAX, f32::MIN), |(lo, hi), p| {
        let t = (p - centre).dot(axis);
        (lo.min(t), hi.max(t))
    });
    let length = hi - lo + 1.0;
    let (low, high) = points().fold((0_u64, 0_u64), |(low, high), p| {
        let t = (p - centre).dot(axis);
        (low + u64::from(t < lo + END * length), high + u64::from(t > hi - END * length))
    });
    if (low <= high) == flip { -axis } else { axis }
}

/// Returns the direction through `centre` about which a leaf is most nearly its own mirror image.
fn symmetry(leaf: &[bool], width: usize, centre: Vec2) -> Vec2 {
    const POINTS: usize = 4000;
    const ANGLES: u32 = 90;
    let inside: Vec<usize> = (0..leaf.len()).filter(|i| leaf[*i]).collect();
    let some: Vec<Vec2> =
        inside.iter().step_by(inside.len() / POINTS + 1).map(|i| middle(*i, width) - centre).collect();
    let height = leaf.len() / width;
    let has = |p: Vec2| {
        p.x >= 0.0 && p.y >= 0.0 && p.x.trunc_to::<usize>() < width && p.y.trunc_to::<usize>() < height && {
            leaf[p.y.trunc_to::<usize>() * width + p.x.trunc_to::<usize>()]
        }
    };
    let direction = |k: u32| Vec2::from_angle(k.to_f32() * std::f32::consts::PI / ANGLES.to_f32());
    let alike = |k: &u32| {
        let axis = direction(*k);
        some.iter().filter(|d| has(centre + 2.0 * d.dot(axis) * axis - **d)).count()
    };
    direction((0..ANGLES).max_by_key(alike).unwrap_or(0))
}

impl LeafPose {
    /// Returns the stance of a leaf. `foot` is a point above or below the foot; by default it is the middle of the
    /// lowest slice.
    fn of(leaf: &[bool], width: usize, up: Vec2, foot: Option<Vec2>) -> Self {
        let points = || leaf.iter().enumerate().filter(|(_, in_it)| **in_it).map(|(i, _)| middle(i, width));
        let (end, top) = points().fold((f32::MAX, f32::MIN), |(lo, hi), p| (lo.min(p.dot(up)), hi.max(p.dot(up))));
        let length = top - end + 1.0;
        let aside = vec2(-up.y, up.x);
        let across = foot.map_or_else(
            || {
                let slice = points().filter(|p| p.dot(up) < end + (0.02 * length).max(1.5));
                let (sum, n) = slice.fold((0.0, 0_u32), |(sum, n), p| (sum + p.dot(aside), n + 1));
                sum / n.max(1).to_f32()
            },
            |foot| foot.dot(aside),
        );
        let foot = up * (end - 0.5) + aside * across;
        let reach = points().map(|p| (p - foot).dot(aside).abs()).fold(0.0, f32::max) + 1.0;
        Self { foot, up, length, reach }
    }

    /// Returns the point of the photograph at `across` to the right of the foot and `up` above it.
    fn place(&self, across: f32, up: f32) -> Vec2 {
        // The photograph's y axis points down, so the right-hand side of `up` is (−up.y, up.x).
        self.foot + vec2(-self.up.y, self.up.x) * across + self.up * up
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws a leaf with a petiole on paper, rotated by `turn`: half an ellipse in width at each height, with a petiole
    /// below.
    fn photograph(turn: f32) -> Vec<[u8; 3]> {
        let (sin, cos) = turn.sin_cos();
        (0..400 * 400)
            .map(|i| {
                let p = middle(i, 400) - 200.0;
                let (x, y) = (cos * p.x + sin * p.y, -sin * p.x + cos * p.y);
                let blade = (x / 45.0).powi(2) + ((y + 20.0) / 90.0).powi(2) < 1.0;
                let stalk = x.abs() < 4.0 && (60.0..130.0).contains(&y);
                // A notch on the right-hand side only.
                let notch = (x - 45.0).hypot(y + 20.0) < 15.0;
                if (blade || stalk) && !notch { [70, 120, 50] } else { [235, 232, 228] }
            })
            .collect()
    }

    /// Method: one leaf photographed at eight angles. Expected: the same image each time within a few pixels: upright,
    /// the foot in the middle of the lower edge, not mirrored.
    #[test]
    fn a_leaf_comes_out_upright_whichever_way_it_lies() {
        for k in 0..8 {
            let photo = photograph(k.to_f32() * 0.8);
            let leaf = cut_out(400, 400, &photo, &CutoutOptions { stalk: true, ..CutoutOptions::default() }).unwrap();
            let blade = cut_out(400, 400, &photo, &CutoutOptions::default()).unwrap();
            assert!((blade.height.to_f32() - 187.0).abs() < 8.0, "{k}: the petiole is removed: {}", blade.height);
            let (w, h) = (leaf.width.to_usize(), leaf.height.to_usize());
            assert!((h.to_f32() - 250.0).abs() < 8.0 && (w.to_f32() - 100.0).abs() < 8.0, "{k}: {w} × {h}");
            let opaque = |x: usize, y: usize| leaf.rgba[4 * (y * w + x) + 3] > 127;
            assert!(
                opaque(w / 2, h - 12) && !opaque(w / 2 - 12, h - 12),
                "{k}: the petiole is in the middle of the lower edge"
            );
            let (left, right) = (opaque(12, 95), opaque(w - 13, 95));
            assert!(left && !right, "{k}: the notch is on the right: {left} {right}");
        }
    }

    /// Expected: no warning for one leaf in the middle; a warning for a second leaf beside it, but not for a speck; a
    /// warning for a leaf cut by the border.
    #[test]
    fn unusable_photographs_are_warned_of() {
        let photo = photograph(0.0);
        assert_eq!(doubts(400, 400, &photo, false), Vec::<String>::new());
        let green = |size: usize| {
            let mut photo = photo.clone();
            for i in
                (0..400 * 400).filter(|i| (10..10 + size).contains(&(i % 400)) && (10..10 + size).contains(&(i / 400)))
            {
                photo[i] = [70, 120, 50];
            }
            doubts(400, 400, &photo, false)
        };
        assert_eq!(green(10), Vec::<String>::new());
        let messages = green(80);
        assert!(messages.len() == 1 && messages[0].contains("more than one leaf"), "{messages:?}");
        let messages = doubts(400, 250, &photo[150 * 400..], false);
        assert!(messages.len() == 1 && messages[0].contains("border"), "{messages:?}");
    }

    /// Draws an ovate, pointed leaf of length 200 and a brown petiole on paper: widest near the base, with this half width.
    fn ovate(half: f32, turn: f32, stalk: f32) -> Vec<[u8; 3]> {
        let (sin, cos) = turn.sin_cos();
        (0..600 * 600)
            .map(|i| {
                let p = middle(i, 600) - 300.0;
                let (along, across) = (cos * p.x + sin * p.y + 100.0, -sin * p.x + cos * p.y);
                let t = (along / 200.0).clamp(0.0, 1.0);
                let blade = across.abs() < half * (std::f32::consts::PI * t.powf(0.6)).sin().max(0.0).powf(0.8);
                let is_stalk = across.abs() < 3.5 && (-stalk..2.0).contains(&along);
                if blade {
                    [60, 130, 40]
                } else if is_stalk {
                    [120, 90, 40]
                } else {
                    [244, 244, 244]
                }
            })
            .collect()
    }

    /// Rationale: a leaf as wide as long has no long axis, and a brown petiole is not green. Method: ovate leaves,
    /// narrow, round and wider than long, at six angles. Expected: the tip is up, the image nearly its own mirror image,
    /// no part of the blade is lost; with `stalk` the petiole is kept, with `flip` the tip is down.
    #[test]
    fn the_petiole_shows_the_base_of_any_leaf() {
        for (half, k) in [50.0, 100.0, 140.0].into_iter().flat_map(|half| (0..6).map(move |k| (half, k))) {
            let turn = k.to_f32() * 1.1 - 0.4;
            let photo = ovate(half, turn, 100.0);
            assert_eq!(doubts(600, 600, &photo, false), Vec::<String>::new(), "{half} {turn}");
            let blade = photo.iter().filter(|p| p[1] == 130).count().to_f64();
            let of = |cutting: CutoutOptions| cut_out(600, 600, &photo, &cutting).unwrap();
            let row = |leaf: &GeneratedTexture, part: f32| {
                let (w, y) = (leaf.width.to_usize(), (part * leaf.height.to_f32()).trunc_to::<usize>());
                (0..w).filter(|x| leaf.rgba[4 * (y * w + x) + 3] > 127).count()
            };
            let leaf = of(CutoutOptions::default());
            assert!(row(&leaf, 0.08) < row(&leaf, 0.9), "{half} {turn}: the tip is up");
            let (w, h) = (leaf.width.to_usize(), leaf.height.to_usize());
            let opaque = |x: usize, y: usize| leaf.rgba[4 * (y * w + x) + 3] > 127;
            let all = (0..w * h).filter(|i| opaque(i % w, i / w)).count().to_f64();
            let unlike = (0..w * h).filter(|i| opaque(i % w, i / w) != opaque(w - 1 - i % w, i / w)).count().to_f64();
            assert!((all / blade - 1.0).abs() < 0.02 && unlike / all < 0.06, "{half} {turn}: {all} {blade} {unlike}");
            let flipped = of(CutoutOptions { flip: true, ..CutoutOptions::default() });
            assert!(row(&flipped, 0.08) > row(&flipped, 0.9), "{half} {turn}: flipped");
            let kept = of(CutoutOptions { stalk: true, ..CutoutOptions::default() });
            assert!(kept.height > leaf.height + 80, "{half} {turn}: {} {}", kept.height, leaf.height);
        }
    }

    /// Expected: without a petiole a warning, and with `flip` none; a leaf as wide as long stands on its axis of
    /// symmetry.
    #[test]
    fn a_leaf_without_a_petiole_is_warned_of() {
        for half in [50.0, 95.0] {
            let photo = ovate(half, 0.5, 0.0);
            let messages = doubts(600, 600, &photo, false);
            assert!(messages.len() == 1 && messages[0].contains("no petiole"), "{messages:?}");
            assert_eq!(doubts(600, 600, &photo, true), Vec::<String>::new());
            let leaf = cut_out(600, 600, &photo, &CutoutOptions { flip: true, ..CutoutOptions::default() }).unwrap();
            let (w, h) = (leaf.width.to_usize(), leaf.height.to_usize());
            let opaque = |x: usize, y: usize| leaf.rgba[4 * (y * w + x) + 3] > 127;
            let all = (0..w * h).filter(|i| opaque(i % w, i / w)).count().to_f64();
            let unlike = (0..w * h).filter(|i| opaque(i % w, i / w) != opaque(w - 1 - i % w, i / w)).count().to_f64();
            assert!(unlike / all < 0.08, "{half}: {unlike} of {all}");
        }
    }

    #[test]
    fn a_grey_area_makes_reflectances() {
        let photo = photograph(0.3);
        let cutting = CutoutOptions {
            grey: Some(([2, 2, 20, 20], 0.85)),
            height: Some(120),
            stalk: true,
            ..CutoutOptions::default()
        };
        let leaf = cut_out(400, 400, &photo, &cutting).unwrap();
        assert!(leaf.height.abs_diff(120) <= 1);
        let middle = 4 * (leaf.height.to_usize() / 3 * leaf.width.to_usize() + leaf.width.to_usize() / 2);
        let linear = |v: u8| decode(f32::from(v) / 255.0);
        let wanted = linear(120) * 0.85 / linear(232);
        assert!((linear(leaf.rgba[middle + 1]) - wanted).abs() < 0.01);
        assert!(cut_out(400, 400, &photo, &CutoutOptions { grey: Some(([390, 0, 20, 20], 0.8)), ..cutting }).is_err());
    }

    #[test]
    fn paper_alone_has_no_leaf() {
        let paper = vec![[230, 231, 229]; 64 * 64];
        assert!(cut_out(64, 64, &paper, &CutoutOptions::default()).is_err());
    }
}
