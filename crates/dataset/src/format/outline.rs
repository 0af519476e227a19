//! A mask as one closed polygon, with holes and separate parts joined by cuts, and the mask that readers restore from
//! it.
//!
//! The polygon runs along the borders of pixels, so its area and its box are those of the mask. Ultralytics truncates
//! the coordinates of corners, fills the polygon and paints its edges too (OpenCV's `fillPoly`, even-odd). So corners
//! are a hundredth of a pixel inside the mask: each truncated corner is then a pixel of the mask, and a connected part
//! with all its holes is restored exactly.
//!
//! Parts and holes are joined by cuts, which lead there and back over the same points. A cut has no area, but its
//! pixels are painted. It uses pixels of the mask where possible, and as few others as necessary; only these are wrong
//! in the restored mask.
//!
//! Corners of cuts are at pixel centres: Ultralytics inserts corners between those of a polygon in training, and none
//! of them may fall into a neighbouring pixel. supervision rounds corners, and paints one more pixel to the right and
//! below.
//!
//! Sources: edges between pixels that are followed with the mask on their right, known as crack codes, Rosenfeld and
//! Kak 1982, "Digital Picture Processing"; cuts, Dijkstra's shortest path with zero cost for pixels of the mask.

use crate::model::rle::Box2;
use furrow_base::math::{ToFloat, ToInt};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Column and row of a pixel; also the point at its upper left corner.
pub(super) type Pixel = (i32, i32);

/// Distance of corners from the pixel borders, towards the inside of the mask, pixels.
const WITHIN: f64 = 0.01;

/// Corner of the polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Corner {
    /// Point where four pixels meet.
    at: Pixel,
    /// The one of these four pixels that contains the corner.
    pixel: Pixel,
    /// Whether the polygon continues straight on, so that the corner can be omitted.
    straight: bool,
    /// Whether the corner is on a cut, at the centre of its pixel.
    cut: bool,
}

impl Corner {
    /// Returns the position in the image; (0, 0) is the upper left corner of the upper left pixel.
    pub(super) fn place(&self) -> (f64, f64) {
        if self.cut {
            return (f64::from(self.pixel.0) + 0.5, f64::from(self.pixel.1) + 0.5);
        }
        let within = |at: i32, pixel: i32| f64::from(at) + if pixel == at { WITHIN } else { -WITHIN };
        (within(self.at.0, self.pixel.0), within(self.at.1, self.pixel.1))
    }
}

/// Mask of one object in its box, with a margin of one pixel.
pub(super) struct Mask {
    /// First column and row of the margin in the image.
    origin: Pixel,
    width: i32,
    height: i32,
    inside: Vec<bool>,
}

/// Offsets of the eight neighbours of a pixel.
const AROUND: [Pixel; 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];
/// Steps along borders: right, down, left, up.
const STEPS: [Pixel; 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];
/// Offsets from the start of each step to the pixel on its right, which is in the mask.
const RIGHT: [Pixel; 4] = [(0, 0), (-1, 0), (-1, -1), (0, -1)];
/// Offsets from the start of each step to the pixel on its left, which is not in the mask.
const LEFT: [Pixel; 4] = [(0, -1), (0, 0), (-1, 0), (-1, -1)];

fn plus(a: Pixel, b: Pixel) -> Pixel {
    (a.0 + b.0, a.1 + b.1)
}

impl Mask {
    /// Returns the mask of the pixels in `bounds` for which `inside(x, y)` holds.
    pub(super) fn new(bounds: Box2, inside: impl Fn(u32, u32) -> bool) -> Self {
        let [x0, y0, w, h] = bounds.0.map(ToInt::to_i32);
        let mut mask = Self {
            origin: (x0 - 1, y0 - 1),
            width: w + 2,
            height: h + 2,
            inside: vec![false; (w.to_usize() + 2) * (h.to_usize() + 2)],
        };
        for y in bounds.rows() {
            for x in bounds.columns() {
                let at = mask.at((x.to_i32() - mask.origin.0, y.to_i32() - mask.origin.1));
                mask.inside[at] = inside(x, y);
            }
        }
        mask
    }

