//! Deforms a rest mesh: first applies the relief in the flat leaf's coordinates, then the joints by linear blend
//! skinning.
//!
//! Skinning moves a vertex p to `Σ wₖ · Mₖ · p`, where Mₖ is the motion of joint k from the flat leaf to the posture.
//! Source: Magnenat-Thalmann, Laperrière & Thalmann 1988, "Joint-dependent local deformations for hand animation and
//! object grasping", Graphics Interface. The bend per joint is small, so the volume loss for which this method is known
//! is not visible.
//!
//! The relief covers the deformations that are finer than the joints: the fold along the midrib, the curl of both
//! halves, the waves of the margin, the blisters between secondary veins, sway and twist. It is applied to the straight
//! leaf and carried along by the joints.

use super::blade::{BladeGrid, RestMesh};
use super::skeleton::{Pose, Skeleton};
use furrow_base::geometry::Mesh;
use furrow_base::math::{ToFloat, Vec3, smoothstep, vec3};
use furrow_optics::texture::noise::Perlin;
use std::f32::consts::{PI, TAU};

/// Relief of one blade. All zero is the flat blade.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BladeRelief {
    /// Angle between each half and the blade's plane at the base, radians.
    pub fold: f32,
    /// The same angle at the tip, radians.
    pub fold_tip: f32,
    /// Additional bend of each half between midrib and margin, radians; negative values let the margins hang.
    pub curl: f32,
    /// Amplitude of the margin's waves, as a fraction of the length.
    pub wave: f32,
    /// Period of the waves along the midrib, as a fraction of the length.
    pub period: f32,
    /// Height of the blisters between the secondary veins, as a fraction of the length.
    pub quilt: f32,
    /// Number of pairs of secondary veins; blisters form between them.
    pub pairs: f32,
    /// Cotangent of the angle between midrib and secondary veins: waves and blisters run along them.
    pub slant: f32,
    /// Difference between the widths of the right and the left half, as a fraction of the half-width.
    pub asymmetry: f32,
    /// Sideways bow of the midrib, as a fraction of the length.
    pub sway: f32,
    /// Twist about the midrib from base to tip, radians.
    pub twist: f32,
    /// Seed of the noise of waves and blisters.
    pub seed: u32,
}

impl BladeRelief {
    /// Applies the relief to a flat sheet.
    pub fn apply(&self, sheet: &mut BladeGrid, length: f32) {
        if *self == (Self { seed: self.seed, ..Self::default() }) {
            return;
        }
        let noise = Perlin::new(self.seed);
        let stride = sheet.columns + 1;
        let middle = sheet.columns / 2;
        for (i, (t, half_width)) in sheet.t.iter().zip(&sheet.half_width).enumerate() {
            let t = t.clamp(0.0, 1.0);
            let row = &mut sheet.rest.positions[i * stride..(i + 1) * stride];
            let fold = self.fold + (self.fold_tip - self.fold) * t;
            for side in [-1.0_f32, 1.0] {
                let widen = 1.0 + 0.5 * side * self.asymmetry;
                let (mut x, mut z, mut s, mut lift) = (0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32);
                for step in 1..=middle {
                    let k = if side < 0.0 { middle - step } else { middle + step };
                    let next = row[k].x.abs() * widen;
                    // The angle in the middle of this cell: the fold is rounded over the inner sixth.
                    let across = (0.5 * (s + next) / half_width).min(1.3);
                    let angle = fold * smoothstep(-0.08, 0.16, across) + self.curl * across;
                    let higher = self.lift(&noise, t, (next / half_width).min(1.15), side, next / length) * length;
                    // Height gained by a wave reduces its width: margins of wavy leaves look notched from above.
                    let (wide, climb) = (next - s, higher - lift);
                    let reach = (wide * wide - climb * climb).max(0.1 * wide * wide).sqrt();
                    x += reach * angle.cos();
                    z += reach * angle.sin();
                    (s, lift) = (next, higher);
                    row[k].x = side * (x - lift * angle.sin());
                    row[k].z = z + lift * angle.cos();
                }
            }
            for p in row {
                *p = self.carry(*p, length);
            }
        }
    }

    /// Applies sway and twist to a point, which may be off the blade, such as on the rib below it. Points at or before
    /// the base do not move.
    pub fn carry(&self, p: Vec3, length: f32) -> Vec3 {
        let t = (p.y / length).clamp(0.0, 1.0);
        let (sin, cos) = (self.twist * t).sin_cos();
        let bow = self.sway * length * (PI * t).sin() * t;
        vec3(p.x * cos + p.z * sin + bow, p.y, p.z * cos - p.x * sin)
    }

