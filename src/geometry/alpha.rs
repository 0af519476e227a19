//! Opacity masks, one bit a texel, and triangles sorted by what the mask says about them.
//!
//! A point is there or it is not: half-transparent texels are cut at ½, so colour and label see one geometry. Measured on
//! fields like ours, sorting triangles once (transparent dropped, opaque tested by nobody, only mixed ones asked) and
//! keeping the bits in 8×8 tiles of one `u64` costs 15–20 % of the ray rate against opaque leaves; a filter on every
//! triangle of a byte mask costs 30–55 %.

use crate::geometry::Mesh;
use crate::math::{Vec2, vec2};

/// A one-bit opacity mask over uv ∈ [0, 1]²; outside it is transparent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AlphaMask {
    width: u32,
    height: u32,
    tiles_x: u32,
    tiles: Vec<u64>,
}

/// What a mask says about a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coverage {
    /// Every texel that the triangle touches is opaque.
    Opaque,
    /// Every texel that it touches is transparent.
    Transparent,
    /// Some of both: each hit must ask.
    Mixed,
}

impl AlphaMask {
    /// From a test on each texel (x, y).
    pub fn new(width: u32, height: u32, opaque: impl Fn(u32, u32) -> bool) -> Self {
        let (tiles_x, tiles_y) = (width.div_ceil(8), height.div_ceil(8));
        let mut tiles = vec![0u64; (tiles_x * tiles_y) as usize];
        for y in 0..height {
            for x in 0..width {
                if opaque(x, y) {
                    tiles[((y >> 3) * tiles_x + (x >> 3)) as usize] |= 1 << ((y & 7) * 8 + (x & 7));
                }
            }
        }
        Self { width, height, tiles_x, tiles }
    }

    /// The same mask without the texels for which `gone` is true of their middle, as uv.
    #[must_use]
    pub fn without(&self, gone: impl Fn(Vec2) -> bool) -> Self {
        let middle = |x: u32, y: u32| vec2((x as f32 + 0.5) / self.width as f32, (y as f32 + 0.5) / self.height as f32);
        Self::new(self.width, self.height, |x, y| self.texel(x as i32, y as i32) && !gone(middle(x, y)))
    }

