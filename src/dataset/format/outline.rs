//! A mask as one closed polygon, with holes and parts joined by cuts, and the mask that readers make of it again.
//!
//! Readers of polygons fill them on the grid of pixels and paint their edges too (OpenCV's `fillPoly`, even-odd). So the polygon runs
//! through the centres of a part's outermost pixels, not along their outer borders: filled that way, a part with all its holes comes back
//! exactly. Parts and holes are joined by cuts that go there and back over the same pixels. A cut is painted; it goes over pixels
//! of the mask as far as it can, and over as few others as there must be. Those are all that is lost.
//!
//! Sources: borders, Suzuki and Abe 1985, "Topological Structural Analysis of Digitized Binary Images by Border Following",
//! algorithm 1, which is what `findContours` runs; cuts, Dijkstra's shortest path on which pixels of the mask are free.

use crate::dataset::rle::Box2;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A pixel: column and row.
pub(super) type Pixel = (i32, i32);

/// The mask of one thing in its box, with a margin of one pixel about it.
pub(super) struct Mask {
    /// Column and row of the image where the box begins.
    origin: Pixel,
    width: i32,
    height: i32,
    inside: Vec<bool>,
}

/// The eight neighbours, clockwise on the screen from the right.
const AROUND: [Pixel; 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];

impl Mask {
    /// The pixels in `bounds` for which `inside(x, y)` holds.
    pub(super) fn new(bounds: Box2, inside: impl Fn(u32, u32) -> bool) -> Self {
        let [x0, y0, w, h] = bounds.0.map(|n| n as i32);
        let mut mask = Self {
            origin: (x0 - 1, y0 - 1),
            width: w + 2,
            height: h + 2,
            inside: vec![false; (w as usize + 2) * (h as usize + 2)],
        };
        for y in bounds.rows() {
            for x in bounds.columns() {
                let at = mask.at((x as i32 - mask.origin.0, y as i32 - mask.origin.1));
                mask.inside[at] = inside(x, y);
            }
        }
        mask
    }

    fn at(&self, (x, y): Pixel) -> usize {
        (y * self.width + x) as usize
    }

    /// Whether a pixel lies in the box, the margin left out.
    fn in_box(&self, (x, y): Pixel) -> bool {
        (1..self.width - 1).contains(&x) && (1..self.height - 1).contains(&y)
    }

    fn holds(&self, (x, y): Pixel) -> bool {
        self.in_box((x, y)) && self.inside[self.at((x, y))]
    }

    /// Borders of the parts and of their holes, each a closed chain of neighbouring pixels of the mask.
    fn borders(&self) -> Vec<Vec<Pixel>> {
        // What Suzuki and Abe write into the picture: 0 outside, 1 not yet met, k a border's number, −k where its right side is met.
        let mut marks: Vec<i32> = self.inside.iter().map(|i| i32::from(*i)).collect();
        let mut all = Vec::new();
        let mut number = 1;
        for y in 0..self.height {
            for x in 0..self.width {
                let mark = marks[self.at((x, y))];
                let outer = mark == 1 && !self.holds((x - 1, y));
                let hole = mark >= 1 && !self.holds((x + 1, y));
                if outer || hole {
                    number += 1;
                    // Towards the outside: left of an outer border, right of a hole's.
                    let outside = if outer { 4 } else { 0 };
                    all.push(self.follow((x, y), outside, number, &mut marks));
                }
            }
        }
        all
    }

    /// Follows the border that begins at a pixel whose neighbour in direction `outside` is not in the mask.
    fn follow(&self, start: Pixel, outside: usize, number: i32, marks: &mut [i32]) -> Vec<Pixel> {
        let step = |(x, y): Pixel, d: usize| (x + AROUND[d % 8].0, y + AROUND[d % 8].1);
        // The last pixel of the border: the first in the mask clockwise from the outside.
        let Some(last) = (0..8).map(|k| (outside + k) % 8).find(|d| self.holds(step(start, *d))) else {
            marks[self.at(start)] = -number;
            return vec![start];
        };
        let last = step(start, last);
        let mut chain = Vec::new();
        let (mut before, mut now) = (last, start);
        loop {
            chain.push(now);
            let back = (0..8).find(|d| step(now, *d) == before).unwrap_or(0);
            // Counterclockwise from where it came, to the next pixel of the mask.
            let mut right_is_outside = false;
            let mut next = before;
            for k in 1..=8 {
                let d = (back + 8 - k) % 8;
                if self.holds(step(now, d)) {
                    next = step(now, d);
                    break;
                }
                right_is_outside |= d == 0;
            }
            let at = self.at(now);
            if right_is_outside {
                marks[at] = -number;
            } else if marks[at] == 1 {
                marks[at] = number;
            }
            if next == start && now == last {
                return chain;
            }
            (before, now) = (now, next);
        }
    }

    /// One closed chain of neighbouring pixels through all borders; empty for an empty mask. In the box's coordinates.
    fn chain(&self) -> Vec<Pixel> {
        let mut borders = self.borders();
        let mut of_pixel: Vec<Vec<usize>> = vec![Vec::new(); self.inside.len()];
        for (k, border) in borders.iter().enumerate() {
            for pixel in border {
                let at = self.at(*pixel);
                if of_pixel[at].last() != Some(&k) {
                    of_pixel[at].push(k);
                }
            }
        }
        let mut waiting: Vec<bool> = vec![true; borders.len()];
        let Some(first) = borders.first_mut() else { return Vec::new() };
        let mut chain = std::mem::take(first);
        waiting[0] = false;
        let mut search = Search::new(self);
        search.begin(&chain);
        while let Some(path) = search.nearest(|pixel| of_pixel[self.at(pixel)].iter().any(|k| waiting[*k])) {
            let Some(end) = path.last() else { break };
            let met: Vec<usize> = of_pixel[self.at(*end)].iter().copied().filter(|k| waiting[*k]).collect();
            search.begin(&path);
            for k in met {
                waiting[k] = false;
                let border = std::mem::take(&mut borders[k]);
                search.begin(&border);
                splice(&mut chain, &path, &border);
            }
        }
        chain
    }

