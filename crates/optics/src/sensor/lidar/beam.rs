//! Rays that sample one pulse.
//!
//! A pulse is a cone about its axis whose intensity falls as exp(−2 ρ²), with ρ = 1 at half the divergence. One ray on
//! the axis and rings of six and twelve rays represent the annuli 0 to 0.2, 0.2 to 0.6 and 0.6 to 1 of ρ. Each ring
//! carries its annulus' fraction of the energy within ρ = 1: exp(−2 a²) − exp(−2 b²) between a and b. Source: the
//! Gaussian beam, Siegman 1986, "Lasers", chapter 17.

use super::{Lidar, Pulse};
use furrow_base::math::{ToFloat, ToInt, Vec3};

/// Number of rays on each ring.
const RINGS: [u32; 3] = [1, 6, 12];
/// Distance between rings, in units of ρ.
const STEP: f64 = 0.4;
/// Smallest ray spacing used to choose geometric detail, metres.
const FINEST: f32 = 2e-3;

/// One ray of a pulse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamRay {
    /// Fraction of the pulse's energy.
    pub share: f32,
    /// Origin, metres, world.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
}

impl Lidar {
    /// Returns the rays of a pulse, starting with the one on its axis; only that one for a beam without width.
    pub fn rays(&self, pulse: &Pulse) -> Vec<BeamRay> {
        let axis = BeamRay { share: 1.0, origin: pulse.origin, direction: pulse.direction };
        if self.divergence == 0.0 && self.exit == 0.0 {
            return vec![axis];
        }
        let energy = |rho: f64| 1.0 - (-2.0 * rho * rho).exp();
        let edge = |ring: usize| STEP * (ring.to_f64() + 0.5);
        let mut rays = Vec::with_capacity(RINGS.iter().sum::<u32>().to_usize());
        for (ring, count) in RINGS.into_iter().enumerate() {
            let inner = if ring == 0 { 0.0 } else { energy(edge(ring - 1)) };
            let share = (energy(edge(ring)) - inner) / energy(1.0) / f64::from(count);
            let rho = (STEP * ring.to_f64()).to_f32();
            for k in 0..count {
                let angle = std::f32::consts::TAU * k.to_f32() / count.to_f32();
                let off = pulse.across[0] * (rho * angle.cos()) + pulse.across[1] * (rho * angle.sin());
                rays.push(BeamRay {
                    share: share.to_f32(),
                    origin: pulse.origin + off * (0.5 * self.exit),
                    direction: (pulse.direction + off * (0.5 * self.divergence)).normalize(),
                });
            }
        }
        rays
    }

    /// Returns the spacing of a pulse's rays at a distance, metres. It determines the geometric detail needed there and
    /// the texture footprint of a ray.
    pub fn spacing(&self, distance: f32) -> f32 {
        (0.5 * STEP.to_f32() * (self.exit + self.divergence * distance)).max(FINEST)
    }
}

#[cfg(test)]
mod tests {
    use crate::sensor::LidarDesc;
    use furrow_base::sampling::{Purpose, Stream};

    /// Expected: the fractions sum to 1. Their second moment is that of the Gaussian truncated at ρ = 1, ⟨ρ²⟩ = ½ −
    /// 1/(e² − 1) = 0.3435, within 10 %, the difference between a ring's radius and that of its annulus.
    #[test]
    fn rays_have_the_energy_and_the_width_of_a_gaussian_beam() {
        let desc = LidarDesc::named("Vlp16").unwrap();
        let lidar = desc.build(&mut Stream::of(1, 0, Purpose::Test, 0)).unwrap();
        let pulse = lidar.pulse(7, 3);
        let rays = lidar.rays(&pulse);
        let sum: f64 = rays.iter().map(|ray| f64::from(ray.share)).sum();
        assert!(rays.len() == 19 && (sum - 1.0).abs() < 1e-6, "{sum}");
        let half = 0.5 * f64::from(lidar.divergence);
        let rho = |ray: &super::BeamRay| f64::from(ray.direction.cross(pulse.direction).length()).asin() / half;
        let moment: f64 = rays.iter().map(|ray| f64::from(ray.share) * rho(ray).powi(2)).sum();
        let expected = 0.5 - 1.0 / (std::f64::consts::E.powi(2) - 1.0);
        assert!((moment / expected - 1.0).abs() < 0.1, "{moment}, not {expected}");
        let off = |k: usize| (rays[k].origin - pulse.origin).length();
        assert!(off(0) == 0.0 && (off(18) - 0.4 * lidar.exit).abs() < 1e-6);
    }
}
