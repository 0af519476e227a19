//! Owen-scrambled Sobol points, four dimensions at a time.
//!
//! Every set of four dimensions of every pixel scrambles the same sequence with its own hash, so any number of samples may be taken in any
//! order by any thread. Source: Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4), with the hashes of `sobol_burley`.
//!
//! Independent numbers can take their place ([`Points::Independent`]): the mean of an image must not depend on which.

use super::rng::mix;
use super::sobol;

/// What each set of four dimensions is for.
pub mod sets {
    /// Place in the pixel, and what a pixel's error depends on most beside it, stratified together: where on the first narrow light;
    /// where there is none, the direction in which the first surface scatters.
    pub const FIRST: u32 = 0;
    /// Place on the lens.
    pub const LENS: u32 = (1 << 24) - 1;

    /// When in the exposure.
    pub const SHUTTER: u32 = (1 << 24) - 2;

    /// Which lobe, which direction, and, at the first surface, how many: at surface number `depth` of a path's `branch`.
    pub const fn scatter(branch: u32, depth: u32) -> u32 {
        branch * BRANCH + 1 + 2 * depth
    }

    /// Which light, where on it, roulette: the same surface.
    pub const fn light(branch: u32, depth: u32) -> u32 {
        branch * BRANCH + 2 + 2 * depth
    }

    /// Where on light number `light`, and whether to ask it: at the first surface.
    pub const fn first_light(light: u32) -> u32 {
        (1 << 24) + light
    }

    /// Sets of one branch: twice the surfaces of any path.
    const BRANCH: u32 = 1 << 12;
}

/// Which numbers the samples of a pixel draw.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Points {
    /// Owen-scrambled Sobol points: spread evenly over the samples of a pixel.
    #[default]
    Sobol,
    /// Independent random numbers: more noise, and what stratified points are measured against.
    Independent,
}

/// Where one sample of one pixel draws its numbers.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    index: u32,
    seed: u32,
    points: Points,
}

impl Sampler {
    /// Largest number of samples a pixel can take: the length of the tabulated sequence.
    pub const MAX_SAMPLES: u32 = 1 << 16;

    /// Sample `index` (below [`Self::MAX_SAMPLES`]) of pixel (x, y) of the image that `seed` names.
    pub fn new(seed: u64, x: u32, y: u32, index: u32) -> Self {
        Self::of(Points::Sobol, seed, x, y, index)
    }

    /// The same with numbers of a kind.
    pub fn of(points: Points, seed: u64, x: u32, y: u32, index: u32) -> Self {
        Self { index, seed: mix(seed ^ (u64::from(y) << 32 | u64::from(x))) as u32, points }
    }

    /// The four numbers in [0, 1) of dimension set `set`; each set is stratified by itself over the samples of a pixel, and has nothing
    /// to do with the others.
    #[inline]
    pub fn get4(&self, set: u32) -> [f32; 4] {
        match self.points {
            Points::Sobol => sobol::point(self.index, mix(u64::from(self.seed) << 32 | u64::from(set)) as u32),
            Points::Independent => self.independent4(set),
        }
    }

    /// Four numbers that have nothing to do with those of any other sample or set: a hash of their address.
    #[cold]
    fn independent4(&self, set: u32) -> [f32; 4] {
        let first = mix(mix(u64::from(self.seed) << 32 | u64::from(self.index)) ^ u64::from(set));
        let second = mix(first);
        // 24 bits each: all that a number below one holds evenly.
        [first >> 40, first >> 16 & 0xff_ffff, second >> 40, second >> 16 & 0xff_ffff]
            .map(|bits| bits as f32 * (1.0 / (1 << 24) as f32))
    }
}
