//! Detection of a leaf's petiole in a photograph: it shows where the base of the blade is.
//!
//! A petiole is a thin part that ends bluntly, unlike a pointed tip. It may have another colour than the blade if the
//! background is plain, such as paper.

use super::grid::{flood, middle};
use furrow_base::math::{ToFloat, ToInt, Vec2};

/// Largest half width of a petiole relative to the square root of the blade's area.
const THIN: f32 = 0.05;
/// Smallest length of a petiole relative to the square root of the blade's area.
const SHORT: f32 = 0.1;
/// Smallest width of the far quarter of a petiole relative to its second quarter; a pointed tip has 0.2.
const BLUNT: f32 = 0.5;
/// Difference from the background, of 255, above which a pixel belongs to an object.
const APART: i32 = 40;
/// Largest median difference of the border's pixels from the background colour, for a plain background.
const PLAIN: i32 = 12;

/// The petiole of a leaf.
pub(super) struct Petiole {
    /// Indices of its pixels.
    pub(super) pixels: Vec<usize>,
    /// Where it meets the blade, in pixels.
    pub(super) foot: Vec2,
}

/// Returns the petiole of the leaf with these pixels.
pub(super) fn find(rgb: &[[u8; 3]], leaf: &[bool], width: usize, height: usize) -> Option<Petiole> {
    let object = object(rgb, leaf, width, height);
    let size = leaf.iter().filter(|inside| **inside).count().to_f32().sqrt();
    let radius = THIN * size;
    // Opening: what a disc of this radius can reach within the object.
    let inner = distance(width, height, |i| !object[i]);
    let reach = distance(width, height, |i| inner[i] > radius);
    let body = |i: usize| reach[i] <= radius;
    let mut seen = vec![false; leaf.len()];
    let mut longest: Option<(f32, Petiole)> = None;
    for start in 0..leaf.len() {
        let mut pixels = Vec::new();
        flood(start, width, height, |i| {
            object[i] && !body(i) && !std::mem::replace(&mut seen[i], true) && {
                pixels.push(i);
                true
            }
        });
        if let Some((length, foot)) = stalk(&pixels, width, height, &body, SHORT * size)
            && longest.as_ref().is_none_or(|(before, _)| length > *before)
        {
            longest = Some((length, Petiole { pixels, foot }));
        }
    }
    longest.map(|(_, petiole)| petiole)
}

/// Returns length and foot of a thin part, if it is a petiole of at least `shortest` pixels.
fn stalk(
    pixels: &[usize],
    width: usize,
    height: usize,
    body: &dyn Fn(usize) -> bool,
    shortest: f32,
) -> Option<(f32, Vec2)> {
    let beside = |i: &usize| {
        let (x, y) = (i % width, i / width);
        let near = |x: usize, y: usize| x < width && y < height && body(y * width + x);
        near(x.wrapping_sub(1), y) || near(x + 1, y) || near(x, y.wrapping_sub(1)) || near(x, y + 1)
    };
    let touching: Vec<Vec2> = pixels.iter().filter(|i| beside(i)).map(|i| middle(*i, width)).collect();
    if touching.is_empty() {
        return None;
    }
    let foot = touching.iter().sum::<Vec2>() / touching.len().to_f32();
    let away = |i: &usize| (middle(*i, width) - foot).length();
    let length = pixels.iter().map(away).fold(0.0, f32::max);
    let within = |from: f32, to: f32| {
        pixels.iter().map(away).filter(|d| (from * length..=to * length).contains(d)).count().to_f32()
    };
    (length >= shortest && within(0.75, 1.0) >= BLUNT * within(0.25, 0.5)).then_some((length, foot))
}

/// Returns the pixels of the leaf, and on a plain background those of anything that touches it.
fn object(rgb: &[[u8; 3]], leaf: &[bool], width: usize, height: usize) -> Vec<bool> {
    let mut object = leaf.to_vec();
    let border = (0..width)
        .flat_map(|x| [x, (height - 1) * width + x])
        .chain((0..height).flat_map(|y| [y * width, y * width + width - 1]));
    let border: Vec<[u8; 3]> = border.filter(|i| !leaf[*i]).map(|i| rgb[i]).collect();
    if border.is_empty() {
        return object;
    }
    let median = |mut values: Vec<i32>| *values.select_nth_unstable(border.len() / 2).1;
    let paper: [i32; 3] = std::array::from_fn(|k| median(border.iter().map(|p| i32::from(p[k])).collect()));
    let apart = |p: &[u8; 3]| (0..3).map(|k| (i32::from(p[k]) - paper[k]).abs()).max().unwrap_or(0);
    if median(border.iter().map(apart).collect()) > PLAIN {
        return object;
    }
    let mut reached = vec![false; leaf.len()];
    for start in (0..leaf.len()).filter(|i| leaf[*i]) {
        flood(start, width, height, |i| {
            (leaf[i] || apart(&rgb[i]) > APART) && !std::mem::replace(&mut reached[i], true) && {
                object[i] = true;
                true
            }
        });
    }
    object
}

/// Returns the distance of every pixel to the nearest one that is a `goal`, in pixels, within 6 % (chamfer distances 3
/// and 4, Borgefors 1986). Infinite if there is none.
fn distance(width: usize, height: usize, goal: impl Fn(usize) -> bool) -> Vec<f32> {
    const FAR: u32 = u32::MAX / 2;
    let mut all: Vec<u32> = (0..width * height).map(|i| if goal(i) { 0 } else { FAR }).collect();
    let relax = |all: &mut [u32], i: usize, x: isize, y: isize, step: u32| {
        if (0..width.to_isize()).contains(&x) && (0..height.to_isize()).contains(&y) {
            all[i] = all[i].min(all[y.to_usize() * width + x.to_usize()].saturating_add(step));
        }
    };
    for i in 0..all.len() {
        let (x, y) = ((i % width).to_isize(), (i / width).to_isize());
        for (dx, dy, step) in [(-1, 0, 3), (-1, -1, 4), (0, -1, 3), (1, -1, 4)] {
            relax(&mut all, i, x + dx, y + dy, step);
        }
    }
    for i in (0..all.len()).rev() {
        let (x, y) = ((i % width).to_isize(), (i / width).to_isize());
        for (dx, dy, step) in [(1, 0, 3), (1, 1, 4), (0, 1, 3), (-1, 1, 4)] {
            relax(&mut all, i, x + dx, y + dy, step);
        }
    }
    all.into_iter().map(|d| if d >= FAR { f32::INFINITY } else { d.to_f32() / 3.0 }).collect()
}