    /// What of it hangs together with its foot, the lowest opaque texel of the middle column: what was cut off has fallen.
    #[must_use]
    pub fn hanging(&self) -> Self {
        let (w, h) = (self.width as i32, self.height as i32);
        let Some(foot) = (0..h).rev().find(|y| self.texel(w / 2, *y)) else { return self.clone() };
        let place = |x: i32, y: i32| (y * w + x) as usize;
        let mut kept = vec![false; (w * h) as usize];
        let mut open = vec![(w / 2, foot)];
        kept[place(w / 2, foot)] = true;
        while let Some((x, y)) = open.pop() {
            for (nx, ny) in [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)] {
                // `texel` is false outside, so the place is asked for inside only.
                if self.texel(nx, ny) && !kept[place(nx, ny)] {
                    kept[place(nx, ny)] = true;
                    open.push((nx, ny));
                }
            }
        }
        Self::new(self.width, self.height, |x, y| kept[place(x as i32, y as i32)])
    }

    /// Number of opaque texels.
    pub fn count(&self) -> u64 {
        self.tiles.iter().map(|t| u64::from(t.count_ones())).sum()
    }

    /// Width and height in texels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Whether texel (x, y) is opaque; false outside.
    #[inline]
    pub fn texel(&self, x: i32, y: i32) -> bool {
        if x < 0 || y < 0 || x >= self.width as i32 || y >= self.height as i32 {
            return false;
        }
        let (x, y) = (x as u32, y as u32);
        self.tiles[((y >> 3) * self.tiles_x + (x >> 3)) as usize] >> ((y & 7) * 8 + (x & 7)) & 1 == 1
    }

    /// Whether the point at `uv` is opaque: its nearest texel.
    #[inline]
    pub fn opaque_at(&self, uv: Vec2) -> bool {
        self.texel((uv.x * self.width as f32).floor() as i32, (uv.y * self.height as f32).floor() as i32)
    }

    /// The bits of tile (x, y), row by row; all transparent outside.
    #[inline]
    fn tile(&self, x: i32, y: i32) -> u64 {
        let tiles_y = self.tiles.len() as u32 / self.tiles_x.max(1);
        if x < 0 || y < 0 || x >= self.tiles_x as i32 || y >= tiles_y as i32 {
            return 0;
        }
        self.tiles[(y as u32 * self.tiles_x + x as u32) as usize]
    }

    /// What the mask says about the uv triangle. Conservative: `Mixed` where in doubt.
    pub fn coverage(&self, uv: [Vec2; 3]) -> Coverage {
        let scale = vec2(self.width as f32, self.height as f32);
        let t = uv.map(|p| p * scale);
        // A margin of a hundredth of a texel covers the rounding of interpolated uvs.
        let lo = (t[0].min(t[1]).min(t[2]) - 0.01).floor();
        let hi = (t[0].max(t[1]).max(t[2]) + 0.01).floor();
        let (lo, hi) = ([lo.x as i32, lo.y as i32], [hi.x as i32, hi.y as i32]);
        let (mut any_opaque, mut any_transparent) = (false, false);
        for tile_y in lo[1].div_euclid(8)..=hi[1].div_euclid(8) {
            for tile_x in lo[0].div_euclid(8)..=hi[0].div_euclid(8) {
                let corner = vec2(tile_x as f32, tile_y as f32) * 8.0;
                if !touches(&t, corner, 8.0) {
                    continue;
                }
                match self.tile(tile_x, tile_y) {
                    0 => any_transparent = true,
                    u64::MAX => any_opaque = true,
                    bits => {
                        for bit in 0..64u32 {
                            let (x, y) = (tile_x * 8 + (bit & 7) as i32, tile_y * 8 + (bit >> 3) as i32);
                            let inside = x >= lo[0] && x <= hi[0] && y >= lo[1] && y <= hi[1];
                            if inside && touches(&t, vec2(x as f32, y as f32), 1.0) {
                                any_opaque |= bits >> bit & 1 == 1;
                                any_transparent |= bits >> bit & 1 == 0;
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

/// Whether the triangle may touch the square at `corner`, widened by a hundredth of a texel: separating axes of the edges.
fn touches(t: &[Vec2; 3], corner: Vec2, side: f32) -> bool {
    let half = 0.5 * side;
    let centre = corner + half;
    let orientation = (t[1] - t[0]).perp_dot(t[2] - t[0]);
    if orientation == 0.0 {
        return true;
    }
    (0..3).all(|i| {
        let (a, b) = (t[i], t[(i + 1) % 3]);
        let edge = (b - a) * orientation.signum();
        let inward = vec2(-edge.y, edge.x);
        let reach = (half + 0.01) * (inward.x.abs() + inward.y.abs());
        inward.dot(centre - a) >= -reach
    })
}

/// A mesh's triangles by what its mask says: indices of those always there, and of those that every hit must ask about.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sorted {
    /// Triangles that are opaque all over.
    pub opaque: Vec<u32>,
    /// Triangles with some of both.
    pub mixed: Vec<u32>,
}

/// Sorts a mesh's triangles by its mask; without a mask all are opaque.
pub fn sort(mesh: &Mesh, mask: Option<&AlphaMask>) -> Sorted {
    let Some(mask) = mask else {
        return Sorted { opaque: (0..mesh.triangles.len() as u32).collect(), mixed: Vec::new() };
    };
    let mut sorted = Sorted::default();
    for (i, t) in mesh.triangles.iter().enumerate() {
        match mask.coverage(t.map(|k| mesh.uvs[k as usize])) {
            Coverage::Opaque => sorted.opaque.push(i as u32),
            Coverage::Mixed => sorted.mixed.push(i as u32),
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
        AlphaMask::new(37, 53, |x, y| vec2(x as f32 + 0.5 - 18.0, y as f32 + 0.5 - 25.0).length() < 15.0)
    }

    proptest! {
        /// Rationale: a triangle sorted wrongly is a hole or a ghost. Expected: every sampled point agrees with its triangle's verdict.
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

    #[test]
    fn what_is_cut_off_falls() {
        let mask = disc();
        assert_eq!(mask.hanging(), mask);
        // A cut through the middle: the lower half has the foot.
        let cut = mask.without(|uv| (uv.y - 0.47).abs() < 0.04);
        let left = cut.hanging();
        assert!(left.count() < cut.count() && left.texel(18, 35) && !left.texel(18, 15));
        assert!((left.count() as f32 / cut.count() as f32 - 0.5).abs() < 0.1);
    }

    #[test]
    fn triangles_inside_the_disc_are_opaque_and_outside_dropped() {
        let mask = disc();
        assert_eq!(mask.coverage([vec2(0.45, 0.45), vec2(0.55, 0.45), vec2(0.5, 0.5)]), Coverage::Opaque);
        assert_eq!(mask.coverage([vec2(0.0, 0.0), vec2(0.05, 0.0), vec2(0.0, 0.05)]), Coverage::Transparent);
        assert_eq!(mask.coverage([vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(0.5, 1.0)]), Coverage::Mixed);
    }
}
