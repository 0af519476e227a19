//! One grown field, ready to be rendered.

use super::threads::Threads;
use crate::ablation::Edit;
use crate::accel::EmbreeAccel;
use crate::integrator::World;
use crate::scene;
use crate::{Error, Result};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// A grown field: everything that a camera can see, and what is known of every plant.
pub struct Field {
    grown: scene::Field,
    edit: &'static Edit,
    threads: Threads,
    /// Of a preview: raised where it is not wanted any more.
    outdated: Option<Arc<AtomicBool>>,
    grow: Duration,
    geometry: OnceLock<(EmbreeAccel, Duration)>,
}

impl Field {
    pub(super) fn new(
        grown: scene::Field,
        edit: &'static Edit,
        threads: Threads,
        outdated: Option<Arc<AtomicBool>>,
        grow: Duration,
    ) -> Self {
        Self { grown, edit, threads, outdated, grow, geometry: OnceLock::new() }
    }

    /// Scene, plants and sensor; seed, index and hash of what was read; conditions and warnings.
    pub fn grown(&self) -> &scene::Field {
        &self.grown
    }

    /// The same field as another of its images has it: `capture` counts from 0, all cameras of a frame and then those of the next. What was
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
            let surfaces = self.grown.scene.surfaces();
            let (count, outdated) = (self.threads.count() as u32, self.outdated.as_deref());
            let built = self.threads.install(|| EmbreeAccel::build_until(&surfaces, count, outdated))?;
            let _ = self.geometry.set((built, begin.elapsed()));
        }
        self.geometry.get().map(|(built, _)| built).ok_or_else(|| Error::failed("the scene was not built"))
    }

    /// Scene and geometry, as integrators take them.
    pub fn world(&self) -> Result<World<'_>> {
        Ok(World { scene: &self.grown.scene, geometry: self.geometry()? })
    }
}
