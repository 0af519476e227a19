//! The crop that a user names for a trained network: a network that takes the crop as an input becomes the ordinary network for it, and
//! one that was trained for other crops is refused.

use super::species::Species;
use crate::ensemble::Ensemble;
use crate::run::{ModelCard, TrainedModel};
use furrow_base::{Error, Result};

/// Name of crops of any kind.
const AUTO: &str = "auto";

/// Returns the network with the crops that a user names, and warnings. Without names, or with `auto`, it has crops of any kind.
///
/// # Errors
/// If the network was trained for other crops, or if a name is unknown.
pub fn with_crops(trained: Ensemble, names: &[String]) -> Result<(Ensemble, Vec<String>)> {
    check_auto(names)?;
    if trained.card.species.is_empty() {
        let names = names.iter().filter(|name| *name != AUTO);
        let warnings = names.filter_map(|name| check_crop(&trained.card, name).transpose()).collect::<Result<_>>()?;
        return Ok((trained, warnings));
    }
    Ok(match known(&trained.card, names)?.as_slice() {
        [] => (trained, Vec::new()),
        crops => (trained.of_crops(crops)?, Vec::new()),
    })
}

/// Returns the ordinary network for the crops that a user names, for an export. Without names, or with `auto`, the network stays.
///
/// # Errors
/// Like [`with_crops`], and if the network does not take the crop as an input.
pub fn exported(trained: TrainedModel, names: &[String]) -> Result<TrainedModel> {
    check_auto(names)?;
    if trained.card.species.is_empty() {
        for name in names.iter().filter(|name| *name != AUTO) {
            if check_crop(&trained.card, name)?.is_some() {
                return Err(Error::misuse(format!("--crop {name}: this network does not take the crop as an input"))
                    .help(format!("`train make --crop {name} --out DIR` trains a network for it; `train fit --name-crops 0.75` trains one that takes the crop as an input")));
            }
        }
        return Ok(trained);
    }
    match known(&trained.card, names)?.as_slice() {
        [] => Ok(trained),
        crops => trained.of_crops(crops),
    }
}

/// Returns an error if `auto` is given beside other names, which it contradicts.
fn check_auto(names: &[String]) -> Result<()> {
    if names.iter().any(|name| name == AUTO) && names.iter().any(|name| name != AUTO) {
        return Err(Error::misuse("--crop auto means crops of any kind and cannot be combined with names")
            .help("name the crops, or give --crop auto alone"));
    }
    Ok(())
}

/// Returns the places of the named species in the list of a network that takes the crop as an input, without `auto`.
fn known(card: &ModelCard, names: &[String]) -> Result<Vec<usize>> {
    let place = |name: &str| card.species.iter().position(|own| own.eq_ignore_ascii_case(name));
    let place_of = |species: &Species| {
        place(&species.desc.name).ok_or_else(|| {
            Error::misuse(format!("this network does not know {}", species.desc.name)).help(format!(
                "it knows {}; `train make --crop {} --out DIR` trains a network for that crop",
                card.species.join(", "),
                species.written
            ))
        })
    };
    let mut places = Vec::new();
    for name in names.iter().filter(|name| *name != AUTO) {
        let found = place(name).map_or_else(|| place_of(&Species::find(name)?), Ok)?;
        if !places.contains(&found) {
            places.push(found);
        }
    }
    Ok(places)
}

/// Checks that a network was trained for the crop that a user names. Returns a warning if it was trained for crops of any kind.
///
/// # Errors
/// If it was trained for other crops, or if the name is unknown.
fn check_crop(card: &ModelCard, name: &str) -> Result<Option<String>> {
    let is = |own: &str| card.crops.iter().any(|crop| crop.eq_ignore_ascii_case(own));
    if is(name) {
        return Ok(None);
    }
    let found = Species::find(name)?;
    if card.crops.is_empty() {
        let name = found.desc.name;
        return Ok(Some(format!(
            "this network does not know which crop is sown: --crop {name} has no effect, and it separates crop from weed as for any field; `train make --crop {name}` trains one that knows"
        )));
    }
    if is(&found.desc.name) {
        return Ok(None);
    }
    Err(Error::misuse(format!(
        "this network was trained for {}, not for {}",
        card.crops.join(" and "),
        found.desc.name
    ))
    .help(format!("`train make --crop {} --out DIR` trains one for it", found.written)))
}
