//! A leaf cut out of a photograph: on paper or soil, lying in any direction.
//!
//! Green is told from the background by the excess green of chromaticities, 2g − r − b (Woebbecke et al. 1995), with the threshold that
//! separates the picture's two kinds of pixels best (Otsu 1979). The largest connected piece is the leaf; its long axis, that of its second
//! moments, is turned upright, with the narrower end, the stalk's, at the bottom and its foot in the middle column, as species files want
//! it.

use super::draw::Drawn;
use super::srgb::{ColorSpace, decode};
use crate::error::{Error, Result};
use crate::math::{Vec2, vec2};

/// Least share of the photograph that is taken for a leaf.
const LEAST: f64 = 0.002;
/// Share of the leaf's length at each end whose widths tell the stalk from the tip.
const END: f32 = 0.12;
/// Width of a petiole at most, of the blade's.
const STALK: f64 = 0.2;
/// Room around the leaf, of its length.
const ROOM: f32 = 0.02;

/// How a leaf is cut out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cutting {
    /// Whether the base is at the wider end.
    pub flip: bool,
    /// Whether the petiole stays; a species file grows one of its own, so a picture is of the blade alone.
    pub stalk: bool,
    /// Whether holes stay open; photographs of glossy leaves have false ones where the light is mirrored.
    pub holes: bool,
    /// Height of the result, pixels; that of the leaf in the photograph unless given.
    pub height: Option<u32>,
    /// Something grey or white in the photograph and its reflectance, 0 to 1: x, y, width, height in pixels. Colours are then reflectances.
    pub grey: Option<([u32; 4], f32)>,
}

/// A second piece is told as another leaf above this share of the first: it is no speck of weed or mirrored light.
const ANOTHER: f64 = 0.15;
/// Share of a leaf's pixels on the photograph's border above which it is said to be cut by it.
const CUT: f64 = 0.002;

/// What may not be meant in a photograph, one sentence each; those of `cut_out` come as errors.
pub fn doubts(width: u32, height: u32, rgb: &[[u8; 3]]) -> Vec<String> {
    let (width, height) = (width as usize, height as usize);
    let mut green = green(rgb);
    let first = largest(&green, width, height);
    let count = |piece: &[bool]| piece.iter().filter(|inside| **inside).count() as f64;
    green.iter_mut().zip(&first).for_each(|(green, taken)| *green &= !taken);
    let mut all = Vec::new();
    if count(&largest(&green, width, height)) > ANOTHER * count(&first) {
        all.push("there is more than one leaf: the largest is cut out; photograph one at a time".to_owned());
    }
    let border = |i: &usize| [0, width - 1].contains(&(i % width)) || [0, height - 1].contains(&(i / width));
    let beyond = (0..first.len()).filter(|i| first[*i] && border(i)).count() as f64;
    if beyond > (CUT * count(&first)).max(4.0) {
        all.push(
            "the leaf reaches the photograph's border, so a part of it is missing: leave room around it".to_owned(),
        );
    }
    all
}

/// The leaf of a photograph, upright, with opacity; sRGB.
pub fn cut_out(width: u32, height: u32, rgb: &[[u8; 3]], cutting: &Cutting) -> Result<Drawn> {
    let mut leaf = largest(&green(rgb), width as usize, height as usize);
    let count = leaf.iter().filter(|in_it| **in_it).count();
    if (count as f64) < LEAST * rgb.len() as f64 {
        return Err(Error::input("no leaf is found: nothing green stands out of the background")
            .help("photograph one leaf on white paper or on soil, filling at least a twentieth of the picture"));
    }
    if !cutting.holes {
        fill(&mut leaf, width as usize, height as usize);
    }
    let gain = gain(width, height, rgb, cutting)?;
    let mut stance = Stance::of(&leaf, width as usize, cutting.flip);
    if !cutting.stalk {
        stance = stance.above_stalk(&mut leaf, width as usize);
    }
    let leaf = leaf;
    let there = |x: i64, y: i64| {
        (0..i64::from(width)).contains(&x)
            && (0..i64::from(height)).contains(&y)
            && leaf[(y * i64::from(width) + x) as usize]
    };
    let scale = cutting.height.map_or(1.0, |h| (h as f32 - 1.0) / ((1.0 + 2.0 * ROOM) * stance.length));
    let side = |length: f32| ((length * scale).ceil() as u32 + 1).max(2);
    let (w, h) = (side(2.0 * stance.reach + 2.0 * ROOM * stance.length), side((1.0 + 2.0 * ROOM) * stance.length));
    if u64::from(w) * u64::from(h) > 1 << 26 {
        return Err(
            Error::misuse(format!("a picture of {w} × {h} pixels is too large")).help("give a smaller --height")
        );
    }
    let mut rgba = Vec::with_capacity(4 * w as usize * h as usize);
    for y in 0..h {
        for x in 0..w {
            let across = (x as f32 + 0.5 - 0.5 * w as f32) / scale;
            let up = (h as f32 - (y as f32 + 0.5)) / scale - ROOM * stance.length;
            let at = stance.place(across, up);
            rgba.extend(sample(rgb, width, at, &there, gain));
        }
    }
    Ok(Drawn { width: w, height: h, rgba, opaque: false, relief: None })
}

