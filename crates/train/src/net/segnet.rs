//! SegNet: 26 convolutions; the decoder upsamples with the positions of the encoder's max pooling.
//!
//! Source: Badrinarayanan, Kendall & Cipolla 2017, "SegNet: a deep convolutional encoder-decoder architecture for image
//! segmentation"; channels as in VGG16 (Simonyan & Zisserman 2015).

use super::{Conv, Operations, unit};

/// Input and output channels of the encoder's convolutions, by block. A 0 is replaced by the number of bands.
const ENCODER: [&[(usize, usize)]; 5] = [
    &[(0, 64), (64, 64)],
    &[(64, 128), (128, 128)],
    &[(128, 256), (256, 256), (256, 256)],
    &[(256, 512), (512, 512), (512, 512)],
    &[(512, 512), (512, 512), (512, 512)],
];

/// Input and output channels of the decoder's convolutions, by block, without the last convolution (`head.conv`).
const DECODER: [&[(usize, usize)]; 5] = [
    &[(512, 512), (512, 512), (512, 512)],
    &[(512, 512), (512, 512), (512, 256)],
    &[(256, 256), (256, 256), (256, 128)],
    &[(128, 128), (128, 64)],
    &[(64, 64)],
];

pub(super) fn walk<O: Operations>(o: &mut O, x: &O::Value, bands: usize, classes: usize) -> O::Value {
    let conv = |inputs, outputs| Conv::new(inputs, outputs, 3).bias();
    let mut stack = Vec::new();
    let mut now = None;
    for (level, block) in ENCODER.iter().enumerate() {
        for (i, (inputs, outputs)) in block.iter().enumerate() {
            let inputs = if *inputs == 0 { bands } else { *inputs };
            now = Some(unit(o, now.as_ref().unwrap_or(x), &format!("enc{level}_{i}"), conv(inputs, *outputs), true));
        }
        o.features(now.as_ref().unwrap_or(x), level);
        let (smaller, places) = o.pool(now.as_ref().unwrap_or(x));
        stack.push(places);
        now = Some(smaller);
    }
    for (level, block) in DECODER.iter().enumerate() {
        if let Some(places) = stack.pop() {
            now = Some(o.unpool(now.as_ref().unwrap_or(x), places));
        }
        for (i, (inputs, outputs)) in block.iter().enumerate() {
            now = Some(unit(o, now.as_ref().unwrap_or(x), &format!("dec{level}_{i}"), conv(*inputs, *outputs), true));
        }
    }
    o.conv(now.as_ref().unwrap_or(x), "head.conv", conv(64, classes))
}

/// Returns the name of a parameter in torchvision's `vgg16_bn`. Its layers are numbered: each convolution is followed by its batch
/// norm and ReLU, each block by a pooling.
pub(super) fn published(name: &str) -> Option<String> {
    let (unit, what) = super::parameters::parts(name)?;
    let (block, i) = unit.strip_prefix("enc")?.split_once('_')?;
    let (block, i): (usize, usize) = (block.parse().ok()?, i.parse().ok()?);
    let before: usize = ENCODER[..block].iter().map(|convolutions| 3 * convolutions.len() + 1).sum();
    let (layer, what) = what.split_once('.')?;
    Some(format!("features.{}.{what}", before + 3 * i + usize::from(layer == "bn")))
}
