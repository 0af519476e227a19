//! Place, size and opening of one flower.

use furrow_base::math::{Frame, Vec3};

/// Place, size and opening of one flower.
#[derive(Clone, Copy, Debug)]
pub(in crate::plant) struct Bloom {
    /// End of its stalk, metres.
    pub(in crate::plant) base: Vec3,
    /// Frame: z along its axis, away from its stalk; x is the upward direction perpendicular to it.
    pub(in crate::plant) frame: Frame,
    /// Diameter or length, metres.
    pub(in crate::plant) size: f32,
    /// Opening: 0 closed, 1 open.
    pub(in crate::plant) opening: f32,
}
