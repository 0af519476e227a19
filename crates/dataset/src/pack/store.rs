//! Puts images into their packs, and takes packs apart.

use crate::File;
use crate::make::push::Unit;
use crate::pack::adopt::adopt;
use crate::read::archive::{BLOCK, append, entry_name};
use crate::read::checksum_record::{ChecksumRecord, write_files};
use crate::read::native;
use crate::read::packs::Id;
use crate::read::packs::Packing;
use crate::read::packs::record::PackRecord;
use crate::read::set::{Set, Whole};
use crate::read::task::{Task, remaining};
use furrow_base::input::below;
use furrow_base::{Error, Result};
use furrow_output::{is_unfinished, remove_unfinished_in};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::Path;

/// Whether a pack is there and holds what its dataset asks for, down to each byte. One that does not is taken apart: its images that are
/// whole lie in folders of their own then.
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
            "{} was pushed and removed here, and is to hold other images or formats now",
            id.name()
        ))
        .help("bring it back, or make what is to be added as a dataset of its own")
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

/// Puts the images of a pack into it where all are there, also those that were added since it was written.
pub(crate) fn ensure(set: &Set, id: Id) -> Result<()> {
    if let Some(record) = set.packs.get(&set.folder, id)
        && !is_complete(set, id, &record)?
    {
        take_apart(set, id, &record)?;
    }
    close(set, id)
}

/// Archives that are missing or have another length than their records say, each with what is wrong with it: what is seen without reading them.
pub(crate) fn cut_short(set: &Set) -> BTreeMap<Id, String> {
    let all: Vec<Id> = Packing::of(&set.recipe).map(|packing| packing.all().collect()).unwrap_or_default();
    let fault = |id: &Id| {
        let length = std::fs::metadata(set.folder.join(id.path())).map(|about| about.len());
        let fault = set.packs.get(&set.folder, *id)?.tar.fault_of_length(length)?;
        Some((*id, format!("{} {fault}", id.path())))
    };
    all.par_iter().filter_map(fault).collect()
}

/// Whether an image lies in one of these packs and in no folder.
pub(crate) fn lies_in(set: &Set, packs: &BTreeMap<Id, String>, index: u64) -> bool {
    Packing::of(&set.recipe).is_some_and(|packing| packs.contains_key(&packing.id(index)))
        && !ChecksumRecord::path(&set.folder, index).is_file()
}

/// Whether a record tells of all images that a pack is to hold, with all their files.
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

/// Puts the images of a pack into it where all are there, and clears their folders. Does nothing where some are missing.
pub(crate) fn close(set: &Set, id: Id) -> Result<()> {
    match written(set, id) {
        // Another run may have put them there meanwhile, and removed their folders.
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
                // Of a pack that is there already, what a killed run has left.
                return match packs.get(folder, id) {
                    Some(record) if is_complete(set, id, &record)? => clear(folder, &record),
                    _ => Ok(()),
                };
            }
        }
    }
    let mut members = BTreeMap::new();
    let mut whole = Whole::new(folder);
    whole.file(&id.path(), |out| {
        let mut archive = tar::Builder::new(out);
        for image in &images {
            for path in native::in_order(image.files.keys().filter(|path| native::is_native(path))) {
                let file = below(folder, path)?;
                let bytes = furrow_base::input::contents(&file).map_err(Error::io(&file))?;
                members.insert(entry_name(path), (archive.get_ref().written() + BLOCK, bytes.len() as u64));
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

/// Removes the files of images that a pack holds, and their folders. A folder stays in which something else lies: that is the user's.
pub(crate) fn clear(folder: &Path, record: &PackRecord) -> Result<()> {
    for image in &record.images {
        // First what says that it is whole.
        remove(&below(folder, &ChecksumRecord::path_below(image.index))?)?;
        clear_image(folder, image)?;
    }
    Ok(())
}

/// Removes the files of an image from its folder, with what killed runs have left of such, and the folder where nothing else lies in it. Another run
/// may be writing there just now: what that one makes is in the pack already.
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
    // Whoever writes there clears it away when its own pack is closed.
    Ok(())
}

/// How often a folder is cleared that fills again, and how long is waited in between.
const TRIES: u32 = 50;
const PAUSE: std::time::Duration = std::time::Duration::from_millis(20);

/// Whether all that lies in the folder of an image is the user's: nothing of the image, and nothing that is unfinished.
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

/// Takes a pack apart: what is whole of it lies in folders again.
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
        // An image of which a byte was changed is made again.
        if let Some(files) = whole.collect::<Option<Vec<File>>>() {
            write_files(folder, &files)?;
            image.write(folder)?;
        }
    }
    packs.forget(id);
    // First what says that it is whole.
    for path in [id.seal(), id.path()] {
        remove(&below(folder, &path)?)?;
    }
    Ok(())
}
