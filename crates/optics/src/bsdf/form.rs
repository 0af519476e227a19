//! Properties of a BSDF beside its sampling: its reflectance, for denoisers, and its form, which exporters translate.

use super::microfacet::Ggx;
use super::surface_layer::SurfaceLayer;
use crate::optics::Shadowing;
use furrow_base::math::Spectrum;

/// Scattering in terms that exporters translate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// Opaque rough surface of Oren & Nayar 1994.
    Rough {
        /// Albedo, without the reflection of the film.
        albedo: Spectrum,
        /// A and B of the model; 1 and 0 for a Lambertian surface.
        shape: [f32; 2],
        /// Film of water, if any.
        film: Option<Film>,
        /// Shadowing by fine relief that is not meshed.
        shadowing: Option<Shadowing>,
    },
    /// Thin sheet.
    Sheet {
        /// Upper and lower side.
        sides: [SheetSide; 2],
        /// Transmittance at normal incidence, the same from both sides.
        transmittance: Spectrum,
    },
    /// None of these. Exporters replace it by a Lambertian surface of the same reflectance and transmittance, and warn.
    Unsupported,
}

/// Film of water over a part of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    /// Surface of the film.
    pub coat: Ggx,
    /// Fraction of the surface under the film, 0–1.
    pub share: f32,
}

/// One side of a sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetSide {
    /// Reflectance of the tissue, without that of the coat.
    pub diffuse: Spectrum,
    /// Coat, if any.
    pub coat: Option<Ggx>,
    /// Layer of hairs and wax bloom, if any.
    pub layer: Option<SurfaceLayer>,
}

/// Properties of a BSDF beside its sampling.
pub trait Portable: Sized {
    /// Returns the approximate reflectance seen from the side of `cos_o`, for the albedo feature of denoisers and the
    /// material colour in exports.
    fn reflectance(&self, cos_o: f32) -> Spectrum;
    /// Returns the transmittance at normal incidence; zero for opaque bodies, also under a coat.
    #[inline]
    fn transmittance(&self) -> Spectrum {
        Spectrum::ZERO
    }
    /// Returns the form that exporters translate, by default [`Form::Unsupported`].
    fn form(&self) -> Form {
        Form::Unsupported
    }
    /// Returns named examples over the range of parameters; the tests run over all of them.
    fn examples() -> Vec<(&'static str, Self)>;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: a BSDF that states only its reflectance is opaque and has no form.
    #[test]
    fn a_bsdf_that_states_nothing_is_not_held() {
        struct Plain;
        impl Portable for Plain {
            fn reflectance(&self, _: f32) -> Spectrum {
                Spectrum::ONE
            }
            fn examples() -> Vec<(&'static str, Self)> {
                vec![("plain", Self)]
            }
        }
        assert!(Plain.form() == Form::Unsupported && Plain.transmittance().is_black());
    }
}
