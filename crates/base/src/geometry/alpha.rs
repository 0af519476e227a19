//! Opacity masks with one bit per texel, and the classification of triangles by mask.
//!
//! Opacity is binary: half-transparent texels are thresholded at ½, so colour and labels see the same geometry. Each
//! triangle is classified once: transparent triangles are dropped, opaque ones skip the alpha test, and only mixed ones
//! are tested at each hit. The bits are stored in 8×8 tiles of one `u64`. On typical fields this costs 15–20 % of the
//! ray rate compared with fully opaque leaves; an alpha test on every triangle with a byte mask costs 30–55 %.

use crate::geometry::Mesh;
use crate::math::{RoundTo, ToFloat, ToInt, Vec2, vec2};

/// One-bit opacity mask over uv ∈ [0, 1]². Everything outside is transparent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AlphaMask {
    width: u32,
    height: u32,
    tiles_x: u32,
    tiles: Vec<u64>,
}

/// Maximum number of subdivisions of a triangle's sides in [`AlphaMask::share`].
const MOST_STEPS: f32 = 8.0;
/// Bits of the texels in the leftmost column (smallest x) of a tile.
const FIRST_COLUMN: u64 = 0x0101_0101_0101_0101;
/// Bits of the texels in the rightmost column (largest x) of a tile.
const LAST_COLUMN: u64 = FIRST_COLUMN << 7;

/// Flood fill within one tile: returns the bits of `within` that are 4-connected to `seeds`.
fn spread(mut seeds: u64, within: u64) -> u64 {
    loop {
        let across = (seeds & !LAST_COLUMN) << 1 | (seeds & !FIRST_COLUMN) >> 1;
        let grown = (seeds | across | seeds << 8 | seeds >> 8) & within;
        if grown == seeds {
            return seeds;
        }
        seeds = grown;
    }
}

/// Opacity of a triangle according to a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coverage {
    /// Every texel that the triangle touches is opaque.
    Opaque,
    /// Every texel that the triangle touches is transparent.
    Transparent,
    /// The triangle touches opaque and transparent texels: each hit needs an alpha test.
    Mixed,
}

impl AlphaMask {
    /// Builds a mask by calling `opaque` for each texel (x, y).
    pub fn new(width: u32, height: u32, opaque: impl Fn(u32, u32) -> bool) -> Self {
        let (tiles_x, tiles_y) = (width.div_ceil(8), height.div_ceil(8));
        let mut tiles = vec![0u64; (tiles_x * tiles_y).to_usize()];
        for y in 0..height {
            for x in 0..width {
                if opaque(x, y) {
                    tiles[((y >> 3) * tiles_x + (x >> 3)).to_usize()] |= 1 << ((y & 7) * 8 + (x & 7));
                }
            }
        }
        Self { width, height, tiles_x, tiles }
    }

    /// Makes texels transparent inside the uv box `[lo, hi]`, where `gone` returns `true` for the uv of the texel
    /// centre.
    pub fn cut(&mut self, [lo, hi]: [Vec2; 2], gone: impl Fn(Vec2) -> bool) {
        let size = vec2(self.width.to_f32(), self.height.to_f32());
        // One extra texel on each side covers the rounding of texel centres.
        let lo = (lo * size).floor() - 1.0;
        let hi = (hi * size).ceil() + 1.0;
        for y in lo.y.max(0.0).trunc_to::<u32>()..hi.y.clamp(0.0, size.y).trunc_to::<u32>() {
            for x in lo.x.max(0.0).trunc_to::<u32>()..hi.x.clamp(0.0, size.x).trunc_to::<u32>() {
                if self.texel(x.to_i32(), y.to_i32()) && gone(vec2(x.to_f32() + 0.5, y.to_f32() + 0.5) / size) {
                    self.tiles[((y >> 3) * self.tiles_x + (x >> 3)).to_usize()] &= !(1 << ((y & 7) * 8 + (x & 7)));
                }
            }
        }
    }