    fn at(&self, (x, y): Pixel) -> usize {
        (y * self.width + x).to_usize()
    }

    /// Returns whether a pixel is in the box, without the margin.
    fn in_box(&self, (x, y): Pixel) -> bool {
        (1..self.width - 1).contains(&x) && (1..self.height - 1).contains(&y)
    }

    fn holds(&self, (x, y): Pixel) -> bool {
        self.in_box((x, y)) && self.inside[self.at((x, y))]
    }

    /// Returns whether the step in direction `d` from a point runs along a border, with the mask on its right.
    fn borders(&self, at: Pixel, d: usize) -> bool {
        self.holds(plus(at, RIGHT[d])) && !self.holds(plus(at, LEFT[d]))
    }

    /// Returns the borders of all parts and holes, each a closed chain of steps. Pixels that touch only at a corner are
    /// separate parts.
    fn loops(&self) -> Vec<Vec<Corner>> {
        let mut met = vec![[false; 4]; self.inside.len()];
        let mut all = Vec::new();
        for y in 1..self.height {
            for x in 1..self.width {
                for d in 0..4 {
                    if self.borders((x, y), d) && !met[self.at((x, y))][d] {
                        all.push(self.follow((x, y), d, &mut met));
                    }
                }
            }
        }
        all
    }

    /// Follows the border that starts with the step from `start` in the direction `first`.
    fn follow(&self, start: Pixel, first: usize, met: &mut [[bool; 4]]) -> Vec<Corner> {
        let mut corners = Vec::new();
        let (mut at, mut d) = (start, first);
        loop {
            met[self.at(at)][d] = true;
            at = plus(at, STEPS[d]);
            // Right turns are tried first: at a corner where two pixels touch, the border stays with its own pixel.
            let right = (d + 1) % 4;
            let next = [right, d, (d + 3) % 4].into_iter().find(|next| self.borders(at, *next)).unwrap_or(right);
            let pixel = if next == (d + 3) % 4 {
                // At a left turn, one of the four pixels is not in the mask: the one on the left of both steps. The
                // corner is in the opposite pixel.
                let (x, y) = LEFT[(d + 3) % 4];
                plus(at, (-1 - x, -1 - y))
            } else {
                plus(at, RIGHT[next])
            };
            corners.push(Corner { at, pixel, straight: next == d, cut: false });
            d = next;
            if at == start && d == first {
                return corners;
            }
        }
    }

    /// Returns one closed chain of steps along all borders, in the coordinates of the box; empty for an empty mask.
    fn chain(&self) -> Vec<Corner> {
        let mut loops = self.loops();
        let mut touching: Vec<Vec<usize>> = vec![Vec::new(); self.inside.len()];
        for (k, border) in loops.iter().enumerate() {
            for corner in border {
                touching[self.at(corner.at)].push(k);
            }
        }
        let Some(first) = loops.first_mut() else { return Vec::new() };
        let mut chain = std::mem::take(first);
        let mut search = Search::new(self);
        search.begin(chain.iter().map(|corner| corner.at));
        let mut fresh: Vec<Pixel> = chain.iter().map(|corner| corner.at).collect();
        // Borders that are joined already are empty.
        let waiting =
            |loops: &[Vec<Corner>], at: Pixel| touching[self.at(at)].iter().copied().find(|k| !loops[*k].is_empty());
        loop {
            // Borders that touch need no cut.
            let (path, k) = if let Some(at) = fresh.pop() {
                let Some(k) = waiting(&loops, at) else { continue };
                fresh.push(at);
                (vec![at], k)
            } else {
                let Some(path) = search.nearest(|at| waiting(&loops, at).is_some()) else { return chain };
                let Some(k) = path.last().and_then(|end| waiting(&loops, *end)) else { return chain };
                (path, k)
            };
            let border = std::mem::take(&mut loops[k]);
            fresh.extend(border.iter().map(|corner| corner.at));
            search.begin(path.iter().copied().chain(border.iter().map(|corner| corner.at)));
            splice(&mut chain, &path, &border);
        }
    }

