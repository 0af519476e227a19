//! A decoder over a vision transformer, whose features DINOv2 learns from photographs without labels: the largest encoder here, for whoever
//! has its weights and a GPU, or patience.
//!
//! Sources: Dosovitskiy et al. 2021, "An image is worth 16 × 16 words" (patches as tokens, pre-norm blocks); Oquab et al. 2023, "DINOv2"
//! (ViT-S/14: 12 blocks of 384 channels and 6 heads, LayerScale, 37 × 37 positions). Positions are brought to another size bicubically and
//! not antialiased, as Hugging Face's `Dinov2Model` has it; timm antialiases, and DINOv2's own code stretches by a tenth of a patch. An image is first brought to multiples of a patch's 14 pixels. What a patch is too coarse for comes
//! from three convolutions of the image itself, of 2, 4 and 8 pixels; the decoder has 128, 64, 32 and 16 channels, each two 3 × 3
//! convolutions behind an enlargement by the nearest pixel.

use super::{Conv, Norm, Operations, decode, unit};
use crate::train::weights::Array;

/// Pixels across a patch.
const PATCH: usize = 14;
/// Channels of a token.
const CHANNELS: usize = 384;
/// Blocks of the transformer.
const BLOCKS: usize = 12;
/// Heads of each attention.
const HEADS: usize = 6;
/// Positions across the grid whose embeddings are learnt: 518 pixels.
const GRID: usize = 37;
/// The block in the middle, whose tokens the decoder sees beside the last ones.
const MIDDLE: usize = 5;
/// ε of the layer norms.
const EPSILON: f64 = 1e-6;
/// Channels of what is seen of the image itself, at 2, 4 and 8 pixels.
const FINE: [usize; 3] = [16, 32, 64];
/// Channels of the decoder at 8, 4, 2 pixels and one.
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
    // A patch is between 8 and 16 pixels wide, so both are shown in cells of 8.
    for (features, halvings) in seen.iter().zip([3, 4]) {
        let cells = o.enlarge(features, &skips[FINE.len() - 1].0);
        o.features(&cells, halvings);
    }
    let tokens = o.concat(&seen[0], &seen[1]);
    decode(o, x, (tokens, 2 * CHANNELS), skips, &DECODER, classes)
}

/// A block: attention between tokens, then a layer of four times the channels in each, both behind a norm and beside a way past them.
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

/// A parameter's name in DINOv2's code and in timm's `vit_small_patch14_dinov2`.
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

/// Published values as they lie here. `pos_embed` is 1 × (1 + positions) × channels, and that of the class token is added to it; layers of
/// tokens are 1 × 1 convolutions. An error that says what has another shape.
pub(super) fn laid(name: &str, array: &Array, found: &[Array]) -> Result<Array, String> {
    let shape = [1, 1 + GRID * GRID, CHANNELS];
    let positions = || {
        let positions = found.iter().find(|a| a.name == "pos_embed" && a.shape == shape);
        positions.ok_or_else(|| format!("`pos_embed` is not {shape:?}, as of 518 × 518 pixels and no registers"))
    };
    if let Some(registers) = found.iter().find(|a| ["reg_token", "register_tokens"].contains(&a.name.as_str())) {
        return Err(format!("it has registers, `{}`: take the weights without them", registers.name));
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

    fn array(name: &str, shape: &[usize]) -> Array {
        let values = (0..shape.iter().product::<usize>()).map(|i| (i % 8191) as f32).collect();
        Array { name: name.into(), shape: shape.into(), values }
    }

    /// Rationale: a token without its position, or features of a network with registers, still learn, only worse. Expected: the class token with
    /// the first row of positions added, the others as a map of each channel; other shapes and registers are refused by their names.
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
