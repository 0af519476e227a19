//! Mip pyramids in memory. Each level is half the size of the finer one. Texels are stored in 4×4 tiles, so a bilinear
//! lookup touches one or two cache lines.

use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2};

/// Wrap mode: the values outside uv ∈ [0, 1]².
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The nearest texel of the edge.
    #[default]
    Clamp,
    /// Repeats the image, for textures that tile.
    Repeat,
    /// Repeats the image, every second time mirrored.
    Mirror,
}

impl Wrap {
    /// Returns the index within 0..n that `i` maps to.
    #[inline]
    pub fn index(self, i: i32, n: u32) -> u32 {
        match self {
            Self::Clamp => i.clamp(0, n.to_i32() - 1).to_u32(),
            Self::Repeat => i.rem_euclid(n.to_i32()).to_u32(),
            Self::Mirror => {
                let i = i.rem_euclid(2 * n.to_i32()).to_u32();
                i.min(2 * n - 1 - i)
            }
        }
    }

    /// Maps a coordinate into the range in which its texels are addressed.
    #[inline]
    fn coordinate(self, x: f32) -> f32 {
        match self {
            Self::Clamp => x.clamp(-1.0, 2.0),
            Self::Repeat => x - x.floor(),
            Self::Mirror => {
                let within = x - 2.0 * (0.5 * x).floor();
                within.min(2.0 - within)
            }
        }
    }

    /// Returns the indices of the two texels around the coordinate `x` (0..1 over the image of `n` texels) and the
    /// weight of the second.
    #[inline]
    pub(super) fn pair(self, x: f32, n: u32) -> (u32, u32, f32) {
        let place = self.coordinate(x) * n.to_f32() - 0.5;
        let floor = place.floor();
        let i = floor.trunc_to::<i32>();
        // A repeated coordinate is at most one texel outside, so no division is needed.
        let index = |i: i32| match self {
            Self::Repeat if i < 0 => n - 1,
            Self::Repeat if i.to_u32() >= n => 0,
            Self::Repeat => i.to_u32(),
            // A mirrored image continues with its own edge.
            Self::Clamp | Self::Mirror => Self::Clamp.index(i, n),
        };
        (index(i), index(i + 1), place - floor)
    }
}

/// One mip level.
#[derive(Clone, Debug)]
pub(super) struct Level<T> {
    pub(super) width: u32,
    pub(super) height: u32,
    tiles_x: u32,
    texels: Vec<T>,
}

impl<T: Copy> Level<T> {
    /// Creates the level from the value of each texel (x, y); tile texels beyond the edge repeat the last one.
    pub(super) fn new(width: u32, height: u32, value: impl Fn(u32, u32) -> T) -> Self {
        let (tiles_x, tiles_y) = (width.div_ceil(4), height.div_ceil(4));
        let mut texels = Vec::with_capacity((tiles_x * tiles_y * 16).to_usize());
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
        self.texels[(((y >> 2) * self.tiles_x + (x >> 2)) * 16 + (y & 3) * 4 + (x & 3)).to_usize()]
    }
}

/// All mip levels, finest first.
#[derive(Clone, Debug)]
pub(super) struct Pyramid<T> {
    pub(super) levels: Vec<Level<T>>,
}

impl<T: Copy> Pyramid<T> {
    /// Returns the four texels around `uv` on the level nearest to `lod`, with their bilinear weights.
    #[inline]
    pub(super) fn taps(&self, uv: Vec2, lod: f32, [across, down]: [Wrap; 2]) -> [(T, f32); 4] {
        // `max` comes first so that NaN selects the finest level.
        let level = &self.levels[(lod.max(0.0) + 0.5).trunc_to::<usize>().min(self.levels.len() - 1)];
        let (x0, x1, fx) = across.pair(uv.x, level.width);
        let (y0, y1, fy) = down.pair(uv.y, level.height);
        [
            (level.get(x0, y0), (1.0 - fx) * (1.0 - fy)),
            (level.get(x1, y0), fx * (1.0 - fy)),
            (level.get(x0, y1), (1.0 - fx) * fy),
            (level.get(x1, y1), fx * fy),
        ]
    }
}