    /// Returns the polygon's corners in the image, without those on a straight line between their neighbours; none for
    /// an empty mask.
    pub(super) fn polygon(&self) -> Vec<Corner> {
        let corners = self.chain().into_iter().filter(|corner| !corner.straight);
        corners.map(|c| Corner { at: plus(c.at, self.origin), pixel: plus(c.pixel, self.origin), ..c }).collect()
    }

    /// Returns the intersection over union of the mask and the pixels that Ultralytics paints for the polygon; 1 if
    /// both are equal.
    pub(super) fn overlap(&self, polygon: &[Corner]) -> f64 {
        let local: Vec<Pixel> =
            polygon.iter().map(|c| (c.pixel.0 - self.origin.0, c.pixel.1 - self.origin.1)).collect();
        let painted = self.paint(&local);
        let both = painted.iter().zip(&self.inside).filter(|(a, b)| **a && **b).count();
        let any = painted.iter().zip(&self.inside).filter(|(a, b)| **a || **b).count();
        if any == 0 { 1.0 } else { both.to_f64() / any.to_f64() }
    }

    /// Returns the pixels of the polygon's edges, which run along rows, columns and diagonals, and those that it
    /// encloses an odd number of times.
    fn paint(&self, polygon: &[Pixel]) -> Vec<bool> {
        let mut edge = vec![false; self.inside.len()];
        // Whether an odd number of edges leads from a pixel to the row below.
        let mut crosses = vec![false; self.inside.len()];
        for (i, from) in polygon.iter().enumerate() {
            let to = polygon[(i + 1) % polygon.len()];
            let mut now = *from;
            edge[self.at(now)] = true;
            while now != to {
                let next = (now.0 + (to.0 - now.0).signum(), now.1 + (to.1 - now.1).signum());
                if next.1 != now.1 {
                    let upper = if next.1 > now.1 { now } else { next };
                    let at = self.at(upper);
                    crosses[at] = !crosses[at];
                }
                now = next;
                edge[self.at(now)] = true;
            }
        }
        let mut painted = edge.clone();
        for row in 0..self.height {
            let mut odd = false;
            for x in 0..self.width {
                let at = self.at((x, row));
                // Pixels on an edge are painted in any case.
                painted[at] = edge[at] || odd;
                odd ^= crosses[at];
            }
        }
        painted
    }
}

/// Inserts a border into a closed chain: along a path that starts on the chain and ends on the border, around the
/// border, and back.
fn splice(chain: &mut Vec<Corner>, path: &[Pixel], border: &[Corner]) {
    let (Some(from), Some(to)) = (path.first(), path.last()) else { return };
    let here = chain.iter().position(|corner| corner.at == *from);
    let there = border.iter().position(|corner| corner.at == *to);
    let (Some(here), Some(there)) = (here, there) else { return };
    chain[here].straight = false;
    let back = chain[here];
    let end = Corner { straight: false, ..border[there] };
    let (cut, mut home): (Vec<Corner>, Vec<Corner>) = if path.len() == 1 {
        // Between pixels that touch only at this corner, each way leads through the centre of the pixel that it enters.
        let diagonal = back.pixel.0 != end.pixel.0 && back.pixel.1 != end.pixel.1;
        let into = |pixel: Pixel| diagonal.then_some(Corner { at: pixel, pixel, straight: false, cut: true });
        (into(end.pixel).into_iter().collect(), into(back.pixel).into_iter().collect())
    } else {
        let cut: Vec<Corner> = (0..path.len()).map(|i| on_cut(path, i)).collect();
        (cut.clone(), cut)
    };
    home.reverse();
    let mut detour = cut;
    detour.push(end);
    detour.extend(border[there..].iter().chain(&border[..there]).skip(1));
    detour.push(end);
    detour.extend(home);
    detour.push(back);
    let rest = chain.split_off(here + 1);
    chain.extend(detour.into_iter().chain(rest));
}

