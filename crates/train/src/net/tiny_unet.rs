//! U-Net of two levels with few channels: trains in seconds. For tests and for trying a pipeline out, not for results.
//! Its encoder is too shallow for the features of the appearance refinement, so it reports none.
//!
//! Source of the architecture: Ronneberger, Fischer & Brox 2015, reduced to 8 and 16 channels.

use super::{Conv, Operations, decode, unit};

/// Channels of the first level; the second has twice this number.
const WIDTH: usize = 8;

pub(super) fn walk<O: Operations>(o: &mut O, x: &O::Value, bands: usize, classes: usize) -> O::Value {
    let first = unit(o, x, "enc0", Conv::new(bands, WIDTH, 3), true);
    let (half, _) = o.pool(&first);
    let second = unit(o, &half, "enc1", Conv::new(WIDTH, 2 * WIDTH, 3), true);
    let (deepest, _) = o.pool(&second);
    let skips = vec![(first, WIDTH), (second, 2 * WIDTH)];
    decode(o, x, (deepest, 2 * WIDTH), skips, &[2 * WIDTH, WIDTH], classes)
}
