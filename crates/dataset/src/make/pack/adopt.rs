//! Unpacks an archive whose record is lost.

use crate::File;
use crate::model::recipe::{MANIFEST, Recipe};
use crate::read::checksum::Checksum;
use crate::read::checksum_record::{ChecksumRecord, write_files};
use crate::read::native;
use crate::read::packs::Id;
use crate::read::set::Set;
use furrow_base::input;
use furrow_base::{Error, Result};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::io::Read;

/// Part of a manifest that identifies an archive.
#[derive(Deserialize)]
struct Listed {
    recipe: Recipe,
    files: BTreeMap<String, Checksum>,
}

/// Unpacks the images of an archive into folders if its record is lost or damaged, and the manifest has its current
/// checksum. Then only the formats of the images need to be made again. Does nothing otherwise.
pub(crate) fn adopt(set: &Set, id: Id) -> Result<()> {
    let path = set.folder.join(id.path());
    if !path.is_file() || !is_known(set, id)? {
        return Ok(());
    }
    let mut archive = tar::Archive::new(input::open(&path).map_err(|refusal| refusal.into_error(&path))?);
    let mut images: BTreeMap<u64, Vec<File>> = BTreeMap::new();
    for entry in archive.entries().map_err(Error::io(&path))? {
        let mut entry = entry.map_err(Error::io(&path))?;
        // Packs contain regular files only. A sparse entry states its own length, which may exceed the memory.
        if !entry.header().entry_type().is_file() {
            continue;
        }
        let name = String::from_utf8_lossy(&entry.path_bytes()).into_owned();
        let Some((index, file)) = name.split_once('.').and_then(|(key, file)| Some((key.parse().ok()?, file))) else {
            continue;
        };
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).map_err(Error::io(&path))?;
        let file = File { path: format!("{}/{file}", native::folder(&Set::name(index))), bytes };
        // The files of an image are consecutive.
        if !images.contains_key(&index) {
            std::mem::take(&mut images).into_iter().try_for_each(|(index, files)| put(set, index, &files))?;
        }
        images.entry(index).or_default().push(file);
    }
    images.into_iter().try_for_each(|(index, files)| put(set, index, &files))
}

/// Writes an image into its folder, unless it is complete there.
fn put(set: &Set, index: u64, files: &[File]) -> Result<()> {
    if ChecksumRecord::read(&set.folder, index).is_some() {
        return Ok(());
    }
    write_files(&set.folder, files)?;
    ChecksumRecord::of(index, &set.recipe, files)?.write(&set.folder)
}

/// Returns whether the manifest lists an archive with its current checksum, and has the same recipe.
fn is_known(set: &Set, id: Id) -> Result<bool> {
    let manifest = input::contents(&set.folder.join(MANIFEST)).ok();
    let Some(listed) = manifest.and_then(|bytes| serde_json::from_slice::<Listed>(&bytes).ok()) else {
        return Ok(false);
    };
    let is_same = listed.recipe.fingerprint()? == set.recipe.fingerprint()?;
    Ok(is_same && listed.files.get(&id.path()).is_some_and(|sum| sum.holds(&set.folder.join(id.path()))))
}
