//! Height maps over uv, for displacement or to derive normals.

use super::pyramid::Wrap;
use furrow_base::error::Result;
use furrow_base::math::{ToFloat, ToInt, Vec2, vec2};
use std::path::Path;

/// Height map with one f32 per texel. The unit is the caller's choice: [`Height::load`] scales to any; [`super::maps`]
/// uses fractions of the image's height.
#[derive(Clone, Debug)]
pub struct Height {
    width: u32,
    rows: u32,
    values: Vec<f32>,
    wrap: Wrap,
}

impl Height {
    /// Loads a grey PNG of 8 or 16 bits (a colour image is converted to luma). Black is 0, white is `range`.
    pub fn load(path: &Path, range: f32) -> Result<Self> {
        let grey = super::decode(path)?.into_luma16();
        let (width, height) = grey.dimensions();
        let values = grey.as_raw().iter().map(|&v| f32::from(v) * (range / 65535.0)).collect();
        Ok(Self::from_values(width, height, values))
    }

    /// Creates a map from rows of heights, top row first; `values` holds width × height of them.
    pub fn from_values(width: u32, height: u32, values: Vec<f32>) -> Self {
        assert!(width > 0 && height > 0 && values.len() == width.to_usize() * height.to_usize());
        Self { width, rows: height, values, wrap: Wrap::Clamp }
    }

    /// Returns the same heights with another wrap mode.
    #[must_use]
    pub fn wrapped(self, wrap: Wrap) -> Self {
        Self { wrap, ..self }
    }

    /// Returns the heights multiplied by `factor`.
    #[must_use]
    pub fn scaled(mut self, factor: f32) -> Self {
        self.values.iter_mut().for_each(|v| *v *= factor);
        self
    }

    /// Returns the wrap mode, which defines the heights outside uv ∈ [0, 1]².
    pub fn wrap(&self) -> Wrap {
        self.wrap
    }

    /// Returns width and height in texels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.rows)
    }

    /// Returns the heights, row by row, top row first.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Returns the bilinear height at `uv`.
    #[inline]
    pub fn at(&self, uv: Vec2) -> f32 {
        let ([a, b, c, d], fx, fy) = self.corners(uv);
        let (top, bottom) = (a + (b - a) * fx, c + (d - c) * fx);
        top + (bottom - top) * fy
    }

    /// Returns the slope of the bilinear surface at `uv`: change of height per image height to the right (+u) and up
    /// (−v), for square texels. Dimensionless if heights are in image heights.
    #[inline]
    pub fn slope(&self, uv: Vec2) -> Vec2 {
        let ([a, b, c, d], fx, fy) = self.corners(uv);
        let right = (b - a) * (1.0 - fy) + (d - c) * fy;
        let down = (c - a) * (1.0 - fx) + (d - b) * fx;
        vec2(right, -down) * self.rows.to_f32()
    }

    #[inline]
    fn corners(&self, uv: Vec2) -> ([f32; 4], f32, f32) {
        let (x0, x1, fx) = self.wrap.pair(uv.x, self.width);
        let (y0, y1, fy) = self.wrap.pair(uv.y, self.rows);
        let get = |x: u32, y: u32| self.values[y.to_usize() * self.width.to_usize() + x.to_usize()];
        ([get(x0, y0), get(x1, y0), get(x0, y1), get(x1, y1)], fx, fy)
    }
}
