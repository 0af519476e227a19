//! Where things stand: crops in rows, weeds in patches.
//!
//! Pure functions of a scene file, an area and a stream. Every place has an address of its own (the slot of its row, the cell of
//! the ground), never its turn in a list: a larger area holds the same plants at the same places, and one more species
//! moves nothing of another.

mod field;
mod record;
mod rows;
mod weeds;

pub use record::{RowsRecord, WeedsRecord};
pub use rows::{Rows, RowsDesc, rows, rows_looked_at};
pub use weeds::{ClustersDesc, WeedsDesc, weeds, weeds_looked_at};

use crate::math::{Vec2, Vec3};
use crate::sampling::Stream;

/// Lower left and upper right corner of a piece of ground, metres.
pub type Area = [Vec2; 2];

/// A disc where nothing may start: centre and radius, metres.
pub type Disc = (Vec2, f32);

/// A place where a plant stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Where, metres.
    pub at: Vec2,
    /// Its address: the index of the plant's own stream, the same whatever the area.
    pub key: u64,
}

/// Whether `p` lies in an area; its south and west sides belong to it.
fn within(area: Area, p: Vec2) -> bool {
    p.cmpge(area[0]).all() && p.cmplt(area[1]).all()
}

/// Leaves out the spots inside the discs: plants do not start inside stones.
pub fn outside(mut spots: Vec<Spot>, discs: &[Disc]) -> Vec<Spot> {
    spots.retain(|s| discs.iter().all(|(c, r)| s.at.distance_squared(*c) > r * r));
    spots
}

/// The direction a plant first grows in: the ground's normal and a little white noise, `noise_deg` its standard deviation
/// about each of two axes.
pub fn axis(normal: Vec3, noise_deg: f32, stream: &mut Stream) -> Vec3 {
    let sd = noise_deg.to_radians();
    let n = normal.normalize_or(Vec3::Z);
    let (a, b) = n.any_orthonormal_pair();
    (n + a * (stream.normal() as f32 * sd).tan() + b * (stream.normal() as f32 * sd).tan()).normalize_or(n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec2;
    use crate::sampling::Purpose;

    #[test]
    fn plants_grow_along_the_normal_give_or_take_the_noise() {
        let normal = Vec3::new(0.2, -0.1, 1.0).normalize();
        let mut s = Stream::of(1, 0, Purpose::Test, 0);
        let n = 4000;
        let squares: f32 = (0..n).map(|_| axis(normal, 5.0, &mut s).angle_between(normal).powi(2)).sum();
        let sd = (squares / n as f32 / 2.0).sqrt().to_degrees();
        assert!((sd - 5.0).abs() < 0.25, "{sd}");
        assert!(axis(normal, 0.0, &mut s).distance(normal) < 1e-6);
    }

    #[test]
    fn nothing_starts_inside_a_stone() {
        let spots: Vec<Spot> = (0..100).map(|k| Spot { at: vec2(k as f32 * 0.01, 0.0), key: k }).collect();
        let left = outside(spots, &[(vec2(0.5, 0.0), 0.1)]);
        assert!(left.len() < 85 && left.iter().all(|s| (s.at.x - 0.5).abs() > 0.1));
    }
}
