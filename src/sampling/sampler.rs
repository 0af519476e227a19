//! Owen-scrambled Sobol points, four dimensions at a time.
//!
//! Every pixel scrambles the same sequence with its own hash, so any number of samples may be taken in any order by any
//! thread. Source: Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4), as carried out by `sobol_burley`.

use super::rng::mix;

/// What each set of four dimensions is for.
pub mod sets {
    /// Place in the pixel, place on the lens.
    pub const CAMERA: u32 = 0;
    /// The filter's blur.
    pub const BLUR: u32 = 1;

    /// Which light, where on it, roulette: at the surface number `depth`.
    pub const fn light(depth: u32) -> u32 {
        2 + 2 * depth
    }

    /// Which lobe, which direction.
    pub const fn scatter(depth: u32) -> u32 {
        3 + 2 * depth
    }
}

/// Where one sample of one pixel draws its numbers.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    index: u32,
    seed: u32,
}

impl Sampler {
    /// Largest number of samples a pixel can take: the length of the tabulated sequence.
    pub const MAX_SAMPLES: u32 = 1 << 16;

    /// Sample `index` (below [`Self::MAX_SAMPLES`]) of pixel (x, y) of the image that `seed` names.
    pub fn new(seed: u64, x: u32, y: u32, index: u32) -> Self {
        Self { index, seed: mix(seed ^ (u64::from(y) << 32 | u64::from(x))) as u32 }
    }

    /// The four numbers in [0, 1) of dimension set `set`; each set is stratified by itself over the samples of a pixel.
    /// The direction numbers of far sets are used again under another scramble and another order of the samples.
    #[inline]
    pub fn get4(&self, set: u32) -> [f32; 4] {
        const SETS: u32 = sobol_burley::NUM_DIMENSION_SETS_4D;
        let seed = if set < SETS { self.seed } else { mix(u64::from(self.seed) << 32 | u64::from(set / SETS)) as u32 };
        sobol_burley::sample_4d(self.index, set % SETS, seed)
    }
}
