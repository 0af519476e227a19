//! Makes the images of a shard on a node's local disk (`--scratch`) and copies them to the dataset's folder, called
//! home, as they are finished. The shared folder thus receives complete images and archives, and no temporary files.
//!
//! A run works in a local copy of the dataset that contains only the recipe and the scene. Images that are complete at
//! home are not made again. Each finished unit, an image or a pack, is copied home, pushed from there if requested, and
//! removed locally. Images of a pack that is incomplete at the end of the run are copied home as folders, and the next
//! run on any node continues with them. The timing log is written at home. Home therefore has the same contents as
//! after a run without `--scratch`.
//!
//! If several runs of one shard use the same local folder, one works at a time; the others wait for its lock and then
//! make the remaining images.

use crate::File;
use crate::make::begin::write_changed;
use crate::make::generate::{Callbacks, Delivery, OpenPacks, Shard, Work, generate_for};
use crate::make::pack::store;
use crate::make::push::{Push, Stop, Unit, free};
use crate::make::task::{Task, task};
use crate::read::checksum::Checksum;
use crate::read::checksum_record::{ChecksumRecord, write_files};
use crate::read::native;
use crate::read::packs::Id;
use crate::read::packs::Packing;
use crate::read::place::place;
use crate::read::set::Set;
use furrow_base::error::Kind;
use furrow_base::input::{self, below};
use furrow_base::shell::quoted;
use furrow_base::{Error, Result};
use furrow_job::Threads;
use furrow_output::{Lock, stream_atomically};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Makes the missing images of a shard like [`generate`](crate::make::generate::generate()), but works in a separate
/// folder below `place`. The folder is removed when the whole shard is at home. If another run works there, waits for
/// its end and issues a warning.
pub fn generate(home: &Set, place: &Path, work: &Work<'_>, callbacks: &Callbacks<'_>) -> Result<()> {
    let folder = own_folder(home, place, work.shard)?;
    let done = lock(&folder, work.shard, callbacks).and_then(|_lock| generate_there(home, &folder, work, callbacks));
    done.map_err(|error| match error.kind() {
        Kind::Interrupted => error.help(go_on(home, place, work.shard)).in_file(&home.folder),
        _ => error,
    })
}

/// Returns the help text of a stopped run: the command that continues it.
fn go_on(home: &Set, place: &Path, shard: Shard) -> String {
    let [home, place] = [home.folder.as_path(), place].map(|path: &Path| quoted(&path.to_string_lossy()));
    let Shard { number, of } = shard;
    let command = format!("trace dataset render {home} --shard {number}/{of} --scratch {place}");
    format!("`{command}` continues the shard; add the other options of this run")
}

/// Waits until no other run of the shard works in the folder, and locks the folder.
fn lock(folder: &Path, shard: Shard, callbacks: &Callbacks<'_>) -> Result<Lock> {
    let Shard { number, of } = shard;
    let waits = || {
        (callbacks.warn)(&format!(
            "another run of shard {number}/{of} works in {}; this one waits until it has ended",
            folder.display()
        ));
    };
    let stop = || callbacks.soon.load(Ordering::Relaxed) || callbacks.now.load(Ordering::Relaxed);
    Lock::wait(&folder.with_extension("lock"), waits, stop)?
        .ok_or_else(|| Error::stopped(format!("stopped while another run of shard {number}/{of} was at work")))
}

/// Makes the missing images of a shard in the local folder.
fn generate_there(home: &Set, folder: &Path, work: &Work<'_>, callbacks: &Callbacks<'_>) -> Result<()> {
    work.push.map_or(Ok(()), |push| push.clear(home))?;
    let here = copy(home, folder)?;
    let run = Run { home, here, shard: work.shard, push: work.push, stop: callbacks.stop() };
    run.push(Unit::Recipe)?;
    let there = Threads::new(work.threads)?.install(|| run.at_home())?;
    run.push_again(&there, callbacks.soon)?;
    let has = |index: u64| there.contains(&index);
    let deliver = |unit: Unit| run.deliver(unit);
    let made = generate_for(&run.here, work, callbacks, &Delivery { has: &has, deliver: &deliver, home: &home.folder });
    let rest = run.bring_rest();
    made?;
    rest?;
    // A stopped run may leave finished units that it has not copied yet.
    if !callbacks.soon.load(Ordering::Relaxed) {
        remove(std::fs::remove_dir_all(&run.here.folder), &run.here.folder)?;
    }
    Ok(())
}

