//! Makes the images of a shard on a node's own disk, and brings them home as they are finished: a shared folder then gets whole images and
//! archives, and none of the temporary files that making them takes.
//!
//! A run works in a copy of the dataset that holds recipe and scene alone. What is at home is not made again. What is finished, an image or a
//! pack, is copied home, pushed from there where that is asked for, and removed here. Images of a pack that is not full when the run ends come
//! home in folders of their own, and the next run goes on with them on whatever node. The timing log is written at home. So home holds what it
//! would hold had the run worked there.
//!
//! Of several runs of one shard in one place, one works at a time: a second waits for its lock, then makes what the first has left.

use crate::File;
use crate::deliver::cluster::quoted;
use crate::make::begin::write_changed;
use crate::make::generate::{Callbacks, Delivery, OpenPacks, Shard, Work, generate_for};
use crate::make::push::{Push, Unit, free};
use crate::pack::store;
use crate::read::checksum::Checksum;
use crate::read::checksum_record::{ChecksumRecord, write_files};
use crate::read::native;
use crate::read::packs::Id;
use crate::read::packs::Packing;
use crate::read::set::Set;
use crate::read::task::{Task, task};
use furrow_base::error::Kind;
use furrow_base::input::{self, below};
use furrow_base::{Error, Result};
use furrow_job::Threads;
use furrow_output::{Lock, stream_atomically};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Makes what is missing of a shard, as [`generate`](crate::make::generate::generate()) does, in a folder of its own below `place`. That folder is
/// removed when all of the shard is at home. While another run works there it waits, which is told as a warning.
pub fn generate(home: &Set, place: &Path, work: &Work<'_>, callbacks: &Callbacks<'_>) -> Result<()> {
    let folder = own_folder(home, place, work.shard)?;
    let done = lock(&folder, work.shard, callbacks).and_then(|_lock| generate_there(home, &folder, work, callbacks));
    done.map_err(|error| match error.kind() {
        Kind::Interrupted => error.help(go_on(home, place, work.shard)).in_file(&home.folder),
        _ => error,
    })
}

/// What goes on with a run that was stopped.
fn go_on(home: &Set, place: &Path, shard: Shard) -> String {
    let [home, place] = [home.folder.as_path(), place].map(|path: &Path| quoted(&path.to_string_lossy()));
    let Shard { number, of } = shard;
    let command = format!("trace dataset render {home} --shard {number}/{of} --scratch {place}");
    format!("`{command}` goes on with it; give it what else this run was given")
}

/// Waits until no other run of the shard works in the folder, and keeps others out.
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

/// Makes what is missing of a shard in this folder.
fn generate_there(home: &Set, folder: &Path, work: &Work<'_>, callbacks: &Callbacks<'_>) -> Result<()> {
    work.push.map_or(Ok(()), |push| push.clear(home))?;
    let here = copy(home, folder)?;
    let run = Run { home, here, shard: work.shard, push: work.push, stop: callbacks.now };
    run.push(Unit::Recipe)?;
    let there = Threads::new(work.threads)?.install(|| run.at_home())?;
    run.push_again(&there, callbacks.soon)?;
    let has = |index: u64| there.contains(&index);
    let deliver = |unit: Unit| run.deliver(unit);
    let made = generate_for(&run.here, work, callbacks, &Delivery { has: &has, deliver: &deliver, home: &home.folder });
    let rest = run.bring_rest();
    made?;
    rest?;
    // One that was asked to stop may not have looked at all that is finished here.
    if !callbacks.soon.load(Ordering::Relaxed) {
        remove(std::fs::remove_dir_all(&run.here.folder), &run.here.folder)?;
    }
    Ok(())
}

/// A folder in `place` that belongs to this dataset and shard alone.
fn own_folder(home: &Set, place: &Path, shard: Shard) -> Result<PathBuf> {
    home.recipe.rendering()?;
    let full = std::path::absolute(&home.folder).map_err(Error::io(&home.folder))?;
    let words = format!("{}\n{}", full.display(), home.recipe.fingerprint()?);
    let own = Checksum::of(words.as_bytes()).sha256;
    Ok(place.join(format!("{}-{}-of-{}", &own[..16], shard.number, shard.of)))
}

