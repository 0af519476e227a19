//! Plant decoder: an optional second decoder of a U-Net that separates plants one by one.
//!
//! For each plant pixel it gives the vector to the centre of its plant, in [`UNIT`]s, and the natural logarithm of the plant's radius in
//! pixels: three channels. The centre is the mean position of the plant's visible pixels, the radius their root mean square distance
//! from it. Pixels that point to the same place are one plant, so that touching plants are separated and leaves whose stem is hidden stay
//! together.
//!
//! Its parameters are named as those of the class decoder with the prefix `plants.`. They read the features of the encoder and change no
//! class score. The decoder lacks the last level: its map has half of the resolution and is resized to the image.
//!
//! Sources: vectors to centres: Cheng et al. 2020, "Panoptic-DeepLab"; for leaves and plants of crops, Weyler et al. 2022, "In-field
//! phenotyping based on crop leaf and plant instance segmentation". Radii that decide which vectors belong together: Neven et al. 2019,
//! "Instance segmentation by jointly optimizing spatial embeddings and clustering bandwidth".

use super::parameters::list;
use super::{Network, Parameter};
pub use crate::data::plants::UNIT;
use crate::weights::Array;

/// Prefix of the names of the decoder's parameters.
pub const PREFIX: &str = super::PLANTS;
/// Number of channels: two components of the vector, x to the right and y downwards, and the logarithm of the radius.
pub const CHANNELS: usize = super::PLANT_CHANNELS;

/// Returns whether a parameter or layer of this name belongs to the plant decoder.
pub fn is_of_plants(name: &str) -> bool {
    name.starts_with(PREFIX)
}

/// Returns the parameters of the plant decoder; none for networks without a U-Net decoder.
pub fn plants(network: Network, bands: usize, classes: usize) -> Vec<Parameter> {
    list(network, bands, classes, true).into_iter().filter(|p| is_of_plants(&p.name)).collect()
}

/// Returns whether these arrays contain a plant decoder.
pub fn has_plants(arrays: &[Array]) -> bool {
    arrays.iter().any(|array| is_of_plants(&array.name))
}

/// Returns the arrays with those of a plant decoder added; the ones that are missing get their initial values.
pub fn completed(network: Network, bands: usize, classes: usize, mut arrays: Vec<Array>, seed: u64) -> Vec<Array> {
    let first = arrays.len();
    for (k, parameter) in plants(network, bands, classes).into_iter().enumerate() {
        if !arrays.iter().any(|array| array.name == parameter.name) {
            let values = parameter.begin(seed, first + k);
            arrays.push(Array { name: parameter.name, shape: parameter.shape, values });
        }
    }
    arrays
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::net::parameters;

    /// Expected: U-Nets have a plant decoder of three outputs, SegNets none; the parameters of the network itself do not change; a decoder
    /// that is there is kept.
    #[test]
    fn unets_have_a_plant_decoder_beside_their_own() {
        for network in Network::ALL {
            let found = plants(*network, 3, 3);
            let has = !matches!(network, Network::Segnet | Network::BasicSegnet);
            assert_eq!(!found.is_empty(), has, "{}", network.name());
            assert!(
                found.iter().all(|p| !p.is_encoder())
                    && !parameters(*network, 3, 3).iter().any(|p| is_of_plants(&p.name))
            );
            if let Some(last) = found.last() {
                assert_eq!((last.name.as_str(), last.shape.as_slice()), ("plants.head.conv.bias", &[CHANNELS][..]));
            }
        }
        let new = completed(Network::TinyUnet, 3, 3, Vec::new(), 1);
        assert!(has_plants(&new) && !has_plants(&[]));
        assert_eq!(completed(Network::TinyUnet, 3, 3, new.clone(), 2), new);
    }
}
