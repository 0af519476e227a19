//! Implementation of [`Operations`] that computes a network with libtorch.

use super::device::Precision;
use crate::net::plants::is_of_plants;
use crate::net::{Conv, MULTIPLIED_OUT, Norm, Operations, film, is_encoder};
use furrow_base::math::{ToFloat, ToInt};
use std::collections::BTreeMap;
use tch::{Kind, Tensor};

/// Kind of forward pass: which statistics batch norms use, and whether it updates the running statistics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pass {
    /// Running statistics.
    Inference,
    /// Statistics of the batch; updates the running ones.
    Training,
    /// Statistics of the batch in the decoder, which updates its running ones; running statistics in the encoder.
    Decoder,
    /// Statistics of the batch, without updating the running ones.
    Batch,
    /// Statistics of the batch in the plant decoder, which updates its running ones; running statistics elsewhere.
    Plants,
}

/// Forward pass of a network. In bf16, convolutions use rounded copies of their weights; the weights and the statistics of batch norms
/// stay in single precision. This is the behaviour of `torch.autocast`, which tch supports only for CUDA.
pub(super) struct Compute<'a> {
    pub(super) tensors: &'a BTreeMap<String, Tensor>,
    pub(super) precision: Precision,
    pub(super) pass: Pass,
    /// Encoder features by their number of halvings, if requested.
    pub(super) features: Option<BTreeMap<usize, Tensor>>,
    /// Embedding of the crops of each image, images × width, if they are named; see [`film`].
    pub(super) crops: Option<Tensor>,
    /// Whether the plant decoder is applied as well.
    pub(super) wants_plants: bool,
    /// Its output.
    pub(super) plants: Option<Tensor>,
    /// Whether the class decoder is applied.
    pub(super) wants_classes: bool,
}

impl Compute<'_> {
    /// Modulates the output of a batch norm by the named crops: (1 + γ) y + β.
    fn modulated(&self, y: Tensor, name: &str, channels: usize) -> Tensor {
        let map = self.crops.as_ref().and_then(|crops| Some((crops, self.tensors.get(&film::map(name))?)));
        let Some((crops, map)) = map else { return y };
        let changes = crops.matmul(&map.tr()).to_kind(y.kind()).unsqueeze(-1).unsqueeze(-1);
        let channels = channels.to_i64();
        let (gamma, beta) = (changes.narrow(1, 0, channels), changes.narrow(1, channels, channels));
        y * (gamma + 1.0) + beta
    }

    fn rounded(&self, x: &Tensor) -> Tensor {
        match self.precision {
            Precision::Single => x.shallow_clone(),
            Precision::Bf16 => x.to_kind(Kind::BFloat16),
        }
    }
}

