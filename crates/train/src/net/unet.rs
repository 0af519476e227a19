//! U-Net with a residual encoder: the common choice today.
//!
//! Sources: Ronneberger, Fischer & Brox 2015 (skip connections from encoder to decoder); He, Zhang, Ren & Sun 2016 (ResNet-18: a
//! 7 × 7 stem, then four stages of two blocks).
//!
//! The decoder has levels of 256, 128, 64, 32 and 16 channels, each with nearest-neighbour upsampling and two 3 × 3 convolutions.
//! Initial weights are random unless a file is given.

use super::{Conv, Operations, decode, unit};

/// Channels of the encoder's stages.
const STAGES: [usize; 4] = [64, 128, 256, 512];
/// Channels of the decoder's levels.
const DECODER: [usize; 5] = [256, 128, 64, 32, 16];

pub(super) fn walk<O: Operations>(o: &mut O, x: &O::Value, bands: usize, classes: usize) -> O::Value {
    let stem = unit(o, x, "stem", Conv::new(bands, STAGES[0], 7).stride(2), true);
    let mut deepest = o.pool3(&stem);
    let mut skips = vec![(stem, STAGES[0])];
    let mut channels = STAGES[0];
    for (stage, outputs) in STAGES.into_iter().enumerate() {
        let stride = if stage == 0 { 1 } else { 2 };
        let first = block(o, &deepest, &format!("enc{stage}_0"), channels, outputs, stride);
        let second = block(o, &first, &format!("enc{stage}_1"), outputs, outputs, 1);
        if stage > 0 {
            o.features(&deepest, stage + 1);
            skips.push((std::mem::replace(&mut deepest, second), channels));
        } else {
            deepest = second;
        }
        channels = outputs;
    }
    decode(o, x, (deepest, channels), skips, &DECODER, classes)
}

/// Residual block: two convolutions and a skip connection, which has its own convolution if input and output sizes differ.
fn block<O: Operations>(o: &mut O, x: &O::Value, name: &str, inputs: usize, outputs: usize, stride: usize) -> O::Value {
    let first = unit(o, x, &format!("{name}.0"), Conv::new(inputs, outputs, 3).stride(stride), true);
    let second = unit(o, &first, &format!("{name}.1"), Conv::new(outputs, outputs, 3), false);
    let sum = if inputs == outputs && stride == 1 {
        o.add(&second, x)
    } else {
        let past = unit(o, x, &format!("{name}.past"), Conv::new(inputs, outputs, 1).stride(stride), false);
        o.add(&second, &past)
    };
    o.relu(&sum)
}

/// Returns the name of a parameter in torchvision's `resnet18`.
pub(super) fn published(name: &str) -> Option<String> {
    let (unit, what) = super::parameters::parts(name)?;
    if unit == "stem" {
        return Some(what.replacen("conv", "conv1", 1).replacen("bn", "bn1", 1));
    }
    let (place, part) = unit.strip_prefix("enc")?.split_once('.')?;
    let (stage, k) = place.split_once('_')?;
    let stage = stage.parse::<usize>().ok()? + 1;
    let what = match part {
        "past" => what.replacen("conv", "downsample.0", 1).replacen("bn", "downsample.1", 1),
        part => {
            let number = part.parse::<usize>().ok()? + 1;
            what.replacen("conv", &format!("conv{number}"), 1).replacen("bn", &format!("bn{number}"), 1)
        }
    };
    Some(format!("layer{stage}.{k}.{what}"))
}
