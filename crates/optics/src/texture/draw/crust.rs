//! Soil crust: crumbs levelled by rain, then cracked by drying.
//!
//! The small features make it look like soil: grain of half a millimetre to two, pores, hairline cracks that end within
//! a plate, plate margins that rise and crumble, and fragments of both in the cracks and beside them.

use super::cells::Cells;
use super::stamp::Stamp;
use super::tile::Tile;
use furrow_base::math::{RoundTo, ToFloat, Vec2, lerp, smoothstep, vec2, vec3};
use furrow_base::sampling::rng::Purpose;

/// Fragments: fraction of the ground that they would cover if they also lay on plates, and their smallest and largest
/// length, mm.
pub(super) const FRAGMENTS: (f32, f32, f32) = (0.7, 0.8, 6.0);

/// Relative depths of cracks between plates, cracks within plates, and hairlines.
const SHALLOW: [f32; 3] = [1.0, 0.8, 0.3];

impl Tile {
    /// Slakes the crumbs: rain levels them to a smooth, paler crust.
    pub(super) fn slake(&mut self) {
        let size = (self.size, self.size);
        let wrap = crate::texture::Wrap::Repeat;
        let soften = |t: &Self, mm: f32| {
            let radius = (mm * t.scale).round().max(1.0).trunc_to::<usize>();
            crate::texture::maps::blur(&crate::texture::maps::blur(&t.height, size, radius, wrap), size, radius, wrap)
        };
        let (soft, broad) = (soften(self, 1.0), soften(self, 9.0));
        let albedo = self.albedo;
        self.each(|t, x, y, i| {
            let sieve = smoothstep(-0.2, 0.5, t.noise(x, y, 26.0, 4, 6));
            // Slaked crumbs still show where the crust is thin.
            let shows = lerp(0.18, 0.8, sieve);
            // Grain is patchy because rain has sorted sand from silt.
            let coarse = lerp(0.45, 1.0, smoothstep(-0.3, 0.3, t.noise(x, y, 14.0, 3, 10)));
            let grain = coarse * t.noise(x, y, 1.7, 3, 7);
            let knobs = coarse * t.noise(x, y, 4.5, 2, 11);
            let pore = smoothstep(0.42, 0.56, t.noise(x, y, 2.6, 3, 8));
            let relief = 0.42 * grain + 0.4 * knobs - 0.55 * pore;
            let h = 4.6 + 0.45 * (broad[i] - 2.6) + 0.5 * shows * (soft[i] - broad[i]) + relief;
            let veil = albedo * (1.0 + 0.10 * t.noise(x, y, 60.0, 5, 9) + 0.10 * t.noise(x, y, 11.0, 3, 12));
            let colour = veil.lerp(t.colour[i], 0.25 + 0.4 * shows) * (1.0 + 0.22 * grain + 0.08 * knobs - 0.14 * pore);
            (h, colour * t.grain_hue(x, y))
        });
    }

