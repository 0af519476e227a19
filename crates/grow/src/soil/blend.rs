//! Blending of the soil layers.
//!
//! Layer i has its own Perlin noise nᵢ and the weight wᵢ ∝ shareᵢ · exp(sharpness · (nᵢ + height · (hᵢ − ½))),
//! normalised so that the weights sum to one.
//!
//! Two layers then blend linearly by a Perlin mask, as is usual for terrains. The term with the layer's own height hᵢ
//! lets the high parts of one layer protrude from the other at the border, which a plain mask would render half
//! transparent. The same weights are used for the vertices and for the texture.

use super::{BlendDesc, LayerDesc, LayerMaps, MAX_LAYERS};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, vec2};
use furrow_base::sampling::{Purpose, Stream};
use furrow_optics::texture::noise::Perlin;

/// Weights of the layers at a point; unused ones are zero.
pub type Weights = [f32; MAX_LAYERS];

/// Blending of one ground.
#[derive(Clone, Debug)]
pub(super) struct Blend {
    tiles: Vec<Tile>,
    frequency: f64,
    octaves: u32,
    sharpness: f32,
    height: f32,
}

#[derive(Clone, Debug)]
struct Tile {
    noise: Perlin,
    log_share: f32,
    /// Logarithm of the factor on its share at the current day.
    log_grown: f32,
    // Each ground rotates and shifts its tiles differently, so that no two show the same clod.
    rotation: Vec2,
    offset: Vec2,
    low: f32,
    relief: f32,
    clods: f32,
}

/// Maximum number of octaves: beyond it, amplitudes are below 2⁻³² of the first, less than single precision resolves.
const MOST_OCTAVES: u32 = 32;

impl Blend {
    pub(super) fn new(desc: &BlendDesc, layers: &[LayerDesc], stream: &Stream) -> Self {
        let child = |k| stream.child(Purpose::Texture, k);
        let tiles = layers
            .iter()
            .enumerate()
            .map(|(i, layer)| {
                let mut s = child(16 + i.to_u64());
                let (low, high) = (layer.height_mm.0.f32() * 1e-3, layer.height_mm.1.f32() * 1e-3);
                Tile {
                    noise: Perlin::new(s.seed32()),
                    rotation: Vec2::from_angle(s.range32(0.0, std::f32::consts::TAU)) / layer.size_m.f32(),
                    offset: vec2(s.uniform32(), s.uniform32()),
                    log_share: layer.share.draw32(&mut s).ln(),
                    log_grown: 0.0,
                    low,
                    relief: high - low,
                    clods: layer.clods.f32(),
                }
            })
            .collect();
        Self {
            tiles,
            frequency: 1.0 / desc.scale_m.draw(&mut child(0)),
            octaves: desc.octaves.get().trunc_to::<u32>().min(MOST_OCTAVES),
            sharpness: desc.sharpness.draw32(&mut child(1)),
            height: desc.height.f32(),
        }
    }

    /// Multiplies the shares of crusts, the layers with fewer than half of the clods, by `crust`, which must be above
    /// 0.
    pub(super) fn with_crust(mut self, crust: f32) -> Self {
        for tile in self.tiles.iter_mut().filter(|tile| tile.clods < 0.5) {
            tile.log_grown = crust.ln();
        }
        self
    }

    /// Multiplies the heights of all layers by a factor.
    pub(super) fn flattened(mut self, factor: f32) -> Self {
        for tile in &mut self.tiles {
            (tile.low, tile.relief) = (factor * tile.low, factor * tile.relief);
        }
        self
    }

    /// Returns the noise of layer `i`. It varies slowly, so it may be interpolated between vertices.
    pub(super) fn noise(&self, i: usize, p: Vec2) -> f32 {
        let (x, y) = (f64::from(p.x) * self.frequency, f64::from(p.y) * self.frequency);
        // Shifted off the lattice, where all noises are zero at the same points.
        self.tiles[i].noise.fbm2(x + 0.37 + i.to_f64(), y + 0.61, self.octaves, 0.5).to_f32()
    }

    /// Returns the tile coordinates of layer `i`.
    pub(super) fn uv(&self, i: usize, p: Vec2) -> Vec2 {
        self.tiles[i].rotation.rotate(p) + self.tiles[i].offset
    }

    /// Returns the weights for the layers' noises and heights (0..1).
    #[inline]
    pub(super) fn weights(&self, noise: Weights, heights: Weights) -> Weights {
        let mut w = [0.0; MAX_LAYERS];
        let n = self.tiles.len();
        if n == 1 {
            w[0] = 1.0;
            return w;
        }
        let score = |i: usize| {
            self.sharpness * (noise[i] + self.height * (heights[i] - 0.5))
                + self.tiles[i].log_share
                + self.tiles[i].log_grown
        };
        let top = (0..n).map(score).fold(f32::MIN, f32::max);
        for (i, w) in w.iter_mut().enumerate().take(n) {
            *w = (score(i) - top).exp();
        }
        let sum: f32 = w.iter().sum();
        w.map(|x| x / sum)
    }

    /// Returns the heights of all layers, 0..1.
    pub(super) fn heights<L: LayerMaps>(&self, maps: &[L], p: Vec2) -> Weights {
        let mut h = [0.0; MAX_LAYERS];
        for (i, (h, map)) in h.iter_mut().zip(maps).enumerate() {
            *h = map.height(self.uv(i, p));
        }
        h
    }

    /// Returns the displacement in metres.
    pub(super) fn displacement(&self, weights: Weights, heights: Weights) -> f32 {
        self.tiles.iter().enumerate().map(|(i, t)| weights[i] * (t.low + heights[i] * t.relief)).sum()
    }

    /// Returns the reflectance.
    pub(super) fn albedo<L: LayerMaps>(&self, maps: &[L], weights: Weights, p: Vec2) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for (i, map) in maps.iter().enumerate().take(self.tiles.len()) {
            if weights[i] > 1e-3 {
                let a = map.albedo(self.uv(i, p));
                for (s, a) in sum.iter_mut().zip(a) {
                    *s += weights[i] * a;
                }
            }
        }
        sum
    }

    /// Returns the fraction of the clods at a place. It is computed without the current growth of the crusts, so that
    /// clods do not move while crusts grow.
    pub(super) fn clods(&self, mut weights: Weights) -> f32 {
        if self.tiles.iter().any(|tile| tile.log_grown != 0.0) {
            for (w, tile) in weights.iter_mut().zip(&self.tiles) {
                *w *= (-tile.log_grown).exp();
            }
            let sum: f32 = weights.iter().sum();
            weights = weights.map(|w| w / sum);
        }
        self.tiles.iter().zip(weights).map(|(t, w)| t.clods * w).sum()
    }

    /// Returns the drawn share of each layer, without the effect of noise and heights.
    pub(super) fn shares(&self) -> Vec<f32> {
        let share = |t: &Tile| (t.log_share + t.log_grown).exp();
        let sum: f32 = self.tiles.iter().map(share).sum();
        self.tiles.iter().map(|t| share(t) / sum).collect()
    }

    /// Returns the size of the largest patches, metres, and the sharpness of their borders.
    pub(super) fn patches(&self) -> (f64, f32) {
        (1.0 / self.frequency, self.sharpness)
    }

    pub(super) fn layers(&self) -> usize {
        self.tiles.len()
    }
}