    /// Returns the 4-connected component that contains the base, the lowest opaque texel of the middle column. Severed
    /// pieces are removed, because they would have fallen off.
    #[must_use]
    pub fn hanging(&self) -> Self {
        let middle = self.width / 2;
        let Some(foot) = (0..self.height).rev().find(|y| self.texel(middle.to_i32(), y.to_i32())) else {
            return self.clone();
        };
        let across = self.tiles_x.to_usize();
        let place = |x: u32, y: u32| (y >> 3).to_usize() * across + (x >> 3).to_usize();
        let mut kept = vec![0u64; self.tiles.len()];
        let mut reached = kept.clone();
        let mut open = vec![place(middle, foot)];
        reached[open[0]] = 1 << ((foot & 7) * 8 + (middle & 7));
        while let Some(tile) = open.pop() {
            if reached[tile] & !kept[tile] == 0 {
                continue;
            }
            let all = spread(reached[tile], self.tiles[tile]);
            (kept[tile], reached[tile]) = (all, all);
            let x = tile % across;
            // Each edge of this tile becomes the opposite edge of the neighbouring tile.
            let right = (x + 1 < across).then_some((tile + 1, (all & LAST_COLUMN) >> 7));
            let left = (x > 0).then(|| (tile - 1, (all & FIRST_COLUMN) << 7));
            let below = (tile + across < kept.len()).then_some((tile + across, all >> 56));
            let above = (tile >= across).then(|| (tile - across, all << 56));
            for (next, edge) in [right, left, below, above].into_iter().flatten() {
                reached[next] |= edge & self.tiles[next];
                open.push(next);
            }
        }
        Self { tiles: kept, ..self.clone() }
    }

    /// Number of opaque texels.
    pub fn count(&self) -> u64 {
        self.tiles.iter().map(|t| u64::from(t.count_ones())).sum()
    }

    /// Returns width and height in texels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Returns `true` if texel (x, y) is opaque; `false` outside the mask.
    #[inline]
    pub fn texel(&self, x: i32, y: i32) -> bool {
        if x < 0 || y < 0 || x >= self.width.to_i32() || y >= self.height.to_i32() {
            return false;
        }
        let (x, y) = (x.to_u32(), y.to_u32());
        self.tiles[((y >> 3) * self.tiles_x + (x >> 3)).to_usize()] >> ((y & 7) * 8 + (x & 7)) & 1 == 1
    }

    /// Returns `true` if the texel at `uv` is opaque (nearest-neighbour lookup).
    #[inline]
    pub fn opaque_at(&self, uv: Vec2) -> bool {
        self.texel((uv.x * self.width.to_f32()).floor_to::<i32>(), (uv.y * self.height.to_f32()).floor_to::<i32>())
    }

    /// Returns the bits of tile (x, y) in row order; 0 (transparent) outside the mask.
    #[inline]
    fn tile(&self, x: i32, y: i32) -> u64 {
        let tiles_y = self.tiles.len().to_u32() / self.tiles_x.max(1);
        if x < 0 || y < 0 || x >= self.tiles_x.to_i32() || y >= tiles_y.to_i32() {
            return 0;
        }
        self.tiles[(y.to_u32() * self.tiles_x + x.to_u32()).to_usize()]
    }

    /// Returns the [`AlphaMask::coverage`] of a uv triangle and its opaque area fraction in 0..1. The fraction is exact
    /// for opaque and transparent triangles. Otherwise it is estimated from about two sample points per texel, at most
    /// 64.
    pub fn share(&self, uv: [Vec2; 3]) -> (Coverage, f64) {
        let coverage = self.coverage(uv);
        let share = match coverage {
            Coverage::Opaque => 1.0,
            Coverage::Transparent => 0.0,
            Coverage::Mixed => self.mixed_share(uv),
        };
        (coverage, share)
    }

