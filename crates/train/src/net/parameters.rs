//! Parameters of a network: names, shapes and initial values.

use super::{Conv, Network, Norm, Operations};
use crate::weights::Array;
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::sampling::{Purpose, Stream};
use furrow_base::{Error, Result};

/// Role of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Weights of a convolution.
    Weight,
    /// Bias of a convolution; class token; position embeddings.
    Bias,
    /// Factors of a norm or a LayerScale.
    Gain,
    /// Bias of a norm.
    Shift,
    /// Running mean of a batch norm; not trained by gradients.
    Mean,
    /// Running variance of a batch norm; not trained by gradients.
    Variance,
}

impl Role {
    /// Returns whether it is trained by gradients.
    pub fn is_trainable(self) -> bool {
        !matches!(self, Self::Mean | Self::Variance)
    }
}

/// Parameter of a network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Name, such as `enc0_0.conv.weight`.
    pub name: String,
    /// Size along each axis: outputs × inputs of a group × kernel × kernel, or channels.
    pub shape: Vec<usize>,
    /// Role.
    pub role: Role,
}

impl Parameter {
    /// Returns the number of its values.
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Returns whether it belongs to the encoder, the part of a network that can be initialised with published weights.
    pub fn is_encoder(&self) -> bool {
        is_encoder(&self.name)
    }

    /// Returns whether it has no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns its initial values: weights are normal with variance 2 / (inputs · kernel²), gains and variances are one, the rest is
    /// zero. Each parameter has its own random stream. Source: He et al. 2015, "Delving deep into rectifiers", eq. 10.
    pub fn begin(&self, seed: u64, place: usize) -> Vec<f32> {
        match self.role {
            Role::Weight => {
                let mut stream = Stream::of(seed, place.to_u64(), Purpose::Training, 3);
                let fan_in: usize = self.shape.iter().skip(1).product();
                let sd = (2.0 / fan_in.max(1).to_f64()).sqrt();
                (0..self.len()).map(|_| (sd * stream.normal()).to_f32()).collect()
            }
            Role::Gain | Role::Variance => vec![1.0; self.len()],
            Role::Bias | Role::Shift | Role::Mean => vec![0.0; self.len()],
        }
    }
}

/// Returns whether a parameter or layer of this name belongs to the encoder.
pub fn is_encoder(name: &str) -> bool {
    name.starts_with("stem.") || name.starts_with("enc")
}

/// Returns the parameters of a network, in the order of the forward pass.
pub fn parameters(network: Network, bands: usize, classes: usize) -> Vec<Parameter> {
    list(network, bands, classes, false)
}

/// Like [`parameters()`], with those of the plant decoder if `plants` is set.
pub(super) fn list(network: Network, bands: usize, classes: usize, plants: bool) -> Vec<Parameter> {
    let mut list = List { all: Vec::new(), plants };
    network.walk(&mut list, &(), bands, classes);
    list.all
}

/// Finds the values of a network's parameters in `arrays` by name and returns them in the order of [`parameters()`]. Other arrays are
/// ignored. An error names the array that is missing or has another shape.
pub fn fitting(network: Network, bands: usize, classes: usize, arrays: &[Array]) -> Result<Vec<&Array>> {
    let found = matching(&parameters(network, bands, classes), arrays);
    found.map_err(|what| {
        let network = network.name();
        Error::input(format!(
            "these weights are not those of {network} with {bands} bands and {classes} classes: {what}"
        ))
    })
}

/// Finds the values of these parameters in `arrays` by name, or describes the first that is missing or has another shape.
pub fn matching<'a>(list: &[Parameter], arrays: &'a [Array]) -> Result<Vec<&'a Array>, String> {
    let fit = |parameter: &Parameter| {
        let array = arrays.iter().find(|a| a.name == parameter.name);
        let array = array.ok_or_else(|| format!("`{}` is missing", parameter.name))?;
        if array.shape != parameter.shape {
            return Err(format!("`{}` is {:?}, not {:?}", array.name, array.shape, parameter.shape));
        }
        Ok(array)
    };
    list.iter().map(fit).collect()
}

/// Splits the name of an encoder parameter into the unit and the part in it, such as `enc0_1.depthwise` and `bn.bias`.
pub(super) fn parts(name: &str) -> Option<(&str, &str)> {
    [".conv.", ".bn."].iter().find_map(|part| name.find(part).map(|at| (&name[..at], &name[at + 1..])))
}

struct List {
    all: Vec<Parameter>,
    /// Whether the plant decoder is listed as well.
    plants: bool,
}

impl List {
    fn note(&mut self, name: String, shape: &[usize], role: Role) {
        self.all.push(Parameter { name, shape: shape.to_vec(), role });
    }
}

impl Operations for List {
    type Value = ();
    type PoolIndices = ();

