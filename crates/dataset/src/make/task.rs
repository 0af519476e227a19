//! Remaining work of an image, determined from the files on disk.

use crate::format;
use crate::read::checksum_record::ChecksumRecord;
use crate::read::set::Set;
use furrow_base::Result;

/// Remaining work of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Task {
    /// None.
    Done,
    /// Write the formats, from the native files.
    Formats,
    /// Make the native files and the formats.
    All,
}

/// Determines the remaining work of an image. All its files are compared with their checksums.
pub(crate) fn task(set: &Set, index: u64) -> Result<Task> {
    let Some(checksums) = set.checksums(index) else { return Ok(Task::All) };
    let task = remaining(set, &checksums)?;
    if task == Task::All {
        return Ok(task);
    }
    let formats = format::all(&set.recipe)?;
    let broken = set.faults(&checksums);
    let lost = |(path, _): &(String, String)| {
        path.starts_with("images/") || formats.iter().any(|(name, f)| f.needs_film() && in_format(path, name))
    };
    if broken.iter().any(lost) {
        return Ok(Task::All);
    }
    // Damage to a format that is no longer requested does not matter.
    let wanted = |(path, _): &(String, String)| formats.iter().any(|(name, _)| in_format(path, name));
    Ok(if broken.iter().any(wanted) { Task::Formats } else { task })
}

/// Determines the remaining work of an image from its checksum record alone, without reading the files: the record may
/// belong to another recipe, or lack a format.
pub(crate) fn remaining(set: &Set, checksums: &ChecksumRecord) -> Result<Task> {
    if checksums.recipe != set.recipe.fingerprint()? {
        return Ok(Task::All);
    }
    let other_labels = checksums.labelling != set.recipe.labelling.fingerprint()?;
    let mut task = if other_labels { Task::Formats } else { Task::Done };
    for (name, format) in format::all(&set.recipe)? {
        // Their labels come from what only the renderer has, so they cannot be written again from the image's files.
        if other_labels && (format.needs_masks() || format.needs_boxes()) {
            return Ok(Task::All);
        }
        if format.has_images(&set.recipe) && !checksums.files.keys().any(|path| in_format(path, name)) {
            if format.needs_film() {
                return Ok(Task::All);
            }
            task = Task::Formats;
        }
    }
    Ok(task)
}

/// Returns whether a path is in the folder of a format.
pub(crate) fn in_format(path: &str, format: &str) -> bool {
    path.strip_prefix(format).is_some_and(|rest| rest.starts_with('/'))
}
