//! Materials of models loaded from disk: base colour and image under a coat of any roughness, opaque or a translucent
//! sheet.
//!
//! Model files contain three bands. Near infrared comes from the scene file, from values that this program wrote into
//! the file, or from an estimate.
//!
//! A translucent sheet is taken for a leaf, with reflectance and transmittance of 0.45 each (the plateau of
//! PROSPECT-D's green leaves). An opaque surface has the reflectance of red, which is roughly right for dry soil, stone
//! and paint. If the near infrared of an opaque surface is given, it applies to the mean of the image and follows the
//! image's red.

use super::feature::Feature;
use super::shading::{bump, frame};
use super::swatch::{Swatch, Tone, centre};
use super::varies::Varies;
use furrow_base::geometry::Interaction;
use furrow_base::math::{Frame, Spectrum, ToFloat, ToInt, Vec2, Vec3};
use furrow_optics::bsdf::{self, Bsdf, OrenNayar, Side};
use furrow_optics::texture::{NormalTexture, Surface, Texture, Transmission};
use std::sync::Arc;

/// Index of refraction of the coat, as in glTF.
const IOR: f32 = 1.5;
/// Roughness above which the coat is omitted because its effect is not visible.
const MATTE: f32 = 0.8;
/// Slope angle of the microfacets of a matte surface, radians.
const SIGMA: f32 = 0.3;
/// Reflectance and transmittance of a leaf in near infrared.
const LEAF_NIR: f32 = 0.45;

/// Reflectance at which the bands of a surface are cut: that of fresh snow and barium sulphate.
const BRIGHTEST: f32 = 0.95;

/// Surface properties in a scene file that override those of a model.
#[derive(Clone, Copy, Debug, Default)]
pub struct SurfaceOverride {
    /// GGX roughness α, 0–1.
    pub roughness: Option<f32>,
    /// Transmittance per band, 0–1.
    pub transmission: Option<Spectrum>,
    /// Reflectance in near infrared, 0–1.
    pub nir: Option<f32>,
    /// Factor on the reflectance of the file's colours.
    pub gain: Option<f32>,
}

/// A surface of a model, prepared for shading.
#[derive(Clone, Debug)]
pub struct ModelSurface {
    color: Vec3,
    picture: Option<Arc<Texture>>,
    nir: Nir,
    relief: Option<NormalTexture>,
    transmission: Option<Translucency>,
    coat: Option<Side>,
    /// Fixed mip level of the colour image for all rays; `None` for the level of each ray's width.
    level: Option<u32>,
}

/// Near-infrared reflectance.
#[derive(Clone, Copy, Debug)]
enum Nir {
    /// Uniform.
    Even(f32),
    /// Multiple of the red reflectance.
    OfRed(f32),
}

/// Transmission of a translucent sheet.
#[derive(Clone, Debug)]
struct Translucency {
    transmittance: Spectrum,
    picture: Option<Arc<Texture>>,
}

impl ModelSurface {
    /// Builds the material from a surface of a model file, with the scene file's overrides.
    pub fn new(surface: &Surface, page: &SurfaceOverride) -> Self {
        let own = |t: &Transmission| Translucency {
            transmittance: Spectrum(Vec3::from(t.color).extend(surface.nir_transmission.unwrap_or(LEAF_NIR))),
            picture: t.picture.clone(),
        };
        let transmission = match page.transmission {
            Some(t) => (!t.is_black()).then_some(Translucency { transmittance: t, picture: None }),
            None => surface.transmission.as_ref().map(own),
        };
        let roughness = page.roughness.or(surface.roughness).unwrap_or(1.0).max(0.02);
        let known = page.nir.or(surface.nir);
        let color = Vec3::from(surface.color) * page.gain.unwrap_or(1.0);
        let nir = match (&transmission, known) {
            (Some(_), nir) => Nir::Even(nir.unwrap_or(LEAF_NIR)),
            (None, None) => Nir::OfRed(1.0),
            (None, Some(nir)) => {
                let red = color.x * surface.picture.as_ref().map_or(1.0, |p| mean(p).x);
                // A black surface has no red to scale.
                if red > 0.01 { Nir::OfRed(nir / red) } else { Nir::Even(nir) }
            }
        };
        Self {
            color,
            picture: surface.picture.clone(),
            nir,
            relief: surface.relief.clone(),
            coat: (roughness < MATTE).then(|| Side::new(IOR, [roughness; 2], Spectrum::ZERO)),
            transmission,
            level: None,
        }
    }

    /// Returns the mean reflectance of the surface.
    pub fn mean_reflectance(&self) -> Spectrum {
        self.tone(mean).reflectance
    }

