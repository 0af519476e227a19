//! U-Net decoder over a vision transformer, for the weights of DINOv2, which were trained on photographs without labels. It is the
//! largest encoder here and slow without a GPU.
//!
//! Sources: Dosovitskiy et al. 2021, "An image is worth 16 × 16 words" (patches as tokens, pre-norm blocks); Oquab et al. 2023, "DINOv2"
//! (ViT-S/14: 12 blocks of 384 channels and 6 heads, LayerScale, 37 × 37 positions).
//!
//! Position embeddings are resized bicubically without antialiasing, as in Hugging Face's `Dinov2Model`; timm antialiases, and DINOv2's
//! own code stretches by a tenth of a patch. An image is first resized to multiples of the patch size of 14 pixels.
//!
//! Details below the size of a patch come from three convolutions of the image itself, with cells of 2, 4 and 8 pixels. The decoder has
//! levels of 128, 64, 32 and 16 channels, each with nearest-neighbour upsampling and two 3 × 3 convolutions.

use super::{Conv, Norm, Operations, decode, unit};
use crate::weights::Array;

/// Width and height of a patch, pixels.
const PATCH: usize = 14;
/// Channels of a token.
const CHANNELS: usize = 384;
/// Number of transformer blocks.
const BLOCKS: usize = 12;
/// Number of attention heads.
const HEADS: usize = 6;
/// Width and height of the grid of position embeddings, patches: 37 patches are 518 pixels.
const GRID: usize = 37;
/// Index of the middle block, whose tokens the decoder uses together with the last ones.
const MIDDLE: usize = 5;
/// ε of the layer norms.
const EPSILON: f64 = 1e-6;
/// Channels of the three convolutions of the image itself, with cells of 2, 4 and 8 pixels.
const FINE: [usize; 3] = [16, 32, 64];
/// Channels of the decoder's levels, with cells of 8, 4, 2 and 1 pixels.
const DECODER: [usize; 4] = [128, 64, 32, 16];

pub(super) fn walk<O: Operations>(o: &mut O, x: &O::Value, bands: usize, classes: usize) -> O::Value {
    let whole = o.to_multiple(x, PATCH);
    let patches = o.conv(&whole, "stem", Conv::new(bands, CHANNELS, PATCH).same(PATCH).bias());
    let mut tokens = o.tokens(&patches, "enc", CHANNELS, GRID);
    let mut seen = Vec::new();
    for k in 0..BLOCKS {
        tokens = block(o, &tokens, &format!("enc{k}"));
        if k == MIDDLE || k == BLOCKS - 1 {
            let normed = o.layer_norm(&tokens, &format!("enc{k}.norm"), Norm { channels: CHANNELS, epsilon: EPSILON });
            seen.push(o.map(&normed, &patches));
        }
    }
    let (mut skips, mut inputs) = (Vec::new(), bands);
    for (level, outputs) in FINE.into_iter().enumerate() {
        let finer = skips.last().map_or(x, |(finer, _)| finer);
        let coarser = unit(o, finer, &format!("fine{level}"), Conv::new(inputs, outputs, 3).stride(2), true);
        skips.push((coarser, outputs));
        inputs = outputs;
    }
    // A patch is between 8 and 16 pixels wide, so the features of both blocks are resized to cells of 8.
    for (features, halvings) in seen.iter().zip([3, 4]) {
        let cells = o.enlarge(features, &skips[FINE.len() - 1].0);
        o.features(&cells, halvings);
    }
    let tokens = o.concat(&seen[0], &seen[1]);
    decode(o, x, (tokens, 2 * CHANNELS), skips, &DECODER, classes)
}

/// Transformer block: self-attention, then a two-layer perceptron with four times the channels. Both have a layer norm before them and a
/// skip connection.
fn block<O: Operations>(o: &mut O, x: &O::Value, name: &str) -> O::Value {
    let norm = Norm { channels: CHANNELS, epsilon: EPSILON };
    let linear = |inputs, outputs| Conv::new(inputs, outputs, 1).bias();
    let y = o.layer_norm(x, &format!("{name}.norm1"), norm);
    let y = o.conv(&y, &format!("{name}.qkv"), linear(CHANNELS, 3 * CHANNELS));
    let y = o.attention(&y, CHANNELS, HEADS);
    let y = o.conv(&y, &format!("{name}.proj"), linear(CHANNELS, CHANNELS));
    let y = o.scale(&y, &format!("{name}.scale1"), CHANNELS);
    let x = o.add(x, &y);
    let y = o.layer_norm(&x, &format!("{name}.norm2"), norm);
    let y = o.conv(&y, &format!("{name}.fc1"), linear(CHANNELS, 4 * CHANNELS));
    let y = o.gelu(&y);
    let y = o.conv(&y, &format!("{name}.fc2"), linear(4 * CHANNELS, CHANNELS));
    let y = o.scale(&y, &format!("{name}.scale2"), CHANNELS);
    o.add(&x, &y)
}

