//! Properties of a light beside its sampling: its form, which exporters and the rasterizer translate, and smaller lights
//! of the same kind, for ablations.

use furrow_base::math::{Frame, Spectrum, Vec2, Vec3};

/// Light in terms that exporters and the rasterizer translate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// Distant disc. Its radiance is [`Light::le`](super::Light::le).
    Distant {
        /// Unit direction to the disc's centre.
        towards: Vec3,
        /// Irradiance of a plane that faces the light, W·m⁻²·nm⁻¹ per band.
        normal_irradiance: Spectrum,
    },
    /// Flat area that emits on one side, with the same radiance at every point and in every direction.
    Area {
        /// Outline.
        outline: Outline,
        /// Centre, metres.
        centre: Vec3,
        /// The light emits along z; a rectangle's width is along x.
        frame: Frame,
        /// Radiance, W·m⁻²·sr⁻¹·nm⁻¹ per band.
        radiance: Spectrum,
        /// Area, m².
        area: f32,
    },
    /// Light from all directions at infinity. Its radiance is [`Light::le`](super::Light::le).
    Dome {
        /// `true` if the radiance is the same from all directions.
        uniform: bool,
    },
    /// None of these. Exporters omit the light and warn; the rasterizer treats it as uniform ambient light that gives
    /// level ground the same irradiance.
    Unsupported,
}

/// Outline of a flat light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outline {
    /// Half of the width and height, metres.
    Rectangle(Vec2),
    /// Radius, metres.
    Disc(f32),
}

/// Properties of a light beside its sampling; the defaults are those of a light that has none of them.
pub trait Portable: Sized {
    /// Returns the form that exporters and the rasterizer translate, by default [`Form::Unsupported`].
    fn form(&self) -> Form {
        Form::Unsupported
    }

    /// Returns a light of the same irradiance whose size is scaled by `by`, 0 < `by` ≤ 1; `None` for a light without a
    /// size, which ablations keep.
    fn shrunk(&self, _by: f32) -> Option<Self> {
        None
    }
}

impl<T: Portable> Portable for Box<T> {
    fn form(&self) -> Form {
        (**self).form()
    }

    fn shrunk(&self, by: f32) -> Option<Self> {
        (**self).shrunk(by).map(Self::new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: a light that states nothing is held by no exporter and has no smaller version.
    #[test]
    fn a_light_that_states_nothing_is_not_held() {
        struct Plain;
        impl Portable for Plain {}
        assert_eq!(Plain.form(), Form::Unsupported);
        assert!(Plain.shrunk(0.5).is_none() && Box::new(Plain).shrunk(0.5).is_none());
        assert_eq!(Box::new(Plain).form(), Form::Unsupported);
    }
}