    fn conv(&mut self, (): &(), name: &str, conv: Conv) {
        self.note(
            format!("{name}.weight"),
            &[conv.outputs, conv.inputs / conv.groups, conv.kernel, conv.kernel],
            Role::Weight,
        );
        if conv.bias {
            self.note(format!("{name}.bias"), &[conv.outputs], Role::Bias);
        }
    }

    fn norm(&mut self, (): &(), name: &str, norm: Norm) {
        let roles = [
            ("weight", Role::Gain),
            ("bias", Role::Shift),
            ("running_mean", Role::Mean),
            ("running_var", Role::Variance),
        ];
        for (what, role) in roles {
            self.note(format!("{name}.{what}"), &[norm.channels], role);
        }
    }

    fn relu(&mut self, (): &()) {}
    fn relu6(&mut self, (): &()) {}
    fn add(&mut self, (): &(), (): &()) {}
    fn concat(&mut self, (): &(), (): &()) {}
    fn pool(&mut self, (): &()) -> ((), ()) {
        ((), ())
    }
    fn unpool(&mut self, (): &(), (): ()) {}
    fn pool3(&mut self, (): &()) {}
    fn enlarge(&mut self, (): &(), (): &()) {}
    fn to_multiple(&mut self, (): &(), _pixels: usize) {}

    fn tokens(&mut self, (): &(), name: &str, channels: usize, grid: usize) {
        self.note(format!("{name}.class"), &[1, channels, 1, 1], Role::Bias);
        self.note(format!("{name}.position"), &[1, channels, grid, grid], Role::Bias);
    }

    fn map(&mut self, (): &(), (): &()) {}

    fn layer_norm(&mut self, (): &(), name: &str, norm: Norm) {
        self.note(format!("{name}.weight"), &[norm.channels], Role::Gain);
        self.note(format!("{name}.bias"), &[norm.channels], Role::Shift);
    }

    fn gelu(&mut self, (): &()) {}
    fn attention(&mut self, (): &(), _channels: usize, _heads: usize) {}

    fn scale(&mut self, (): &(), name: &str, channels: usize) {
        self.note(format!("{name}.gamma"), &[channels], Role::Gain);
    }

    fn wants_plants(&self) -> bool {
        self.plants
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trainable(network: Network) -> usize {
        parameters(network, 3, 3).iter().filter(|p| p.role.is_trainable()).map(Parameter::len).sum()
    }

    #[test]
    fn networks_have_the_published_convolutions() {
        let convolutions = |network, kernel| {
            parameters(network, 3, 3).iter().filter(|p| p.role == Role::Weight && p.shape[2] == kernel).count()
        };
        assert_eq!(convolutions(Network::Segnet, 3), 26);
        assert_eq!(convolutions(Network::BasicSegnet, 7), 8);
        // VGG16's thirteen convolutions have 14 714 688 parameters.
        let vgg: usize = parameters(Network::Segnet, 3, 3)
            .iter()
            .filter(|p| p.name.starts_with("enc") && p.name.contains("conv"))
            .map(Parameter::len)
            .sum();
        assert_eq!(vgg, 14_714_688);
        // 3·64·49 + 64, seven times 64·64·49 + 64, eight batch norms, and the head.
        assert_eq!(trainable(Network::BasicSegnet), 9472 + 7 * 200_768 + 8 * 128 + 195);
        // ResNet-18 without its classifier has 11 176 512.
        let resnet: usize = parameters(Network::Unet, 3, 3)
            .iter()
            .filter(|p| p.role.is_trainable() && (p.name.starts_with("enc") || p.name.starts_with("stem")))
            .map(Parameter::len)
            .sum();
        assert_eq!(resnet, 11_176_512);
        // EfficientNet-Lite0 has 4 652 008, 1 281 000 of them in its classifier and 412 160 in the convolution before that.
        let lite: usize = parameters(Network::LiteUnet, 3, 3)
            .iter()
            .filter(|p| p.role.is_trainable() && p.is_encoder())
            .map(Parameter::len)
            .sum();
        assert_eq!(lite, 4_652_008 - 1_281_000 - 412_160);
        // DINOv2's ViT-S/14 has 22 056 576, including 384 of a mask token, which is not used here, and 384 of the class token's position,
        // which is added to that token. Its last norm is used twice here.
        let vit: usize = parameters(Network::VitUnet, 3, 3).iter().filter(|p| p.is_encoder()).map(Parameter::len).sum();
        assert_eq!(vit, 22_056_576 - 384 - 384 + 768);
    }

    #[test]
    fn names_are_unique_and_first_values_have_their_deviation() {
        for network in Network::ALL {
            let all = parameters(*network, 4, 5);
            let mut names: Vec<&str> = all.iter().map(|p| p.name.as_str()).collect();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), all.len());
            assert_eq!(Network::named(network.name()).unwrap(), *network);
        }
        let weight = &parameters(Network::Segnet, 3, 3)[6];
        let values = weight.begin(1, 6);
        let variance = values.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / values.len().to_f64();
        assert!((variance * 576.0 / 2.0 - 1.0).abs() < 0.05, "{} {variance}", weight.name);
    }
}
