//! Moves images into packs, and unpacks them.

use crate::File;
use crate::make::pack::adopt::adopt;
use crate::make::push::Unit;
use crate::make::task::{Task, remaining};
use crate::read::archive::{BLOCK, append, entry_name};
use crate::read::checksum_record::{ChecksumRecord, write_files};
use crate::read::native;
use crate::read::packs::Id;
use crate::read::packs::Packing;
use crate::read::packs::record::PackRecord;
use crate::read::set::{Set, SetWriter};
use furrow_base::input::below;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_output::{is_unfinished, remove_unfinished_in};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::Path;

/// Returns whether a pack is complete and all its bytes agree with the checksums. Any other pack is unpacked: its
/// intact images are then in folders of their own.
pub(crate) fn settle(set: &Set, id: Id) -> Result<bool> {
    let Set { folder, packs, .. } = set;
    packs.forget(id);
    let Some(record) = packs.get(folder, id) else {
        adopt(set, id)?;
        return Ok(false);
    };
    if Unit::Pack(id).is_freed(set) {
        if is_complete(set, id, &record)? {
            return Ok(true);
        }
        return Err(Error::misuse(format!(
            "{} was pushed and removed here, but now needs other images or formats",
            id.name()
        ))
        .help("restore it, or make the additional images or formats as a separate dataset")
        .in_file(folder));
    }
    if is_complete(set, id, &record)?
        && record.tar.holds(&folder.join(id.path()))
        && record.images.iter().all(|image| set.faults_beside_packs(image).is_empty())
    {
        clear(folder, &record)?;
        return Ok(true);
    }
    take_apart(set, id, &record)?;
    Ok(false)
}

/// Moves the images of a pack into it if all are complete, including those added since the pack was written.
pub(crate) fn ensure(set: &Set, id: Id) -> Result<()> {
    if let Some(record) = set.packs.get(&set.folder, id)
        && !is_complete(set, id, &record)?
    {
        take_apart(set, id, &record)?;
    }
    close(set, id)
}

/// Returns the archives that are missing or do not have their recorded length, each with a description. The archives
/// are not read.
pub(crate) fn cut_short(set: &Set) -> BTreeMap<Id, String> {
    let all: Vec<Id> = Packing::of(&set.recipe).map(|packing| packing.all().collect()).unwrap_or_default();
    let fault = |id: &Id| {
        let length = std::fs::metadata(set.folder.join(id.path())).map(|about| about.len());
        let fault = set.packs.get(&set.folder, *id)?.tar.fault_of_length(length)?;
        Some((*id, format!("{} {fault}", id.path())))
    };
    all.par_iter().filter_map(fault).collect()
}

/// Returns whether an image is in one of these packs and has no checksum record of its own.
pub(crate) fn lies_in(set: &Set, packs: &BTreeMap<Id, String>, index: u64) -> bool {
    Packing::of(&set.recipe).is_some_and(|packing| packs.contains_key(&packing.id(index)))
        && !ChecksumRecord::path(&set.folder, index).is_file()
}

