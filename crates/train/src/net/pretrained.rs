//! Initialises encoders with published weights: finds the file and maps the names of its arrays.
//!
//! Files are safetensors with the array names of the network's public implementation, converted from its original format. Pickle files
//! are not read, because they can execute code.
//!
//! | network | array names of |
//! |---|---|
//! | `lite-unet` | `efficientnet_lite_pytorch`, `efficientnet-lite0` |
//! | `unet` | torchvision's `resnet18` |
//! | `segnet` | torchvision's `vgg16_bn` |
//! | `vit-unet` | DINOv2's `dinov2_vits14`, timm's `vit_small_patch14_dinov2` |

use super::{Network, Parameter, lite_unet, parameters, segnet, unet, vit_unet};
use crate::data::Band;
use crate::weights::{self, Array};
use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Initial weights of the encoder.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pretrained {
    /// Random weights.
    #[default]
    None,
    /// EfficientNet-Lite0 trained on ImageNet; for `lite-unet`.
    Imagenet,
    /// Weights of a safetensors file.
    File(PathBuf),
}

impl Pretrained {
    /// Parses `none`, `imagenet` or the path of a file.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "" => Err("an empty name: write none, imagenet or a safetensors file".into()),
            "none" => Ok(Self::None),
            "imagenet" => Ok(Self::Imagenet),
            path => Ok(Self::File(path.into())),
        }
    }

    /// Returns `none`, `imagenet` or the path of the file.
    pub fn name(&self) -> String {
        match self {
            Self::None => "none".into(),
            Self::Imagenet => "imagenet".into(),
            Self::File(path) => path.display().to_string(),
        }
    }

    /// Returns whether all weights are random.
    pub fn is_none(&self) -> bool {
        *self == Self::None
    }

    /// Returns all initial values of a network, in the order of [`parameters()`]: those of the encoder from the file, the others random.
    /// The list is empty for [`Self::None`].
    ///
    /// In the first convolution, red, green and blue use their published kernels and other bands the mean of the three. Kernels are scaled
    /// by 3 / bands, so that a gray image gives the same sums as in colour.
    ///
    /// # Errors
    /// If an array is missing in the file, has another shape or contains values that are not finite.
    pub fn begin(&self, network: Network, bands: &[Band], classes: usize, seed: u64) -> Result<Vec<Array>> {
        let path = match self {
            Self::None => return Ok(Vec::new()),
            Self::Imagenet if network != Network::LiteUnet => {
                return Err(Error::misuse(format!("there are no ImageNet weights for {}", network.name()))
                    .help("use --network lite-unet, or a safetensors file with weights of this network's encoder"));
            }
            Self::Imagenet => imagenet(),
            Self::File(path) => path.clone(),
        };
        if *self == Self::Imagenet && !path.is_file() {
            return Err(Error::missing("there is no file with the ImageNet weights")
                .help("run `sh .libtorch/imagenet.sh` in the repository, or set FURROW_IMAGENET to another file")
                .in_file(path));
        }
        let found = weights::read_foreign(&path)?;
        let place = |(i, parameter): (usize, &Parameter)| {
            let values = if parameter.is_encoder() {
                values(network, parameter, (i == 0).then_some(bands), &found).map_err(|e| e.in_file(&path))?
            } else {
                parameter.begin(seed, i)
            };
            Ok(Array { name: parameter.name.clone(), shape: parameter.shape.clone(), values })
        };
        parameters(network, bands.len(), classes).iter().enumerate().map(place).collect()
    }
}

/// Returns the path of the ImageNet weights: that in `FURROW_IMAGENET`, or the one where `sh .libtorch/imagenet.sh` writes them.
fn imagenet() -> PathBuf {
    const HERE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../.libtorch/efficientnet-lite0.safetensors");
    std::env::var_os("FURROW_IMAGENET").map_or_else(|| Path::new(HERE).into(), PathBuf::from)
}

