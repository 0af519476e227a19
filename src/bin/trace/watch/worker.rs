//! Thread that builds and renders requested fields. A newer request interrupts it. If a scene file cannot be rendered,
//! the last image is kept and the error is shown.
//!
//! `furrow_job::Schedule` does not fit: it makes every item of a known list, whereas here only the newest request counts
//! and a newer one discards the image in progress.

use super::contact_sheet;
use super::files::Files;
use super::live_image::{LiveImage, RenderInfo, own_width};
use super::session::{PageRequest, Session};
use super::sliders::{sliders, with};
use super::tev::Tev;
use furrow_base::error::Kind;
use furrow_base::math::ToInt;
use furrow_base::ron_file::RonFile;
use furrow_base::supervise::supervised;
use furrow_base::{Error, Result};
use furrow_field::assemble::Preview;
use furrow_job::{PreparedField, Renderer, Request, SceneFile, Threads};
use furrow_render::render::RenderMonitor;
use furrow_render::settings::{Quality, RenderOptions};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime};

/// State of the rendering thread.
pub(super) struct Worker {
    session: Arc<Session>,
    files: Files,
    threads: Threads,
    /// Memory limit of a field, bytes.
    memory: Option<u64>,
    renderer: Renderer,
    tev: Option<Tev>,
    /// Data reused from the last field.
    preview: Preview,
    /// Last scene file that could be read, with its textures and species.
    known: Option<SceneFile>,
    /// Image width of the scene's own camera, once known.
    own_width: Option<u32>,
}

impl Worker {
    /// Builds an idle worker.
    pub(super) fn new(
        session: Arc<Session>,
        files: Files,
        (threads, memory): (&Threads, Option<u64>),
        tev: Option<Tev>,
    ) -> Result<Self> {
        let renderer = Renderer::open(&RenderOptions::path_traced(Quality::spp(session.spp())))?;
        let threads = threads.clone();
        Ok(Self {
            session,
            files,
            threads,
            memory,
            renderer,
            tev,
            preview: Preview::default(),
            known: None,
            own_width: None,
        })
    }

    /// Handles requests until the session ends.
    pub(super) fn run(mut self) {
        let mut done = 0;
        let session = self.session.clone();
        while let Some((asked, wish)) = session.next(done) {
            done = asked;
            let answered = supervised(|| self.answer(asked, &wish)).unwrap_or_else(|bug| {
                // What a panic interrupted may be incomplete: the next request reads and builds everything again.
                (self.preview, self.known, self.own_width) = (Preview::default(), None, None);
                Err(bug)
            });
            match answered {
                Err(error) if error.kind() == Kind::Interrupted => {}
                Err(error) => {
                    self.files.fail(session.path(), error.place().map(|place| place.file.as_path()));
                    // Moving a slider must not print the same error repeatedly.
                    let words = format!("error: {error}");
                    if session.shown(|shown| shown.error.as_ref() != Some(&words)) {
                        furrow_cli::message!("{words}");
                    }
                    session.show(|shown| {
                        (shown.doing, shown.error) = ("", Some(words));
                    });
                }
                Ok(()) => session.show(|shown| shown.doing = ""),
            }
        }
    }

    /// Reads the scene file, builds the field and renders it.
    fn answer(&mut self, asked: u64, wish: &PageRequest) -> Result<()> {
        let (begin, written) = (Instant::now(), SystemTime::now());
        let session = self.session.clone();
        self.files.expect(session.path());
        let page = RonFile::read(session.path())?;
        let (complete, text) = (page.check_syntax().is_ok(), page.text);
        if session.shown(|shown| shown.text != text || shown.sliders.is_empty()) {
            session.read(&text, sliders(&text, session.assigned()), complete);
        }
        session.show(|shown| shown.doing = "building the scene");
        let text = with(&text, &wish.values);
        let scene = match &self.known {
            Some(known) => known.reread(Some(&text))?,
            None => SceneFile::open(session.path())?
                .threads(&self.threads)
                .assign(session.assigned())?
                .reread(Some(&text))?,
        };
        let scene = scene.seed(wish.seed).memory(self.memory).preview(&self.preview).until(session.outdated());
        let expected_warnings = scene.expected_warnings(wish.index)?;
        session.show(|shown| shown.expected_warnings = (asked, expected_warnings));
        let field = Arc::new(self.grow(&scene, wish)?);
        if self.files.keep(session.path(), &field.grown().files, written) {
            // Its buffers, materials or images may have been read before a change.
            session.reload();
        }
        self.known = Some(scene.clone());
        let passes = (0..u32::BITS).map(|k| 1 << k).take_while(|spp| *spp < session.spp());
        let passes: Vec<u32> = passes.chain([session.spp()]).collect();
        let mut first = None;
        if wish.sheet {
            // The first pass of the image comes before the sheet, its refinement after it.
            self.refine(&field, asked, &passes[..1], &mut || *first.get_or_insert_with(|| begin.elapsed()))?;
            // If a species or texture has changed, the text is the same, but the hash of the files read differs.
            let of = [text.as_str(), &field.grown().hash].concat();
            self.sheet(&scene, of, wish, asked)?;
        }
        self.refine(&field, asked, &passes, &mut || *first.get_or_insert_with(|| begin.elapsed()))
    }