/// Returns corner `i` of a cut.
fn on_cut(path: &[Pixel], i: usize) -> Corner {
    let step = |a: Pixel, b: Pixel| (b.0 - a.0, b.1 - a.1);
    let straight = i > 0 && i + 1 < path.len() && step(path[i - 1], path[i]) == step(path[i], path[i + 1]);
    Corner { at: path[i], pixel: path[i], straight, cut: true }
}

/// Search for paths from joined borders to others, over the upper left corners of pixels. Pixels of the mask cost
/// nothing, others one each.
struct Search<'a> {
    mask: &'a Mask,
    cost: Vec<u32>,
    before: Vec<Option<Pixel>>,
    queue: BinaryHeap<Reverse<(u32, Pixel)>>,
}

impl<'a> Search<'a> {
    fn new(mask: &'a Mask) -> Self {
        let n = mask.inside.len();
        Self { mask, cost: vec![u32::MAX; n], before: vec![None; n], queue: BinaryHeap::new() }
    }

    /// Adds starting points of paths.
    fn begin(&mut self, places: impl Iterator<Item = Pixel>) {
        for place in places.filter(|place| self.mask.in_box(*place)) {
            let (at, cost) = (self.mask.at(place), u32::from(!self.mask.holds(place)));
            self.cost[at] = cost;
            self.before[at] = None;
            self.queue.push(Reverse((cost, place)));
        }
    }

