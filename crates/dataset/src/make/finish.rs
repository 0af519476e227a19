//! Writes the files of the whole dataset once all images are complete: the formats' lists, the manifest, the report.

use crate::format::labels::LeftOut;
use crate::make::pack::store;
use crate::make::push;
use crate::make::task::{Task, remaining};
use crate::model::recipe::{FILE, MANIFEST, Recipe};
use crate::model::warnings::Totals;
use crate::read::checksum::Checksum;
use crate::read::checksum_record::ChecksumRecord;
use crate::read::native::{Files, is_native};
use crate::read::packs::Id;
use crate::read::packs::Packing;
use crate::read::set::{Set, SetWriter, Stream, in_parallel};
use crate::{format, index, report};
use furrow_base::error::Kind;
use furrow_base::{Error, Result};
use furrow_output::{is_unfinished, remove_unfinished};
use furrow_render::scene::tag::Class;
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Writes all files of the whole dataset and returns their paths. If images are missing, returns an error of
/// [`Kind::Damaged`] that lists them, and, if the number of `shards` is given, the
/// shards that contain them.
pub fn finish(set: &Set, shards: Option<u64>) -> Result<Vec<PathBuf>> {
    push::refuse_freed(set)?;
    let cut = store::cut_short(set);
    let mut missing = Vec::new();
    for (index, checksums) in (0..).zip(set.all_checksums()) {
        match checksums {
            Some(checksums) if remaining(set, &checksums)? == Task::Done && !store::lies_in(set, &cut, index) => {}
            _ => missing.push(index),
        }
    }
    if !missing.is_empty() {
        let lacks = lacks(set, &missing, shards);
        let words: Vec<String> = cut.into_values().chain([lacks.to_string()]).collect();
        return Err(if words.len() == 1 { lacks } else { Error::damaged(words.join("\nerror: ")) });
    }
    check_records(set).and_then(|()| written(set)).map_err(|e| with_a_way_out(set, e))
}

/// Returns an error if a record differs from its checksum, because tables and lists would copy the wrong values.
fn check_records(set: &Set) -> Result<()> {
    let fault = |k| set.checksums(k).and_then(|checksums| set.fault_of_record(&checksums));
    match in_parallel(0..set.recipe.count, fault).flatten().next() {
        None => Ok(()),
        Some((path, fault)) => Err(Error::damaged(format!("it {fault}")).in_file(set.place(&path))),
    }
}

/// Adds a help text to an error in a file of an image: how to repair it.
fn with_a_way_out(set: &Set, error: Error) -> Error {
    let within = error.place().and_then(|place| place.file.strip_prefix(&set.folder).ok());
    let is_image = within.is_some_and(|path| path.starts_with("images") || path.starts_with("packs"));
    if !is_image || !matches!(error.kind(), Kind::Damaged | Kind::Input) {
        return error;
    }
    let folder = set.folder.display();
    let again = if set.recipe.is_imported() {
        "the command that imported this folder imports damaged images again".to_owned()
    } else {
        format!("`trace dataset render {folder}` renders damaged images again")
    };
    error.help(format!("{again}; `trace dataset verify {folder}` lists all damage"))
}

fn written(set: &Set) -> Result<Vec<PathBuf>> {
    let Set { folder, recipe, .. } = set;
    remove_unfinished(folder)?;
    let packs: Vec<Id> = Packing::of(recipe).map(|packing| packing.all().collect()).unwrap_or_default();
    packs.par_iter().try_for_each(|id| store::ensure(set, *id))?;
    if !packs.is_empty() {
        // Fails if the folder is not empty, which is intended.
        let _ = std::fs::remove_dir(folder.join("images"));
    }
    let mut whole = SetWriter::new(folder);
    for (_, format) in format::all(recipe)? {
        format.write_set(set, &mut whole)?;
    }
    index::write(set, &mut whole)?;
    report::write(set, &mut whole)?;
    let mut files = own_files(folder, recipe)?;
    files.append(&mut whole.files.clone());
    let mut paths: Vec<PathBuf> = whole.files.keys().map(|p| folder.join(p)).collect();
    let mut last = SetWriter::new(folder);
    last.file(MANIFEST, |out| manifest(set, &files, out))?;
    paths.push(folder.join(MANIFEST));
    Ok(paths)
}

/// Returns the error for missing images: lists the images, and, if the number of shards is given, the shards for a
/// scheduler.
pub fn lacks(set: &Set, missing: &[u64], shards: Option<u64>) -> Error {
    let again = match shards {
        _ if set.recipe.is_imported() => {
            "run the command that imported this folder again; it imports the missing images".to_owned()
        }
        None => "run `trace dataset render` again; it renders the missing images".to_owned(),
        Some(of) => {
            let lacking: BTreeSet<u64> = missing.iter().map(|k| set.recipe.unit_of(*k) % of).collect();
            let lacking: Vec<u64> = lacking.into_iter().collect();
            format!("run the shards that contain them again: --array={}", ranges(&lacking))
        }
    };
    let words = format!("{} of {} images are missing: {}", missing.len(), set.recipe.count, ranges(missing));
    Error::damaged(words).help(again).in_file(&set.folder)
}

/// Formats ascending numbers as `1-3,7`, the syntax of Slurm's `--array`.
pub fn ranges(numbers: &[u64]) -> String {
    let mut parts: Vec<(u64, u64)> = Vec::new();
    for n in numbers {
        match parts.last_mut() {
            Some((_, last)) if *last + 1 == *n => *last = *n,
            _ => parts.push((*n, *n)),
        }
    }
    let text = |(a, b): &(u64, u64)| if a == b { a.to_string() } else { format!("{a}-{b}") };
    parts.iter().map(text).collect::<Vec<_>>().join(",")
}

