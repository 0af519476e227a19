//! The contract of a light in a scene file: its fields, the values sampled from them, and the light sources.

use super::environment_map::{Infrared, Table};
use super::sample::Emitter;
use furrow_base::Result;
use furrow_base::math::Spectrum;
use furrow_base::sampling::rng::Stream;
use std::sync::Arc;

/// Function that loads an environment map named in a scene file.
pub type Open<'a> = dyn FnMut(&str, Infrared) -> Result<Arc<Table>> + 'a;

/// Fields of a light in a scene file.
pub trait Described {
    /// Sampled values.
    type Record: Recorded;
    /// Light sources: an option for each, `None` for one that is black.
    type Sources;

    /// Samples the light; `open` loads a file named in the scene file.
    fn draw(&self, stream: &mut Stream, open: &mut Open<'_>) -> Result<(Self::Record, Self::Sources)>;

    /// Returns an error that [`Self::draw`] would return for the same stream, if it follows from the sampled values alone.
    fn check(&self, _stream: &mut Stream) -> Result<()> {
        Ok(())
    }

    /// Returns the environment maps that it names.
    fn files(&self) -> Vec<&str> {
        Vec::new()
    }

    /// Returns named examples of its sources, including edge cases, for tests that run over all lights.
    fn examples() -> Vec<(&'static str, Self::Sources)>;
}

/// Sampled values of a light.
pub trait Recorded {
    /// Returns the irradiance of the ground; for several sources, their sum.
    fn irradiance_w_m2_nm(&self) -> Spectrum;
}

/// Light sources that convert to a list.
pub(super) trait Sources<L> {
    /// Returns those that are not black.
    fn list(self) -> Vec<L>;
}

impl<L, A: Into<L>> Sources<L> for Option<A> {
    fn list(self) -> Vec<L> {
        self.into_iter().map(A::into).collect()
    }
}

impl<L, A: Into<L>, B: Into<L>> Sources<L> for (Option<A>, Option<B>) {
    fn list(self) -> Vec<L> {
        let (first, second) = self;
        first.map(A::into).into_iter().chain(second.map(B::into)).collect()
    }
}

/// Returns the irradiance of the ground, zero without a source.
pub(super) fn irradiance<E: Emitter>(source: Option<&E>) -> Spectrum {
    source.map_or(Spectrum::ZERO, E::horizontal_irradiance)
}
