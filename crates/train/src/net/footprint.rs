//! Size of the values of a forward pass, found by walking the network without computing it.

use super::{Conv, Network, Norm, Operations};
use furrow_base::math::ToFloat;
use std::cell::Cell;
use std::rc::Rc;

/// Largest number of tokens for which attention is computed with explicit matrices: an image of 560 × 350 pixels in patches of 14, and
/// the class token.
pub const MULTIPLIED_OUT: usize = 1 + 1000;

/// Numbers held by a forward pass over one image, whatever their precision.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footprint {
    /// Largest number held at the same time, if a value is freed after its last use: inference.
    pub peak: f64,
    /// All numbers, if each value is kept for the gradients: training.
    pub all: f64,
}

impl Footprint {
    /// Returns the footprint of a network, with its plant decoder if `plants` is set, for one image of this width and height.
    pub fn of(network: Network, bands: usize, classes: usize, plants: bool, (width, height): (u32, u32)) -> Self {
        let tally = Rc::new(Tally::default());
        let image = Map::new(&tally, bands, f64::from(height), f64::from(width));
        network.walk(&mut Walk { plants, found: None }, &image, bands, classes);
        Self { peak: tally.peak.get(), all: tally.all.get() }
    }
}

/// Numbers held by all values together.
#[derive(Default)]
struct Tally {
    now: Cell<f64>,
    peak: Cell<f64>,
    all: Cell<f64>,
}

impl Tally {
    fn add(&self, numbers: f64) {
        self.now.set(self.now.get() + numbers);
        self.all.set(self.all.get() + numbers);
        self.peak.set(self.peak.get().max(self.now.get()));
    }
}

/// Size of a value. Its numbers count until it is dropped, as those of a tensor.
struct Map {
    channels: usize,
    height: f64,
    width: f64,
    tally: Rc<Tally>,
}

impl Map {
    fn new(tally: &Rc<Tally>, channels: usize, height: f64, width: f64) -> Self {
        let map = Self { channels, height, width, tally: tally.clone() };
        tally.add(map.numbers());
        map
    }

    fn numbers(&self) -> f64 {
        self.channels.to_f64() * self.height * self.width
    }

    fn with(&self, channels: usize, height: f64, width: f64) -> Self {
        Self::new(&self.tally, channels, height, width)
    }

    /// Returns a value of the same size.
    fn alike(&self) -> Self {
        self.with(self.channels, self.height, self.width)
    }

    /// Holds numbers for the duration of one operation.
    fn briefly(&self, numbers: f64) {
        self.tally.add(numbers);
        self.tally.now.set(self.tally.now.get() - numbers);
    }
}

impl Drop for Map {
    fn drop(&mut self) {
        self.tally.now.set(self.tally.now.get() - self.numbers());
    }
}

/// Implementation of [`Operations`] that only follows sizes.
struct Walk {
    /// Whether the plant decoder is applied as well.
    plants: bool,
    /// Its output, which is held to the end.
    found: Option<Map>,
}

impl Operations for Walk {
    type Value = Map;
    /// The positions of the maxima, 64-bit integers, and the size before the pooling.
    type PoolIndices = (Map, Map, [f64; 2]);

    fn conv(&mut self, x: &Map, _name: &str, conv: Conv) -> Map {
        let stride = conv.stride.to_f64();
        let (before, after) = conv.padding();
        if before != after {
            x.briefly(x.numbers());
        }
        x.with(conv.outputs, (x.height / stride).ceil(), (x.width / stride).ceil())
    }

    fn norm(&mut self, x: &Map, _name: &str, _norm: Norm) -> Map {
        x.alike()
    }

    fn relu(&mut self, x: &Map) -> Map {
        x.alike()
    }

    fn relu6(&mut self, x: &Map) -> Map {
        x.alike()
    }

    fn add(&mut self, a: &Map, _b: &Map) -> Map {
        a.alike()
    }

    fn concat(&mut self, a: &Map, b: &Map) -> Map {
        a.with(a.channels + b.channels, a.height, a.width)
    }

    fn pool(&mut self, x: &Map) -> (Map, Self::PoolIndices) {
        let half = || x.with(x.channels, (x.height / 2.0).floor(), (x.width / 2.0).floor());
        (half(), (half(), half(), [x.height, x.width]))
    }

    fn unpool(&mut self, x: &Map, (_, _, [height, width]): Self::PoolIndices) -> Map {
        x.with(x.channels, height, width)
    }

    fn pool3(&mut self, x: &Map) -> Map {
        x.with(x.channels, (x.height / 2.0).ceil(), (x.width / 2.0).ceil())
    }

    fn enlarge(&mut self, x: &Map, like: &Map) -> Map {
        x.with(x.channels, like.height, like.width)
    }

    fn to_multiple(&mut self, x: &Map, pixels: usize) -> Map {
        let up = |side: f64| (side / pixels.to_f64()).ceil() * pixels.to_f64();
        x.with(x.channels, up(x.height), up(x.width))
    }

    fn tokens(&mut self, x: &Map, _name: &str, channels: usize, _grid: usize) -> Map {
        x.briefly(x.numbers());
        x.with(channels, 1.0, 1.0 + x.height * x.width)
    }

    fn map(&mut self, tokens: &Map, like: &Map) -> Map {
        tokens.with(tokens.channels, like.height, like.width)
    }

    fn layer_norm(&mut self, x: &Map, _name: &str, _norm: Norm) -> Map {
        x.alike()
    }

    fn gelu(&mut self, x: &Map) -> Map {
        x.alike()
    }

    fn attention(&mut self, x: &Map, channels: usize, heads: usize) -> Map {
        if x.width <= MULTIPLIED_OUT.to_f64() {
            x.briefly(2.0 * heads.to_f64() * x.width * x.width);
        }
        x.with(channels, 1.0, x.width)
    }

    fn scale(&mut self, x: &Map, _name: &str, _channels: usize) -> Map {
        x.alike()
    }

    fn wants_plants(&self) -> bool {
        self.plants
    }

    fn plants(&mut self, x: Map) {
        self.found = Some(x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: more than the input and the output of the network, in proportion to the pixels, and more for training than for
    /// inference.
    #[test]
    fn the_footprint_grows_with_the_image() {
        for network in Network::ALL {
            let of = |side: u32| Footprint::of(*network, 3, 3, false, (side, side));
            let (small, large) = (of(560), of(1120));
            assert!(small.peak > 6.0 * 560.0 * 560.0 && small.all > small.peak, "{} {small:?}", network.name());
            let ratio = large.peak / small.peak;
            assert!((3.5..4.5).contains(&ratio), "{} {ratio}", network.name());
        }
    }
}
