//! The thread that grows and renders what is asked for. Whatever is asked for later stops it; a scene file that cannot be rendered leaves the
//! last picture and says why.

use super::files::Files;
use super::picture::{Made, Picture};
use super::session::{Session, Wish};
use super::sheet;
use super::sliders::{sliders, with};
use super::tev::Tev;
use furrow::error::Kind;
use furrow::job::{Field, Renderer, Request, SceneFile, Threads};
use furrow::render::Watch;
use furrow::ron_file::RonFile;
use furrow::scene::assemble::Preview;
use furrow::settings::{Quality, RenderOptions};
use furrow::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime};

/// What renders, and what it has read.
pub(super) struct Worker {
    session: Arc<Session>,
    files: Files,
    threads: Threads,
    /// Most bytes that a field may take.
    memory: Option<u64>,
    renderer: Renderer,
    tev: Option<Tev>,
    /// What is kept of the last field.
    preview: Preview,
    /// The last scene file that could be read, with its textures and species.
    known: Option<SceneFile>,
    /// Pixels across of the scene's own camera, once one was seen.
    own_width: Option<u32>,
}

impl Worker {
    /// One that has done nothing yet.
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

    /// Works until the session ends.
    pub(super) fn run(mut self) {
        let mut done = 0;
        let session = self.session.clone();
        while let Some((asked, wish)) = session.next(done) {
            done = asked;
            match self.answer(asked, &wish) {
                Err(error) if error.kind() == Kind::Interrupted => {}
                Err(error) => {
                    self.files.fail(session.path(), error.place().map(|place| place.file.as_path()));
                    // A slider that is moved on must not print the same words again and again.
                    let words = format!("error: {error}");
                    if session.shown(|shown| shown.error.as_ref() != Some(&words)) {
                        furrow::tell!("{words}");
                    }
                    session.show(|shown| {
                        (shown.doing, shown.error) = ("", Some(words));
                    });
                }
                Ok(()) => session.show(|shown| shown.doing = ""),
            }
        }
    }

    /// Reads, grows and renders.
    fn answer(&mut self, asked: u64, wish: &Wish) -> Result<()> {
        let (begin, written) = (Instant::now(), SystemTime::now());
        let session = self.session.clone();
        self.files.expect(session.path());
        let text = RonFile::read(session.path())?.text;
        session.show(|shown| {
            if shown.text != text || shown.sliders.is_empty() {
                shown.sliders = sliders(&text);
                shown.text.clone_from(&text);
            }
            shown.doing = "growing";
        });
        let text = with(&text, &wish.values);
        let scene = match &self.known {
            Some(known) => known.reread(Some(&text))?,
            None => SceneFile::open(session.path())?.threads(&self.threads).reread(Some(&text))?,
        };
        let scene = scene.seed(wish.seed).memory(self.memory).preview(&self.preview).until(session.outdated());
        let foretold = scene.foretold(wish.index)?;
        session.show(|shown| shown.foretold = (asked, foretold));
        let field = Arc::new(self.grow(&scene, wish)?);
        if self.files.keep(session.path(), &field.grown().files, written) {
            // Its buffers, materials or pictures may be older than they are now.
            session.reload();
        }
        self.known = Some(scene.clone());
        let passes = (0..u32::BITS).map(|k| 1 << k).take_while(|spp| *spp < session.spp());
        let passes: Vec<u32> = passes.chain([session.spp()]).collect();
        let mut first = None;
        if wish.sheet {
            // The picture comes before the sheet, and its refinement after it.
            self.refine(&field, asked, &passes[..1], &mut || *first.get_or_insert_with(|| begin.elapsed()))?;
            // Of a species or texture that has changed, the text is the same and the hash of what was read is not.
            let of = [text.as_str(), &field.grown().hash].concat();
            self.sheet(&scene, of, wish, asked)?;
        }
        self.refine(&field, asked, &passes, &mut || *first.get_or_insert_with(|| begin.elapsed()))
    }

    /// Grows the field at the width that is asked for, or at the camera's own where that is less.
    fn grow(&mut self, scene: &SceneFile, wish: &Wish) -> Result<Field> {
        let guess = self.own_width.map_or(wish.width, |own| own.min(wish.width));
        let field = scene.clone().width(guess).field(wish.index)?;
        let camera = &field.grown().scene.camera;
        let own = (f64::from(camera.width()) / f64::from(camera.scale())).round() as u32;
        self.own_width = Some(own);
        let wanted = own.min(wish.width);
        if wanted == guess { Ok(field) } else { scene.clone().width(wanted).field(wish.index) }
    }

    /// Shows the field with more and more samples; `first` says how long the first picture took.
    fn refine(
        &mut self,
        field: &Arc<Field>,
        asked: u64,
        passes: &[u32],
        first: &mut (dyn FnMut() -> Duration + Send),
    ) -> Result<()> {
        let Self { session, renderer, tev, .. } = self;
        let watch = Watch { done: &|_| (), stop: session.outdated() };
        if watch.stop.load(Ordering::Relaxed) {
            return Err(Error::interrupted());
        }
        session.show(|shown| shown.doing = "building");
        field.geometry()?;
        session.show(|shown| shown.doing = "rendering");
        let (mut spp, mut kept) = (passes.iter(), None);
        renderer.refine(field, &Request { watch, ..Request::default() }, passes, &mut |film, labels| {
            let labels = kept.get_or_insert_with(|| Arc::new(labels.clone()));
            let made = Made { asked, first: first(), spp: spp.next().copied().unwrap_or_default() };
            let picture = Arc::new(Picture::new(field, film, labels, made));
            session.show(|shown| (shown.picture, shown.error) = (Some(picture), None));
            if let Some(tev) = tev {
                tev.send(film);
            }
            Ok(())
        })
    }

    /// Renders what is missing of the sheet of indices.
    fn sheet(&mut self, scene: &SceneFile, text: String, wish: &Wish, asked: u64) -> Result<()> {
        let session = &self.session;
        let same = |of: &(String, Option<u64>, u64)| of.0 == text && of.1 == wish.seed;
        if !session.shown(|shown| shown.sheet.of.as_ref().is_some_and(same)) {
            session.show(|shown| {
                shown.sheet = sheet::Sheet { of: Some((text, wish.seed, asked)), pictures: Vec::new() };
            });
        }
        let width = self.own_width.unwrap_or(sheet::WIDTH).min(sheet::WIDTH);
        // Their fields are others: the picture's is kept apart from them.
        let scene = scene.clone().width(width).preview(&Preview::default());
        for index in session.shown(|shown| shown.sheet.pictures.len() as u64)..sheet::COUNT {
            if session.outdated().load(Ordering::Relaxed) {
                return Err(Error::interrupted());
            }
            let picture = match sheet::picture(&scene, index, session.outdated()) {
                Ok(png) => Ok(Arc::new(png)),
                Err(error) if error.kind() == Kind::Interrupted => return Err(error),
                // The others may have pictures.
                Err(error) => Err(format!("error: {error}")),
            };
            session.show(|shown| shown.sheet.pictures.push(picture));
        }
        Ok(())
    }
}
