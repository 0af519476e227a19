//! FiLM: a network that takes the crop as an input.
//!
//! Each species has a learnt embedding, a vector of [`WIDTH`] numbers. A linear map of it gives, for each channel of a batch norm, a
//! relative change γ of the gain and a change β of the output: y becomes (1 + γ) y + β. The batch norms are those of the decoder and
//! the last of the encoder. Several named crops have the mean of their embeddings. Without a named crop γ and β are zero, so the
//! network without these parameters is the answer for crops of any kind, and commands that know nothing of species use that.
//!
//! The maps start at zero: a training starts from the network without the input. For one choice of crops, γ and β can be folded into
//! the batch norms ([`folded`]), which gives an ordinary network.
//!
//! Source: Perez et al. 2018, "FiLM: visual reasoning with a general conditioning layer"; conditional batch norm is of de Vries et al.
//! 2017.

use super::plants::is_of_plants;
use super::{Network, Parameter, Role, parameters};
use crate::weights::Array;
use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};

/// Name of the array of embeddings: species × [`WIDTH`].
pub const EMBEDDING: &str = "film.embedding";
/// Size of an embedding.
pub const WIDTH: usize = 16;

/// Returns the name of the map that modulates the batch norm `norm`: twice its channels × [`WIDTH`]; the first half gives γ.
pub fn map(norm: &str) -> String {
    format!("film.{norm}.weight")
}

/// Returns the additional parameters of a network for `species` species; none for 0.
pub fn film(network: Network, bands: usize, classes: usize, species: usize) -> Vec<Parameter> {
    if species == 0 {
        return Vec::new();
    }
    let embedding = Parameter { name: EMBEDDING.into(), shape: vec![species, WIDTH], role: Role::Weight };
    let maps = modulated(&parameters(network, bands, classes)).into_iter();
    let maps =
        maps.map(|(norm, channels)| Parameter { name: map(&norm), shape: vec![2 * channels, WIDTH], role: Role::Bias });
    std::iter::once(embedding).chain(maps).collect()
}

/// Returns name and channels of the batch norms that the crop modulates: the last of the encoder, and all after it.
fn modulated(list: &[Parameter]) -> Vec<(String, usize)> {
    let norms: Vec<&Parameter> = list.iter().filter(|p| p.role == Role::Mean).collect();
    let last = norms.iter().rposition(|p| p.is_encoder());
    let name = |p: &Parameter| p.name.strip_suffix(".running_mean").map(|norm| (norm.to_owned(), p.len()));
    let chosen = norms.iter().enumerate().filter(|(k, p)| !p.is_encoder() || Some(*k) == last);
    chosen.filter_map(|(_, p)| name(p)).collect()
}

/// Returns the number of species among a network's arrays: 0 if it does not take the crop as an input.
pub fn species(arrays: &[Array]) -> usize {
    arrays.iter().find(|array| array.name == EMBEDDING).and_then(|array| array.shape.first().copied()).unwrap_or(0)
}

