//! Ground: soil layers blended by noise, relief, moisture, and the clods, stones and litter on it.
//!
//! [`SoilDesc`] is the description in a scene file. [`Ground`] is one piece of ground: a displaced grid
//! ([`Ground::mesh`]) that continues beyond the view with growing cells, and a baked texture ([`Ground::bake`]) with
//! the detail that is finer than the grid. The same blend weights drive both. Bodies are then placed on a [`Pile`],
//! which tracks the height of everything placed so far, largest first: [`stones()`], [`clods()`], [`litter()`].
//! [`InView`] selects the bodies for which meshes are built.
//!
//! Every random number is addressed by place: noise by its field, a body by the world cell that it fell into. A larger
//! area therefore contains the same ground.

mod bake;
pub mod blend;
mod body;
mod canopy;
mod clod;
mod color;
mod crack;
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
mod pigments;
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
mod tool;
mod wheel;

pub use canopy::Canopy;
pub use clod::{Clods, clods};
pub use color::SoilColor;
pub use debris::{Debris, DebrisKind};
pub use desc::{
    BlendDesc, ClodsDesc, CracksDesc, CrumbsDesc, LAYERS, LayerDesc, LitterDesc, MoistureDesc, ReliefDesc,
    RowReliefDesc, SoilDesc, StonesDesc,
};
pub use envelope::Envelope;
pub use estimate::{Expected, expected};
pub use ground::{Ground, MOISTURE_LEVELS, Stance};
pub use in_view::InView;
pub use litter::litter;
pub use pigments::PigmentsDesc;
pub use pile::Pile;
pub use record::{
    ClodsRecord, CracksRecord, LayerRecord, LitterRecord, MoistureRecord, ReliefRecord, RowReliefRecord, SoilRecord,
    ToolRecord, WheelRecord,
};
pub use site::{FULL_CELL_M, FULL_TEXEL_M, SeedRows, Site};
pub use stone::stones;
pub use tool::ToolDesc;
pub use wheel::WheelDesc;

pub use furrow_optics::texture::ground::MAX_LAYERS;

use furrow_base::math::{RoundTo, Vec2, vec2};
use furrow_base::sampling::{Purpose, Stream};

/// Textures of one layer, sampled at tile coordinates: one tile is 0..1, and both textures repeat.
pub trait LayerMaps {
    /// Returns the height, 0 (black) to 1 (white).
    fn height(&self, uv: Vec2) -> f32;
    /// Returns the linear reflectance R, G, B of the dry soil.
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

/// Layer without textures: one colour and one height.
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

/// Axis-aligned rectangle on the ground, metres.
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
    /// Builds a rectangle from the coordinates of two opposite corners.
    pub const fn new(x0: f32, y0: f32, x1: f32, y1: f32) -> Self {
        Self { x0, y0, x1, y1 }
    }

    /// Returns the lower left and the upper right corner.
    pub fn corners(self) -> [Vec2; 2] {
        [vec2(self.x0, self.y0), vec2(self.x1, self.y1)]
    }

    /// Returns the size in x and y.
    pub fn size(self) -> Vec2 {
        vec2(self.x1 - self.x0, self.y1 - self.y0)
    }

    /// Returns the area, m².
    pub fn area(self) -> f32 {
        self.size().x * self.size().y
    }

    /// Returns `true` if `p` is inside; the south and west sides are included.
    pub fn contains(self, p: Vec2) -> bool {
        p.x >= self.x0 && p.x < self.x1 && p.y >= self.y0 && p.y < self.y1
    }

    /// Returns the rectangle enlarged by `by` on every side.
    #[must_use]
    pub fn grown(self, by: f32) -> Self {
        Self { x0: self.x0 - by, y0: self.y0 - by, x1: self.x1 + by, y1: self.y1 + by }
    }
}

/// Returns the random stream of cell (i, j), which does not depend on the area.
fn cell_stream(stream: &Stream, i: i32, j: i32) -> Stream {
    stream.child(Purpose::Debris, (u64::from(i.cast_unsigned()) << 32) | u64::from(j.cast_unsigned()))
}

/// Iterates over the cells of side `cell` that touch a rectangle.
fn cells(area: Rect, cell: f32) -> impl Iterator<Item = (i32, i32)> {
    let range = |lo: f32, hi: f32| (lo / cell).floor_to::<i32>()..(hi / cell).ceil_to::<i32>();
    let columns = range(area.x0, area.x1);
    range(area.y0, area.y1).flat_map(move |j| columns.clone().map(move |i| (i, j)))
}
