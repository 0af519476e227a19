//! One grown field, ready to be rendered.

use super::threads::Threads;
use crate::ablation::Edit;
use crate::accel::{Before, EmbreeAccel};
use crate::geometry::Window;
use crate::integrator::World;
use crate::render::{self, Echo, LabelMap};
use crate::scene;
use crate::scene::assemble::{Options, Stage};
use crate::sensor::Lidar;
use crate::{Error, Result};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// A grown field: everything that a camera can see, and what is known of every plant.
pub struct Field {
    grown: scene::Field,
    edit: &'static Edit,
    threads: Threads,
    options: Options,
    grow: Duration,
    geometry: OnceLock<(Arc<EmbreeAccel>, Duration)>,
}

impl Field {
    pub(super) fn new(
        grown: scene::Field,
        edit: &'static Edit,
        threads: Threads,
        options: Options,
        grow: Duration,
    ) -> Self {
        Self { grown, edit, threads, options, grow, geometry: OnceLock::new() }
    }

    /// Scene, plants and sensor; seed, index and hash of what was read; conditions and warnings.
    pub fn grown(&self) -> &scene::Field {
        &self.grown
    }

    /// The same field as another of its images has it: `capture` counts from 0, all cameras of a frame and then those of the next, on
    /// the field's day. What was
    /// grown and built is kept.
    ///
    /// # Errors
    /// Where there are fewer images of it.
    pub fn take(&mut self, capture: u64) -> Result<()> {
        let captures = self.grown.captures.len();
        let place = usize::try_from(capture).ok().filter(|place| *place < captures);
        let place = place.ok_or_else(|| {
            Error::misuse(format!("image {capture} of a field of which {captures} are taken")).help("they count from 0")
        })?;
        if place != self.grown.capture {
            self.grown.take(place);
        }
        Ok(())
    }

    /// What was changed of it.
    pub fn edit(&self) -> &'static Edit {
        self.edit
    }

    /// The threads that work on it.
    pub fn threads(&self) -> &Threads {
        &self.threads
    }

    /// How long it took to grow, and to build its BVH as far as that is done.
    pub fn times(&self) -> (Duration, Duration) {
        (self.grow, self.geometry.get().map_or(Duration::ZERO, |(_, build)| *build))
    }

    /// What rays hit; built at the first call.
    pub fn geometry(&self) -> Result<&EmbreeAccel> {
        if self.geometry.get().is_none() {
            let begin = Instant::now();
            self.options.progress.enter(Stage::Bvh);
            let (scene, count) = (&self.grown.scene, self.threads.count() as u32);
            let build = |before: Option<&Before<'_>>| {
                EmbreeAccel::build_until(&scene.surfaces(), count, self.options.stop.as_deref(), before)
            };
            let built = self.threads.install(|| match &self.options.preview {
                // A ray a pixel and no more: a good hierarchy takes longer to build than all of them.
                None if self.options.unlit => {
                    EmbreeAccel::build_quickly(&scene.surfaces(), count, self.options.stop.as_deref()).map(Arc::new)
                }
                None => build(None).map(Arc::new),
                Some(preview) => preview.geometry(&scene.parts, build),
            })?;
            self.options.progress.leave();
            let _ = self.geometry.set((built, begin.elapsed()));
        }
        self.geometry.get().map(|(built, _)| built.as_ref()).ok_or_else(|| Error::failed("the scene was not built"))
    }

    /// Labels of what the camera sees, without any light: one ray for each pixel. An edit of the labels is not made, which asks samples.
    pub fn label(&self) -> Result<LabelMap> {
        let (scene, geometry) = (&self.grown.scene, self.geometry()?);
        let window = Window::full(scene.camera.width(), scene.camera.height());
        Ok(self.threads.install(|| render::label(geometry, &scene.parts, &scene.camera, window)))
    }

    /// What its LiDAR measures in a turn that begins at the frame of the image; of a field that was grown for a [scan](super::SceneFile::scanned).
    ///
    /// # Errors
    /// Where it was grown for its cameras.
    pub fn scan(&self) -> Result<(&Lidar, Vec<Echo>)> {
        let (lidar, stream) = self.grown.scanner().ok_or_else(|| {
            Error::misuse("the field was grown for its cameras, not for a LiDAR").help("ask `SceneFile::scanned` first")
        })?;
        let world = self.world()?;
        Ok((lidar, self.threads.install(|| render::scan(&world, lidar, &stream))))
    }

    /// Scene and geometry, as integrators take them.
    pub fn world(&self) -> Result<World<'_>> {
        Ok(World { scene: &self.grown.scene, geometry: self.geometry()? })
    }
}