    /// Tone at a point; `of` samples the images there.
    fn tone(&self, of: impl Fn(&Texture) -> Vec3) -> Tone {
        let seen = |picture: &Option<Arc<Texture>>| picture.as_ref().map_or(Vec3::ONE, |p| of(p));
        let color = self.color * seen(&self.picture);
        let nir = match self.nir {
            Nir::Even(nir) => nir,
            Nir::OfRed(share) => share * color.x,
        };
        let reflectance = Spectrum(color.extend(nir)).clamp(0.0, BRIGHTEST);
        let transmittance = self.transmission.as_ref().map_or(Spectrum::ZERO, |sheet| {
            let passed = sheet.transmittance * Spectrum(seen(&sheet.picture).extend(1.0));
            // Energy conservation: reflectance plus transmittance at most 0.99.
            Spectrum(passed.0.min((Spectrum::splat(0.99) - reflectance).0))
        });
        Tone { reflectance, transmittance }
    }

    pub(super) fn leave_out(&mut self, feature: Feature) {
        match feature {
            // It remains a sheet, so that nothing else changes.
            Feature::Transmission => {
                self.transmission =
                    self.transmission.take().map(|s| Translucency { transmittance: Spectrum::ZERO, ..s });
            }
            Feature::Coat => self.coat = None,
            Feature::Relief => self.relief = None,
            Feature::Facets | Feature::Texture => {}
        }
    }

    pub(super) fn swatch(&self) -> Swatch<'_> {
        let mean = self.tone(mean);
        let roughness = self.coat.and_then(|side| side.coat()).map_or(1.0, |coat| coat.alpha[0]);
        let passed = self.transmission.as_ref().and_then(|sheet| sheet.picture.as_ref());
        let Some(picture) = self.picture.as_ref().or(passed) else {
            return Swatch::plain(mean, roughness);
        };
        let size = (picture.width(), picture.height());
        let texel = move |x, y| self.tone(|picture| rgb(picture.sample(centre(size, x, y), 0.0)));
        // Repainted surfaces do not share the image of the file.
        let swatch = Swatch::pictured([std::ptr::from_ref(self).addr(), 1], size, texel, mean, roughness);
        match &self.relief {
            Some(NormalTexture { normals, strength }) => {
                swatch.raised(move |x, y| normals.sample(centre(size, x, y), 0.0), *strength)
            }
            None => swatch,
        }
    }

    /// The image whose resolution limits the variation: colours, or else transmission.
    fn finest(&self) -> Option<&Texture> {
        let passed = self.transmission.as_ref().and_then(|sheet| sheet.picture.as_ref());
        self.picture.as_ref().or(passed).map(|p| &**p)
    }

    pub(super) fn fix_level(&mut self, level: u32) {
        self.level = Some(level);
    }

    pub(super) fn varies(&self) -> Varies {
        self.finest().map_or(Varies::Nowhere, |p| Varies::over((p.width(), p.height()), self.level))
    }

    /// Width of a ray's footprint in texture coordinates.
    fn extent(&self, at: &Interaction) -> f32 {
        if let (Some(level), Some(p)) = (self.level, self.finest()) {
            return 2.0_f32.powi(level.to_i32()) / p.width().max(p.height()).to_f32();
        }
        let (along_u, along_v) = at.tangents();
        at.footprint / along_u.length().max(along_v.length()).max(1e-6)
    }

    pub(super) fn scatter(&self, at: &Interaction, wo: Vec3) -> (Bsdf, Frame) {
        let extent = self.extent(at);
        let read = |picture: &Texture| rgb(picture.sample(at.uv, picture.lod(extent)));
        let Tone { reflectance, transmittance } = self.tone(read);
        let bsdf = match (&self.coat, &self.transmission) {
            (None, None) => Bsdf::OrenNayar(OrenNayar::new(reflectance, SIGMA)),
            (coat, _) => {
                let side = coat.map_or(Side::bare(reflectance), |side| side.with(reflectance));
                Bsdf::Leaf(bsdf::Leaf::new(side, side, transmittance))
            }
        };
        let normal = self.relief.as_ref().map_or(at.ns, |NormalTexture { normals, strength }| {
            bump(at, at.tangents(), normals.sample(at.uv, normals.lod(extent)) * *strength)
        });
        (bsdf, frame(at, normal, wo))
    }
}

/// Mean colour of the opaque texels of an image: its coarsest mip level.
fn mean(picture: &Texture) -> Vec3 {
    rgb(picture.sample(Vec2::splat(0.5), 32.0))
}