/// Returns the name of a parameter in DINOv2's code and in timm's `vit_small_patch14_dinov2`.
pub(super) fn published(name: &str) -> Option<String> {
    Some(match name {
        "stem.weight" | "stem.bias" => name.replacen("stem", "patch_embed.proj", 1),
        "enc.class" => "cls_token".into(),
        "enc.position" => "pos_embed".into(),
        _ => {
            let (block, part) = name.strip_prefix("enc")?.split_once('.')?;
            let (part, what) = part.split_once('.')?;
            match part {
                "norm" => format!("norm.{what}"),
                "norm1" | "norm2" => format!("blocks.{block}.{part}.{what}"),
                "qkv" | "proj" => format!("blocks.{block}.attn.{part}.{what}"),
                "fc1" | "fc2" => format!("blocks.{block}.mlp.{part}.{what}"),
                _ => format!("blocks.{block}.{}.{what}", part.replacen("scale", "ls", 1)),
            }
        }
    })
}

/// Converts published values to the layout of this network. The published `pos_embed` is 1 × (1 + positions) × channels; the position
/// of the class token is added to that token. Linear layers become 1 × 1 convolutions. An error names the array with a wrong shape.
pub(super) fn laid(name: &str, array: &Array, found: &[Array]) -> Result<Array, String> {
    let shape = [1, 1 + GRID * GRID, CHANNELS];
    let positions = || {
        let positions = found.iter().find(|a| a.name == "pos_embed" && a.shape == shape);
        positions.ok_or_else(|| format!("`pos_embed` is not {shape:?}, for 518 × 518 pixels without registers"))
    };
    if let Some(registers) = found.iter().find(|a| ["reg_token", "register_tokens"].contains(&a.name.as_str())) {
        return Err(format!("it has registers, `{}`: use the weights without them", registers.name));
    }
    let (shape, values) = match name {
        "enc.class" if array.shape != [1, 1, CHANNELS] => {
            return Err(format!("`{}` is {:?}, not {:?}", array.name, array.shape, [1, 1, CHANNELS]));
        }
        "enc.class" => {
            let sum = array.values.iter().zip(&positions()?.values).map(|(class, position)| class + position);
            (vec![1, CHANNELS, 1, 1], sum.collect())
        }
        "enc.position" => {
            let lying = &positions()?.values;
            let at = |i: usize| lying[(1 + i % (GRID * GRID)) * CHANNELS + i / (GRID * GRID)];
            (vec![1, CHANNELS, GRID, GRID], (0..CHANNELS * GRID * GRID).map(at).collect())
        }
        _ => match *array.shape {
            [outputs, inputs] => (vec![outputs, inputs, 1, 1], array.values.clone()),
            _ => (array.shape.clone(), array.values.clone()),
        },
    };
    Ok(Array { name: array.name.clone(), shape, values })
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToFloat;

    fn array(name: &str, shape: &[usize]) -> Array {
        let values = (0..shape.iter().product::<usize>()).map(|i| (i % 8191).to_f32()).collect();
        Array { name: name.into(), shape: shape.into(), values }
    }

    /// Rationale: with a missing position, or weights for registers, training still works, but worse. Expected: the first row of positions
    /// is added to the class token, the others become a map for each channel; errors name arrays of other shapes and registers.
    #[test]
    fn published_values_lie_as_the_network_has_them() {
        let tokens = 1 + GRID * GRID;
        let (class, positions) = (array("cls_token", &[1, 1, CHANNELS]), array("pos_embed", &[1, tokens, CHANNELS]));
        let found = [class.clone(), positions.clone()];
        let token = laid("enc.class", &class, &found).unwrap();
        assert_eq!((token.shape.as_slice(), token.values[7]), (&[1, CHANNELS, 1, 1][..], 14.0));
        let map = laid("enc.position", &positions, &found).unwrap();
        let (channel, row, column) = (5, 3, 30);
        let place = (channel * GRID + row) * GRID + column;
        assert_eq!(map.values[place], positions.values[(1 + row * GRID + column) * CHANNELS + channel]);
        for shape in [&[1, CHANNELS][..], &[1, CHANNELS, 1, 1]] {
            assert!(
                laid("enc.class", &array("cls_token", shape), &found).unwrap_err().contains("cls_token"),
                "{shape:?}"
            );
        }
        let fewer = [class.clone(), array("pos_embed", &[1, tokens - 1, CHANNELS])];
        assert!(laid("enc.class", &class, &fewer).unwrap_err().contains("pos_embed"));
        for name in ["reg_token", "register_tokens"] {
            let with = [class.clone(), positions.clone(), array(name, &[1, 4, CHANNELS])];
            assert!(laid("enc.class", &class, &with).unwrap_err().contains(name));
        }
    }
}