/// Returns the values of a parameter from the published arrays `found`. `bands` are the input bands if it is the first convolution.
fn values(network: Network, parameter: &Parameter, bands: Option<&[Band]>, found: &[Array]) -> Result<Vec<f32>> {
    let published = match network {
        Network::LiteUnet => lite_unet::published(&parameter.name),
        Network::Unet => unet::published(&parameter.name),
        Network::Segnet => segnet::published(&parameter.name),
        Network::VitUnet => vit_unet::published(&parameter.name),
        Network::BasicSegnet | Network::TinyUnet => None,
    };
    let Some(name) = published else {
        return Err(Error::misuse(format!("there are no published weights for {}", network.name()))
            .help("use --pretrained none, or another --network"));
    };
    let known = match network {
        Network::LiteUnet => "efficientnet_lite_pytorch's efficientnet-lite0",
        Network::Unet => "torchvision's resnet18",
        Network::VitUnet => "timm's vit_small_patch14_dinov2",
        Network::Segnet | Network::BasicSegnet | Network::TinyUnet => "torchvision's vgg16_bn",
    };
    let wrong = |what: String| {
        Error::input(format!("these are not weights of the encoder of {}: {what}", network.name()))
            .help(format!("use safetensors with the array names of {known}"))
    };
    let array = found.iter().find(|a| a.name == name).ok_or_else(|| wrong(format!("`{name}` is missing")))?;
    let laid = (network == Network::VitUnet).then(|| vit_unet::laid(&parameter.name, array, found).map_err(wrong));
    let laid = laid.transpose()?;
    let array = laid.as_ref().unwrap_or(array);
    if !array.values.iter().all(|v| v.is_finite()) {
        return Err(wrong(format!("`{name}` contains values that are not finite")));
    }
    match (array.shape.as_slice(), parameter.shape.as_slice(), bands) {
        (&[outputs, 3, height, width], &[to, _, h, w], Some(bands)) if (outputs, height, width) == (to, h, w) => {
            Ok(for_bands(&array.values, height * width, bands))
        }
        (is, must, _) if is == must => Ok(array.values.clone()),
        (is, must, _) => Err(wrong(format!("`{name}` is {is:?}, not {must:?}"))),
    }
}

