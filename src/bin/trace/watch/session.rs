//! Requested and displayed state, shared by the threads that render, watch files and answer requests.

use super::contact_sheet::ContactSheet;
use super::live_image::LiveImage;
use super::sliders::{self, Slider};
use furrow_base::ron_file::Assignment;
use furrow_base::shell::quoted;
use furrow_base::{Error, Result};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Request of the page.
#[derive(Clone, Default, PartialEq)]
pub(super) struct PageRequest {
    /// Index of the field.
    pub(super) index: u64,
    /// Seed that overrides the scene file's.
    pub(super) seed: Option<u64>,
    /// Image width, pixels.
    pub(super) width: u32,
    /// Values that override those of the file, by their paths.
    pub(super) values: BTreeMap<String, f64>,
    /// `true` if the sheet of indices is requested.
    pub(super) sheet: bool,
}

/// State displayed by the page.
#[derive(Default)]
pub(super) struct PageState {
    /// Last image that could be rendered.
    pub(super) picture: Option<Arc<LiveImage>>,
    /// Error of the newest request, if it failed.
    pub(super) error: Option<String>,
    /// Warnings of the newest field that are known before it is built, with the number of the request.
    pub(super) expected_warnings: (u64, Vec<String>),
    /// Text of the scene file when last read.
    pub(super) text: String,
    /// Numbers of the scene file.
    pub(super) sliders: Vec<Slider>,
    /// Sheet of indices.
    pub(super) sheet: ContactSheet,
    /// `true` if a photograph was given on the command line.
    pub(super) photo: bool,
    /// Current activity of the worker; empty if idle.
    pub(super) doing: &'static str,
}

struct Inner {
    wish: PageRequest,
    /// Incremented with every request and every change of a file.
    asked: u64,
    /// Incremented with every change of the displayed state.
    version: u64,
    shown: PageState,
    ended: bool,
}

/// Session of one watched scene file.
pub(super) struct Session {
    path: PathBuf,
    /// Values of the command line, which replace those of the file.
    assigned: Vec<Assignment>,
    /// Samples per pixel of a complete image.
    spp: u32,
    inner: Mutex<Inner>,
    changed: Condvar,
    /// Set when the current rendering is outdated.
    outdated: Arc<AtomicBool>,
}

impl Session {
    /// Creates a session without an image.
    pub(super) fn new(path: PathBuf, assigned: Vec<Assignment>, wish: PageRequest, spp: u32) -> Self {
        let inner = Inner { wish, asked: 1, version: 1, shown: PageState::default(), ended: false };
        Self { path, assigned, spp, inner: Mutex::new(inner), changed: Condvar::new(), outdated: Arc::default() }
    }

    /// Path of the scene file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Values of the command line, which replace those of the file.
    pub(super) fn assigned(&self) -> &[Assignment] {
        &self.assigned
    }

    /// Samples per pixel of a complete image.
    pub(super) fn spp(&self) -> u32 {
        self.spp
    }

    /// Flag that interrupts rendering.
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

    /// Requests a new rendering, because a file has changed.
    pub(super) fn reload(&self) {
        self.turn(|inner| {
            inner.asked += 1;
            self.outdated.store(true, Ordering::Relaxed);
        });
    }

    /// Changes the request. Returns the number of the newest request.
    pub(super) fn wish(&self, change: impl FnOnce(&mut PageRequest)) -> u64 {
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

    /// Replaces text and sliders of the scene file. Removes the values of numbers that it no longer has, if it is
    /// `complete`: the numbers of a text with a syntax error may come back.
    pub(super) fn read(&self, text: &str, sliders: Vec<Slider>, complete: bool) {
        self.turn(|inner| {
            inner.wish.values.retain(|path, _| !complete || sliders::has(&sliders, path));
            (inner.shown.sliders, inner.shown.text) = (sliders, text.to_owned());
            inner.version += 1;
        });
    }

    /// Ends the threads that render and watch files.
    pub(super) fn end(&self) {
        self.turn(|inner| {
            inner.ended = true;
            self.outdated.store(true, Ordering::Relaxed);
        });
    }

    /// Waits for a request newer than number `done`; `None` at the end.
    pub(super) fn next(&self, done: u64) -> Option<(u64, PageRequest)> {
        let mut inner = self.lock();
        while inner.asked == done && !inner.ended {
            inner = self.changed.wait(inner).unwrap_or_else(PoisonError::into_inner);
        }
        self.outdated.store(inner.ended, Ordering::Relaxed);
        (!inner.ended).then(|| (inner.asked, inner.wish.clone()))
    }

    /// Changes the displayed state.
    pub(super) fn show(&self, change: impl FnOnce(&mut PageState)) {
        self.turn(|inner| {
            change(&mut inner.shown);
            inner.version += 1;
        });
    }

    /// Reads from the displayed state.
    pub(super) fn shown<T>(&self, look: impl FnOnce(&PageState) -> T) -> T {
        look(&self.lock().shown)
    }

    /// Returns the image; an error before the first one is rendered.
    pub(super) fn picture(&self) -> Result<Arc<LiveImage>> {
        self.shown(|shown| shown.picture.clone()).ok_or_else(|| Error::input("there is no image yet"))
    }

    /// Waits until the state is newer than `version`, for at most `most`. Returns the state for the page; `None` at the
    /// end.
    pub(super) fn state(&self, version: u64, most: Duration) -> Option<(u64, Value)> {
        let inner = self.lock();
        let waits = |inner: &mut Inner| inner.version == version && !inner.ended;
        let waited = self.changed.wait_timeout_while(inner, most, waits);
        let (inner, _) = waited.unwrap_or_else(PoisonError::into_inner);
        (!inner.ended).then(|| (inner.version, self.describe(&inner)))
    }

    /// Returns the command that renders the requested image, at most as wide as the camera of the last one.
    fn command(&self, wish: &PageRequest, last: Option<&LiveImage>) -> String {
        let mut words = vec!["trace".to_owned(), "--scene".into(), self.path.display().to_string()];
        let mut option = |name: &str, value: String| words.extend([name.to_owned(), value]);
        option("--index", wish.index.to_string());
        if let Some(seed) = wish.seed {
            option("--seed", seed.to_string());
        }
        option("--width", last.map_or(wish.width, |last| wish.width.min(last.own_width())).to_string());
        option("--spp", self.spp.to_string());
        let assigned = self.assigned.iter().map(Assignment::to_string);
        for value in assigned.chain(wish.values.iter().map(|(path, value)| format!("{path}={value}"))) {
            option("--set", value);
        }
        words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
    }

    fn describe(&self, inner: &Inner) -> Value {
        let Inner { wish, asked, version, shown, .. } = inner;
        let (expected_for, expected_warnings) = &shown.expected_warnings;
        let grown = shown.picture.as_ref().filter(|picture| picture.asked() >= *expected_for);
        let warnings = grown.map_or(expected_warnings, |picture| picture.warnings());
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
            "command": self.command(wish, shown.picture.as_deref()),
            "warnings": warnings,
            "sliders": shown.sliders,
            "sheet": shown.sheet.about(wish.sheet),
        })
    }
}
