//! Which piece of ground, and which rows were sown on it.

use super::{Rect, SoilDesc};

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

/// Lengths from which on aggregates are bodies, over the length of the smallest that are told from the ground.
pub(super) const BODIES_FROM: f32 = 3.0;

/// Cells of the coarsest ground of full detail, metres.
pub const FULL_CELL_M: f32 = 4e-3;
/// Texels of its maps, metres.
pub const FULL_TEXEL_M: f32 = 2e-3;

/// Which piece of ground to make, and how finely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// What the camera sees, with room for what leans in.
    pub area: Rect,
    /// Grid spacing inside the area: 0.0008–0.001 for pixels of 0.25 mm.
    pub grid_m: f32,
    /// How far the coarse ground goes on beyond the area, for low suns and light that bounces.
    pub margin_m: f32,
    /// How much longer each of its cells is than the one before, above 1.
    pub growth: f32,
    /// How far from the world's origin the ground may be tilted, metres: level beyond, so that it ends at the horizon. Infinite where it need not.
    pub level_m: f32,
    /// Length of the smallest aggregates that are told from the ground, mm; those up to three times as long are drawn into its heights, even
    /// where the soil makes bodies of them. 0: as the soil says.
    pub smallest_mm: f32,
    /// The seed rows, if the ground was sown.
    pub rows: Option<SeedRows>,
}

/// Lengths of the aggregates of a ground, from the least to the greatest, mm; nothing where they are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sizes {
    /// What the soil calls crumbs, drawn into the heights.
    pub(super) crumbs: (f32, f32),
    /// What the soil makes bodies of, but the site draws into the heights.
    pub(super) drawn: (f32, f32),
    /// Of the two what is too small to be drawn.
    pub(super) unseen: [(f32, f32); 2],
    /// Bodies.
    pub(super) clods: (f32, f32),
    /// What is told from the ground, mm: what lies on it needs no finer shape. 0: as fine as it is made.
    pub(super) told: f32,
}

impl Site {
    /// How the aggregates of a soil are made here.
    pub(super) fn sizes(&self, desc: &SoilDesc) -> Sizes {
        let (crumb, clod) = (desc.crumbs.min_mm.f32(), desc.clods.min_mm.f32());
        // A soil whose clods' lengths run from high to low is refused only when it is made, after it was counted.
        let most = desc.clods.max_mm.f32().max(clod);
        let crumbs = (self.smallest_mm.clamp(crumb, clod.max(crumb)), clod);
        let body = (BODIES_FROM * self.smallest_mm).clamp(clod, most);
        let drawn = (self.smallest_mm.clamp(clod, body), body);
        Sizes {
            crumbs,
            drawn,
            unseen: [(crumb, crumbs.0), (clod, drawn.0)],
            clods: (body, most),
            told: self.smallest_mm,
        }
    }
}
