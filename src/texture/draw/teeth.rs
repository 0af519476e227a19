//! Teeth along a margin: each rises slowly from the sinus before it to a blunt tip, and falls steeply into the next.

use crate::math::smoothstep;

/// Where the tip of a tooth is, of the way from one sinus to the next.
const TIP: f32 = 0.68;

/// The teeth of one side of a blade or of a lobe; places are counted along its axis, 0 at the foot and 1 at the tip.
#[derive(Default)]
pub(super) struct Teeth {
    /// Place and depth of each sinus, from the foot; a tooth stands between two. Depths are of the half-width, or of what the caller scales by.
    pub(super) sinuses: Vec<(f32, f32)>,
    /// Between which places sinuses grow to their depth, and between which they shrink again.
    pub(super) fades: [(f32, f32); 2],
}

impl Teeth {
    /// What the sinuses take at a place, of what their depths are of: nothing at a tooth's tip, and where no teeth are.
    pub(super) fn sinus(&self, t: f32) -> f32 {
        let i = self.sinuses.partition_point(|(place, _)| *place <= t);
        if i == 0 || i == self.sinuses.len() {
            return 0.0;
        }
        let ((start, low), (end, high)) = (self.sinuses[i - 1], self.sinuses[i]);
        let v = (t - start) / (end - start);
        let fall = if v < TIP { 1.0 - v / TIP } else { (v - TIP) / (1.0 - TIP) };
        let [(none, full), (still, gone)] = self.fades;
        let fade = smoothstep(none, full, t) * (1.0 - smoothstep(still, gone, t));
        fall * fall * (1.4 - 0.4 * fall) * if v < TIP { low } else { high } * fade
    }
}