/// Bilinear colour and opacity at a place of the photograph. Texels beside the leaf give no colour: that of the background stays out.
fn sample(rgb: &[[u8; 3]], width: u32, at: Vec2, there: &dyn Fn(i64, i64) -> bool, gain: [f32; 3]) -> [u8; 4] {
    let corner = (at - 0.5).floor();
    let part = at - 0.5 - corner;
    let (mut sum, mut weight) = ([0.0_f32; 3], 0.0_f32);
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let (x, y) = (corner.x as i64 + dx, corner.y as i64 + dy);
        let share = |d: i64, t: f32| if d == 1 { t } else { 1.0 - t };
        if there(x, y) {
            let own = share(dx, part.x) * share(dy, part.y);
            let texel = rgb[(y * i64::from(width) + x) as usize];
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
    [color(0), color(1), color(2), (weight.min(1.0) * 255.0 + 0.5) as u8]
}

/// Factors on linear R, G, B that give what is grey its reflectance.
fn gain(width: u32, height: u32, rgb: &[[u8; 3]], cutting: &Cutting) -> Result<[f32; 3]> {
    let Some(([x, y, w, h], reflectance)) = cutting.grey else { return Ok([1.0; 3]) };
    if w == 0 || h == 0 || x.saturating_add(w) > width || y.saturating_add(h) > height {
        return Err(Error::misuse(format!(
            "the grey area does not lie in the photograph of {width} × {height} pixels"
        ))
        .help("write it as x,y,width,height in pixels"));
    }
    let mut sum = [0.0_f64; 3];
    for row in y..y + h {
        for column in x..x + w {
            let texel = rgb[(row * width + column) as usize];
            for k in 0..3 {
                sum[k] += f64::from(decode(f32::from(texel[k]) / 255.0));
            }
        }
    }
    let mean = sum.map(|s| (s / (f64::from(w) * f64::from(h))) as f32);
    if mean.iter().any(|m| *m < 0.01) {
        return Err(Error::input("the grey area is black").help("name an area of the paper or of a grey card"));
    }
    Ok(mean.map(|m| reflectance / m))
}

/// Which pixels are green, by Otsu's threshold of 2g − r − b.
fn green(rgb: &[[u8; 3]]) -> Vec<bool> {
    let excess: Vec<u8> = rgb
        .iter()
        .map(|p| {
            let [r, g, b] = p.map(f32::from);
            let sum = (r + g + b).max(24.0);
            (((2.0 * g - r - b) / sum + 1.0) / 3.0 * 255.0) as u8
        })
        .collect();
    let mut counts = [0_u64; 256];
    for v in &excess {
        counts[usize::from(*v)] += 1;
    }
    let threshold = otsu(&counts);
    // Nothing below the grey of 2g = r + b is green, whatever the picture's two kinds are.
    let grey = (255.0 / 3.0) as u8 + 3;
    excess.into_iter().map(|v| v > threshold.max(grey)).collect()
}

/// The value that separates a histogram into the two kinds with the largest variance between them.
fn otsu(counts: &[u64; 256]) -> u8 {
    let total: f64 = counts.iter().map(|n| *n as f64).sum();
    let all: f64 = counts.iter().enumerate().map(|(v, n)| v as f64 * *n as f64).sum();
    let (mut below, mut sum, mut best, mut at) = (0.0, 0.0, -1.0, 0);
    for (v, n) in counts.iter().enumerate() {
        below += *n as f64;
        sum += v as f64 * *n as f64;
        let above = total - below;
        if below > 0.0 && above > 0.0 {
            let apart = sum / below - (all - sum) / above;
            let between = below * above * apart * apart;
            if between > best {
                (best, at) = (between, v as u8);
            }
        }
    }
    at
}

/// The largest piece of pixels that touch at their sides.
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

/// Visits what `enter` lets in, from `start` on over sides; returns how many.
fn flood(start: usize, width: usize, height: usize, mut enter: impl FnMut(usize) -> bool) -> usize {
    let mut open = Vec::new();
    if enter(start) {
        open.push(start);
    }
    let mut count = 0;
    while let Some(i) = open.pop() {
        count += 1;
        let (x, y) = (i % width, i / width);
        let beside = [
            (x > 0, i.wrapping_sub(1)),
            (x + 1 < width, i + 1),
            (y > 0, i.wrapping_sub(width)),
            (y + 1 < height, i + width),
        ];
        open.extend(beside.into_iter().filter(|(inside, _)| *inside).map(|(_, n)| n).filter(|n| enter(*n)));
    }
    count
}

/// Fills what the border of the picture does not reach.
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

/// Where a leaf lies in its photograph, pixels.
struct Stance {
    foot: Vec2,
    /// From the foot to the tip, unit.
    up: Vec2,
    length: f32,
    /// How far it reaches to either side of the line from the foot along `up`.
    reach: f32,
}

impl Stance {
    fn of(leaf: &[bool], width: usize, flip: bool) -> Self {
        let points = || leaf.iter().enumerate().filter(|(_, in_it)| **in_it).map(|(i, _)| middle(i, width));
        let count = points().count().max(1) as f64;
        let (sx, sy) = points().fold((0.0, 0.0), |(x, y), p| (x + f64::from(p.x), y + f64::from(p.y)));
        let centre = vec2((sx / count) as f32, (sy / count) as f32);
        let (mut xx, mut xy, mut yy) = (0.0_f64, 0.0, 0.0);
        for p in points() {
            let d = p - centre;
            xx += f64::from(d.x * d.x);
            xy += f64::from(d.x * d.y);
            yy += f64::from(d.y * d.y);
        }
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let axis = vec2(angle.cos() as f32, angle.sin() as f32);
        let (lo, hi) = points().fold((f32::MAX, f32::MIN), |(lo, hi), p| {
            let t = (p - centre).dot(axis);
            (lo.min(t), hi.max(t))
        });
        let length = hi - lo + 1.0;
        // Pixels at each end: the stalk's are fewer.
        let (low, high) = points().fold((0_u64, 0_u64), |(low, high), p| {
            let t = (p - centre).dot(axis);
            (low + u64::from(t < lo + END * length), high + u64::from(t > hi - END * length))
        });
        let up = if (low <= high) == flip { -axis } else { axis };
        let end = points().map(|p| (p - centre).dot(up)).fold(f32::MAX, f32::min);
        let aside = vec2(-up.y, up.x);
        // The foot: the middle of the lowest slice.
        let slice = points().filter(|p| (*p - centre).dot(up) < end + (0.02 * length).max(1.5));
        let (sum, n) = slice.fold((0.0, 0_u32), |(sum, n), p| (sum + (p - centre).dot(aside), n + 1));
        let foot = centre + up * (end - 0.5) + aside * (sum / n.max(1) as f32);
        let reach = points().map(|p| (p - foot).dot(aside).abs()).fold(0.0, f32::max) + 1.0;
        Self { foot, up, length, reach }
    }

    /// The same of the blade alone: what lies below where the leaf gets a fifth as wide as it ever is, is taken out of it.
    fn above_stalk(self, leaf: &mut [bool], width: usize) -> Self {
        let mut widths = vec![0_u32; self.length.ceil() as usize + 1];
        let row = |i: usize| ((middle(i, width) - self.foot).dot(self.up).max(0.0) as usize).min(widths.len() - 1);
        let rows: Vec<(usize, usize)> = (0..leaf.len()).filter(|i| leaf[*i]).map(|i| (i, row(i))).collect();
        for (_, row) in &rows {
            widths[*row] += 1;
        }
        let widest = widths.iter().max().copied().unwrap_or(0);
        let cut = widths.iter().position(|w| f64::from(*w) > STALK * f64::from(widest)).unwrap_or(0);
        // No stalk is worth a row or two.
        if (cut as f32) < 0.02 * self.length {
            return self;
        }
        let Self { foot, up, length, .. } = self;
        let aside = vec2(-up.y, up.x);
        let (mut sum, mut n, mut reach) = (0.0_f32, 0_u32, 0.0_f32);
        for (i, row) in rows {
            leaf[i] = row >= cut;
            if (cut..cut + 3).contains(&row) {
                sum += (middle(i, width) - foot).dot(aside);
                n += 1;
            }
        }
        let foot = foot + up * cut as f32 + aside * (sum / n.max(1) as f32);
        for i in (0..leaf.len()).filter(|i| leaf[*i]) {
            reach = reach.max((middle(i, width) - foot).dot(aside).abs() + 1.0);
        }
        Self { foot, up, length: length - cut as f32, reach }
    }

    /// The photograph's place at so much to the right of the foot and up from it.
    fn place(&self, across: f32, up: f32) -> Vec2 {
        // The photograph's y points down, so the right-hand side of `up` is (−up.y, up.x).
        self.foot + vec2(-self.up.y, self.up.x) * across + self.up * up
    }
}

fn middle(i: usize, width: usize) -> Vec2 {
    vec2((i % width) as f32 + 0.5, (i / width) as f32 + 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A leaf with a stalk on paper, turned by an angle: half an ellipse's width at each height, a stalk below.
    fn photograph(turn: f32) -> Vec<[u8; 3]> {
        let (sin, cos) = turn.sin_cos();
        (0..400 * 400)
            .map(|i| {
                let p = middle(i, 400) - 200.0;
                let (x, y) = (cos * p.x + sin * p.y, -sin * p.x + cos * p.y);
                let blade = (x / 45.0).powi(2) + ((y + 20.0) / 90.0).powi(2) < 1.0;
                let stalk = x.abs() < 4.0 && (60.0..130.0).contains(&y);
                // A notch on its right-hand side only.
                let notch = (x - 45.0).hypot(y + 20.0) < 15.0;
                if (blade || stalk) && !notch { [70, 120, 50] } else { [235, 232, 228] }
            })
            .collect()
    }

    /// Method: one leaf photographed at eight turns. Expected: the same picture each time within a few pixels: upright, its foot in the middle of
    /// the lower edge, not mirrored.
    #[test]
    fn a_leaf_comes_out_upright_whichever_way_it_lies() {
        for k in 0..8 {
            let photo = photograph(k as f32 * 0.8);
            let leaf = cut_out(400, 400, &photo, &Cutting { stalk: true, ..Cutting::default() }).unwrap();
            let blade = cut_out(400, 400, &photo, &Cutting::default()).unwrap();
            assert!((blade.height as f32 - 187.0).abs() < 8.0, "{k}: the stalk is cut off: {}", blade.height);
            let (w, h) = (leaf.width as usize, leaf.height as usize);
            assert!((h as f32 - 250.0).abs() < 8.0 && (w as f32 - 100.0).abs() < 8.0, "{k}: {w} × {h}");
            let opaque = |x: usize, y: usize| leaf.rgba[4 * (y * w + x) + 3] > 127;
            assert!(opaque(w / 2, h - 12) && !opaque(w / 2 - 12, h - 12), "{k}: the stalk stands in the middle below");
            let (left, right) = (opaque(12, 95), opaque(w - 13, 95));
            assert!(left && !right, "{k}: the notch is on the right: {left} {right}");
        }
    }

    /// Expected: one leaf in the middle is doubted by nobody; a second one beside it is told, a speck is not; one that the border cuts is told.
    #[test]
    fn what_a_photograph_should_not_show_is_told() {
        let photo = photograph(0.0);
        assert_eq!(doubts(400, 400, &photo), Vec::<String>::new());
        let green = |size: usize| {
            let mut photo = photo.clone();
            for i in
                (0..400 * 400).filter(|i| (10..10 + size).contains(&(i % 400)) && (10..10 + size).contains(&(i / 400)))
            {
                photo[i] = [70, 120, 50];
            }
            doubts(400, 400, &photo)
        };
        assert_eq!(green(10), Vec::<String>::new());
        let told = green(80);
        assert!(told.len() == 1 && told[0].contains("more than one leaf"), "{told:?}");
        let told = doubts(400, 250, &photo[150 * 400..]);
        assert!(told.len() == 1 && told[0].contains("border"), "{told:?}");
    }

    #[test]
    fn a_grey_area_makes_reflectances() {
        let photo = photograph(0.3);
        let cutting =
            Cutting { grey: Some(([2, 2, 20, 20], 0.85)), height: Some(120), stalk: true, ..Cutting::default() };
        let leaf = cut_out(400, 400, &photo, &cutting).unwrap();
        assert!(leaf.height.abs_diff(120) <= 1);
        let middle = 4 * (leaf.height as usize / 3 * leaf.width as usize + leaf.width as usize / 2);
        let linear = |v: u8| decode(f32::from(v) / 255.0);
        let wanted = linear(120) * 0.85 / linear(232);
        assert!((linear(leaf.rgba[middle + 1]) - wanted).abs() < 0.01);
        assert!(cut_out(400, 400, &photo, &Cutting { grey: Some(([390, 0, 20, 20], 0.8)), ..cutting }).is_err());
    }

    #[test]
    fn paper_alone_has_no_leaf() {
        let paper = vec![[230, 231, 229]; 64 * 64];
        assert!(cut_out(64, 64, &paper, &Cutting::default()).is_err());
    }
}
