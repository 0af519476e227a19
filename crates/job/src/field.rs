//! A built field, ready to be rendered.

use super::threads::Threads;
use furrow_base::geometry::Window;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_field::ablation::Edit;
use furrow_field::assemble::{Options, Source, Stage};
use furrow_field::profile::{Phase, Profiler};
use furrow_optics::sensor::Lidar;
use furrow_render::accel::{EmbreeAccel, PreviousBuild};
use furrow_render::integrator::World;
use furrow_render::render::{self, Echo, LabelMap};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// A built field: scene, captures, and ground truth of every plant. The BVH is built on first use.
pub struct PreparedField {
    grown: furrow_field::Field,
    /// Scene file that the field was built from.
    source: Arc<Source>,
    edit: &'static Edit,
    threads: Threads,
    options: Options,
    grow: Duration,
    geometry: OnceLock<(Arc<EmbreeAccel>, Duration)>,
}

impl PreparedField {
    pub(super) fn new(
        grown: furrow_field::Field,
        (source, edit): (Arc<Source>, &'static Edit),
        threads: Threads,
        options: Options,
        grow: Duration,
    ) -> Self {
        Self { grown, source, edit, threads, options, grow, geometry: OnceLock::new() }
    }

    /// Returns the field's data: scene, plants and sensor; seed, index and hash of the files read; conditions and warnings.
    pub fn grown(&self) -> &furrow_field::Field {
        &self.grown
    }

    /// Switches to another image of the field on its day. `capture` counts from 0: all cameras of a frame, then those of the next. The
    /// scene and the BVH are kept.
    ///
    /// # Errors
    /// If the field has no image with this number.
    pub fn take(&mut self, capture: u64) -> Result<()> {
        let captures = self.grown.captures.len();
        let place = usize::try_from(capture).ok().filter(|place| *place < captures);
        let place = place.ok_or_else(|| {
            Error::misuse(format!("there is no image {capture}: the field has {captures}")).help("images count from 0")
        })?;
        if place != self.grown.capture {
            self.grown.take(place);
        }
        Ok(())
    }

    /// Gives the field another of its lights; 0 is its own. Scene and BVH are kept, so the field is then as if it were built
    /// [under this light](super::SceneFile::light). After an error, it is unchanged.
    pub fn relight(&mut self, light: u64) -> Result<()> {
        if light == self.grown.light {
            return Ok(());
        }
        let Self { grown, source, edit, threads, options, .. } = self;
        threads.install(|| edit.relight(source, grown, options, light))
    }

    /// Returns the edit that was applied to the field.
    pub fn edit(&self) -> &'static Edit {
        self.edit
    }

    /// Returns the worker threads of the field.
    pub fn threads(&self) -> &Threads {
        &self.threads
    }

    /// Returns the profiler of the field's phases; it is off unless [`SceneFile::profiled`](super::SceneFile::profiled) set it.
    pub fn profiler(&self) -> &Profiler {
        &self.options.profiler
    }

    /// Returns the time that building the scene took, and the time of building the BVH, or zero if it is not built yet.
    pub fn times(&self) -> (Duration, Duration) {
        (self.grow, self.geometry.get().map_or(Duration::ZERO, |(_, build)| *build))
    }

    /// Returns the BVH; the first call builds it.
    pub fn geometry(&self) -> Result<&EmbreeAccel> {
        if self.geometry.get().is_none() {
            let begin = Instant::now();
            self.options.progress.enter(Stage::Bvh);
            self.profiler().enter(Phase::Bvh);
            let (scene, count) = (&self.grown.scene, self.threads.count().to_u32());
            let build = |before: Option<&PreviousBuild<'_>>| {
                EmbreeAccel::build_until(&scene.surfaces(), count, self.options.stop.as_deref(), before)
            };
            let built = self.threads.install(|| match &self.options.preview {
                // Labels need one ray per pixel: a high-quality BVH would take longer to build than to trace them.
                None if self.options.unlit => {
                    EmbreeAccel::build_quickly(&scene.surfaces(), count, self.options.stop.as_deref()).map(Arc::new)
                }
                None => build(None).map(Arc::new),
                Some(preview) => preview.geometry(&scene.parts, build),
            })?;
            self.options.progress.leave();
            self.profiler().enter(Phase::Other);
            let _ = self.geometry.set((built, begin.elapsed()));
        }
        self.geometry.get().map(|(built, _)| built.as_ref()).ok_or_else(|| Error::failed("the scene was not built"))
    }

    /// Returns the label map of the camera's view, traced with one ray per pixel and without light. Edits of labels are not applied,
    /// because they need samples.
    pub fn label(&self) -> Result<LabelMap> {
        let (scene, geometry) = (&self.grown.scene, self.geometry()?);
        let window = Window::full(scene.camera.width(), scene.camera.height());
        self.profiler().enter(Phase::Labels);
        Ok(self.threads.install(|| render::label(geometry, &scene.parts, &scene.camera, window)))
    }

    /// Scans one turn of the LiDAR, starting at the frame of the current image. The field must be built for a
    /// [scan](super::SceneFile::scanned).
    ///
    /// # Errors
    /// If the field was built for its cameras.
    pub fn scan(&self) -> Result<(&Lidar, Vec<Echo>)> {
        let (lidar, stream) = self.grown.scanner().ok_or_else(|| {
            Error::misuse("the field was built for its cameras, not for a LiDAR")
                .help("call `SceneFile::scanned` first")
        })?;
        let world = self.world()?;
        Ok((lidar, self.threads.install(|| render::scan(&world, lidar, &stream))))
    }

    /// Returns scene and geometry in the form that integrators take.
    pub fn world(&self) -> Result<World<'_>> {
        Ok(World::new(&self.grown.scene, self.geometry()?))
    }
}
