//! Scattering functions (BSDFs) of a surface point in its local frame. Pure functions that know neither geometry nor
//! textures.

mod diffuse;
pub mod fresnel;
mod leaf;
pub mod microfacet;
mod sample;
mod shadowed;
mod surface_layer;
mod wet;

use crate::optics::Shadowing;
use furrow_base::math::{Spectrum, Vec3};

pub use diffuse::OrenNayar;
pub use leaf::{Leaf, Side};
pub use sample::{BsdfSample, Scatter};
pub use shadowed::{Rough, Shadowed};
pub use surface_layer::SurfaceLayer;
pub use wet::Wet;

/// BSDF of one surface point. `Copy`, because it lives on the stack for one bounce.
#[derive(Clone, Copy, Debug)]
pub enum Bsdf {
    /// Rough and dry surface: soil, stone, wood.
    OrenNayar(OrenNayar),
    /// Rough surface partly covered by a film of water.
    Wet(Wet),
    /// Dry or wet rough surface whose fine relief is not meshed but included as a shadowing factor.
    Shadowed(Shadowed),
    /// Thin sheet that reflects and transmits under a coat.
    Leaf(Leaf),
}

macro_rules! each {
    ($self:ident, $b:ident => $e:expr) => {
        match $self {
            Bsdf::OrenNayar($b) => $e,
            Bsdf::Wet($b) => $e,
            Bsdf::Shadowed($b) => $e,
            Bsdf::Leaf($b) => $e,
        }
    };
}

impl Bsdf {
    /// See [`Scatter::eval`].
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        each!(self, b => b.eval(wo, wi))
    }

    /// See [`Scatter::pdf`].
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        each!(self, b => b.pdf(wo, wi))
    }

    /// See [`Scatter::eval_pdf`].
    #[inline]
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        each!(self, b => b.eval_pdf(wo, wi))
    }

    /// See [`Scatter::sample`].
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        each!(self, b => b.sample(wo, u))
    }

    /// Returns the approximate reflectance seen from the side of `cos_o`, for the albedo feature of denoisers and the
    /// material colour in exports.
    pub fn reflectance(&self, cos_o: f32) -> Spectrum {
        match self {
            Self::OrenNayar(b) => b.albedo(),
            Self::Wet(b) => b.albedo(),
            Self::Shadowed(b) => b.albedo(),
            Self::Leaf(b) => b.reflectance(cos_o),
        }
    }

    /// Returns `true` if light may pass through: for a leaf with non-zero transmittance, not for an opaque body under a
    /// coat.
    pub fn transmits(&self) -> bool {
        matches!(self, Self::Leaf(leaf) if !leaf.transmittance().is_black())
    }

    /// Returns named examples of every kind over its parameter range; the tests run over all of them.
    pub fn examples() -> Vec<(&'static str, Self)> {
        let soil = Spectrum::new(0.22, 0.14, 0.09, 0.27);
        let leaf = |front: f32, back: f32| {
            let side = |roughness: f32, r: Spectrum| Side::new(1.45, [roughness; 2], r);
            Leaf::new(
                side(front, Spectrum::new(0.07, 0.11, 0.05, 0.44)),
                side(back, Spectrum::new(0.1, 0.15, 0.08, 0.44)),
                Spectrum::new(0.07, 0.12, 0.02, 0.5),
            )
        };
        let grass = Leaf::new(
            Side::new(1.45, [0.5, 0.2], Spectrum::splat(0.3)),
            Side::new(1.45, [0.5, 0.2], Spectrum::splat(0.3)),
            Spectrum::splat(0.4),
        );
        let layered = |hairs: f32, bloom: f32| {
            let side = |r: Spectrum| Side::new(1.45, [0.45; 2], r).layered(SurfaceLayer::new(hairs, bloom));
            let [upper, lower] =
                [Spectrum::new(0.07, 0.11, 0.05, 0.44), Spectrum::new(0.1, 0.15, 0.08, 0.44)].map(side);
            Leaf::new(upper, lower, Spectrum::new(0.07, 0.12, 0.02, 0.5))
        };
        let shadowed = |base: Rough| {
            // The factor grows with the elevation of both directions and shrinks with the azimuth between them.
            let factor = |pair: usize, turn: usize| 0.6 + 0.02 * pair as f32 - 0.05 * turn as f32;
            let factors = std::array::from_fn(|pair| std::array::from_fn(|turn| factor(pair, turn)));
            Self::Shadowed(Shadowed::new(base, Vec3::new(0.28, 0.0, 0.96), Shadowing::new(&factors)))
        };
        vec![
            ("lambert", Self::OrenNayar(OrenNayar::new(Spectrum::splat(0.5), 0.0))),
            ("dry soil", Self::OrenNayar(OrenNayar::new(soil, 0.35))),
            ("rough soil", Self::OrenNayar(OrenNayar::new(soil, 0.7))),
            ("moist soil", Self::Wet(Wet::new(soil, 0.35, 0.4, 0.3))),
            ("wet soil", Self::Wet(Wet::new(soil, 0.35, 1.0, 0.15))),
            ("coarse soil", shadowed(Rough::Dry(OrenNayar::new(soil, 0.35)))),
            ("coarse wet soil", shadowed(Rough::Wet(Wet::new(soil, 0.35, 0.7, 0.6)))),
            ("glossy leaf", Self::Leaf(leaf(0.15, 0.5))),
            ("beet leaf", Self::Leaf(leaf(0.3, 0.5))),
            ("dull leaf", Self::Leaf(leaf(0.6, 0.6))),
            ("grass", Self::Leaf(grass)),
            ("hairy leaf", Self::Leaf(layered(0.3, 0.0))),
            ("blue leaf", Self::Leaf(layered(0.0, 0.1))),
            ("leaf without a coat", Self::Leaf(Leaf::bare(Spectrum::splat(0.45), Spectrum::splat(0.55)))),
        ]
    }
}
