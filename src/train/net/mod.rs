//! The networks, each written once as a walk over a handful of operations.
//!
//! Who walks decides what comes of it: [`parameters()`] lists what there is to learn, libtorch computes, an exporter writes the graph
//! down. So parameter counts, forward passes and exported graphs cannot disagree. Nothing here needs libtorch.
//!
//! A new network is one file and one line in the table below.

mod basic_segnet;
mod lite_unet;
mod parameters;
mod pretrained;
mod segnet;
mod unet;
mod vit_unet;

pub use parameters::{Parameter, Role, fitting, is_encoder, parameters};
pub use pretrained::Pretrained;

use serde::{Deserialize, Serialize};

/// A convolution's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conv {
    /// Channels in.
    pub inputs: usize,
    /// Channels out.
    pub outputs: usize,
    /// Pixels across the square kernel; odd.
    pub kernel: usize,
    /// Pixels between two results.
    pub stride: usize,
    /// Whether a number is added to each channel.
    pub bias: bool,
    /// Groups of channels that do not see each other: 1, or as many as channels, "depthwise".
    pub groups: usize,
    /// Whether it is padded as TensorFlow's `SAME` pads even sizes: with stride 2, one zero fewer before the first pixel than behind the
    /// last.
    pub same: bool,
}

impl Conv {
    /// A convolution of stride 1 without bias.
    pub const fn new(inputs: usize, outputs: usize, kernel: usize) -> Self {
        Self { inputs, outputs, kernel, stride: 1, bias: false, groups: 1, same: false }
    }

    /// The same with this stride.
    #[must_use]
    pub const fn stride(self, stride: usize) -> Self {
        Self { stride, ..self }
    }

    /// The same with this stride, padded as TensorFlow does.
    #[must_use]
    pub const fn same(self, stride: usize) -> Self {
        Self { stride, same: true, ..self }
    }

    /// The same with a bias.
    #[must_use]
    pub const fn bias(self) -> Self {
        Self { bias: true, ..self }
    }

    /// The same, each channel by itself.
    #[must_use]
    pub const fn depthwise(self) -> Self {
        Self { groups: self.inputs, ..self }
    }

    /// Zeros before the first and behind the last pixel of a row or column: so many that stride 1 keeps the size.
    pub const fn padding(self) -> (usize, usize) {
        if self.same {
            let all = self.kernel - self.stride;
            (all / 2, all - all / 2)
        } else {
            (self.kernel / 2, self.kernel / 2)
        }
    }
}

/// A batch or layer norm's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Norm {
    /// Channels.
    pub channels: usize,
    /// What is added to variances.
    pub epsilon: f64,
}

/// What networks are made of. Values are images × channels × height × width; parameters are found by name, as in
/// `enc0_0.conv.weight`.
pub trait Operations {
    /// A value.
    type Value;
    /// Where the maxima of a pooling lay.
    type Places;

    /// A convolution with the parameters `name.weight` and `name.bias`.
    fn conv(&mut self, x: &Self::Value, name: &str, conv: Conv) -> Self::Value;
    /// Batch normalisation (Ioffe & Szegedy 2015) with `name.weight`, `.bias`, `.running_mean`, `.running_var`.
    fn norm(&mut self, x: &Self::Value, name: &str, norm: Norm) -> Self::Value;
    /// max(x, 0).
    fn relu(&mut self, x: &Self::Value) -> Self::Value;
    /// min(max(x, 0), 6).
    fn relu6(&mut self, x: &Self::Value) -> Self::Value;
    /// a + b.
    fn add(&mut self, a: &Self::Value, b: &Self::Value) -> Self::Value;
    /// The channels of a, then those of b.
    fn concat(&mut self, a: &Self::Value, b: &Self::Value) -> Self::Value;
    /// The largest of each 2 × 2 pixels, and where it lay; an odd row or column at the end is left out.
    fn pool(&mut self, x: &Self::Value) -> (Self::Value, Self::Places);
    /// Puts each value back to its place; zero elsewhere. The size is that before the pooling.
    fn unpool(&mut self, x: &Self::Value, places: Self::Places) -> Self::Value;
    /// The largest of each 3 × 3 pixels, two pixels apart.
    fn pool3(&mut self, x: &Self::Value) -> Self::Value;
    /// To the height and width of `like`, by the nearest pixel.
    fn enlarge(&mut self, x: &Self::Value, like: &Self::Value) -> Self::Value;
    /// To the next height and width that so many pixels divide, bilinearly.
    fn to_multiple(&mut self, x: &Self::Value, pixels: usize) -> Self::Value;
    /// A map's pixels, each with its position's embedding added, behind a class token: images × channels × 1 × (1 + pixels), with
    /// `name.class` (1 × channels × 1 × 1) and `name.position` (1 × channels × grid × grid, brought to the map's size bicubically).
    fn tokens(&mut self, x: &Self::Value, name: &str, channels: usize, grid: usize) -> Self::Value;
    /// Tokens without the class token, as a map of the height and width of `like`.
    fn map(&mut self, tokens: &Self::Value, like: &Self::Value) -> Self::Value;
    /// Layer normalisation (Ba et al. 2016) of each pixel's channels, with `name.weight` and `name.bias`.
    fn layer_norm(&mut self, x: &Self::Value, name: &str, norm: Norm) -> Self::Value;
    /// x · Φ(x), Φ being the normal distribution (Hendrycks & Gimpel 2016).
    fn gelu(&mut self, x: &Self::Value) -> Self::Value;
    /// Self-attention (Vaswani et al. 2017) between tokens, each with so many channels of its query, then of its key, then of its value.
    fn attention(&mut self, x: &Self::Value, channels: usize, heads: usize) -> Self::Value;
    /// Each channel times its number in `name.gamma`: LayerScale (Touvron et al. 2021).
    fn scale(&mut self, x: &Self::Value, name: &str, channels: usize) -> Self::Value;
    /// Told of the last value of the encoder that is halved so many times: its features at that size.
    fn features(&mut self, _x: &Self::Value, _halvings: usize) {}
}