    /// Returns the cheapest path to a pixel for which `wanted` holds, from its start; `None` if there is none.
    fn nearest(&mut self, wanted: impl Fn(Pixel) -> bool) -> Option<Vec<Pixel>> {
        while let Some(Reverse((cost, pixel))) = self.queue.pop() {
            if cost > self.cost[self.mask.at(pixel)] {
                continue;
            }
            if wanted(pixel) {
                let mut path = vec![pixel];
                while let Some(before) = self.before[self.mask.at(path[path.len() - 1])] {
                    path.push(before);
                }
                path.reverse();
                return Some(path);
            }
            for (dx, dy) in AROUND {
                let next = (pixel.0 + dx, pixel.1 + dy);
                if !self.mask.in_box(next) {
                    continue;
                }
                let (at, step) = (self.mask.at(next), u32::from(!self.mask.holds(next)));
                if cost + step < self.cost[at] {
                    self.cost[at] = cost + step;
                    self.before[at] = Some(pixel);
                    self.queue.push(Reverse((cost + step, next)));
                }
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns the mask of a drawing; `#` is inside.
    fn mask(rows: &[&str]) -> Mask {
        let bounds = Box2([3, 5, rows[0].len().to_u32(), rows.len().to_u32()]);
        Mask::new(bounds, |x, y| rows[y.to_usize() - 5].as_bytes()[x.to_usize() - 3] == b'#')
    }

    fn parts(mask: &Mask) -> usize {
        let mut seen = vec![false; mask.inside.len()];
        let mut parts = 0;
        for y in 0..mask.height {
            for x in 0..mask.width {
                if !mask.holds((x, y)) || seen[mask.at((x, y))] {
                    continue;
                }
                parts += 1;
                let mut todo = vec![(x, y)];
                while let Some(p) = todo.pop() {
                    if mask.holds(p) && !std::mem::replace(&mut seen[mask.at(p)], true) {
                        todo.extend(AROUND.map(|(dx, dy)| (p.0 + dx, p.1 + dy)));
                    }
                }
            }
        }
        parts
    }

    /// Returns the signed area within the polygon's borders.
    fn area(polygon: &[Corner]) -> i32 {
        let next = polygon.iter().cycle().skip(1);
        polygon.iter().zip(next).map(|(a, b)| a.at.0 * b.at.1 - b.at.0 * a.at.1).sum::<i32>() / 2
    }

    #[test]
    fn a_rectangle_has_four_corners() {
        let mask = mask(&["####", "####", "####"]);
        let polygon = mask.polygon();
        let mut corners: Vec<Pixel> = polygon.iter().map(|corner| corner.at).collect();
        corners.sort_unstable();
        assert_eq!(corners, [(3, 5), (3, 8), (7, 5), (7, 8)]);
        assert!(polygon.iter().any(|corner| corner.place() == (3.01, 5.01)));
        assert!(polygon.iter().any(|corner| corner.place() == (6.99, 7.99)));
        assert_eq!((mask.overlap(&polygon), area(&polygon)), (1.0, 12));
    }

    #[test]
    fn a_pixel_and_a_line_are_polygons_too() {
        for rows in [&["#"][..], &["###"], &["#", "#"], &["#..", ".#.", "..#"]] {
            let mask = mask(rows);
            assert!(mask.polygon().len() >= 3);
            assert_eq!(mask.overlap(&mask.polygon()), 1.0, "{rows:?}");
        }
    }

    #[test]
    fn a_hole_and_an_island_in_it_come_back_with_the_cut_between_them() {
        let ring = mask(&["#######", "#.....#", "#.....#", "#.....#", "#######"]);
        assert_eq!(ring.overlap(&ring.polygon()), 1.0);
        let island = mask(&["#######", "#.....#", "#..#..#", "#.....#", "#######"]);
        // The shortest cut crosses one pixel outside the mask.
        assert_eq!(island.overlap(&island.polygon()), 21.0 / 22.0);
    }

    #[test]
    fn a_cut_is_as_short_as_can_be() {
        let two = mask(&["###......", "###....##", "......###"]);
        assert_eq!(two.overlap(&two.polygon()), 11.0 / 14.0);
        // Cuts do not leave the box, since there may be no image outside it.
        let apart = mask(&["##.##", "##.##"]);
        assert_eq!(apart.overlap(&apart.polygon()), 8.0 / 9.0);
        assert!(apart.polygon().iter().all(|c| (3..8).contains(&c.pixel.0) && (5..7).contains(&c.pixel.1)));
    }

    #[test]
    fn a_mask_of_nothing_is_no_polygon() {
        assert!(mask(&["..", ".."]).polygon().is_empty());
    }

    proptest! {
        #[test]
        fn one_part_with_its_holes_comes_back_and_many_lose_nothing_of_theirs(
            width in 1_u32..24, height in 1_u32..24, share in 0.0..1.0_f64, seed in any::<u64>(),
        ) {
            let mut bits = seed;
            let inside: Vec<bool> = (0..width * height).map(|_| {
                bits = bits.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                ((bits >> 40).to_f64() / (1_u64 << 24).to_f64()) < share
            }).collect();
            let mask = Mask::new(Box2([0, 0, width, height]), |x, y| inside[(y * width + x).to_usize()]);
            let polygon = mask.polygon();
            prop_assert_eq!(polygon.is_empty(), !inside.contains(&true));
            // Cuts and holes have no area.
            prop_assert_eq!(area(&polygon).to_usize(), inside.iter().filter(|inside| **inside).count());
            let painted = mask.paint(&polygon.iter().map(|c| plus(c.pixel, (1, 1))).collect::<Vec<_>>());
            // OpenCV paints edges between truncated corners, which must run along rows, columns and diagonals.
            let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
            let steps = edges.map(|(a, b)| ((b.pixel.0 - a.pixel.0).abs(), (b.pixel.1 - a.pixel.1).abs()));
            prop_assert!(steps.into_iter().all(|(x, y)| x == 0 || y == 0 || x == y));
            prop_assert!(painted.iter().zip(&mask.inside).all(|(painted, inside)| *painted || !inside));
            if parts(&mask) == 1 {
                prop_assert_eq!(&painted, &mask.inside);
                prop_assert_eq!(mask.overlap(&polygon), 1.0);
            }
        }
    }
}
