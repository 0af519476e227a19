//! The ground: soil layers blended by noise, relief, moisture, and the clods, stones and litter that lie on it.
//!
//! [`SoilDesc`] is what a scene file says. [`Ground`] is one piece of ground: a displaced grid ([`Ground::mesh`]) that goes on
//! beyond the view with growing cells, and a texture of its own ([`Ground::bake`]) with all that is finer than the grid.
//! The same blend weights drive both. Bodies are then laid on a [`Pile`], which remembers what lies there already, largest
//! first: [`stones()`], [`clods()`], [`litter()`]. [`InView`] says of which of them meshes are made.
//!
//! Every random number is addressed: noise by its field, a body by the cell of the world it fell into. A larger area holds
//! the same ground.

mod bake;
pub mod blend;
mod body;
mod canopy;
mod clod;
mod color;
mod crumb;
mod debris;
mod desc;
mod envelope;
mod estimate;
mod grid;
mod ground;
mod in_view;
mod lit;
mod litter;
mod openness;
mod pile;
mod record;
mod relief;
mod residue;
mod site;
mod stone;
mod stone_cover;
mod surface;
#[cfg(test)]
mod tests;
mod wheel;

pub use bake::GroundMaps;
pub use canopy::Canopy;
pub use clod::{Clods, clods};
pub use color::SoilColor;
pub use debris::{Debris, DebrisKind};
pub use desc::{
    BlendDesc, ClodsDesc, CrumbsDesc, LAYERS, LayerDesc, LitterDesc, MoistureDesc, ReliefDesc, RowReliefDesc, SoilDesc,
    StonesDesc,
};
pub use envelope::Envelope;
pub use estimate::{Expected, expected};
pub use ground::Ground;
pub use in_view::InView;
pub use litter::litter;
pub use pile::Pile;
pub use record::{
    ClodsRecord, LayerRecord, LitterRecord, MoistureRecord, ReliefRecord, RowReliefRecord, SoilRecord, WheelRecord,
};
pub use site::{FULL_CELL_M, FULL_TEXEL_M, SeedRows, Site};
pub use stone::stones;
pub use wheel::WheelDesc;

use crate::math::{Vec2, vec2};
use crate::sampling::{Purpose, Stream};

/// Slope angle of the soil's facets below a millimetre, radians. With explicit relief down to 1 mm Irons et al. 1992 leave 0.26–0.52.
pub const FACETS: f32 = 0.35;

/// The most layers that a ground blends.
pub const MAX_LAYERS: usize = 4;

/// The textures of one layer, read at tile coordinates: one tile is 0..1, and both repeat beyond.
pub trait LayerMaps {
    /// Height, 0 (black) to 1 (white).
    fn height(&self, uv: Vec2) -> f32;
    /// Linear reflectance R, G, B of the dry soil.
    fn albedo(&self, uv: Vec2) -> [f32; 3];
}

impl<T: LayerMaps + ?Sized> LayerMaps for &T {
    fn height(&self, uv: Vec2) -> f32 {
        (**self).height(uv)
    }
    fn albedo(&self, uv: Vec2) -> [f32; 3] {
        (**self).albedo(uv)
    }
}

impl<T: LayerMaps + ?Sized> LayerMaps for Box<T> {
    fn height(&self, uv: Vec2) -> f32 {
        (**self).height(uv)
    }
    fn albedo(&self, uv: Vec2) -> [f32; 3] {
        (**self).albedo(uv)
    }
}

impl<T: LayerMaps + ?Sized> LayerMaps for std::sync::Arc<T> {
    fn height(&self, uv: Vec2) -> f32 {
        (**self).height(uv)
    }
    fn albedo(&self, uv: Vec2) -> [f32; 3] {
        (**self).albedo(uv)
    }
}

/// A layer without textures: one colour, one height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plain {
    /// Linear reflectance.
    pub albedo: [f32; 3],
    /// Height, 0 to 1.
    pub height: f32,
}

impl LayerMaps for Plain {
    fn height(&self, _: Vec2) -> f32 {
        self.height
    }
    fn albedo(&self, _: Vec2) -> [f32; 3] {
        self.albedo
    }
}

/// A rectangle on the ground, metres, sides along x and y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// West side.
    pub x0: f32,
    /// South side.
    pub y0: f32,
    /// East side.
    pub x1: f32,
    /// North side.
    pub y1: f32,
}

impl Rect {
    /// The rectangle between two corners given as numbers.
    pub const fn new(x0: f32, y0: f32, x1: f32, y1: f32) -> Self {
        Self { x0, y0, x1, y1 }
    }

    /// Lower left and upper right corner.
    pub fn corners(self) -> [Vec2; 2] {
        [vec2(self.x0, self.y0), vec2(self.x1, self.y1)]
    }

    /// Size in x and y.
    pub fn size(self) -> Vec2 {
        vec2(self.x1 - self.x0, self.y1 - self.y0)
    }

    /// Square metres.
    pub fn area(self) -> f32 {
        self.size().x * self.size().y
    }

    /// Whether `p` lies inside; the south and west sides belong to it.
    pub fn contains(self, p: Vec2) -> bool {
        p.x >= self.x0 && p.x < self.x1 && p.y >= self.y0 && p.y < self.y1
    }

    /// Larger by `by` on every side.
    #[must_use]
    pub fn grown(self, by: f32) -> Self {
        Self { x0: self.x0 - by, y0: self.y0 - by, x1: self.x1 + by, y1: self.y1 + by }
    }
}

/// The stream of cell (i, j): the same wherever the area begins.
fn cell_stream(stream: &Stream, i: i32, j: i32) -> Stream {
    stream.child(Purpose::Debris, (u64::from(i as u32) << 32) | u64::from(j as u32))
}

/// The cells of side `cell` that touch a rectangle.
fn cells(area: Rect, cell: f32) -> impl Iterator<Item = (i32, i32)> {
    let range = |lo: f32, hi: f32| (lo / cell).floor() as i32..(hi / cell).ceil() as i32;
    let columns = range(area.x0, area.x1);
    range(area.y0, area.y1).flat_map(move |j| columns.clone().map(move |i| (i, j)))
}
