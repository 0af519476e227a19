//! What is asked for and what is shown, shared by the threads that render, listen and answer.

use super::picture::Picture;
use super::sheet::Sheet;
use super::sliders::Slider;
use furrow::{Error, Result};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// What the page asks for.
#[derive(Clone, Default, PartialEq)]
pub(super) struct Wish {
    /// Field of the distribution.
    pub(super) index: u64,
    /// Instead of the scene file's seed.
    pub(super) seed: Option<u64>,
    /// Width of the picture, pixels.
    pub(super) width: u32,
    /// Values that stand in the place of the file's, by the paths that lead there.
    pub(super) values: BTreeMap<String, f64>,
    /// Whether the sheet of indices is wanted.
    pub(super) sheet: bool,
}

/// What the page shows.
#[derive(Default)]
pub(super) struct Shown {
    /// The last picture that could be rendered.
    pub(super) picture: Option<Arc<Picture>>,
    /// Why the newest could not be.
    pub(super) error: Option<String>,
    /// What the newest field warns of before it grows, and the number of what was asked for.
    pub(super) foretold: (u64, Vec<String>),
    /// The scene file's text, as it was read last.
    pub(super) text: String,
    /// Its numbers.
    pub(super) sliders: Vec<Slider>,
    /// The sheet of indices.
    pub(super) sheet: Sheet,
    /// Whether the program was given a photograph.
    pub(super) photo: bool,
    /// What the worker does; empty where it waits.
    pub(super) doing: &'static str,
}

struct Inner {
    wish: Wish,
    /// Rises with every wish and every change of a file.
    asked: u64,
    /// Rises with everything that the page could show.
    version: u64,
    shown: Shown,
    ended: bool,
}

/// One scene file that is watched.
pub(super) struct Session {
    path: PathBuf,
    /// Samples a pixel of a finished picture.
    spp: u32,
    inner: Mutex<Inner>,
    changed: Condvar,
    /// Raised where what is rendered is not wanted any more.
    outdated: Arc<AtomicBool>,
}

impl Session {
    /// A session that has shown nothing yet.
    pub(super) fn new(path: PathBuf, wish: Wish, spp: u32) -> Self {
        let inner = Inner { wish, asked: 1, version: 1, shown: Shown::default(), ended: false };
        Self { path, spp, inner: Mutex::new(inner), changed: Condvar::new(), outdated: Arc::default() }
    }

    /// The scene file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Samples a pixel of a finished picture.
    pub(super) fn spp(&self) -> u32 {
        self.spp
    }

    /// The flag that stops what is rendered.
    pub(super) fn outdated(&self) -> &Arc<AtomicBool> {
        &self.outdated
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn turn(&self, act: impl FnOnce(&mut Inner)) {
        act(&mut self.lock());
        self.changed.notify_all();
    }

    /// Renders again: a file has changed.
    pub(super) fn reload(&self) {
        self.turn(|inner| {
            inner.asked += 1;
            self.outdated.store(true, Ordering::Relaxed);
        });
    }

    /// Changes what is asked for; returns the number of the newest that was.
    pub(super) fn wish(&self, change: impl FnOnce(&mut Wish)) -> u64 {
        let mut asked = 0;
        self.turn(|inner| {
            let before = inner.wish.clone();
            change(&mut inner.wish);
            if inner.wish != before {
                inner.asked += 1;
                inner.version += 1;
                self.outdated.store(true, Ordering::Relaxed);
            }
            asked = inner.asked;
        });
        asked
    }

    /// Ends the threads that render and listen.
    pub(super) fn end(&self) {
        self.turn(|inner| {
            inner.ended = true;
            self.outdated.store(true, Ordering::Relaxed);
        });
    }

    /// Waits for something newer than number `done` to be asked for; `None` at the end.
    pub(super) fn next(&self, done: u64) -> Option<(u64, Wish)> {
        let mut inner = self.lock();
        while inner.asked == done && !inner.ended {
            inner = self.changed.wait(inner).unwrap_or_else(PoisonError::into_inner);
        }
        self.outdated.store(inner.ended, Ordering::Relaxed);
        (!inner.ended).then(|| (inner.asked, inner.wish.clone()))
    }

    /// Changes what is shown.
    pub(super) fn show(&self, change: impl FnOnce(&mut Shown)) {
        self.turn(|inner| {
            change(&mut inner.shown);
            inner.version += 1;
        });
    }

    /// Something of what is shown.
    pub(super) fn shown<T>(&self, look: impl FnOnce(&Shown) -> T) -> T {
        look(&self.lock().shown)
    }

    /// The picture; an error before the first one is there.
    pub(super) fn picture(&self) -> Result<Arc<Picture>> {
        self.shown(|shown| shown.picture.clone()).ok_or_else(|| Error::input("there is no picture yet"))
    }

    /// Waits until there is something newer than `version`, or for so long; the state as the page reads it, `None` at the end.
    pub(super) fn state(&self, version: u64, most: Duration) -> Option<(u64, Value)> {
        let inner = self.lock();
        let waits = |inner: &mut Inner| inner.version == version && !inner.ended;
        let waited = self.changed.wait_timeout_while(inner, most, waits);
        let (inner, _) = waited.unwrap_or_else(PoisonError::into_inner);
        (!inner.ended).then(|| (inner.version, self.describe(&inner)))
    }

    fn describe(&self, inner: &Inner) -> Value {
        let Inner { wish, asked, version, shown, .. } = inner;
        let (told_of, foretold) = &shown.foretold;
        let grown = shown.picture.as_ref().filter(|picture| picture.asked() >= *told_of);
        let warnings = grown.map_or(foretold, |picture| picture.warnings());
        json!({
            "version": version,
            "asked": asked,
            "file": self.path.display().to_string(),
            "spp": self.spp,
            "photo": shown.photo,
            "doing": shown.doing,
            "error": shown.error,
            "picture": shown.picture.as_ref().map(|picture| picture.about()),
            "index": wish.index,
            "seed": wish.seed,
            "width": wish.width,
            "values": wish.values,
            "warnings": warnings,
            "sliders": shown.sliders,
            "sheet": shown.sheet.about(wish.sheet),
        })
    }
}
