//! The networks. Each is defined once, as a function over the trait [`Operations`].
//!
//! Implementations of the trait give the definition its meaning: [`parameters()`] lists the parameters, `torch` computes the network
//! with libtorch, and the exporters write its graph. So parameter counts, forward passes and exported graphs always agree. This
//! module does not need libtorch. [`Footprint`] follows the sizes of values, for an estimate of the memory.
//!
//! To add a network, add one file and one line in the table below.

mod basic_segnet;
mod extras;
pub mod film;
mod footprint;
mod lite_unet;
mod parameters;
pub mod plants;
mod pretrained;
mod segnet;
mod tiny_unet;
mod unet;
mod vit_unet;

pub use extras::Extras;
pub use footprint::{Footprint, MULTIPLIED_OUT};
pub use parameters::{Parameter, Role, fitting, is_encoder, matching, parameters};
pub use pretrained::Pretrained;

use serde::{Deserialize, Serialize};
use std::borrow::Borrow;

/// Parameters of a convolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conv {
    /// Number of input channels.
    pub inputs: usize,
    /// Number of output channels.
    pub outputs: usize,
    /// Width of the square kernel, pixels.
    pub kernel: usize,
    /// Stride, pixels.
    pub stride: usize,
    /// Whether each output channel has a bias.
    pub bias: bool,
    /// Number of channel groups: 1, or the number of channels for a depthwise convolution.
    pub groups: usize,
    /// Whether it is padded like TensorFlow's `SAME` for even sizes: with stride 2, one zero fewer before the first pixel than after
    /// the last.
    pub same: bool,
}

impl Conv {
    /// Returns a convolution of stride 1 without bias.
    pub const fn new(inputs: usize, outputs: usize, kernel: usize) -> Self {
        Self { inputs, outputs, kernel, stride: 1, bias: false, groups: 1, same: false }
    }

    /// Returns the convolution with this stride.
    #[must_use]
    pub const fn stride(self, stride: usize) -> Self {
        Self { stride, ..self }
    }

    /// Returns the convolution with this stride and TensorFlow's `SAME` padding.
    #[must_use]
    pub const fn same(self, stride: usize) -> Self {
        Self { stride, same: true, ..self }
    }

    /// Returns the convolution with a bias.
    #[must_use]
    pub const fn bias(self) -> Self {
        Self { bias: true, ..self }
    }

    /// Returns the convolution as a depthwise one.
    #[must_use]
    pub const fn depthwise(self) -> Self {
        Self { groups: self.inputs, ..self }
    }

    /// Returns the number of zeros before the first and after the last pixel of a row or column. Stride 1 keeps the size.
    pub const fn padding(self) -> (usize, usize) {
        if self.same {
            let all = self.kernel - self.stride;
            (all / 2, all - all / 2)
        } else {
            (self.kernel / 2, self.kernel / 2)
        }
    }
}

/// Parameters of a batch or layer norm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Norm {
    /// Number of channels.
    pub channels: usize,
    /// Constant that is added to variances.
    pub epsilon: f64,
}

/// Operations that networks consist of. Values are images × channels × height × width. Parameters are identified by names such as
/// `enc0_0.conv.weight`.
pub trait Operations {
    /// Value, such as a tensor.
    type Value;
    /// Positions of the maxima of a pooling.
    type PoolIndices;

