//! What geometry costs before it is made: triangles, bytes and seconds, as estimates.

use std::iter::Sum;
use std::ops::{Add, Mul};

/// Bytes of a triangle with its share of corners: in the scene, in the ray tracing kernels' copy, and in their hierarchy. Measured:
/// docs/results.md, "Memory of a field".
const BYTES_PER_TRIANGLE: f64 = 170.0;
/// Bytes of a part beside its triangles: its material and the kernels' record of a geometry.
const BYTES_PER_PART: f64 = 2500.0;
/// Seconds of one core to make a triangle and to sort it into the hierarchy.
const SECONDS_PER_TRIANGLE: f64 = 1e-6;

/// An estimate of what something takes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Triangles.
    pub triangles: f64,
    /// Bytes of memory while it is rendered.
    pub bytes: f64,
    /// Seconds of one core until it is there.
    pub seconds: f64,
}

impl Cost {
    /// Of so many triangles in so many parts.
    pub fn of(triangles: f64, parts: f64) -> Self {
        let bytes = triangles * BYTES_PER_TRIANGLE + parts * BYTES_PER_PART;
        Self { triangles, bytes, seconds: triangles * SECONDS_PER_TRIANGLE }
    }

    /// Of work that leaves no triangles.
    pub fn work(bytes: f64, seconds: f64) -> Self {
        Self { triangles: 0.0, bytes, seconds }
    }
}

impl Add for Cost {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            triangles: self.triangles + other.triangles,
            bytes: self.bytes + other.bytes,
            seconds: self.seconds + other.seconds,
        }
    }
}

impl Mul<f64> for Cost {
    type Output = Self;

    fn mul(self, by: f64) -> Self {
        Self { triangles: self.triangles * by, bytes: self.bytes * by, seconds: self.seconds * by }
    }
}

impl Sum for Cost {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), Add::add)
    }
}