/// The dataset's recipe and scene in this folder.
fn copy(home: &Set, folder: &Path) -> Result<Set> {
    let paths = Unit::Recipe.contents(home)?.map(|(paths, _)| paths).unwrap_or_default();
    let read = |path: String| -> Result<File> {
        let file = below(&home.folder, &path)?;
        Ok(File { bytes: input::contents(&file).map_err(Error::reading(&file))?, path })
    };
    write_changed(folder, &paths.into_iter().map(read).collect::<Result<Vec<File>>>()?)?;
    Set::open(folder)
}

/// A run that works here for a dataset at home.
struct Run<'a> {
    home: &'a Set,
    here: Set,
    shard: Shard,
    push: Option<&'a Push>,
    stop: &'a AtomicBool,
}

impl Run<'_> {
    /// The images of the shard that lack nothing at home. Those that lack a format or their pack alone are fetched.
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

    /// The images of the shard.
    fn held(&self) -> impl Iterator<Item = u64> + '_ {
        (0..self.home.recipe.count).filter(move |index| self.shard.holds(self.home.recipe.unit_of(*index)))
    }

    /// Takes an image from home, as far as it is whole there, unless it is here.
    fn fetch(&self, index: u64) -> Result<()> {
        let Some(image) = ChecksumRecord::read(&self.home.folder, index) else { return Ok(()) };
        if task(&self.here, index)? != Task::All {
            return Ok(());
        }
        let broken: BTreeSet<String> = self.home.faults(&image).into_iter().map(|(path, _)| path).collect();
        carry(self.home, &self.here, &image, |path| !broken.contains(path))?;
        image.write(&self.here.folder)
    }

    /// Pushes what is at home and was not pushed.
    fn push_again(&self, there: &BTreeSet<u64>, soon: &AtomicBool) -> Result<()> {
        let unit = |index: &u64| Unit::of(self.home, *index);
        let units: BTreeMap<String, Unit> = there.iter().map(unit).map(|unit| (unit.name(), unit)).collect();
        let mut left = units.into_values().take_while(|_| !soon.load(Ordering::Relaxed));
        left.try_for_each(|unit| self.push(unit))
    }

    fn push(&self, unit: Unit) -> Result<()> {
        self.push.map_or(Ok(()), |push| push.unit(self.home, unit, self.stop))
    }

    /// Brings home what is finished here, and pushes it.
    fn deliver(&self, unit: Unit) -> Result<()> {
        match self.bring(unit) {
            // Another run of the same shard has brought it meanwhile.
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
        // First what says that it is whole.
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
        let (from, to) = (below(&self.here.folder, &id.path())?, below(&self.home.folder, &id.path())?);
        stream_atomically(&to, |out| {
            let mut archive = input::open(&from).map_err(|refusal| refusal.into_error(&from))?;
            std::io::copy(&mut archive, out).map(drop).map_err(Error::io(&to))
        })?;
        record.write(&self.home.folder, id)?;
        self.home.packs.forget(id);
        store::clear(&self.home.folder, &record)
    }

    /// Brings home the images of packs that are not full: another node may go on with them.
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

/// Copies those files of an image that lie in folders and are asked for. What was changed since it was made is an error.
fn carry(from: &Set, to: &Set, image: &ChecksumRecord, which: impl Fn(&str) -> bool) -> Result<()> {
    let read = |(path, sum): (&String, &Checksum)| -> Result<File> {
        let file = below(&from.folder, path)?;
        let bytes = input::contents(&file).map_err(Error::io(&file))?;
        if sum.is_of(&bytes) {
            return Ok(File { path: path.clone(), bytes });
        }
        Err(Error::damaged("it was changed since it was made").in_file(file))
    };
    let files = image.files.iter().filter(|(path, _)| which(path)).map(read).collect::<Result<Vec<File>>>()?;
    write_files(&to.folder, &files)
}

/// What became of a removal; what is gone already is well.
fn remove(done: std::io::Result<()>, path: &Path) -> Result<()> {
    match done {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(Error::io(path)(e)),
        _ => Ok(()),
    }
}