/// Returns whether a record lists all images of its pack, with all their files.
fn is_complete(set: &Set, id: Id, record: &PackRecord) -> Result<bool> {
    let Some(packing) = Packing::of(&set.recipe) else { return Ok(false) };
    let wanted = packing.images(id);
    if !record.images.iter().map(|image| image.index).eq(wanted) {
        return Ok(false);
    }
    for image in &record.images {
        if remaining(set, image)? != Task::Done {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Moves the images of a pack into it, and deletes their folders, if all images are complete. Does nothing if some are
/// missing.
pub(crate) fn close(set: &Set, id: Id) -> Result<()> {
    match written(set, id) {
        // Another run may have packed them in the meantime, and deleted their folders.
        Err(e) if e.is_not_found() => {
            set.packs.forget(id);
            match set.packs.get(&set.folder, id) {
                Some(record) if is_complete(set, id, &record)? => clear(&set.folder, &record),
                _ => Err(e),
            }
        }
        other => other,
    }
}

fn written(set: &Set, id: Id) -> Result<()> {
    let Set { folder, packs, .. } = set;
    let Some(packing) = Packing::of(&set.recipe) else { return Ok(()) };
    let mut images = Vec::new();
    for index in packing.images(id) {
        match ChecksumRecord::read(folder, index) {
            Some(image) if remaining(set, &image)? == Task::Done => images.push(image),
            _ => {
                // If the pack exists already, a killed run may have left some of its folders.
                return match packs.get(folder, id) {
                    Some(record) if is_complete(set, id, &record)? => clear(folder, &record),
                    _ => Ok(()),
                };
            }
        }
    }
    let mut members = BTreeMap::new();
    let mut whole = SetWriter::new(folder);
    whole.file(&id.path(), |out| {
        let mut archive = tar::Builder::new(out);
        for image in &images {
            for path in native::in_order(image.files.keys().filter(|path| native::is_native(path))) {
                let file = below(folder, path)?;
                let bytes = furrow_base::input::contents(&file).map_err(Error::io(&file))?;
                members.insert(entry_name(path), (archive.get_ref().written() + BLOCK, bytes.len().to_u64()));
                append(&mut archive, path, &bytes).map_err(Error::io(&file))?;
            }
        }
        archive.finish().map_err(Error::io(&folder.join(id.path())))
    })?;
    let tar = whole.files.remove(&id.path()).ok_or_else(|| Error::failed("an archive was not written"))?;
    let record = PackRecord { pack: id.name(), tar, members, images };
    record.write(folder, id)?;
    packs.forget(id);
    clear(folder, &record)
}

/// Deletes the files of images that are in a pack, and their folders. A folder that contains other files stays, since
/// these belong to the user.
pub(crate) fn clear(folder: &Path, record: &PackRecord) -> Result<()> {
    for image in &record.images {
        // The record that marks the image as complete goes first.
        remove(&below(folder, &ChecksumRecord::path_below(image.index))?)?;
        clear_image(folder, image)?;
    }
    Ok(())
}

/// Deletes the files of an image from its folder, including unfinished files of killed runs, and deletes the folder if
/// it is empty then. Another run may be writing to the folder at the same time; its image is in the pack already.
fn clear_image(folder: &Path, image: &ChecksumRecord) -> Result<()> {
    let own = below(folder, &native::folder(&Set::name(image.index)))?;
    for _ in 0..TRIES {
        if !own.is_dir() {
            return Ok(());
        }
        for path in image.files.keys().filter(|path| native::is_native(path)) {
            remove(&below(folder, path)?)?;
        }
        if let Err(e) = remove_unfinished_in(&own)
            && !e.is_not_found()
        {
            return Err(e);
        }
        match std::fs::remove_dir(&own) {
            Err(e) if e.kind() == ErrorKind::DirectoryNotEmpty && !is_users(&own, image) => std::thread::sleep(PAUSE),
            Err(e) if !matches!(e.kind(), ErrorKind::DirectoryNotEmpty | ErrorKind::NotFound) => {
                return Err(Error::io(&own)(e));
            }
            _ => return Ok(()),
        }
    }
    // The run that writes there deletes the folder when it closes the pack.
    Ok(())
}

/// Number of attempts to delete a folder that another run fills again.
const TRIES: u32 = 50;
/// Pause between these attempts.
const PAUSE: std::time::Duration = std::time::Duration::from_millis(20);

/// Returns whether the folder of an image contains only user files: some files, but none of the image and none that is
/// unfinished.
fn is_users(own: &Path, image: &ChecksumRecord) -> bool {
    let entries = std::fs::read_dir(own).into_iter().flatten();
    let names: Vec<OsString> = entries.filter_map(|entry| Some(entry.ok()?.file_name())).collect();
    let files = || image.files.keys().filter(|path| native::is_native(path));
    let is_of_image = |name: &OsString| files().any(|path| Path::new(path).file_name() == Some(name.as_os_str()));
    !names.is_empty() && !names.iter().any(|name| is_unfinished(name) || is_of_image(name))
}

fn remove(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(Error::io(path)(e)),
        _ => Ok(()),
    }
}

/// Unpacks a pack: its intact images are then in folders.
fn take_apart(set: &Set, id: Id, record: &PackRecord) -> Result<()> {
    let Set { folder, packs, .. } = set;
    for image in &record.images {
        if ChecksumRecord::read(folder, image.index).is_some() {
            continue;
        }
        let native = image.files.iter().filter(|(path, _)| native::is_native(path));
        let whole = native.map(|(path, sum)| {
            let bytes = packs.contents(folder, id, path).ok()?;
            sum.is_of(&bytes).then(|| File { path: path.clone(), bytes })
        });
        // An image with a changed byte is left out and so made again.
        if let Some(files) = whole.collect::<Option<Vec<File>>>() {
            write_files(folder, &files)?;
            image.write(folder)?;
        }
    }
    packs.forget(id);
    // The record that marks the pack as complete goes first.
    for path in [id.seal(), id.path()] {
        remove(&below(folder, &path)?)?;
    }
    Ok(())
}
