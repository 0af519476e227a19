//! Scattering functions (BSDFs) of a surface point in its local frame. Pure functions that know neither geometry nor
//! textures.

mod diffuse;
mod form;
pub mod fresnel;
mod leaf;
pub mod microfacet;
mod sample;
mod shadowed;
mod surface_layer;
mod wet;

use furrow_base::math::{Spectrum, Vec3};

pub use diffuse::OrenNayar;
pub use form::{Film, Form, Portable, SheetSide};
pub use leaf::{Leaf, Side};
pub use sample::{BsdfSample, Scatter};
pub use shadowed::{Rough, Shadowed};
pub use surface_layer::SurfaceLayer;
pub use wet::Wet;

furrow_base::dispatch! {
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
    /// See [`Scatter::eval`].
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum;
    /// See [`Scatter::pdf`].
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32;
    /// See [`Scatter::eval_pdf`].
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32);
    /// See [`Scatter::sample`].
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample>;
    /// See [`Portable::reflectance`].
    fn reflectance(&self, cos_o: f32) -> Spectrum;
    /// See [`Portable::transmittance`].
    fn transmittance(&self) -> Spectrum;
    /// See [`Portable::form`].
    fn form(&self) -> Form;

    of each:
    /// Returns named examples of every kind over its parameter range; the tests run over all of them.
    fn examples();
}

impl Bsdf {
    /// Returns `true` if light may pass through: for a leaf with non-zero transmittance, not for an opaque body under a
    /// coat.
    #[inline]
    pub fn transmits(&self) -> bool {
        !self.transmittance().is_black()
    }
}
