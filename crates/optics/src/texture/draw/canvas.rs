//! Scalar images, strokes in them, and distance transforms.

use furrow_base::math::{RoundTo, ToFloat, Vec2};

/// One f32 per pixel, row by row, top first.
#[derive(Clone, Debug)]
pub(super) struct Canvas {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

impl Canvas {
    pub(super) fn new(width: usize, height: usize, value: f32) -> Self {
        Self { width, height, values: vec![value; width * height] }
    }

    /// Draws a tapered stroke from `a` to `b` (pixels) with half-widths `ra` to `rb`: full `strength` inside, falling
    /// smoothly to zero at twice the half-width. Strokes thinner than a pixel fade instead. Keeps the larger of the old
    /// and the new value.
    pub(super) fn stroke(&mut self, a: Vec2, b: Vec2, ra: f32, rb: f32, strength: f32) {
        const THINNEST: f32 = 0.45;
        let reach = 2.0 * ra.max(rb).max(THINNEST) + 1.0;
        let (lo, hi) = (a.min(b) - reach, a.max(b) + reach);
        let clip = |v: f32, n: usize| v.max(0.0).trunc_to::<usize>().min(n);
        let along = b - a;
        let length2 = along.length_squared().max(1e-12);
        for y in clip(lo.y, self.height)..clip(hi.y + 1.0, self.height) {
            for x in clip(lo.x, self.width)..clip(hi.x + 1.0, self.width) {
                let p = Vec2::new(x.to_f32() + 0.5, y.to_f32() + 0.5);
                let s = ((p - a).dot(along) / length2).clamp(0.0, 1.0);
                let radius = ra + (rb - ra) * s;
                let shown = radius.max(THINNEST);
                let d = (p - a - along * s).length() / shown;
                if d < 2.0 {
                    let fall = 1.0 - (d * 0.5);
                    let profile = (fall * fall * (3.0 - 2.0 * fall) * 1.6).min(1.0);
                    let v = strength * profile * (radius / shown).min(1.0);
                    let old = &mut self.values[y * self.width + x];
                    *old = old.max(v);
                }
            }
        }
    }

    /// Returns the distance in pixels from each pixel to the nearest one whose value is above `level`; huge if there is
    /// none. Source: Felzenszwalb & Huttenlocher 2012, "Distance transforms of sampled functions".
    pub(super) fn distance_to(&self, level: f32) -> Self {
        let mut out = Self::new(self.width, self.height, 0.0);
        for (o, v) in out.values.iter_mut().zip(&self.values) {
            *o = if *v > level { 0.0 } else { 1e12 };
        }
        let mut column = vec![0.0; self.height];
        for x in 0..self.width {
            for (c, row) in column.iter_mut().zip(out.values.chunks_exact(self.width)) {
                *c = row[x];
            }
            for (y, d) in lower_envelope(&column).into_iter().enumerate() {
                out.values[y * self.width + x] = d;
            }
        }
        for row in out.values.chunks_exact_mut(self.width) {
            let d = lower_envelope(row);
            for (o, d) in row.iter_mut().zip(d) {
                *o = d.max(0.0).sqrt();
            }
        }
        out
    }
}

/// Squared distance transform of one line.
fn lower_envelope(f: &[f32]) -> Vec<f32> {
    let n = f.len();
    let (mut parabola, mut from) = (vec![0usize; n], vec![0.0f64; n + 1]);
    let mut k = 0;
    from[0] = f64::NEG_INFINITY;
    from[1] = f64::INFINITY;
    let value = |q: usize| f64::from(f[q]) + (q * q).to_f64();
    for q in 1..n {
        loop {
            let p = parabola[k];
            let s = (value(q) - value(p)) / (2.0 * (q.to_f64() - p.to_f64()));
            if s <= from[k] && k > 0 {
                k -= 1;
                continue;
            }
            k += 1;
            parabola[k] = q;
            from[k] = s;
            from[k + 1] = f64::INFINITY;
            break;
        }
    }
    let mut k = 0;
    (0..n)
        .map(|q| {
            while from[k + 1] < q.to_f64() {
                k += 1;
            }
            let d = q.to_f64() - parabola[k].to_f64();
            (d * d + f64::from(f[parabola[k]])).to_f32()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_exact() {
        let mut c = Canvas::new(31, 17, 0.0);
        let marks = [(3usize, 4usize), (29, 1), (15, 16)];
        for (x, y) in marks {
            c.values[y * 31 + x] = 1.0;
        }
        let d = c.distance_to(0.5);
        for y in 0..17 {
            for x in 0..31 {
                let truth = marks
                    .iter()
                    .map(|(a, b)| (x.to_f32() - a.to_f32()).hypot(y.to_f32() - b.to_f32()))
                    .fold(f32::MAX, f32::min);
                assert!((d.values[y * 31 + x] - truth).abs() < 1e-3, "{x} {y}");
            }
        }
    }
}
