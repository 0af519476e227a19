//! Trails: the rays scattered from a first surface, and the surfaces that they meet.
//!
//! Directions follow from the surface and the random numbers of the sample; they do not depend on light. Light decides
//! only how far a trail is followed. So trails that are kept are the same, bit by bit, under any number of lights.

use super::World;
use super::vertex::{Scattered, Vertex};
use furrow_base::geometry::{Hit, Interaction, Ray};
use furrow_base::math::{Spectrum, ToInt, Vec3};

/// Growth of a ray's width after a diffuse bounce, metres per metre: scattered light sees textures at this resolution.
const DIFFUSE_SPREAD: f32 = 0.1;

/// A ray scattered at a surface.
#[derive(Clone, Copy)]
pub(super) struct ScatteredRay {
    pub(super) ray: Ray,
    /// Width at the origin, metres.
    width: f32,
    /// f · |cos θi| divided by the density.
    pub(super) weight: Spectrum,
    /// Density per solid angle.
    pub(super) pdf: f32,
    /// Surface that it leaves: position, normal for choosing lights, and whether it transmits light.
    pub(super) p: Vec3,
    pub(super) normal: Vec3,
    pub(super) two_sided: bool,
}

impl ScatteredRay {
    /// Samples a ray scattered at `vertex` with the numbers `u`. Returns `None` if the light is absorbed.
    #[inline]
    pub(super) fn leave(vertex: &Vertex, u: [f32; 3]) -> Option<Self> {
        let Scattered { wi, weight, pdf } = vertex.sample(u)?;
        let at = &vertex.at;
        let (normal, two_sided) = (vertex.normal(), vertex.bsdf.transmits());
        Some(Self { ray: at.ray(wi, f32::INFINITY), width: at.footprint, weight, pdf, p: at.p, normal, two_sided })
    }
}

/// What a ray meets: a surface, or nothing.
#[derive(Clone, Copy)]
struct Met(Option<(Hit, Interaction)>);

/// A scattered ray, and the surface that it meets, computed on first use.
pub(super) struct Step {
    pub(super) flight: ScatteredRay,
    met: Option<Met>,
    vertex: Option<Vertex>,
}

impl Step {
    fn of(flight: ScatteredRay) -> Self {
        Self { flight, met: None, vertex: None }
    }

    /// Returns the surface that the ray meets; `None` if it leaves the scene.
    #[inline]
    pub(super) fn met(&mut self, world: &World<'_>) -> Option<(Hit, Interaction)> {
        let ScatteredRay { ray, width, .. } = &self.flight;
        self.met.get_or_insert_with(|| Met(world.interact(ray, *width, DIFFUSE_SPREAD))).0
    }

    /// Returns the vertex at the surface that the ray [meets](Self::met).
    #[inline]
    pub(super) fn vertex(&mut self, world: &World<'_>, (hit, at): &(Hit, Interaction)) -> Vertex {
        *self.vertex.get_or_insert_with(|| Vertex::new(world, &self.flight.ray, hit, *at))
    }
}

/// The steps of one trail.
pub(super) trait Trail {
    /// Returns step `depth`, from 1; the one before it must be known. `leave` samples its ray. Returns `None` if the light is
    /// absorbed.
    fn step(&mut self, depth: u32, leave: impl FnOnce() -> Option<ScatteredRay>) -> Option<&mut Step>;
}

/// The trails of a first surface.
pub(super) trait Trails {
    type One: Trail;

    /// Returns the trail of a scattered ray. Whether some light is `narrow` decides on its random numbers.
    fn of(&mut self, branch: u32, narrow: bool) -> &mut Self::One;
}

/// The current step of a trail, for a single light.
#[derive(Default)]
pub(super) struct Fleeting(Option<Step>);

impl Trail for Fleeting {
    #[inline]
    fn step(&mut self, _: u32, leave: impl FnOnce() -> Option<ScatteredRay>) -> Option<&mut Step> {
        self.0 = leave().map(Step::of);
        self.0.as_mut()
    }
}

impl Trails for Fleeting {
    type One = Self;

    #[inline]
    fn of(&mut self, _: u32, _: bool) -> &mut Self {
        self
    }
}

/// All steps of a trail, for several lights.
#[derive(Default)]
pub(super) struct Kept(Vec<Option<Step>>);

impl Trail for Kept {
    fn step(&mut self, depth: u32, leave: impl FnOnce() -> Option<ScatteredRay>) -> Option<&mut Step> {
        let place = depth.to_usize() - 1;
        if self.0.len() <= place {
            self.0.push(leave().map(Step::of));
        }
        self.0.get_mut(place)?.as_mut()
    }
}

/// All trails of a first surface, for several lights.
#[derive(Default)]
pub(super) struct KeptTrails(Vec<Kept>);

impl Trails for KeptTrails {
    type One = Kept;

    fn of(&mut self, branch: u32, narrow: bool) -> &mut Kept {
        let place = 2 * branch.to_usize() + usize::from(narrow);
        if self.0.len() <= place {
            self.0.resize_with(place + 1, Kept::default);
        }
        &mut self.0[place]
    }
}
