//! Soil crust: crumbs levelled by rain, with grain of half a millimetre to two, and pores.

use super::tile::Tile;
use furrow_base::math::{RoundTo, lerp, smoothstep};

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
}
