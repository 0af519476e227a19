//! Teeth along a margin: each rises slowly from the sinus before it to a blunt tip and falls steeply into the next.

use furrow_base::math::smoothstep;

/// Position of a tooth's tip, as a fraction of the distance from one sinus to the next.
const TIP: f32 = 0.68;

/// Teeth on one side of a blade or a lobe. Positions are along its axis, 0 at the foot and 1 at the tip.
#[derive(Default)]
pub(super) struct Teeth {
    /// Position and depth of each sinus, from the foot; a tooth is between two. Depths are relative to the half-width
    /// or to the caller's scale.
    pub(super) sinuses: Vec<(f32, f32)>,
    /// Range of positions over which sinuses deepen, and range over which they become shallow again.
    pub(super) fades: [(f32, f32); 2],
}

impl Teeth {
    /// Returns the sinus depth at a position, in the unit of `sinuses`: zero at a tooth's tip and where there are no
    /// teeth.
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