    /// Builds the field at the requested width, or at the camera's own width if that is smaller.
    fn grow(&mut self, scene: &SceneFile, wish: &PageRequest) -> Result<PreparedField> {
        let guess = self.own_width.map_or(wish.width, |own| own.min(wish.width));
        let field = scene.clone().width(guess).field(wish.index)?;
        let own = own_width(&field.grown().scene.camera);
        self.own_width = Some(own);
        let wanted = own.min(wish.width);
        if wanted == guess { Ok(field) } else { scene.clone().width(wanted).field(wish.index) }
    }

    /// Renders the field with increasing numbers of samples; `first` returns the time to the first image.
    fn refine(
        &mut self,
        field: &Arc<PreparedField>,
        asked: u64,
        passes: &[u32],
        first: &mut (dyn FnMut() -> Duration + Send),
    ) -> Result<()> {
        let Self { session, renderer, tev, .. } = self;
        let watch = RenderMonitor { done: &|_| (), stop: session.outdated() };
        if watch.stop.load(Ordering::Relaxed) {
            return Err(Error::interrupted());
        }
        session.show(|shown| shown.doing = "building the BVH");
        field.geometry()?;
        session.show(|shown| shown.doing = "rendering");
        let (mut spp, mut kept) = (passes.iter(), None);
        renderer.refine(field, &Request { watch, ..Request::default() }, passes, &mut |film, labels| {
            let labels = kept.get_or_insert_with(|| Arc::new(labels.clone()));
            let made = RenderInfo { asked, first: first(), spp: spp.next().copied().unwrap_or_default() };
            let picture = Arc::new(LiveImage::new(field, film, labels, made));
            session.show(|shown| (shown.picture, shown.error) = (Some(picture), None));
            if let Some(tev) = tev {
                tev.send(film);
            }
            Ok(())
        })
    }

    /// Renders the missing thumbnails of the sheet.
    fn sheet(&mut self, scene: &SceneFile, text: String, wish: &PageRequest, asked: u64) -> Result<()> {
        let session = &self.session;
        let same = |of: &(String, Option<u64>, u64)| of.0 == text && of.1 == wish.seed;
        if !session.shown(|shown| shown.sheet.of.as_ref().is_some_and(same)) {
            session.show(|shown| {
                shown.sheet = contact_sheet::ContactSheet { of: Some((text, wish.seed, asked)), pictures: Vec::new() };
            });
        }
        let width = self.own_width.unwrap_or(contact_sheet::WIDTH).min(contact_sheet::WIDTH);
        // The sheet shows other fields, so it has a preview cache separate from the image's.
        let scene = scene.clone().width(width).preview(&Preview::default());
        for index in session.shown(|shown| shown.sheet.pictures.len().to_u64())..contact_sheet::COUNT {
            if session.outdated().load(Ordering::Relaxed) {
                return Err(Error::interrupted());
            }
            let picture = match contact_sheet::picture(&scene, index, session.outdated()) {
                Ok(png) => Ok(Arc::new(png)),
                Err(error) if error.kind() == Kind::Interrupted => return Err(error),
                // The other indices may still succeed.
                Err(error) => Err(format!("error: {error}")),
            };
            session.show(|shown| shown.sheet.pictures.push(picture));
        }
        Ok(())
    }
}
