//! Species that a user names as crops or weeds: by any name of a species that ships, or by the path of a species file.

use furrow_base::ron_file::nearest;
use furrow_base::{Error, Result};
use furrow_field::desc::{Role, SpeciesDesc};
use furrow_field::shipped::{all_species, is_ambiguous, species};
use std::path::{Path, PathBuf};

/// Number of similar names that the error about an unknown name lists.
const NEAR: usize = 3;

/// A species, and how a scene file names it.
#[derive(Clone, Debug, PartialEq)]
pub struct Species {
    /// Species file.
    pub file: PathBuf,
    /// Value of `species` in a scene file: the name of a species that ships, or the absolute path of a file.
    pub written: String,
    /// Description.
    pub desc: SpeciesDesc,
}

impl Species {
    /// Finds the crop that a user names.
    ///
    /// # Errors
    /// If no species has this name, or if it is a weed.
    pub fn crop(name: &str) -> Result<Self> {
        let found = Self::find(name)?;
        if found.desc.role == Role::Weed {
            return Err(Error::misuse(format!("`{name}` is a weed: {} ({})", found.desc.name, found.desc.eppo))
                .help(format!("{}; a species file of a crop has `role: Crop`", crops()?)));
        }
        Ok(found)
    }

    /// Finds the species that a user names: by file name, EPPO code, English or scientific name if it ships, or by the path of a
    /// species file that ends in `.ron`.
    pub fn find(name: &str) -> Result<Self> {
        if Path::new(name).extension().is_some_and(|e| e == "ron") && Path::new(name).is_file() {
            let file = std::path::absolute(name).map_err(Error::reading(Path::new(name)))?;
            let written = file.to_string_lossy().into_owned();
            return Ok(Self { desc: SpeciesDesc::read(&file)?, file, written });
        }
        match species(name) {
            Ok(Some(file)) => {
                let written = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                Ok(Self { desc: SpeciesDesc::read(&file)?, file, written })
            }
            // The error about a name of several species lists them.
            Err(error) if is_ambiguous(name)? => Err(error),
            Ok(None) | Err(_) => Err(unknown(name)?),
        }
    }

    /// Returns the genus: the first word of the scientific name. Empty if the file gives none.
    pub(super) fn genus(&self) -> &str {
        self.desc.scientific.split_whitespace().next().unwrap_or_default()
    }
}

/// Lists the crops that ship, by English name and EPPO code.
fn crops() -> Result<String> {
    let (all, _) = all_species()?;
    let crops = all.iter().filter(|species| species.desc.role == Role::Crop);
    let names: Vec<String> = crops.map(|species| format!("{} ({})", species.desc.name, species.desc.eppo)).collect();
    Ok(format!("crops that ship are {}", names.join(", ")))
}

/// Returns the error about a name that no species has: similar names, the crops that ship, and what to do for others.
fn unknown(name: &str) -> Result<Error> {
    let (all, _) = all_species()?;
    let mut names: Vec<(usize, String)> = Vec::new();
    for (k, species) in all.iter().enumerate() {
        let SpeciesDesc { name, scientific, eppo, .. } = &species.desc;
        let own = [species.stem(), name.clone(), eppo.clone(), scientific.clone()].into_iter();
        names.extend(own.chain(name.split(' ').map(str::to_owned)).filter(|n| !n.is_empty()).map(|n| (k, n)));
    }
    let mut near: Vec<String> = Vec::new();
    while near.len() < NEAR {
        let known: Vec<&String> = names.iter().map(|(_, name)| name).collect();
        let Some(found) = nearest(&known, name).map(str::to_owned) else { break };
        let Some(species) = names.iter().find(|(_, name)| *name == found).map(|(k, _)| *k) else { break };
        near.push(format!("`{}` ({})", all[species].desc.name, all[species].desc.eppo));
        names.retain(|(k, _)| *k != species);
    }
    let near = if near.is_empty() { String::new() } else { format!("did you mean {}? ", near.join(" or ")) };
    let help = format!(
        "{near}{}; for another plant give a species file, FILE.ron (docs/guide/species.md), or place GLB models in a scene file of your own (docs/guide/models.md)",
        crops()?
    );
    Ok(Error::misuse(format!("no species is called `{name}`")).help(help))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: every kind of name finds the crop; a misspelt one is answered by similar names, the crops and the ways to others.
    #[test]
    fn crops_are_found_by_every_name_and_unknown_ones_are_answered() {
        for name in ["maize", "ZEAMX", "zeamx", "Zea mays", "maize.ron"] {
            assert_eq!(Species::crop(name).unwrap().desc.eppo, "ZEAMX", "{name}");
        }
        let told = |name: &str| Species::crop(name).unwrap_err().to_string();
        for (name, near) in
            [("maise", "`maize` (ZEAMX)"), ("BEAVY", "`sugar beet` (BEAVX)"), ("brasica napus", "(BRSNW)")]
        {
            let told = told(name);
            for words in ["no species is called", near, "soybean (GLXMA)", "species file", "GLB"] {
                assert!(told.contains(words), "{name}: {words}: {told}");
            }
        }
        assert!(told("cirsium").contains("`cirsium` is a weed: creeping thistle"), "{}", told("cirsium"));
        assert!(told("grass").contains("several species"), "{}", told("grass"));
    }
}