/// One line a network: its variant, its file, its name on command lines, what it is.
macro_rules! networks {
    ($($variant:ident, $module:ident, $name:literal, $doc:literal;)*) => {
        /// A network.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub enum Network {
            $(#[doc = $doc] #[serde(rename = $name)] $variant,)*
        }

        impl Network {
            /// All networks.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// Name on command lines and in files.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// What it is, in one sentence.
            pub fn about(self) -> &'static str {
                match self { $(Self::$variant => $doc,)* }
            }

            /// From images of `bands` channels to one value a class and pixel, the highest of which is the network's prediction.
            pub fn walk<O: Operations>(self, o: &mut O, x: &O::Value, bands: usize, classes: usize) -> O::Value {
                match self { $(Self::$variant => $module::walk(o, x, bands, classes),)* }
            }
        }
    };
}

networks! {
    BasicSegnet, basic_segnet, "basic-segnet", "Basic SegNet of Kendall et al. 2015: four 7 × 7 convolutions of 64 channels down, four up.";
    Segnet, segnet, "segnet", "SegNet of Badrinarayanan et al. 2017: the 13 convolutions of VGG16 with batch norm, and their mirror.";
    LiteUnet, lite_unet, "lite-unet", "U-Net with the encoder of EfficientNet-Lite0 (Tan & Le 2019), which may begin with weights learnt from ImageNet.";
    Unet, unet, "unet", "U-Net (Ronneberger et al. 2015) with the residual encoder of ResNet-18 (He et al. 2016).";
    VitUnet, vit_unet, "vit-unet", "U-Net decoder over a ViT-S/14 (Dosovitskiy et al. 2021), which may begin with weights of DINOv2 (Oquab et al. 2023) that one brings.";
}

impl Network {
    /// Pixels that an image must have down and across: SegNets and EfficientNet halve it again and again and keep nothing of what is odd.
    pub fn least_side(self) -> u32 {
        match self {
            Self::BasicSegnet => 16,
            Self::Segnet | Self::LiteUnet => 32,
            Self::Unet | Self::VitUnet => 1,
        }
    }

    /// Reads a name.
    pub fn named(text: &str) -> Result<Self, String> {
        let names: Vec<&str> = Self::ALL.iter().map(|n| n.name()).collect();
        let found = Self::ALL.iter().copied().find(|n| n.name() == text);
        found.ok_or_else(|| format!("there is no network `{text}`: networks are {}", names.join(", ")))
    }
}

/// Convolution, batch norm and, where asked for, ReLU, with the names `name.conv` and `name.bn`.
fn unit<O: Operations>(o: &mut O, x: &O::Value, name: &str, conv: Conv, relu: bool) -> O::Value {
    let y = o.conv(x, &format!("{name}.conv"), conv);
    let y = o.norm(&y, &format!("{name}.bn"), Norm { channels: conv.outputs, epsilon: 1e-5 });
    if relu { o.relu(&y) } else { y }
}

/// The decoder of a U-Net: from the deepest value and its channels through levels of `widths` channels, each behind an enlargement by the nearest
/// pixel and two 3 × 3 convolutions, beside the last of `skips`, or at the size of `x` where none is left; then the classes.
fn decode<O: Operations>(
    o: &mut O,
    x: &O::Value,
    (mut now, mut channels): (O::Value, usize),
    mut skips: Vec<(O::Value, usize)>,
    widths: &[usize],
    classes: usize,
) -> O::Value {
    for (level, outputs) in widths.iter().copied().enumerate() {
        let (joined, inputs) = match skips.pop() {
            Some((skip, more)) => {
                let larger = o.enlarge(&now, &skip);
                (o.concat(&larger, &skip), channels + more)
            }
            None => (o.enlarge(&now, x), channels),
        };
        let first = unit(o, &joined, &format!("dec{level}_0"), Conv::new(inputs, outputs, 3), true);
        now = unit(o, &first, &format!("dec{level}_1"), Conv::new(outputs, outputs, 3), true);
        channels = outputs;
    }
    o.conv(&now, "head.conv", Conv::new(channels, classes, 3).bias())
}
