//! U-Net with the encoder EfficientNet-Lite0. It needs a quarter of the computation of the U-Net with ResNet-18, and pretrained
//! ImageNet weights are available.
//!
//! Sources: Tan & Le 2019, "EfficientNet", table 1 (stages of inverted residual blocks, Sandler et al. 2018); the Lite variant (Liu
//! 2020, TensorFlow) has no squeeze-and-excitation, and ReLU6 instead of Swish. Convolutions are padded as in TensorFlow for even
//! sizes, and batch norms have its ε, so that published weights give the published outputs.
//!
//! The decoder has levels of 128, 64, 48, 32 and 16 channels, each with nearest-neighbour upsampling and two 3 × 3 convolutions.

use super::{Conv, Norm, Operations, decode};

/// Number of blocks, kernel size, stride, expansion and output channels of each stage.
const STAGES: [(usize, usize, usize, usize, usize); 7] = [
    (1, 3, 1, 1, 16),
    (2, 3, 2, 6, 24),
    (2, 5, 2, 6, 40),
    (3, 3, 2, 6, 80),
    (3, 5, 1, 6, 112),
    (4, 5, 2, 6, 192),
    (1, 3, 1, 6, 320),
];
/// Output channels of the stem.
const STEM: usize = 32;
/// Channels of the decoder's levels.
const DECODER: [usize; 5] = [128, 64, 48, 32, 16];
/// ε of the encoder's batch norms.
const EPSILON: f64 = 1e-3;

pub(super) fn walk<O: Operations>(o: &mut O, x: &O::Value, bands: usize, classes: usize) -> O::Value {
    let mut now = light(o, x, "stem", Conv::new(bands, STEM, 3).same(2), true);
    let mut channels = STEM;
    let mut skips = Vec::new();
    for (stage, (blocks, kernel, stride, expansion, outputs)) in STAGES.into_iter().enumerate() {
        for k in 0..blocks {
            let stride = if k == 0 { stride } else { 1 };
            let next = block(o, &now, &format!("enc{stage}_{k}"), channels, (kernel, stride, expansion, outputs));
            let before = std::mem::replace(&mut now, next);
            if stride == 2 {
                o.features(&before, skips.len() + 1);
                skips.push((before, channels));
            }
            channels = outputs;
        }
    }
    decode(o, x, (now, channels), skips, &DECODER, classes)
}

/// Convolution, batch norm and, if `relu`, ReLU6, with the parameter names of [`unit`].
fn light<O: Operations>(o: &mut O, x: &O::Value, name: &str, conv: Conv, relu: bool) -> O::Value {
    let y = o.conv(x, &format!("{name}.conv"), conv);
    let y = o.norm(&y, &format!("{name}.bn"), Norm { channels: conv.outputs, epsilon: EPSILON });
    if relu { o.relu6(&y) } else { y }
}

/// Inverted residual block: expansion, depthwise convolution and projection, with a skip connection if input and output have the
/// same size.
fn block<O: Operations>(
    o: &mut O,
    x: &O::Value,
    name: &str,
    inputs: usize,
    (kernel, stride, expansion, outputs): (usize, usize, usize, usize),
) -> O::Value {
    let wide = inputs * expansion;
    let expanded = (expansion > 1).then(|| light(o, x, &format!("{name}.expand"), Conv::new(inputs, wide, 1), true));
    let depthwise = Conv::new(wide, wide, kernel).same(stride).depthwise();
    let y = light(o, expanded.as_ref().unwrap_or(x), &format!("{name}.depthwise"), depthwise, true);
    let y = light(o, &y, &format!("{name}.project"), Conv::new(wide, outputs, 1), false);
    if inputs == outputs && stride == 1 { o.add(&y, x) } else { y }
}

/// Returns the name of a parameter in `efficientnet_lite_pytorch`.
pub(super) fn published(name: &str) -> Option<String> {
    let (unit, what) = super::parameters::parts(name)?;
    let Some(place) = unit.strip_prefix("enc") else {
        return (unit == "stem").then(|| match what {
            "conv.weight" => "_conv_stem.weight".into(),
            _ => what.replacen("bn", "_bn0", 1),
        });
    };
    let (place, part) = place.split_once('.')?;
    let (stage, k): (usize, usize) =
        place.split_once('_').and_then(|(s, k)| Some((s.parse().ok()?, k.parse().ok()?)))?;
    let number = STAGES[..stage].iter().map(|s| s.0).sum::<usize>() + k;
    let norm = match part {
        "expand" => 0,
        "depthwise" => 1,
        _ => 2,
    };
    Some(match what {
        "conv.weight" => format!("_blocks.{number}._{part}_conv.weight"),
        _ => format!("_blocks.{number}.{}", what.replacen("bn", &format!("_bn{norm}"), 1)),
    })
}