    /// The polygon's corners as pixels of the image, none that lie on a straight line between their neighbours; at least three.
    pub(super) fn polygon(&self) -> Vec<Pixel> {
        let chain = self.chain();
        let n = chain.len();
        let towards = |a: Pixel, b: Pixel| (b.0 - a.0, b.1 - a.1);
        let turns = |i: &usize| {
            let (before, here, after) = (chain[(i + n - 1) % n], chain[*i], chain[(i + 1) % n]);
            towards(before, here) != towards(here, after)
        };
        let mut corners: Vec<Pixel> = (0..n).filter(turns).map(|i| chain[i]).collect();
        if corners.is_empty() {
            corners.extend(chain.first());
        }
        while !corners.is_empty() && corners.len() < 3 {
            corners.push(corners[corners.len() - 1]);
        }
        corners.into_iter().map(|(x, y)| (x + self.origin.0, y + self.origin.1)).collect()
    }

    /// Intersection over union of the mask and what a reader paints for the polygon; 1 where nothing is lost.
    pub(super) fn overlap(&self, polygon: &[Pixel]) -> f64 {
        let local: Vec<Pixel> = polygon.iter().map(|(x, y)| (x - self.origin.0, y - self.origin.1)).collect();
        let painted = self.paint(&local);
        let both = painted.iter().zip(&self.inside).filter(|(a, b)| **a && **b).count();
        let any = painted.iter().zip(&self.inside).filter(|(a, b)| **a || **b).count();
        if any == 0 { 1.0 } else { both as f64 / any as f64 }
    }

    /// The pixels of a polygon's edges, which run along rows, columns and diagonals, and those that it goes around an odd number of times.
    fn paint(&self, polygon: &[Pixel]) -> Vec<bool> {
        let mut edge = vec![false; self.inside.len()];
        // Whether an edge leads from a pixel to the row below.
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
                // On an edge the question is already answered.
                painted[at] = edge[at] || odd;
                odd ^= crosses[at];
            }
        }
        painted
    }
}

/// Inserts a border into a closed chain: along a path that begins on the chain and ends on the border, around it, and back.
fn splice(chain: &mut Vec<Pixel>, path: &[Pixel], border: &[Pixel]) {
    let (Some(from), Some(to)) = (path.first(), path.last()) else { return };
    let (Some(here), Some(there)) = (chain.iter().position(|p| p == from), border.iter().position(|p| p == to)) else {
        return;
    };
    let mut detour: Vec<Pixel> = path[1..].to_vec();
    if border.len() > 1 {
        detour.extend(border[there..].iter().chain(&border[..there]).skip(1));
        detour.push(*to);
    }
    detour.extend(path.iter().rev().skip(1));
    let rest = chain.split_off(here + 1);
    chain.extend(detour);
    chain.extend(rest);
}

/// Ways from what is joined to what is not: steps over pixels of the mask cost nothing, others one each.
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

    /// Ways may begin at these pixels.
    fn begin(&mut self, pixels: &[Pixel]) {
        for pixel in pixels {
            let at = self.mask.at(*pixel);
            self.cost[at] = 0;
            self.before[at] = None;
            self.queue.push(Reverse((0, *pixel)));
        }
    }

    /// The cheapest way to a pixel that is wanted, from where it begins; `None` where there is none.
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

    /// `#` is inside.
    fn mask(rows: &[&str]) -> Mask {
        let bounds = Box2([3, 5, rows[0].len() as u32, rows.len() as u32]);
        Mask::new(bounds, |x, y| rows[y as usize - 5].as_bytes()[x as usize - 3] == b'#')
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

    #[test]
    fn a_rectangle_has_four_corners() {
        let mask = mask(&["####", "####", "####"]);
        let mut corners = mask.polygon();
        corners.sort_unstable();
        assert_eq!(corners, [(3, 5), (3, 7), (6, 5), (6, 7)]);
        assert_eq!(mask.overlap(&mask.polygon()), 1.0);
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
        // One pixel lies between them at the nearest.
        assert_eq!(island.overlap(&island.polygon()), 21.0 / 22.0);
    }

    #[test]
    fn a_cut_is_as_short_as_can_be() {
        let two = mask(&["###......", "###....##", "......###"]);
        assert_eq!(two.overlap(&two.polygon()), 11.0 / 14.0);
        // Nor does it leave the box, beyond which there may be no image.
        let apart = mask(&["##.##", "##.##"]);
        assert_eq!(apart.overlap(&apart.polygon()), 8.0 / 9.0);
        assert!(apart.polygon().iter().all(|(x, y)| (3..8).contains(x) && (5..7).contains(y)));
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
                ((bits >> 40) as f64 / (1_u64 << 24) as f64) < share
            }).collect();
            let mask = Mask::new(Box2([0, 0, width, height]), |x, y| inside[(y * width + x) as usize]);
            let polygon = mask.polygon();
            prop_assert_eq!(polygon.is_empty(), !inside.contains(&true));
            let painted = mask.paint(&polygon.iter().map(|(x, y)| (x + 1, y + 1)).collect::<Vec<_>>());
            prop_assert!(painted.iter().zip(&mask.inside).all(|(painted, inside)| *painted || !inside));
            if parts(&mask) == 1 {
                prop_assert_eq!(&painted, &mask.inside);
                prop_assert_eq!(mask.overlap(&polygon), 1.0);
            }
        }
    }
}