/// Returns the folder below `place` for this dataset and shard; its name contains a hash of the dataset's path and
/// recipe.
fn own_folder(home: &Set, place: &Path, shard: Shard) -> Result<PathBuf> {
    home.recipe.rendering()?;
    let full = std::path::absolute(&home.folder).map_err(Error::io(&home.folder))?;
    let words = format!("{}\n{}", full.display(), home.recipe.fingerprint()?);
    let own = Checksum::of(words.as_bytes()).sha256;
    Ok(place.join(format!("{}-{}-of-{}", &own[..16], shard.number, shard.of)))
}

/// Copies the dataset's recipe and scene to `folder` and opens the copy.
fn copy(home: &Set, folder: &Path) -> Result<Set> {
    let paths = Unit::Recipe.contents(home)?.map(|(paths, _)| paths).unwrap_or_default();
    let read = |path: String| -> Result<File> {
        let file = below(&home.folder, &path)?;
        Ok(File { bytes: input::contents(&file).map_err(Error::reading(&file))?, path })
    };
    std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
    write_changed(folder, &paths.into_iter().map(read).collect::<Result<Vec<File>>>()?)?;
    Set::open(folder)
}

/// A run that works in the local dataset `here` for the dataset `home`.
struct Run<'a> {
    home: &'a Set,
    here: Set,
    shard: Shard,
    push: Option<&'a Push>,
    stop: Stop<'a>,
}

