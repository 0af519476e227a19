//! Basic SegNet: the "smaller version" of Di Cicco et al. 2017, 4 + 4 convolutions.
//!
//! Source: Kendall, Badrinarayanan & Cipolla 2015, `segnet_basic` (7 × 7 kernels, 64 channels, decoders without ReLU).
//! [`crate::data::Normalization`] replaces the local response normalisation before its first layer.

use super::{Conv, Operations, unit};

const CHANNELS: usize = 64;
const DEPTH: usize = 4;

pub(super) fn walk<O: Operations>(o: &mut O, x: &O::Value, bands: usize, classes: usize) -> O::Value {
    let conv = |inputs| Conv::new(inputs, CHANNELS, 7).bias();
    let mut stack = Vec::new();
    let first = unit(o, x, "enc0_0", conv(bands), true);
    let (mut x, places) = o.pool(&first);
    stack.push(places);
    for level in 1..DEPTH {
        x = unit(o, &x, &format!("enc{level}_0"), conv(CHANNELS), true);
        o.features(&x, level);
        let (smaller, places) = o.pool(&x);
        stack.push(places);
        x = smaller;
    }
    o.features(&x, DEPTH);
    for level in 0..DEPTH {
        if let Some(places) = stack.pop() {
            x = o.unpool(&x, places);
        }
        x = unit(o, &x, &format!("dec{level}_0"), conv(CHANNELS), false);
    }
    o.conv(&x, "head.conv", Conv::new(CHANNELS, classes, 1).bias())
}