    /// Convolution with the parameters `name.weight` and `name.bias`.
    fn conv(&mut self, x: &Self::Value, name: &str, conv: Conv) -> Self::Value;
    /// Batch normalisation (Ioffe & Szegedy 2015) with the parameters `name.weight`, `.bias`, `.running_mean` and `.running_var`.
    fn norm(&mut self, x: &Self::Value, name: &str, norm: Norm) -> Self::Value;
    /// max(x, 0).
    fn relu(&mut self, x: &Self::Value) -> Self::Value;
    /// min(max(x, 0), 6).
    fn relu6(&mut self, x: &Self::Value) -> Self::Value;
    /// a + b.
    fn add(&mut self, a: &Self::Value, b: &Self::Value) -> Self::Value;
    /// Concatenation of the channels of a and b.
    fn concat(&mut self, a: &Self::Value, b: &Self::Value) -> Self::Value;
    /// Max pooling of 2 × 2 pixels; also returns the positions of the maxima. An odd last row or column is dropped.
    fn pool(&mut self, x: &Self::Value) -> (Self::Value, Self::PoolIndices);
    /// Inverse of [`Self::pool`]: moves each value to its position; zero elsewhere. Restores the size before the pooling.
    fn unpool(&mut self, x: &Self::Value, places: Self::PoolIndices) -> Self::Value;
    /// Max pooling of 3 × 3 pixels with stride 2.
    fn pool3(&mut self, x: &Self::Value) -> Self::Value;
    /// Nearest-neighbour resize to the height and width of `like`.
    fn enlarge(&mut self, x: &Self::Value, like: &Self::Value) -> Self::Value;
    /// Bilinear resize to the next multiples of `pixels` in height and width.
    fn to_multiple(&mut self, x: &Self::Value, pixels: usize) -> Self::Value;
    /// Tokens of a vision transformer: a class token, then the pixels of the map plus their position embeddings; images × channels ×
    /// 1 × (1 + pixels). Parameters are `name.class` (1 × channels × 1 × 1) and `name.position` (1 × channels × grid × grid, resized
    /// bicubically to the map's size).
    fn tokens(&mut self, x: &Self::Value, name: &str, channels: usize, grid: usize) -> Self::Value;
    /// Tokens without the class token, reshaped to the height and width of `like`.
    fn map(&mut self, tokens: &Self::Value, like: &Self::Value) -> Self::Value;
    /// Layer normalisation (Ba et al. 2016) over the channels of each pixel, with the parameters `name.weight` and `name.bias`.
    fn layer_norm(&mut self, x: &Self::Value, name: &str, norm: Norm) -> Self::Value;
    /// GELU: x · Φ(x), where Φ is the normal distribution function (Hendrycks & Gimpel 2016).
    fn gelu(&mut self, x: &Self::Value) -> Self::Value;
    /// Multi-head self-attention (Vaswani et al. 2017) between tokens. Each token holds its query, key and value, `channels` each.
    fn attention(&mut self, x: &Self::Value, channels: usize, heads: usize) -> Self::Value;
    /// LayerScale (Touvron et al. 2021): multiplies each channel by its factor in `name.gamma`.
    fn scale(&mut self, x: &Self::Value, name: &str, channels: usize) -> Self::Value;
    /// Called with the last value of the encoder that is downsampled by 2^`_halvings`: its features at that size.
    fn features(&mut self, _x: &Self::Value, _halvings: usize) {}
    /// Returns whether the plant decoder is to be applied as well; see [`plants`].
    fn wants_plants(&self) -> bool {
        false
    }
    /// Called with the output of the plant decoder, if it is wanted.
    fn plants(&mut self, _x: Self::Value) {}
    /// Returns whether the class decoder is to be applied. Without it, the result of a network with a plant decoder is that decoder's.
    fn wants_classes(&self) -> bool {
        true
    }
}

/// Defines [`Network`] from one line for each network: variant, module, name on the command line, description.
macro_rules! networks {
    ($($variant:ident, $module:ident, $name:literal, $doc:literal;)*) => {
        /// Network architecture.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub enum Network {
            $(#[doc = $doc] #[serde(rename = $name)] $variant,)*
        }

        impl Network {
            /// All networks.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// Returns the name on command lines and in files.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// Returns a description in one sentence.
            pub fn about(self) -> &'static str {
                match self { $(Self::$variant => $doc,)* }
            }

            /// Applies the network to images with `bands` channels. Returns one score for each class and pixel; the class with
            /// the highest score is the prediction.
            pub fn walk<O: Operations>(self, o: &mut O, x: &O::Value, bands: usize, classes: usize) -> O::Value {
                match self { $(Self::$variant => $module::walk(o, x, bands, classes),)* }
            }
        }
    };
}

networks! {
    BasicSegnet, basic_segnet, "basic-segnet", "Basic SegNet of Kendall et al. 2015: four 7 × 7 convolutions of 64 channels down, four up.";
    Segnet, segnet, "segnet", "SegNet of Badrinarayanan et al. 2017: the 13 convolutions of VGG16 with batch norm, and their mirror.";
    LiteUnet, lite_unet, "lite-unet", "U-Net with the encoder of EfficientNet-Lite0 (Tan & Le 2019), optionally with ImageNet weights.";
    TinyUnet, tiny_unet, "tiny-unet", "U-Net of two levels with 8 and 16 channels: trains in seconds, to try a pipeline out.";
    Unet, unet, "unet", "U-Net (Ronneberger et al. 2015) with the residual encoder of ResNet-18 (He et al. 2016).";
    VitUnet, vit_unet, "vit-unet", "U-Net decoder over a ViT-S/14 (Dosovitskiy et al. 2021), optionally initialised from a file with DINOv2 weights (Oquab et al. 2023).";
}