/// Image with N floats per texel, row by row, from which pyramids are built.
pub(super) struct Plane<const N: usize> {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) values: Vec<[f32; N]>,
}

impl<const N: usize> Plane<N> {
    #[inline]
    pub(super) fn get(&self, x: u32, y: u32) -> [f32; N] {
        self.values[(y * self.width + x).to_usize()]
    }
}

/// Returns the next coarser plane, or `None` after a single texel. Each texel is the exact mean of the area it covers,
/// so odd sizes preserve the image's mean too.
pub(super) fn halve<const N: usize>(width: u32, height: u32, value: impl Fn(u32, u32) -> [f32; N]) -> Option<Plane<N>> {
    if width == 1 && height == 1 {
        return None;
    }
    let (w, h) = ((width / 2).max(1), (height / 2).max(1));
    if (2 * w, 2 * h) == (width, height) {
        return Some(quarter(w, h, value));
    }
    let columns: Vec<_> = (0..w).map(|x| spans(x, width, w)).collect();
    let mut values = Vec::with_capacity((w * h).to_usize());
    for y in 0..h {
        let rows = spans(y, height, h);
        for column in &columns {
            let mut sum = [0.0; N];
            for (dy, wy) in rows.weights.iter().enumerate().take(rows.count) {
                for (dx, wx) in column.weights.iter().enumerate().take(column.count) {
                    let v = value(column.first + dx.to_u32(), rows.first + dy.to_u32());
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

/// Returns the plane of `width` × `height` texels that are the means of two by two texels each: the same bits as by
/// [`spans`], in half of the time.
fn quarter<const N: usize>(width: u32, height: u32, value: impl Fn(u32, u32) -> [f32; N]) -> Plane<N> {
    let mut values = Vec::with_capacity((width * height).to_usize());
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (2 * y, 2 * x))) {
        let mut sum = [0.0; N];
        for v in [value(x, y), value(x + 1, y), value(x, y + 1), value(x + 1, y + 1)] {
            for (s, v) in sum.iter_mut().zip(v) {
                *s += 0.25 * v;
            }
        }
        values.push(sum);
    }
    Plane { width, height, values }
}

struct Spans {
    first: u32,
    count: usize,
    weights: [f32; 4],
}

/// Returns the texels of `n` that the coarse texel `i` of `m` covers, with their area weights.
fn spans(i: u32, n: u32, m: u32) -> Spans {
    let scale = f64::from(n) / f64::from(m);
    let (start, end) = (f64::from(i) * scale, (f64::from(i) * scale + scale).min(f64::from(n)));
    let first = (start + 1e-9).trunc_to::<u32>();
    let mut spans = Spans { first, count: 0, weights: [0.0; 4] };
    let mut at = f64::from(first);
    while at < end - 1e-9 && spans.count < 4 {
        spans.weights[spans.count] = (((at + 1.0).min(end) - at.max(start)) / scale).to_f32();
        spans.count += 1;
        at += 1.0;
    }
    spans
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: texels of an even plane are the means of four, with the bits of the general sum over the texels that
    /// [`spans`] names.
    #[test]
    fn even_planes_are_halved_like_others() {
        let value = |x: u32, y: u32| [(x * 7 + y * 13).to_f32().sin(), -(x.to_f32() / 3.0), 0.1 * y.to_f32()];
        let (width, height) = (10, 6);
        let plane = halve(width, height, value).unwrap();
        assert_eq!((plane.width, plane.height), (5, 3));
        for (y, x) in (0..3).flat_map(|y| (0..5).map(move |x| (y, x))) {
            let (rows, columns) = (spans(y, height, 3), spans(x, width, 5));
            assert_eq!((rows.first, rows.count, columns.first, columns.count), (2 * y, 2, 2 * x, 2));
            let mut sum = [0.0_f32; 3];
            for (j, i) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let v = value(columns.first + i.to_u32(), rows.first + j.to_u32());
                for (s, v) in sum.iter_mut().zip(v) {
                    *s += columns.weights[i] * rows.weights[j] * v;
                }
            }
            assert_eq!(plane.get(x, y).map(f32::to_bits), sum.map(f32::to_bits));
        }
    }
}
