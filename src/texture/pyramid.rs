//! Mip pyramids in memory: each level half the one below it, texels in 4×4 tiles so that a bilinear tap stays in one or two
//! cache lines.

use crate::math::Vec2;

/// What lies outside uv ∈ [0, 1]².
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The nearest texel of the edge.
    #[default]
    Clamp,
    /// The image again: for textures that tile.
    Repeat,
}

impl Wrap {
    /// The texel of 0..n that stands at `i`.
    #[inline]
    pub fn index(self, i: i32, n: u32) -> u32 {
        match self {
            Self::Clamp => i.clamp(0, n as i32 - 1) as u32,
            Self::Repeat => i.rem_euclid(n as i32) as u32,
        }
    }

    /// A coordinate brought to where its texels lie.
    #[inline]
    fn coordinate(self, x: f32) -> f32 {
        match self {
            Self::Clamp => x.clamp(-1.0, 2.0),
            Self::Repeat => x - x.floor(),
        }
    }

    /// Two neighbouring texels of 0..n around the coordinate `x` (0..1 over the image), and the share of the second.
    #[inline]
    pub(super) fn pair(self, x: f32, n: u32) -> (u32, u32, f32) {
        let place = self.coordinate(x) * n as f32 - 0.5;
        let floor = place.floor();
        let i = floor as i32;
        // A coordinate that repeats is at most one texel outside: no division is needed to bring it back.
        let index = |i: i32| match self {
            Self::Repeat if i < 0 => n - 1,
            Self::Repeat if i as u32 >= n => 0,
            Self::Repeat => i as u32,
            Self::Clamp => self.index(i, n),
        };
        (index(i), index(i + 1), place - floor)
    }
}

/// One level.
#[derive(Clone, Debug)]
pub(super) struct Level<T> {
    pub(super) width: u32,
    pub(super) height: u32,
    tiles_x: u32,
    texels: Vec<T>,
}

impl<T: Copy> Level<T> {
    /// From the value of each texel (x, y); texels of the tiles beyond the edge repeat the last.
    pub(super) fn new(width: u32, height: u32, value: impl Fn(u32, u32) -> T) -> Self {
        let (tiles_x, tiles_y) = (width.div_ceil(4), height.div_ceil(4));
        let mut texels = Vec::with_capacity((tiles_x * tiles_y * 16) as usize);
        for tile in 0..tiles_x * tiles_y {
            let (x0, y0) = (tile % tiles_x * 4, tile / tiles_x * 4);
            for i in 0..16 {
                texels.push(value((x0 + i % 4).min(width - 1), (y0 + i / 4).min(height - 1)));
            }
        }
        Self { width, height, tiles_x, texels }
    }

    #[inline]
    pub(super) fn get(&self, x: u32, y: u32) -> T {
        self.texels[(((y >> 2) * self.tiles_x + (x >> 2)) * 16 + (y & 3) * 4 + (x & 3)) as usize]
    }
}

/// All levels, finest first.
#[derive(Clone, Debug)]
pub(super) struct Pyramid<T> {
    pub(super) levels: Vec<Level<T>>,
}

impl<T: Copy> Pyramid<T> {
    /// The four texels around `uv` on the level nearest to `lod`, with their weights.
    #[inline]
    pub(super) fn taps(&self, uv: Vec2, lod: f32, wrap: Wrap) -> [(T, f32); 4] {
        // `max` first: NaN becomes the finest level.
        let level = &self.levels[((lod.max(0.0) + 0.5) as usize).min(self.levels.len() - 1)];
        let (x0, x1, fx) = wrap.pair(uv.x, level.width);
        let (y0, y1, fy) = wrap.pair(uv.y, level.height);
        [
            (level.get(x0, y0), (1.0 - fx) * (1.0 - fy)),
            (level.get(x1, y0), fx * (1.0 - fy)),
            (level.get(x0, y1), (1.0 - fx) * fy),
            (level.get(x1, y1), fx * fy),
        ]
    }
}

/// An image of N numbers a texel, row by row: what pyramids are built from.
pub(super) struct Plane<const N: usize> {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) values: Vec<[f32; N]>,
}

impl<const N: usize> Plane<N> {
    #[inline]
    pub(super) fn get(&self, x: u32, y: u32) -> [f32; N] {
        self.values[(y * self.width + x) as usize]
    }
}

/// The next coarser plane, or `None` after one texel. Each texel is the exact mean of the area it covers, so odd sizes keep
/// the image's mean too.
pub(super) fn halve<const N: usize>(width: u32, height: u32, value: impl Fn(u32, u32) -> [f32; N]) -> Option<Plane<N>> {
    if width == 1 && height == 1 {
        return None;
    }
    let (w, h) = ((width / 2).max(1), (height / 2).max(1));
    let columns: Vec<_> = (0..w).map(|x| spans(x, width, w)).collect();
    let mut values = Vec::with_capacity((w * h) as usize);
    for y in 0..h {
        let rows = spans(y, height, h);
        for column in &columns {
            let mut sum = [0.0; N];
            for (dy, wy) in rows.weights.iter().enumerate().take(rows.count) {
                for (dx, wx) in column.weights.iter().enumerate().take(column.count) {
                    let v = value(column.first + dx as u32, rows.first + dy as u32);
                    let weight = wx * wy;
                    for (s, v) in sum.iter_mut().zip(v) {
                        *s += weight * v;
                    }
                }
            }
            values.push(sum);
        }
    }
    Some(Plane { width: w, height: h, values })
}

struct Spans {
    first: u32,
    count: usize,
    weights: [f32; 4],
}

/// Which of `n` texels the coarse texel `i` of `m` covers, and how much of each.
fn spans(i: u32, n: u32, m: u32) -> Spans {
    let scale = f64::from(n) / f64::from(m);
    let (start, end) = (f64::from(i) * scale, (f64::from(i) * scale + scale).min(f64::from(n)));
    let first = (start + 1e-9) as u32;
    let mut spans = Spans { first, count: 0, weights: [0.0; 4] };
    let mut at = f64::from(first);
    while at < end - 1e-9 && spans.count < 4 {
        spans.weights[spans.count] = (((at + 1.0).min(end) - at.max(start)) / scale) as f32;
        spans.count += 1;
        at += 1.0;
    }
    spans
}