    /// Cracks the crust into plates. Returns for each pixel how close it is to a crack; 1 within a wide one.
    pub(super) fn crack(&mut self, plate: f32, widest: f32, depth: f32) -> Vec<f32> {
        let seed = u64::from(self.stream.child(Purpose::Texture, 3).seed32());
        let layers =
            [(plate, 1.0, 0.0), (plate / 2.9, 0.3, 0.75), (plate / 6.0, 0.11, 0.8)].map(|(mm, width, missing)| {
                let n = (self.period_mm / mm).round().max(1.0);
                (
                    Cells::new(seed + mm.trunc_to::<u64>(), (n.trunc_to::<u32>(), n.trunc_to::<u32>()), 0.9),
                    n,
                    width,
                    missing,
                )
            });
        let mut near = vec![0.0; self.height.len()];
        self.each(|t, x, y, i| {
            let bend = |mm: f32, layer: u64| vec2(t.noise(x, y, mm, 5, layer), t.noise(x, y, mm, 5, layer + 1));
            let warp = bend(plate * 0.5, 20) * plate * 0.16;
            let ragged = bend(5.0, 24) * 0.9;
            let mut open = 0.0f32;
            let (mut curl, mut own, mut close) = (0.0f32, 0.5, 0.0f32);
            for (k, (cells, n, width, missing)) in layers.iter().enumerate() {
                let unit = t.period_mm / n;
                let p = (vec2(x + 0.5, y + 0.5) / t.scale + warp + ragged) / unit;
                let cell = cells.at(p);
                let away = cell.border * unit;
                if k == 0 {
                    own = cell.own;
                }
                // Only some plates crack again, and not along every line.
                if k == 1 && (own < 0.35 || cell.shared < missing - 0.6 * own) {
                    continue;
                }
                // Hairlines end within a plate.
                let runs = if k == 2 { smoothstep(-0.05, 0.2, t.noise(x, y, 30.0, 2, 32)) } else { 1.0 };
                if runs <= 0.0 || k == 2 && cell.shared < *missing {
                    continue;
                }
                let vary = lerp(0.35, 1.0, cell.shared) * (1.0 + 0.5 * t.noise(x, y, 18.0, 3, 30));
                let half = 0.5 * widest * width * vary.max(0.15) * runs;
                let pixel = 0.5 / t.scale;
                // Hairlines are shallower, and cracks narrower than a pixel are faded.
                let thin = SHALLOW[k] * (half / pixel).min(1.0);
                open = open.max(thin * (1.0 - smoothstep(half - pixel, half + pixel + 0.3 * half, away)));
                curl = curl.max(width * (-away / (0.05 * plate)).exp());
                close = close.max(width.sqrt() * (-(away - half).max(0.0) / 3.0).exp());
            }
            let wall = open * depth * (0.75 + 0.25 * t.noise(x, y, 4.0, 2, 31));
            near[i] = close;
            let crumbling = 1.0 + 0.9 * t.noise(x, y, 6.0, 3, 33);
            let h = t.height[i] + 1.5 * curl * crumbling - wall;
            let tone = 1.0 + 0.12 * (own - 0.5) + 0.09 * curl * crumbling;
            // The soil inside a crack is moister and therefore darker; its shadow is left to the renderer.
            (h, t.colour[i] * tone * (1.0 - 0.32 * open))
        });
        let lowest = self.height.iter().copied().fold(f32::MAX, f32::min);
        let lift = (0.2 - lowest).max(0.0);
        self.height.iter_mut().for_each(|h| *h += lift);
        near
    }

    /// Scatters fragments. Most of them are in cracks and beside them, given by `near`.
    pub(super) fn fragments(&mut self, near: &[f32]) {
        let mut s = self.stream.child(Purpose::Texture, 6);
        let (cover, low, high) = FRAGMENTS;
        for l in self.sizes(cover, low, high, 2.6, &mut s) {
            let centre = self.somewhere(&mut s);
            let dome = 0.5 * l * s.range32(0.6, 1.0);
            let sunk = dome * s.range32(0.15, 0.5);
            let axes = (vec2(0.5, 0.5 * s.range32(0.5, 0.95)) * l * self.scale).max(Vec2::splat(0.7));
            let bright = (1.3 * f64::from(self.spread) * s.normal()).exp().to_f32();
            let warm = s.normal().to_f32();
            let mut stamp = Stamp::new(centre, axes, 0.0, dome, s.range32(0.6, 1.0), &mut s);
            let patch = 0.35 * smoothstep(-0.1, 0.4, self.noise(centre.x, centre.y, 35.0, 3, 40));
            let i = centre.y.trunc_to::<usize>().min(self.size - 1) * self.size
                + centre.x.trunc_to::<usize>().min(self.size - 1);
            if s.uniform32() > 0.02 + 0.6 * patch + 0.7 * near[i] {
                continue;
            }
            stamp.bottom = self.surface(centre) - sunk;
            let own = self.albedo * bright * vec3(1.0 + 0.022 * warm, 1.0, 1.0 - 0.04 * warm);
            self.stamp(&stamp, |_, h, _| own * (0.94 + 0.1 * h), 0.2);
        }
    }
}
