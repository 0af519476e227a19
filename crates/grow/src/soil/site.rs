//! Place and resolution of a piece of ground, and its seed rows.

use super::{Rect, SoilDesc};

/// Seed rows that shaped the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeedRows {
    /// Distance between rows, metres.
    pub spacing_m: f32,
    /// Direction of the rows, radians clockwise from north.
    pub azimuth: f32,
    /// Distance of row 0 from the world's origin, measured towards the rows' right-hand side.
    pub offset_m: f32,
}

/// Ratio of the length of the smallest body to that of the smallest resolved aggregate.
pub(super) const BODIES_FROM: f32 = 3.0;

/// Cell size of the coarsest ground at full detail, metres.
pub const FULL_CELL_M: f32 = 4e-3;
/// Texel size of its maps, metres.
pub const FULL_TEXEL_M: f32 = 2e-3;

/// Place and resolution of a piece of ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Area that the camera sees, with a margin for plants that lean into it.
    pub area: Rect,
    /// Grid spacing inside the area: 0.0008–0.001 for pixels of 0.25 mm.
    pub grid_m: f32,
    /// Extent of the coarse ground beyond the area, for low suns and indirect light.
    pub margin_m: f32,
    /// Growth factor from each of its cells to the next, above 1.
    pub growth: f32,
    /// Distance from the world's origin up to which the ground may be tilted, metres. Beyond it the ground is level, so
    /// that it ends at the horizon. Infinite if this is not needed.
    pub level_m: f32,
    /// Length of the smallest resolved aggregates, mm. Those up to three times as long are part of the heights, even
    /// where the soil's description makes them bodies. 0: as the soil's description says.
    pub smallest_mm: f32,
    /// Seed rows, if the ground was sown.
    pub rows: Option<SeedRows>,
}

/// Length ranges of the aggregates of a ground, mm; a range is empty where its ends are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sizes {
    /// Crumbs of the soil's description, which are part of the heights.
    pub(super) crumbs: (f32, f32),
    /// Clods of the soil's description that the site makes part of the heights.
    pub(super) drawn: (f32, f32),
    /// Unresolved crumbs and unresolved clods.
    pub(super) unseen: [(f32, f32); 2],
    /// Bodies.
    pub(super) clods: (f32, f32),
    /// Smallest resolved length, mm; bodies need no finer shape. 0: no limit.
    pub(super) resolved_mm: f32,
}

impl Site {
    /// Returns the length ranges of a soil's aggregates at this site.
    pub(super) fn sizes(&self, desc: &SoilDesc) -> Sizes {
        let (crumb, clod) = (desc.crumbs.min_mm.f32(), desc.clods.min_mm.f32());
        // A reversed range of clod lengths is refused later, when the ground is built, after the cost estimate.
        let most = desc.clods.max_mm.f32().max(clod);
        let crumbs = (self.smallest_mm.clamp(crumb, clod.max(crumb)), clod);
        let body = (BODIES_FROM * self.smallest_mm).clamp(clod, most);
        let drawn = (self.smallest_mm.clamp(clod, body), body);
        Sizes {
            crumbs,
            drawn,
            unseen: [(crumb, crumbs.0), (clod, drawn.0)],
            clods: (body, most),
            resolved_mm: self.smallest_mm,
        }
    }
}