/// Returns the arrays of an ordinary network that answers as this one does if these species, indices of its embeddings, are the
/// crops.
///
/// # Errors
/// If an array is missing or has another shape.
pub fn folded(network: Network, bands: usize, classes: usize, arrays: &[Array], crops: &[usize]) -> Result<Vec<Array>> {
    let wrong =
        |name: &str| Error::input(format!("these weights do not take the crop as an input: `{name}` is missing"));
    let get = |name: &str| arrays.iter().find(|array| array.name == name).ok_or_else(|| wrong(name));
    for parameter in film(network, bands, classes, species(arrays).max(1)) {
        if get(&parameter.name)?.shape != parameter.shape {
            return Err(wrong(&parameter.name));
        }
    }
    let embeddings = &get(EMBEDDING)?.values;
    let row = |crop: &usize| embeddings.chunks_exact(WIDTH).nth(*crop);
    let rows: Vec<&[f32]> = crops.iter().filter_map(row).collect();
    let mean = |k: usize| rows.iter().map(|row| row[k]).sum::<f32>() / rows.len().max(1).to_f32();
    let embedding: Vec<f32> = (0..WIDTH).map(mean).collect();
    let list = parameters(network, bands, classes);
    let own = |parameter: &Parameter| get(&parameter.name).cloned();
    let mut plain: Vec<Array> = list.iter().map(own).collect::<Result<_>>()?;
    plain.extend(arrays.iter().filter(|array| is_of_plants(&array.name)).cloned());
    for (norm, channels) in modulated(&list) {
        let map = &get(&map(&norm))?.values;
        let change = |row: &[f32]| row.iter().zip(&embedding).map(|(a, b)| a * b).sum::<f32>();
        let changes: Vec<f32> = map.chunks_exact(WIDTH).map(change).collect();
        let (gammas, betas) = changes.split_at(channels);
        for array in &mut plain {
            let Some(part) = array.name.strip_prefix(&*norm) else { continue };
            let is_shift = part == ".bias";
            if !is_shift && part != ".weight" {
                continue;
            }
            for ((value, gamma), beta) in array.values.iter_mut().zip(gammas).zip(betas) {
                *value = *value * (1.0 + gamma) + if is_shift { *beta } else { 0.0 };
            }
        }
    }
    Ok(plain)
}

/// Returns the arrays with those of a network for `species` species added: embeddings and maps that are missing get their initial
/// values. Embeddings that are there keep their places.
pub fn completed(
    network: Network,
    bands: usize,
    classes: usize,
    mut arrays: Vec<Array>,
    species: usize,
    seed: u64,
) -> Vec<Array> {
    let first = parameters(network, bands, classes).len();
    for (k, parameter) in film(network, bands, classes, species).into_iter().enumerate() {
        let mut values = parameter.begin(seed, first + k);
        if let Some(place) = arrays.iter().position(|array| array.name == parameter.name) {
            let before = arrays.swap_remove(place).values;
            values.iter_mut().zip(before).for_each(|(value, before)| *value = before);
        }
        arrays.push(Array { name: parameter.name, shape: parameter.shape, values });
    }
    arrays
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: every network has maps for batch norms of its decoder; those of `lite-unet` are the ten of its decoder and the last
    /// of its encoder, with 320 channels. Source: the table of channels in `lite_unet`.
    #[test]
    fn decoder_and_bottleneck_are_modulated() {
        for network in Network::ALL {
            let maps = film(*network, 3, 3, 5);
            assert_eq!(maps[0].shape, [5, WIDTH]);
            assert!(
                maps.len() > 3 && maps.iter().all(|p| !p.is_encoder() && p.role.is_trainable()),
                "{}",
                network.name()
            );
        }
        let lite = modulated(&parameters(Network::LiteUnet, 3, 3));
        assert_eq!((lite.len(), lite[0].1, lite[10].1), (11, 320, 16));
        assert!(film(Network::LiteUnet, 3, 3, 0).is_empty());
    }

    /// Expected: initial maps change nothing; more species keep the embeddings that are there.
    #[test]
    fn a_new_input_changes_nothing_and_species_can_be_added() {
        let network = Network::TinyUnet;
        let array =
            |(k, p): (usize, &Parameter)| Array { name: p.name.clone(), shape: p.shape.clone(), values: p.begin(1, k) };
        let plain: Vec<Array> = parameters(network, 3, 3).iter().enumerate().map(array).collect();
        let two = completed(network, 3, 3, plain.clone(), 2, 7);
        assert_eq!((species(&plain), species(&two)), (0, 2));
        assert_eq!(folded(network, 3, 3, &two, &[1]).unwrap(), plain);
        assert!(folded(network, 3, 3, &plain, &[0]).is_err());
        let three = completed(network, 3, 3, two.clone(), 3, 8);
        let embedding = |all: &[Array]| all.iter().find(|a| a.name == EMBEDDING).unwrap().values.clone();
        assert_eq!(embedding(&three)[..2 * WIDTH], embedding(&two));
        assert_eq!(embedding(&three).len(), 3 * WIDTH);
    }
}