    fn mixed_share(&self, uv: [Vec2; 3]) -> f64 {
        let scale = vec2(self.width.to_f32(), self.height.to_f32());
        let [a, b, c] = uv.map(|p| p * scale);
        let texels = 0.5 * (b - a).perp_dot(c - a).abs();
        let n = (2.0 * texels).sqrt().ceil().clamp(2.0, MOST_STEPS).trunc_to::<u32>();
        // Sample points: centroids of the n² congruent sub-triangles, first those with the triangle's own orientation,
        // then the reversed ones.
        let upright = (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j, 1.0 / 3.0)));
        let reversed = (1..n).flat_map(|i| (0..n - i).map(move |j| (i - 1, j, 2.0 / 3.0)));
        let opaque = upright.chain(reversed).filter(|(i, j, middle)| {
            let (u, v) = ((i.to_f32() + middle) / n.to_f32(), (j.to_f32() + middle) / n.to_f32());
            self.opaque_at(uv[0] * (1.0 - u - v) + uv[1] * u + uv[2] * v)
        });
        opaque.count().to_f64() / f64::from(n * n)
    }

    /// Classifies a uv triangle. Conservative: returns `Mixed` in doubt.
    pub fn coverage(&self, uv: [Vec2; 3]) -> Coverage {
        let scale = vec2(self.width.to_f32(), self.height.to_f32());
        let t = uv.map(|p| p * scale);
        // A margin of 0.01 texel covers the rounding of interpolated uvs.
        let lo = (t[0].min(t[1]).min(t[2]) - 0.01).floor();
        let hi = (t[0].max(t[1]).max(t[2]) + 0.01).floor();
        let (lo, hi) =
            ([lo.x.trunc_to::<i32>(), lo.y.trunc_to::<i32>()], [hi.x.trunc_to::<i32>(), hi.y.trunc_to::<i32>()]);
        let edges = Edges::of(&t);
        let (mut any_opaque, mut any_transparent) = (false, false);
        for tile_y in lo[1].div_euclid(8)..=hi[1].div_euclid(8) {
            let rows = lo[1].max(8 * tile_y)..=hi[1].min(8 * tile_y + 7);
            for tile_x in lo[0].div_euclid(8)..=hi[0].div_euclid(8) {
                let corner = vec2(tile_x.to_f32(), tile_y.to_f32()) * 8.0;
                if !edges.touch(corner, 8.0) {
                    continue;
                }
                match self.tile(tile_x, tile_y) {
                    0 => any_transparent = true,
                    u64::MAX => any_opaque = true,
                    bits => {
                        for y in rows.clone() {
                            for x in lo[0].max(8 * tile_x)..=hi[0].min(8 * tile_x + 7) {
                                let is_opaque = bits >> ((y & 7) * 8 + (x & 7)) & 1 == 1;
                                // Of each kind, one texel is enough.
                                let is_known = if is_opaque { any_opaque } else { any_transparent };
                                if !is_known && edges.touch(vec2(x.to_f32(), y.to_f32()), 1.0) {
                                    any_opaque |= is_opaque;
                                    any_transparent |= !is_opaque;
                                }
                            }
                        }
                    }
                }
                if any_opaque && any_transparent {
                    return Coverage::Mixed;
                }
            }
        }
        if any_opaque { Coverage::Opaque } else { Coverage::Transparent }
    }
}

/// Edges of a triangle: a corner on each, and its normal to the inside, as long as the edge. `None` for a triangle without area.
struct Edges(Option<[(Vec2, Vec2); 3]>);

impl Edges {
    fn of(t: &[Vec2; 3]) -> Self {
        let orientation = (t[1] - t[0]).perp_dot(t[2] - t[0]);
        let edge = |i: usize| {
            let edge = (t[(i + 1) % 3] - t[i]) * orientation.signum();
            (t[i], vec2(-edge.y, edge.x))
        };
        Self((orientation != 0.0).then(|| [edge(0), edge(1), edge(2)]))
    }

    /// Returns `true` if the triangle may touch the square at `corner`, widened by 0.01 texel. Tests only the separating axes
    /// normal to the triangle's edges.
    fn touch(&self, corner: Vec2, side: f32) -> bool {
        let half = 0.5 * side;
        let centre = corner + half;
        self.0.is_none_or(|edges| {
            edges.iter().all(|(a, inward)| {
                let reach = (half + 0.01) * (inward.x.abs() + inward.y.abs());
                inward.dot(centre - *a) >= -reach
            })
        })
    }
}

/// Triangles of a mesh classified by its mask. Fully transparent triangles are in neither list.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sorted {
    /// Indices of fully opaque triangles.
    pub opaque: Vec<u32>,
    /// Indices of mixed triangles, which need an alpha test at each hit.
    pub mixed: Vec<u32>,
}

