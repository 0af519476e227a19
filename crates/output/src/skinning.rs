//! Joints and weights as formats with skins need them: glTF and USD.

use furrow_base::geometry::JointWeights;
use furrow_base::math::{DQuat, Mat3, Quat};

/// Merges duplicate joints of a vertex, drops those without weight, and normalises the weights to a sum of 1.
pub(crate) fn tidy(of: &JointWeights) -> ([u16; 4], [f32; 4]) {
    let (mut numbers, mut shares, mut used) = ([0; 4], [0.0; 4], 0);
    let sum: f32 = of.iter().map(|(_, weight)| weight).sum();
    for (joint, weight) in of.iter().filter(|(_, weight)| *weight > 0.0) {
        let place = numbers[..used].iter().position(|number| number == joint).unwrap_or(used);
        used = used.max(place + 1);
        numbers[place] = *joint;
        shares[place] += weight / sum;
    }
    (numbers, shares)
}

/// Returns the rotation of a joint with these axes.
pub(crate) fn rotation(axes: &Mat3) -> DQuat {
    Quat::from_mat3(axes).as_dquat().normalize()
}
