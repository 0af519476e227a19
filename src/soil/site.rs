//! Which piece of ground, and which rows were sown on it.

use super::Rect;

/// The seed rows that shaped the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeedRows {
    /// From row to row, metres.
    pub spacing_m: f32,
    /// Direction of the rows, radians clockwise from north.
    pub azimuth: f32,
    /// Distance of row 0 from the world's origin, measured towards the rows' right-hand side.
    pub offset_m: f32,
}

/// Which piece of ground to make, and how finely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// What the camera sees, with room for what leans in.
    pub area: Rect,
    /// Grid spacing inside the area: 0.0008–0.001 for pixels of 0.25 mm.
    pub grid_m: f32,
    /// How far the coarse ground goes on beyond the area, for low suns and light that bounces.
    pub margin_m: f32,
    /// The seed rows, if the ground was sown.
    pub rows: Option<SeedRows>,
}
