//! Positions of plants: crops in rows, weeds in patches.
//!
//! All functions are pure functions of a description, an area and a random stream. Every plant is addressed by its slot
//! in a row or by its ground cell, not by its order in a list: a larger area contains the same plants at the same
//! positions, and an additional species does not move the others.

mod field;
mod record;
mod rows;
mod weeds;

pub use record::{RowsRecord, WeedsRecord};
pub use rows::{Rows, RowsDesc, rows, rows_looked_at};
pub use weeds::{ClustersDesc, WeedsDesc, weeds, weeds_looked_at};

use furrow_base::math::{ToFloat, Vec2, Vec3};
use furrow_base::sampling::Stream;

/// Lower left and upper right corner of a piece of ground, metres.
pub type Area = [Vec2; 2];

/// Disc where no plant may start: centre and radius, metres.
pub type Disc = (Vec2, f32);

/// Position of a plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Position, metres.
    pub at: Vec2,
    /// Address: the index of the plant's random stream, which does not depend on the area.
    pub key: u64,
}

/// Returns `true` if `p` is inside an area; its south and west sides are included.
fn within(area: Area, p: Vec2) -> bool {
    p.cmpge(area[0]).all() && p.cmplt(area[1]).all()
}

/// Removes the positions inside the discs: plants do not start inside stones.
pub fn outside(mut spots: Vec<Spot>, discs: &[Disc]) -> Vec<Spot> {
    spots.retain(|s| discs.iter().all(|(c, r)| s.at.distance_squared(*c) > r * r));
    spots
}

/// Draws the direction in which a plant starts to grow: the ground's normal plus white noise with the standard
/// deviation `noise_deg` about each of two axes.
pub fn axis(normal: Vec3, noise_deg: f32, stream: &mut Stream) -> Vec3 {
    let sd = noise_deg.to_radians();
    let n = normal.normalize_or(Vec3::Z);
    let (a, b) = n.any_orthonormal_pair();
    (n + a * (stream.normal().to_f32() * sd).tan() + b * (stream.normal().to_f32() * sd).tan()).normalize_or(n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::vec2;
    use furrow_base::sampling::Purpose;

    #[test]
    fn plants_grow_along_the_normal_give_or_take_the_noise() {
        let normal = Vec3::new(0.2, -0.1, 1.0).normalize();
        let mut s = Stream::of(1, 0, Purpose::Test, 0);
        let n = 4000;
        let squares: f32 = (0..n).map(|_| axis(normal, 5.0, &mut s).angle_between(normal).powi(2)).sum();
        let sd = (squares / n.to_f32() / 2.0).sqrt().to_degrees();
        assert!((sd - 5.0).abs() < 0.25, "{sd}");
        assert!(axis(normal, 0.0, &mut s).distance(normal) < 1e-6);
    }

    #[test]
    fn nothing_starts_inside_a_stone() {
        let spots: Vec<Spot> = (0..100).map(|k| Spot { at: vec2(k.to_f32() * 0.01, 0.0), key: k }).collect();
        let left = outside(spots, &[(vec2(0.5, 0.0), 0.1)]);
        assert!(left.len() < 85 && left.iter().all(|s| (s.at.x - 0.5).abs() > 0.1));
    }
}