impl Operations for Compute<'_> {
    type Value = Tensor;
    /// Positions of the maxima, and the size before the pooling.
    type PoolIndices = (Tensor, [i64; 2]);

    fn conv(&mut self, x: &Tensor, name: &str, conv: Conv) -> Tensor {
        let weight = self.rounded(&self.tensors[&format!("{name}.weight")]);
        let bias = conv.bias.then(|| self.rounded(&self.tensors[&format!("{name}.bias")]));
        let (stride, groups) = (conv.stride.to_i64(), conv.groups.to_i64());
        let (before, after) = (conv.padding().0.to_i64(), conv.padding().1.to_i64());
        let x = self.rounded(x);
        let (x, pad) =
            if before == after { (x, before) } else { (x.constant_pad_nd([before, after, before, after]), 0) };
        x.conv2d(&weight, bias.as_ref(), [stride, stride], [pad, pad], [1, 1], groups)
    }

    fn norm(&mut self, x: &Tensor, name: &str, norm: Norm) -> Tensor {
        let [gain, shift, mean, variance] = ["weight", "bias", "running_mean", "running_var"]
            .map(|what| Some(&self.tensors[&format!("{name}.{what}")]));
        let training = match self.pass {
            Pass::Inference => false,
            Pass::Training | Pass::Batch => true,
            Pass::Decoder => !is_encoder(name),
            Pass::Plants => is_of_plants(name),
        };
        let momentum = if self.pass == Pass::Batch { 0.0 } else { 0.1 };
        let y = x.batch_norm(gain, shift, mean, variance, training, momentum, norm.epsilon, true);
        self.modulated(y, name, norm.channels)
    }

    fn relu(&mut self, x: &Tensor) -> Tensor {
        x.relu()
    }

    fn relu6(&mut self, x: &Tensor) -> Tensor {
        x.clamp(0.0, 6.0)
    }

    fn add(&mut self, a: &Tensor, b: &Tensor) -> Tensor {
        a + b
    }

    fn concat(&mut self, a: &Tensor, b: &Tensor) -> Tensor {
        Tensor::cat(&[a, b], 1)
    }

    fn pool(&mut self, x: &Tensor) -> (Tensor, Self::PoolIndices) {
        let (smaller, places) = x.max_pool2d_with_indices([2, 2], [2, 2], [0, 0], [1, 1], false);
        (smaller, (places, size(x)))
    }

    fn unpool(&mut self, x: &Tensor, (places, size): Self::PoolIndices) -> Tensor {
        x.max_unpool2d(&places, size)
    }

    fn pool3(&mut self, x: &Tensor) -> Tensor {
        x.max_pool2d([3, 3], [2, 2], [1, 1], [1, 1], false)
    }

    fn enlarge(&mut self, x: &Tensor, like: &Tensor) -> Tensor {
        x.upsample_nearest2d(size(like), None, None)
    }

    fn to_multiple(&mut self, x: &Tensor, pixels: usize) -> Tensor {
        let pixels = pixels.to_i64();
        let to = size(x).map(|side| (side + pixels - 1) / pixels * pixels);
        if to == size(x) { x.shallow_clone() } else { x.upsample_bilinear2d(to, false, None, None) }
    }

    fn tokens(&mut self, x: &Tensor, name: &str, channels: usize, _grid: usize) -> Tensor {
        let [class, position] = ["class", "position"].map(|what| &self.tensors[&format!("{name}.{what}")]);
        let [height, width] = size(x);
        let placed = x + position.upsample_bicubic2d([height, width], false, None, None);
        // The number of images is left open (-1), because a trace would record it as a constant.
        let patches = placed.reshape([-1, channels.to_i64(), 1, height * width]);
        Tensor::cat(&[&class.expand_as(&patches.narrow(3, 0, 1)), &patches], 3)
    }

    fn map(&mut self, tokens: &Tensor, like: &Tensor) -> Tensor {
        let [height, width] = size(like);
        tokens.narrow(3, 1, height * width).reshape([-1, tokens.size()[1], height, width])
    }

    /// Computed in single precision, as in `torch.autocast`.
    fn layer_norm(&mut self, x: &Tensor, name: &str, norm: Norm) -> Tensor {
        let [gain, shift] = ["weight", "bias"].map(|what| Some(&self.tensors[&format!("{name}.{what}")]));
        // An unnecessary conversion would record the device in a trace.
        let x = if x.kind() == Kind::Float { x.shallow_clone() } else { x.to_kind(Kind::Float) };
        let lying = x.permute([0, 2, 3, 1]);
        lying.layer_norm([norm.channels.to_i64()], gain, shift, norm.epsilon, true).permute([0, 3, 1, 2])
    }

    fn gelu(&mut self, x: &Tensor) -> Tensor {
        x.gelu("none")
    }

    /// Up to [`MULTIPLIED_OUT`] tokens, attention uses explicit matrix products, which every version of PyTorch can trace. The products of
    /// more tokens would exceed the memory.
    fn attention(&mut self, x: &Tensor, channels: usize, heads: usize) -> Tensor {
        let (channels, heads, count) = (channels.to_i64(), heads.to_i64(), x.size()[3]);
        let split = x.reshape([-1, 3, heads, channels / heads, count]).transpose(3, 4);
        let [query, key, value] = [0, 1, 2].map(|part| split.select(1, part));
        let y = if count > MULTIPLIED_OUT.to_i64() {
            Tensor::scaled_dot_product_attention(&query, &key, &value, None::<&Tensor>, 0.0, false, None, false)
        } else {
            let products = query.matmul(&key.transpose(2, 3)) * (heads.to_f64() / channels.to_f64()).sqrt();
            products.softmax(-1, None::<Kind>).matmul(&value)
        };
        y.transpose(2, 3).reshape([-1, channels, 1, count])
    }

    fn scale(&mut self, x: &Tensor, name: &str, channels: usize) -> Tensor {
        x * self.tensors[&format!("{name}.gamma")].view([1, channels.to_i64(), 1, 1])
    }

    fn wants_plants(&self) -> bool {
        self.wants_plants
    }

    fn plants(&mut self, x: Tensor) {
        self.plants = Some(x);
    }

    fn wants_classes(&self) -> bool {
        self.wants_classes
    }

    fn features(&mut self, x: &Tensor, halvings: usize) {
        if let Some(features) = &mut self.features {
            features.insert(halvings, x.shallow_clone());
        }
    }
}

fn size(x: &Tensor) -> [i64; 2] {
    let size = x.size();
    [size[2], size[3]]
}