fn rgb([r, g, b, _]: [f32; 4]) -> Vec3 {
    Vec3::new(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::geometry::{Hit, Mesh};
    use furrow_base::math::vec2;
    use proptest::prelude::*;

    /// Rationale: a transmitting surface is sampled and lit from both sides. Expected: an opaque body does not
    /// transmit, with or without a coat; a sheet does.
    #[test]
    fn a_coated_body_is_opaque_unless_it_lets_light_through() {
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let mesh = Mesh::smooth(corners, vec![Vec2::ZERO, vec2(1.0, 0.0), vec2(0.0, 1.0)], vec![[0, 1, 2]]);
        let at = Interaction::new(&mesh, &Hit { t: 1.0, u: 0.3, v: 0.3, part: 0, triangle: 0 }, 1e-3);
        let transmits = |roughness: f32, passed: Option<f32>| {
            let transmission = passed.map(|t| Transmission { color: [t; 3], picture: None });
            let surface = Surface { roughness: Some(roughness), transmission, ..Surface::default() };
            ModelSurface::new(&surface, &SurfaceOverride::default()).scatter(&at, Vec3::Z).0.transmits()
        };
        assert!(!transmits(0.2, None) && !transmits(1.0, None));
        assert!(transmits(0.2, Some(0.1)) && transmits(1.0, Some(0.1)));
    }

    proptest! {
        /// Rationale: model and species files give reflectance and transmittance separately, and their sum may exceed
        /// one. Expected: the material limits the sum to 0.99.
        #[test]
        fn no_surface_returns_and_passes_more_than_it_receives(
            color in prop::array::uniform3(0f32..=1.0),
            passed in prop::array::uniform3(0f32..=1.0),
            nir in prop::option::of(0f32..=1.0),
            page in prop::option::of(prop::array::uniform4(0f32..=1.0)),
        ) {
            let transmission = Some(Transmission { color: passed, picture: None });
            let surface = Surface { color, transmission, ..Surface::default() };
            let repaint = SurfaceOverride { nir, transmission: page.map(Spectrum::from), ..SurfaceOverride::default() };
            let tone = ModelSurface::new(&surface, &repaint).tone(|_| Vec3::ONE);
            let sum = (tone.reflectance + tone.transmittance).max();
            prop_assert!(sum <= 0.9901 && tone.transmittance.0.min_element() >= 0.0, "{tone:?}");
        }
    }

    /// Expected: a gain scales the colours and the near infrared that follows red, and leaves a near infrared that the
    /// scene file gives.
    #[test]
    fn a_gain_darkens_what_the_file_paints() {
        let surface = Surface { color: [0.8, 0.6, 0.4], ..Surface::default() };
        let mean = |page: SurfaceOverride| ModelSurface::new(&surface, &page).mean_reflectance().to_array();
        let gain = SurfaceOverride { gain: Some(0.25), ..SurfaceOverride::default() };
        let close = |a: [f32; 4], b: [f32; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(close(mean(gain), [0.2, 0.15, 0.1, 0.2]), "{:?}", mean(gain));
        let given = SurfaceOverride { nir: Some(0.5), ..gain };
        assert!(close(mean(given), [0.2, 0.15, 0.1, 0.5]), "{:?}", mean(given));
        assert_eq!(mean(SurfaceOverride { gain: Some(9.0), ..gain })[0], BRIGHTEST);
    }

    #[test]
    fn near_infrared_follows_red_where_nothing_passes_and_stands_where_something_does() {
        let picture =
            Texture::from_rgba8(2, 1, &[255, 0, 0, 255, 128, 0, 0, 255], furrow_optics::texture::ColorSpace::Srgb);
        let surface = Surface { picture: Some(Arc::new(picture)), ..Surface::default() };
        let nir = |page: SurfaceOverride, red: f32| {
            ModelSurface::new(&surface, &page).tone(|_| Vec3::new(red, 0.0, 0.0)).reflectance.0.w
        };
        assert_eq!(nir(SurfaceOverride::default(), 0.3), 0.3);
        let mean = mean(surface.picture.as_ref().unwrap()).x;
        assert!((nir(SurfaceOverride { nir: Some(0.2), ..SurfaceOverride::default() }, mean) - 0.2).abs() < 1e-6);
        assert!((nir(SurfaceOverride { nir: Some(0.2), ..SurfaceOverride::default() }, 0.5 * mean) - 0.1).abs() < 1e-6);
        let leaf = SurfaceOverride { transmission: Some(Spectrum::splat(0.1)), ..SurfaceOverride::default() };
        assert_eq!(nir(leaf, 0.3), LEAF_NIR);
    }
}