/// Classifies the triangles of a mesh by its mask. Without a mask all of them are opaque.
pub fn sort(mesh: &Mesh, mask: Option<&AlphaMask>) -> Sorted {
    let Some(mask) = mask else {
        return Sorted { opaque: (0..mesh.triangles.len().to_u32()).collect(), mixed: Vec::new() };
    };
    let mut sorted = Sorted::default();
    for (i, t) in mesh.triangles.iter().enumerate() {
        match mask.coverage(t.map(|k| mesh.uvs[k.to_usize()])) {
            Coverage::Opaque => sorted.opaque.push(i.to_u32()),
            Coverage::Mixed => sorted.mixed.push(i.to_u32()),
            Coverage::Transparent => {}
        }
    }
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn disc() -> AlphaMask {
        AlphaMask::new(37, 53, |x, y| vec2(x.to_f32() + 0.5 - 18.0, y.to_f32() + 0.5 - 25.0).length() < 15.0)
    }

    proptest! {
        /// Rationale: a misclassified triangle is a hole or a ghost. Expected: the mask at every sampled point agrees
        /// with the class of its triangle.
        #[test]
        fn sorting_never_contradicts_the_mask(c in prop::array::uniform6(-0.1f32..1.1), w in prop::collection::vec((0f32..1.0, 0f32..1.0), 60)) {
            let mask = disc();
            let t = [vec2(c[0], c[1]), vec2(c[2], c[3]), vec2(c[4], c[5])];
            let verdict = mask.coverage(t);
            for (a, b) in w {
                let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
                let opaque = mask.opaque_at(t[0] * (1.0 - a - b) + t[1] * a + t[2] * b);
                match verdict {
                    Coverage::Opaque => prop_assert!(opaque),
                    Coverage::Transparent => prop_assert!(!opaque),
                    Coverage::Mixed => {}
                }
            }
        }
    }

    proptest! {
        /// Expected: the same texels as a flood fill from the base, whatever the shape. Source: flood fill over four
        /// neighbours.
        #[test]
        fn what_hangs_together_is_what_a_flood_reaches((w, h) in (1u32..40, 1u32..40), seed: u64, fill in 0.4f32..0.9) {
            let mut stream = crate::sampling::Stream::of(seed, 0, crate::sampling::Purpose::Test, 0);
            let texels: Vec<bool> = (0..w * h).map(|_| stream.uniform32() < fill).collect();
            let mask = AlphaMask::new(w, h, |x, y| texels[(y * w + x).to_usize()]);
            let mut kept = vec![false; texels.len()];
            let mut open: Vec<u32> = (0..h).rev().map(|y| y * w + w / 2).filter(|at| texels[at.to_usize()]).take(1).collect();
            let foot = !open.is_empty();
            while let Some(at) = open.pop() {
                if std::mem::replace(&mut kept[at.to_usize()], true) {
                    continue;
                }
                let (x, y) = (at % w, at / w);
                let next = [(x > 0, at.wrapping_sub(1)), (x + 1 < w, at + 1), (y > 0, at.wrapping_sub(w)), (y + 1 < h, at + w)];
                open.extend(next.iter().filter(|(there, at)| *there && texels[at.to_usize()]).map(|(_, at)| *at));
            }
            let expected = if foot { AlphaMask::new(w, h, |x, y| kept[(y * w + x).to_usize()]) } else { mask.clone() };
            prop_assert_eq!(mask.hanging(), expected);
        }

        /// Expected: a cut removes exactly the texels of the box for whose centres the predicate holds.
        #[test]
        fn a_cut_takes_what_is_gone((x, y) in (-0.2f32..1.2, -0.2f32..1.2), r in 0.0f32..0.5) {
            let gone = |uv: Vec2| uv.distance(vec2(x, y)) < r;
            let mut cut = disc();
            cut.cut([vec2(x - r, y - r), vec2(x + r, y + r)], gone);
            let middle = |x: u32, y: u32| vec2(x.to_f32() + 0.5, y.to_f32() + 0.5) / vec2(37.0, 53.0);
            prop_assert_eq!(cut, AlphaMask::new(37, 53, |x, y| disc().texel(x.to_i32(), y.to_i32()) && !gone(middle(x, y))));
        }
    }

    #[test]
    fn what_is_cut_off_falls() {
        let mask = disc();
        assert_eq!(mask.hanging(), mask);
        // A cut through the middle: the lower half contains the base.
        let mut cut = mask.clone();
        cut.cut([vec2(0.0, 0.4), vec2(1.0, 0.6)], |uv| (uv.y - 0.47).abs() < 0.04);
        let left = cut.hanging();
        assert!(left.count() < cut.count() && left.texel(18, 35) && !left.texel(18, 15));
        assert!((left.count().to_f32() / cut.count().to_f32() - 0.5).abs() < 0.1);
    }

    #[test]
    fn triangles_inside_the_disc_are_opaque_and_outside_dropped() {
        let mask = disc();
        assert_eq!(mask.coverage([vec2(0.45, 0.45), vec2(0.55, 0.45), vec2(0.5, 0.5)]), Coverage::Opaque);
        assert_eq!(mask.coverage([vec2(0.0, 0.0), vec2(0.05, 0.0), vec2(0.0, 0.05)]), Coverage::Transparent);
        assert_eq!(mask.coverage([vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(0.5, 1.0)]), Coverage::Mixed);
    }
}
