//! Directions of a beam behind two rotating prisms, which cover a circle with a rosette that does not repeat itself if the
//! ratio of their speeds is not a simple fraction.
//!
//! Each prism deflects the beam by half of the circle's radius R. Thin prisms add their deflections as vectors: the beam
//! is at the angle |d| from the axis in the direction of d,
//!
//! ```text
//! d = R/2 (cos φ₁ + cos φ₂, sin φ₁ + sin φ₂),  φᵢ = φᵢ₀ + 2π fᵢ t
//! ```
//!
//! Sources: Liu, Zhang & Hong 2022, "Low-cost retina-like robotic lidars based on incommensurable scanning", IEEE/ASME
//! Transactions on Mechatronics 27; Marshall 1999, "Risley prism scan patterns", SPIE 3787.

use std::f64::consts::TAU;

/// Two rotating prisms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rosette {
    /// Largest angle from the axis, degrees.
    pub(super) radius_deg: f64,
    /// Turns per second of each prism; of opposite signs if they turn against each other.
    pub(super) speeds_hz: [f64; 2],
    /// Phases at the start of the scan, turns.
    pub(super) phases: [f64; 2],
}

impl Rosette {
    /// Returns azimuth and elevation of the beam, degrees, at a time in seconds.
    pub(super) fn at(&self, time_s: f64) -> [f64; 2] {
        let turns = [0, 1].map(|k| TAU * (self.phases[k] + self.speeds_hz[k] * time_s).fract());
        let half = 0.5 * self.radius_deg.to_radians();
        let [x, z] = [turns.map(f64::cos), turns.map(f64::sin)].map(|of| half * (of[0] + of[1]));
        let angle = x.hypot(z);
        // sin(d)/d is 1 on the axis.
        let share = if angle > 1e-9 { angle.sin() / angle } else { 1.0 };
        let elevation = (share * z).asin();
        [(share * x).atan2(angle.cos()).to_degrees(), elevation.to_degrees()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::{RoundTo, ToFloat};
    use std::collections::BTreeSet;

    const MID: Rosette = Rosette { radius_deg: 19.2, speeds_hz: [121.57, -77.73], phases: [0.0, 0.0] };

    /// Expected: at time 0 both prisms deflect to the right, by the whole radius; half a turn of one against the other
    /// looks along the axis; no direction is outside the circle.
    #[test]
    fn prisms_add_their_deflections() {
        let [azimuth, elevation] = MID.at(0.0);
        assert!((azimuth - 19.2).abs() < 1e-9 && elevation.abs() < 1e-9, "{azimuth} {elevation}");
        let opposed = Rosette { phases: [0.0, 0.5], ..MID }.at(0.0);
        assert!(opposed.iter().all(|of| of.abs() < 1e-6), "{opposed:?}");
        let up = Rosette { phases: [0.25, 0.25], ..MID }.at(0.0);
        assert!((up[1] - 19.2).abs() < 1e-9 && up[0].abs() < 1e-9, "{up:?}");
        for k in 0..5000 {
            let [azimuth, elevation] = MID.at(f64::from(k) * 1e-5).map(f64::to_radians);
            assert!((azimuth.cos() * elevation.cos()).acos().to_degrees() < 19.2 + 1e-6);
        }
    }

    /// Rationale: this is what such a LiDAR is bought for. Expected: scans that last longer cover more of the circle, until
    /// nearly all of it is covered.
    #[test]
    fn the_pattern_does_not_repeat_itself() {
        // Cells of a tenth of the radius.
        let cell = |of: f64| (of / 1.92).floor_to::<i32>();
        let inside = |[x, z]: &[i32; 2]| (f64::from(*x) + 0.5).hypot(f64::from(*z) + 0.5) < 9.0;
        let all = (-10..10).flat_map(|x| (-10..10).map(move |z| [x, z])).filter(inside).count();
        let after = |seconds: f64| {
            let directions = (0..20_000).map(|k| MID.at(seconds * f64::from(k) / 2e4).map(cell));
            directions.filter(inside).collect::<BTreeSet<_>>().len().to_f64() / all.to_f64()
        };
        let (short, middle, long) = (after(0.01), after(0.05), after(0.2));
        assert!(short < 0.5 && short < middle && middle < long && long > 0.97, "{short} {middle} {long}");
    }
}