impl Network {
    /// Returns the smallest width and height of an image, pixels. SegNets and EfficientNet halve the image four or five times, and the
    /// result must not be empty.
    pub fn least_side(self) -> u32 {
        match self {
            Self::BasicSegnet => 16,
            Self::TinyUnet => 4,
            Self::Segnet | Self::LiteUnet => 32,
            Self::Unet | Self::VitUnet => 1,
        }
    }

    /// Parses a name.
    pub fn named(text: &str) -> Result<Self, String> {
        let names: Vec<&str> = Self::ALL.iter().map(|n| n.name()).collect();
        let found = Self::ALL.iter().copied().find(|n| n.name() == text);
        found.ok_or_else(|| format!("there is no network `{text}`: networks are {}", names.join(", ")))
    }
}

/// Convolution, batch norm and, if `relu`, ReLU, with the parameter names `name.conv` and `name.bn`.
fn unit<O: Operations>(o: &mut O, x: &O::Value, name: &str, conv: Conv, relu: bool) -> O::Value {
    let y = o.conv(x, &format!("{name}.conv"), conv);
    let y = o.norm(&y, &format!("{name}.bn"), Norm { channels: conv.outputs, epsilon: 1e-5 });
    if relu { o.relu(&y) } else { y }
}

/// Prefix of the names of the plant decoder's parameters.
const PLANTS: &str = "plants.";
/// Number of channels of the plant decoder.
const PLANT_CHANNELS: usize = 3;

/// Decoders of a U-Net, from the deepest value and its number of channels. Each level of `widths` channels upsamples with the nearest
/// neighbour to the last remaining skip value, concatenates that, and applies two 3 × 3 convolutions. Without a remaining skip value it
/// upsamples to the size of `x`. A last convolution gives the classes.
///
/// The plant decoder has the same levels except the last, if it is wanted.
fn decode<O: Operations>(
    o: &mut O,
    x: &O::Value,
    (deepest, channels): (O::Value, usize),
    skips: Vec<(O::Value, usize)>,
    widths: &[usize],
    classes: usize,
) -> O::Value {
    if o.wants_plants() {
        let kept = skips.iter().rev().map(|(skip, channels)| (skip, *channels));
        let widths = &widths[..widths.len() - 1];
        let found = branch(o, x, (&deepest, channels), kept, widths, (PLANTS, PLANT_CHANNELS));
        let found = o.enlarge(&found, x);
        if !o.wants_classes() {
            return found;
        }
        o.plants(found);
    }
    branch(o, x, (deepest, channels), skips.into_iter().rev(), widths, ("", classes))
}

/// One decoder; its parameter names begin with `prefix`. Values that it owns are freed after their last use.
fn branch<O: Operations, V: Borrow<O::Value>>(
    o: &mut O,
    x: &O::Value,
    (deepest, mut channels): (V, usize),
    mut skips: impl Iterator<Item = (V, usize)>,
    widths: &[usize],
    (prefix, outputs): (&str, usize),
) -> O::Value {
    let mut deepest = Some(deepest);
    let mut now: Option<O::Value> = None;
    for (level, width) in widths.iter().copied().enumerate() {
        let below = now.as_ref().or_else(|| deepest.as_ref().map(Borrow::borrow)).unwrap_or(x);
        let (joined, inputs) = match skips.next() {
            Some((skip, more)) => {
                let larger = o.enlarge(below, skip.borrow());
                (o.concat(&larger, skip.borrow()), channels + more)
            }
            None => (o.enlarge(below, x), channels),
        };
        let first = unit(o, &joined, &format!("{prefix}dec{level}_0"), Conv::new(inputs, width, 3), true);
        now = Some(unit(o, &first, &format!("{prefix}dec{level}_1"), Conv::new(width, width, 3), true));
        deepest = None;
        channels = width;
    }
    let last = now.as_ref().or_else(|| deepest.as_ref().map(Borrow::borrow)).unwrap_or(x);
    o.conv(last, &format!("{prefix}head.conv"), Conv::new(channels, outputs, 3).bias())
}