impl Run<'_> {
    /// Returns the images of the shard that are complete at home. Copies images that only lack formats or their pack to
    /// the local folder.
    fn at_home(&self) -> Result<BTreeSet<u64>> {
        let recipe = &self.home.recipe;
        let open = OpenPacks::of(self.home, self.shard)?;
        let look = |index: u64| -> Result<Option<u64>> {
            let is_freed = || recipe.pack.is_none() && Unit::Image(index).is_freed(self.home);
            if open.is_settled(self.home, index) || is_freed() {
                return Ok(Some(index));
            }
            match task(self.home, index)? {
                Task::Done if recipe.pack.is_none() => return Ok(Some(index)),
                Task::Done | Task::Formats => self.fetch(index)?,
                Task::All => {}
            }
            Ok(None)
        };
        let held: Vec<u64> = self.held().collect();
        held.into_par_iter().filter_map(|index| look(index).transpose()).collect()
    }

    /// Returns the indices of the shard's images.
    fn held(&self) -> impl Iterator<Item = u64> + '_ {
        (0..self.home.recipe.count).filter(move |index| self.shard.holds(self.home.recipe.unit_of(*index)))
    }

    /// Copies the undamaged files of an image from home, unless the image is already in the local folder.
    fn fetch(&self, index: u64) -> Result<()> {
        let Some(image) = ChecksumRecord::read(&self.home.folder, index) else { return Ok(()) };
        if task(&self.here, index)? != Task::All {
            return Ok(());
        }
        let broken: BTreeSet<String> = self.home.faults(&image).into_iter().map(|(path, _)| path).collect();
        carry(self.home, &self.here, &image, |path| !broken.contains(path))?;
        image.write(&self.here.folder)
    }

    /// Pushes the units that are complete at home and were not pushed.
    fn push_again(&self, there: &BTreeSet<u64>, soon: &AtomicBool) -> Result<()> {
        let unit = |index: &u64| Unit::of(self.home, *index);
        let units: BTreeMap<String, Unit> = there.iter().map(unit).map(|unit| (unit.name(), unit)).collect();
        let mut left = units.into_values().take_while(|_| !soon.load(Ordering::Relaxed));
        left.try_for_each(|unit| self.push(unit))
    }

    fn push(&self, unit: Unit) -> Result<()> {
        self.push.map_or(Ok(()), |push| push.unit(self.home, unit, self.stop))
    }

    /// Copies a finished unit home, and pushes it.
    fn deliver(&self, unit: Unit) -> Result<()> {
        match self.bring(unit) {
            // Another run of the same shard has copied the unit in the meantime.
            Err(e) if e.is_not_found() && unit.contents(self.home).is_ok_and(|found| found.is_some()) => {}
            other => other?,
        }
        self.push(unit)
    }

    fn bring(&self, unit: Unit) -> Result<()> {
        let Some((files, _)) = unit.contents(&self.here)? else { return Ok(()) };
        match unit {
            Unit::Image(index) => self.bring_image(index)?,
            Unit::Pack(id) => self.bring_pack(id)?,
            Unit::Recipe | Unit::Whole => return Ok(()),
        }
        // The checksum record is removed first, so that a kill cannot leave a record without its files.
        for seal in files.iter().filter(|file| file.starts_with("seals/")) {
            let path = below(&self.here.folder, seal)?;
            remove(std::fs::remove_file(&path), &path)?;
        }
        if let Unit::Pack(id) = unit {
            self.here.packs.forget(id);
        }
        free(&self.here, &files)
    }

    fn bring_image(&self, index: u64) -> Result<()> {
        let Some(image) = ChecksumRecord::read(&self.here.folder, index) else { return Ok(()) };
        carry(&self.here, self.home, &image, |_| true)?;
        image.write(&self.home.folder)
    }

    fn bring_pack(&self, id: Id) -> Result<()> {
        let Some(record) = self.here.packs.get(&self.here.folder, id) else { return Ok(()) };
        record
            .images
            .iter()
            .try_for_each(|image| carry(&self.here, self.home, image, |path| !native::is_native(path)))?;
        let (from, to) = (below(&self.here.folder, &id.path())?, place(&self.home.folder, &id.path())?);
        stream_atomically(&to, |out| {
            let mut archive = input::open(&from).map_err(|refusal| refusal.into_error(&from))?;
            std::io::copy(&mut archive, out).map(drop).map_err(Error::io(&to))
        })?;
        record.write(&self.home.folder, id)?;
        self.home.packs.forget(id);
        store::clear(&self.home.folder, &record)
    }

    /// Copies the images of incomplete packs home, so that another node can continue with them.
    fn bring_rest(&self) -> Result<()> {
        let Some(packing) = Packing::of(&self.home.recipe) else { return Ok(()) };
        for index in self.held() {
            let Some(image) = ChecksumRecord::read(&self.here.folder, index) else { continue };
            let is_packed = self.home.packs.get(&self.home.folder, packing.id(index)).is_some();
            if !is_packed && ChecksumRecord::read(&self.home.folder, index).as_ref() != Some(&image) {
                self.bring_image(index)?;
            }
        }
        Ok(())
    }
}

/// Copies the files of an image that are stored in folders and for which `which` returns `true`. Returns an error if a
/// file differs from its checksum.
fn carry(from: &Set, to: &Set, image: &ChecksumRecord, which: impl Fn(&str) -> bool) -> Result<()> {
    let read = |(path, sum): (&String, &Checksum)| -> Result<File> {
        let file = below(&from.folder, path)?;
        let bytes = input::contents(&file).map_err(Error::io(&file))?;
        if sum.is_of(&bytes) {
            return Ok(File { path: path.clone(), bytes });
        }
        Err(Error::damaged("it was changed after it was made").in_file(file))
    };
    let files = image.files.iter().filter(|(path, _)| which(path)).map(read).collect::<Result<Vec<File>>>()?;
    write_files(&to.folder, &files)
}

/// Returns the result of a removal; a file that did not exist is no error.
fn remove(done: std::io::Result<()>, path: &Path) -> Result<()> {
    match done {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(Error::io(path)(e)),
        _ => Ok(()),
    }
}