/// Converts kernels of red, green and blue to kernels of these bands; `kernel` is the number of values per channel.
fn for_bands(values: &[f32], kernel: usize, bands: &[Band]) -> Vec<f32> {
    let scale = 3.0 / bands.len().to_f32();
    let mut kernels = Vec::with_capacity(values.len() / 3 * bands.len());
    for output in values.chunks_exact(3 * kernel) {
        for band in bands {
            let colour = Band::RGB.iter().position(|b| b == band);
            let value = |i: usize| {
                let of = |c: usize| output[c * kernel + i];
                scale * colour.map_or_else(|| (of(0) + of(1) + of(2)) / 3.0, of)
            };
            kernels.extend((0..kernel).map(value));
        }
    }
    kernels
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn published(network: Network) -> Vec<Array> {
        let name = |parameter: &Parameter| match network {
            Network::LiteUnet => lite_unet::published(&parameter.name),
            Network::Unet => unet::published(&parameter.name),
            Network::VitUnet => vit_unet::published(&parameter.name),
            _ => segnet::published(&parameter.name),
        };
        let array = |(i, p): (usize, &Parameter)| {
            Some(Array {
                name: name(p)?,
                shape: p.shape.clone(),
                values: (0..p.len()).map(|k| (i + k).to_f32()).collect(),
            })
        };
        parameters(network, 3, 3).iter().enumerate().filter(|(_, p)| p.is_encoder()).filter_map(array).collect()
    }

    /// Rationale: if arrays are confused, an encoder starts with wrong weights without an error. Expected: the names of the public
    /// implementations, each once. Source: torchvision 0.26 `vgg16_bn` and `resnet18`, efficientnet_lite_pytorch 0.1.0.
    #[test]
    fn arrays_have_the_names_of_public_implementations() {
        let known = [
            (Network::Segnet, "enc0_0.conv.weight", "features.0.weight"),
            (Network::Segnet, "enc2_1.bn.running_mean", "features.18.running_mean"),
            (Network::Segnet, "enc4_2.conv.bias", "features.40.bias"),
            (Network::Unet, "stem.bn.weight", "bn1.weight"),
            (Network::Unet, "enc0_1.1.conv.weight", "layer1.1.conv2.weight"),
            (Network::Unet, "enc3_0.past.bn.bias", "layer4.0.downsample.1.bias"),
            (Network::VitUnet, "stem.weight", "patch_embed.proj.weight"),
            (Network::VitUnet, "enc.position", "pos_embed"),
            (Network::VitUnet, "enc0.norm1.weight", "blocks.0.norm1.weight"),
            (Network::VitUnet, "enc10.qkv.bias", "blocks.10.attn.qkv.bias"),
            (Network::VitUnet, "enc11.scale2.gamma", "blocks.11.ls2.gamma"),
            (Network::LiteUnet, "stem.bn.running_var", "_bn0.running_var"),
            (Network::LiteUnet, "enc0_0.depthwise.conv.weight", "_blocks.0._depthwise_conv.weight"),
            (Network::LiteUnet, "enc2_1.project.bn.bias", "_blocks.4._bn2.bias"),
            (Network::LiteUnet, "enc6_0.expand.conv.weight", "_blocks.15._expand_conv.weight"),
        ];
        for (network, ours, theirs) in known {
            let list = parameters(network, 3, 3);
            let i = list.iter().filter(|p| p.is_encoder()).position(|p| p.name == ours).unwrap();
            let all = published(network);
            assert_eq!(all[i].name, theirs);
            assert_eq!(all.iter().filter(|a| a.name == theirs).count(), 1, "{theirs}");
            assert_eq!(all.len(), list.iter().filter(|p| p.is_encoder()).count());
        }
    }

    /// Rationale: a file of another network must not be used in part. Expected: the encoder has the values of the file, the decoder the
    /// random ones; a fourth band has the mean of the colour kernels and a gray image gives the same sums; missing arrays, wrong shapes
    /// and values that are not finite give errors.
    #[test]
    fn an_encoder_starts_from_the_file_and_a_wrong_file_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("encoder.safetensors");
        let mut arrays = published(Network::LiteUnet);
        weights::write(&path, &arrays, "").unwrap();
        let from = Pretrained::File(path.clone());
        let begun = from.begin(Network::LiteUnet, &Band::RGB, 3, 1).unwrap();
        let list = parameters(Network::LiteUnet, 3, 3);
        for ((i, parameter), array) in list.iter().enumerate().zip(&begun) {
            let expected = if parameter.is_encoder() {
                array.values[0] == i.to_f32()
            } else {
                array.values == parameter.begin(1, i)
            };
            assert!(expected, "{}", parameter.name);
        }
        // The first kernel contains the numbers 0 to 26, 9 for each colour.
        let kernel = |bands: &str| {
            let bands = Band::list(bands).unwrap();
            from.begin(Network::LiteUnet, &bands, 3, 1).unwrap()[0].values[..9 * bands.len()].to_vec()
        };
        let colour = |first: f32, scale: f32| (0..9).map(|i| scale * (first + i.to_f32())).collect::<Vec<_>>();
        assert_eq!(kernel("rgb"), (0..27).map(ToFloat::to_f32).collect::<Vec<_>>());
        assert_eq!(kernel("nir,blue"), [colour(9.0, 1.5), colour(18.0, 1.5)].concat());
        assert_eq!(kernel("nir"), colour(9.0, 3.0));
        let sum = |values: Vec<f32>| values.iter().sum::<f32>();
        assert!((sum(kernel("rgbn")) - sum(kernel("rgb"))).abs() < 1e-2);
        let message_of = |arrays: &[Array], network| {
            weights::write(&path, arrays, "").unwrap();
            let error = from.begin(network, &Band::RGB, 3, 1).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            error.to_string()
        };
        assert!(message_of(&arrays, Network::Unet).contains("`conv1.weight` is missing"));
        assert!(message_of(&arrays, Network::BasicSegnet).contains("no published weights"));
        arrays[7].values[0] = f32::NAN;
        assert!(message_of(&arrays, Network::LiteUnet).contains("not finite"));
        arrays[7].shape = vec![1, arrays[7].values.len()];
        arrays[7].values[0] = 0.0;
        assert!(message_of(&arrays, Network::LiteUnet).contains(", not ["));
        std::fs::write(&path, b"\x80\x02}q\x00.").unwrap();
        assert!(from.begin(Network::LiteUnet, &Band::RGB, 3, 1).unwrap_err().to_string().contains("safetensors"));
    }

    /// Unit of an encoder: our name, torchvision's names of its convolution and batch norm, and the outputs, inputs and kernel size of
    /// the convolution.
    type EncoderUnit = (&'static str, &'static str, &'static str, [usize; 3]);

    /// All units of `torchvision.models.resnet18().state_dict()` except `fc` and batch counters.
    const RESNET18: [EncoderUnit; 20] = [
        ("stem", "conv1", "bn1", [64, 3, 7]),
        ("enc0_0.0", "layer1.0.conv1", "layer1.0.bn1", [64, 64, 3]),
        ("enc0_0.1", "layer1.0.conv2", "layer1.0.bn2", [64, 64, 3]),
        ("enc0_1.0", "layer1.1.conv1", "layer1.1.bn1", [64, 64, 3]),
        ("enc0_1.1", "layer1.1.conv2", "layer1.1.bn2", [64, 64, 3]),
        ("enc1_0.0", "layer2.0.conv1", "layer2.0.bn1", [128, 64, 3]),
        ("enc1_0.1", "layer2.0.conv2", "layer2.0.bn2", [128, 128, 3]),
        ("enc1_0.past", "layer2.0.downsample.0", "layer2.0.downsample.1", [128, 64, 1]),
        ("enc1_1.0", "layer2.1.conv1", "layer2.1.bn1", [128, 128, 3]),
        ("enc1_1.1", "layer2.1.conv2", "layer2.1.bn2", [128, 128, 3]),
        ("enc2_0.0", "layer3.0.conv1", "layer3.0.bn1", [256, 128, 3]),
        ("enc2_0.1", "layer3.0.conv2", "layer3.0.bn2", [256, 256, 3]),
        ("enc2_0.past", "layer3.0.downsample.0", "layer3.0.downsample.1", [256, 128, 1]),
        ("enc2_1.0", "layer3.1.conv1", "layer3.1.bn1", [256, 256, 3]),
        ("enc2_1.1", "layer3.1.conv2", "layer3.1.bn2", [256, 256, 3]),
        ("enc3_0.0", "layer4.0.conv1", "layer4.0.bn1", [512, 256, 3]),
        ("enc3_0.1", "layer4.0.conv2", "layer4.0.bn2", [512, 512, 3]),
        ("enc3_0.past", "layer4.0.downsample.0", "layer4.0.downsample.1", [512, 256, 1]),
        ("enc3_1.0", "layer4.1.conv1", "layer4.1.bn1", [512, 512, 3]),
        ("enc3_1.1", "layer4.1.conv2", "layer4.1.bn2", [512, 512, 3]),
    ];

    /// All units of `torchvision.models.vgg16_bn().features.state_dict()` except batch counters.
    const VGG16_BN: [EncoderUnit; 13] = [
        ("enc0_0", "features.0", "features.1", [64, 3, 3]),
        ("enc0_1", "features.3", "features.4", [64, 64, 3]),
        ("enc1_0", "features.7", "features.8", [128, 64, 3]),
        ("enc1_1", "features.10", "features.11", [128, 128, 3]),
        ("enc2_0", "features.14", "features.15", [256, 128, 3]),
        ("enc2_1", "features.17", "features.18", [256, 256, 3]),
        ("enc2_2", "features.20", "features.21", [256, 256, 3]),
        ("enc3_0", "features.24", "features.25", [512, 256, 3]),
        ("enc3_1", "features.27", "features.28", [512, 512, 3]),
        ("enc3_2", "features.30", "features.31", [512, 512, 3]),
        ("enc4_0", "features.34", "features.35", [512, 512, 3]),
        ("enc4_1", "features.37", "features.38", [512, 512, 3]),
        ("enc4_2", "features.40", "features.41", [512, 512, 3]),
    ];

    /// Returns torchvision's name, our name and the shape of every array of these units. `biases` adds the biases of convolutions, as in
    /// VGG.
    fn arrays_of(known: &[EncoderUnit], biases: bool) -> BTreeMap<String, (String, Vec<usize>)> {
        let mut all = BTreeMap::new();
        for (ours, conv, norm, [outputs, inputs, kernel]) in known {
            let shape = vec![*outputs, *inputs, *kernel, *kernel];
            all.insert(format!("{conv}.weight"), (format!("{ours}.conv.weight"), shape));
            if biases {
                all.insert(format!("{conv}.bias"), (format!("{ours}.conv.bias"), vec![*outputs]));
            }
            for part in ["weight", "bias", "running_mean", "running_var"] {
                all.insert(format!("{norm}.{part}"), (format!("{ours}.bn.{part}"), vec![*outputs]));
            }
        }
        all
    }

    /// Rationale: users convert torchvision's own files. Expected: our map gives exactly the names and shapes above, which were written by
    /// hand, each for the right parameter; the encoder is initialised with the values of these names in a file. Source: torchvision 0.26,
    /// `models/resnet.py` and `models/vgg.py`, configuration D.
    #[test]
    fn files_of_torchvision_have_every_array_where_it_is_looked_for() {
        for (network, known) in
            [(Network::Unet, arrays_of(&RESNET18, false)), (Network::Segnet, arrays_of(&VGG16_BN, true))]
        {
            let list = parameters(network, 3, 3);
            let encoder = list.iter().filter(|p| p.is_encoder());
            let found: BTreeMap<_, _> = encoder
                .zip(published(network))
                .map(|(ours, theirs)| (theirs.name, (ours.name.clone(), ours.shape.clone())))
                .collect();
            assert_eq!(found, known);
        }
        let known = arrays_of(&RESNET18, false);
        let array = |(k, (name, (_, shape))): (usize, (&String, &(String, Vec<usize>)))| Array {
            name: name.clone(),
            shape: shape.clone(),
            values: vec![k.to_f32(); shape.iter().product()],
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("resnet18.safetensors");
        weights::write(&path, &known.iter().enumerate().map(array).collect::<Vec<_>>(), "").unwrap();
        let begun = Pretrained::File(path).begin(Network::Unet, &Band::RGB, 3, 1).unwrap();
        for (k, (name, (ours, _))) in known.iter().enumerate() {
            let array = begun.iter().find(|array| array.name == *ours).unwrap();
            assert!(array.values.iter().all(|v| *v == k.to_f32()), "{ours} does not start with the values of {name}");
        }
    }
}