/// Returns what the import of this dataset left out, turned or could not trust: one line for each kind of warning, and
/// one if no pixel is crop or weed. Empty for a rendered dataset.
pub fn dropped(set: &Set) -> Result<Vec<String>> {
    let mut totals = Totals::default();
    if !set.recipe.is_imported() {
        return Ok(totals.lines());
    }
    let (mut plants, mut ignored) = (0_u64, 0_u64);
    for record in set.all() {
        let record = record?;
        totals.add(&record.warnings);
        let shares = record.classes.iter().filter(|share| share.class != Class::Soil);
        plants += shares.map(|share| share.pixels).sum::<u64>();
        ignored += record.ignored;
    }
    let mut lines = totals.lines();
    if plants == 0 {
        lines.push(format!(
            "no pixel of any image is crop or weed, and {ignored} have no label; if the labels mean something else, give \
             their meanings with --classes or --colors"
        ));
    }
    Ok(lines)
}

/// Returns the checksums of the recipe and of the scene's files, which belong to no image.
fn own_files(folder: &Path, recipe: &Recipe) -> Result<BTreeMap<String, Checksum>> {
    let mut todo = vec![folder.join(FILE)];
    if recipe.rendering().is_ok() {
        todo.push(folder.join("scene"));
    }
    let mut files = BTreeMap::new();
    while let Some(path) = todo.pop() {
        if path.is_dir() {
            let entries = std::fs::read_dir(&path).map_err(Error::io(&path))?;
            // Skips temporary files of another process that is writing the same files.
            let whole = entries.filter_map(std::io::Result::ok).filter(|entry| !is_unfinished(&entry.file_name()));
            todo.extend(whole.map(|entry| entry.path()));
        } else {
            let bytes = furrow_base::input::contents(&path).map_err(Error::io(&path))?;
            let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().replace('\\', "/");
            files.insert(name, Checksum::of(&bytes));
        }
    }
    Ok(files)
}

/// Writes the manifest image by image, since it may be larger than memory.
fn manifest(set: &Set, files: &BTreeMap<String, Checksum>, out: &mut Stream<'_>) -> Result<()> {
    let Set { folder, recipe, .. } = set;
    let mut content = Sha256::new();
    out.put("{\n\"recipe\": ")?;
    out.json(recipe)?;
    if let Ok(rendering) = recipe.rendering() {
        let scene = rendering.scene_in(folder)?;
        out.put(",\n\"scene_text\": ")?;
        out.json(&std::fs::read_to_string(&scene).map_err(Error::io(&scene))?)?;
        out.put(",\n\"times\": \"ledger/*.jsonl\"")?;
    }
    if let Some(left_out) = LeftOut::of(set)? {
        out.put(",\n\"left_out\": ")?;
        out.json(&left_out)?;
    }
    let dropped = dropped(set)?;
    if !dropped.is_empty() {
        out.put(",\n\"warnings\": ")?;
        out.json(&dropped)?;
    }
    out.put(",\n\"files\": {")?;
    let mut first = true;
    let mut add = |out: &mut Stream<'_>, path: &str, sum: &Checksum| -> Result<()> {
        content.update(format!("{} {path}\n", sum.sha256));
        out.put(if std::mem::take(&mut first) { "\n" } else { ",\n" })?;
        out.json(&path)?;
        out.put(": ")?;
        out.json(sum)
    };
    for (path, sum) in files {
        add(out, path, sum)?;
    }
    for (path, sum) in archives(set) {
        add(out, &path, &sum)?;
    }
    let mut seals = Vec::new();
    for (index, checksums) in (0..).zip(set.all_checksums()) {
        let Some(checksums) = checksums else { continue };
        for (path, sum) in of_image(recipe, &checksums) {
            add(out, path, sum)?;
        }
        seals.push((index, checksums.hash()?));
    }
    out.put("\n},\n\"images\": [")?;
    let image = |(index, hash): (u64, String)| {
        let name = Set::name(index);
        Ok(serde_json::json!({ "index": index, "name": name, "split": recipe.split_of(index), "seal": hash }))
    };
    out.items(seals.into_iter().map(image))?;
    out.put("],\n\"content_sha256\": ")?;
    out.json(&hex::encode(content.finalize()))?;
    out.put("\n}\n")
}

/// Returns the path and checksum of each archive of images.
pub(crate) fn archives(set: &Set) -> impl Iterator<Item = (String, Checksum)> + '_ {
    let all = Packing::of(&set.recipe).map(Packing::all).into_iter().flatten();
    all.filter_map(|id| Some((id.path(), set.packs.get(&set.folder, id)?.tar.clone())))
}

/// Returns the files of an image that are stored in the dataset's folder, not in an archive.
pub(crate) fn of_image<'a>(
    recipe: &Recipe,
    image: &'a ChecksumRecord,
) -> impl Iterator<Item = (&'a String, &'a Checksum)> + use<'a> {
    let packed = recipe.pack.is_some();
    image.files.iter().filter(move |(path, _)| !(packed && is_native(path)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_what_a_scheduler_reads() {
        assert_eq!(ranges(&[]), "");
        assert_eq!(ranges(&[4]), "4");
        assert_eq!(ranges(&[0, 1, 2, 5, 7, 8]), "0-2,5,7-8");
    }
}
