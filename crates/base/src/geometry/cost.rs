//! Estimates of what geometry costs before it is built: triangles, bytes and seconds.

use std::iter::Sum;
use std::ops::{Add, Mul};

/// Bytes per triangle including its share of vertices: in the scene, in the ray tracing kernel's copy, and in the BVH.
/// Measured: docs/results/rendering-speed.md, "Memory of a field".
const BYTES_PER_TRIANGLE: f64 = 170.0;
/// Bytes per part in addition to its triangles: its material and the ray tracing kernel's geometry record.
const BYTES_PER_PART: f64 = 2500.0;
/// Core-seconds to build a triangle and insert it into the BVH.
const SECONDS_PER_TRIANGLE: f64 = 1e-6;

/// Estimated cost of building and rendering geometry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Number of triangles.
    pub triangles: f64,
    /// Memory in bytes during rendering.
    pub bytes: f64,
    /// Build time in core-seconds.
    pub seconds: f64,
}

impl Cost {
    /// Estimates the cost of `triangles` triangles in `parts` parts.
    pub fn of(triangles: f64, parts: f64) -> Self {
        let bytes = triangles * BYTES_PER_TRIANGLE + parts * BYTES_PER_PART;
        Self { triangles, bytes, seconds: triangles * SECONDS_PER_TRIANGLE }
    }

    /// Cost of work that produces no triangles.
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