    /// Returns the height of waves and blisters above the folded half, as a fraction of the length.
    fn lift(&self, noise: &Perlin, t: f32, across: f32, side: f32, out: f32) -> f32 {
        if self.wave == 0.0 && self.quilt == 0.0 {
            return 0.0;
        }
        // Where the secondary vein through this point leaves the midrib.
        let origin = t - out * self.slant;
        let ends = smoothstep(0.0, 0.12, t) * smoothstep(1.0, 0.8, t);
        let mut lift = 0.0;
        if self.wave != 0.0 {
            // Phase and amplitude vary over about two periods, independently for the two margins.
            let wander = f64::from(origin / (2.2 * self.period.max(0.02)));
            let drift = noise.at2(wander, f64::from(side) * 7.3 + 0.5).to_f32();
            let swell = 1.0 + 1.3 * noise.at2(2.0 * wander + 31.7, f64::from(side) * 5.1 + 0.5).to_f32();
            let phase = TAU * (origin / self.period.max(0.02) + 0.8 * drift) + side;
            lift += self.wave * swell.max(0.1) * ends * across.powf(1.5) * phase.sin();
        }
        if self.quilt != 0.0 {
            // One blister between neighbouring secondary veins: high in its middle, zero on the midrib, lowest on the veins.
            let cell = (PI * self.pairs * origin).sin().abs();
            let patch = 1.0 + 0.8 * noise.at2(f64::from(9.0 * t), f64::from(side * across * 3.0) + 11.3).to_f32();
            lift += self.quilt * patch * ends * (cell - 0.35) * (PI * across.min(1.0)).sin();
        }
        lift
    }
}

/// Returns the positions of a rest mesh's vertices after the joints' motions.
pub fn bend(rest: &RestMesh, motions: &[Pose]) -> Vec<Vec3> {
    let carry = |(p, weights): (&Vec3, &super::skeleton::Weights)| {
        weights.iter().filter(|(_, w)| *w != 0.0).map(|(k, w)| *w * motions[usize::from(*k)].point(*p)).sum()
    };
    rest.positions.iter().zip(&rest.weights).map(carry).collect()
}

/// Returns the position of the midrib's point at `y` metres from the blade's base after the joints' motions.
pub fn carried(skeleton: &Skeleton, motions: &[Pose], y: f32) -> Vec3 {
    let weights = skeleton.weights_on_chain(y);
    weights.iter().map(|(k, w)| *w * motions[usize::from(*k)].point(vec3(0.0, y, 0.0))).sum()
}

/// Returns the deformed mesh with smooth normals. If `rigged`, it keeps the skin weights of its vertices.
pub fn skin(rest: RestMesh, motions: &[Pose], rigged: bool) -> Mesh {
    let positions = bend(&rest, motions);
    let mesh = Mesh::smooth(positions, rest.uvs, rest.triangles);
    if rigged { Mesh { weights: rest.weights, ..mesh } } else { mesh }
}

#[cfg(test)]
mod tests {
    use super::super::blade;
    use super::super::skeleton::{Measures, Skeleton};
    use super::*;
    use furrow_base::geometry::outline::Outline;

    fn skeleton() -> Skeleton {
        Skeleton::new(&Measures {
            stalk: 0.03,
            stalk_joints: 3,
            length: 0.08,
            veins: vec![0.2, 0.4, 0.6, 0.8],
            secondaries: Some((0.95, vec![0.018, 0.02, 0.016, 0.01])),
        })
    }

    #[test]
    fn zero_angles_give_the_flat_rest_mesh() {
        let s = skeleton();
        let mut sheet = blade::sheet(Outline::Power { a: 0.55, b: 1.0 }, 0.05, 20, 8, &s);
        BladeRelief::default().apply(&mut sheet, 0.08);
        let bent = bend(&sheet.rest, &s.motions(Pose::leaf(-0.03)));
        for (p, q) in sheet.rest.positions.iter().zip(&bent) {
            assert!(p.distance(*q) < 1e-7, "{p} {q}");
            assert_eq!(p.z, 0.0);
        }
    }

    #[test]
    fn a_bend_keeps_the_midribs_length() {
        let mut s = skeleton();
        for joint in &mut s.joints {
            if matches!(joint.name, super::super::skeleton::Name::Vn(_)) {
                joint.bend = -0.15;
            }
        }
        let sheet = blade::sheet(Outline::Power { a: 0.55, b: 1.0 }, 0.05, 40, 8, &s);
        let bent = bend(&sheet.rest, &s.motions(Pose::leaf(-0.03)));
        let length: f32 = (0..40).map(|i| bent[i * 9 + 4].distance(bent[(i + 1) * 9 + 4])).sum();
        let flat = 0.08 * (1.0 + 2.0 * blade::PAD);
        assert!((length / flat - 1.0).abs() < 0.01, "{length} {flat}");
        assert!(bent.iter().any(|p| p.z < -0.005));
    }

    #[test]
    fn fold_and_curl_keep_the_halves_width() {
        let s = skeleton();
        let mut sheet = blade::sheet(Outline::Power { a: 0.55, b: 1.0 }, 0.05, 20, 16, &s);
        let flat = sheet.rest.positions.clone();
        BladeRelief { fold: 0.6, fold_tip: 0.3, curl: -0.5, ..BladeRelief::default() }.apply(&mut sheet, 0.08);
        for i in 0..=20 {
            let walk = |p: &[Vec3]| (0..16).map(|j| p[i * 17 + j].distance(p[i * 17 + j + 1])).sum::<f32>();
            assert!((walk(&flat) - walk(&sheet.rest.positions)).abs() < 1e-6);
        }
        assert!(sheet.rest.positions.iter().any(|p| p.z > 0.003));
    }
}
