//! Averages of scattering that Mitsuba's own plugins lack, over the view and light directions of a scene's surfaces.
//!
//! A Lambertian surface that replaces a rough, wet or hairy one can match its brightness for one pair of directions, or
//! on average over many. The pairs that occur in the image matter; the caller finds them (`furrow_job::mitsuba`).
//!
//! Notation: E is the irradiance of a light on a plane that faces it, n the shading normal, n' the normal that
//! `normalmap` derives from the same relief, c(θ) the transmission of the water film (see `Wet`), and ρ (A + B s) the
//! ground's Oren–Nayar model. The albedo is exported times
//!
//! `k = Σ ρ E (n·l) (A + B s) c(θ_eye) c(θ_light) / Σ ρ E (n'·l)`, `s = max(0, cos Δφ) sin α tan β`.
//!
//! Both sums are over the same pairs of points and light directions, so the diffuse direct light of the ground in the
//! image is preserved. The two normals differ where a slope of the mesh meets a slope of the relief. This renderer adds
//! slopes over the ground plane; `normalmap` rotates the relief with the mesh and is darker on average, by 1.4 % on
//! `02-one-plant.ron`.

use furrow_base::math::{Spectrum, ToFloat};
use furrow_optics::bsdf::microfacet::Ggx;
use furrow_optics::bsdf::{SurfaceLayer, fresnel};
use furrow_optics::optics::Shadowing;
use std::f32::consts::PI;

/// Two directions above a surface, with their weight.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// Cosines of the angles from the surface's normal to the eye and to the light.
    pub cos: [f32; 2],
    /// Cosine of the angle between the two directions.
    pub between: f32,
    /// Light that a Lambertian surface with this renderer's normal scatters to the eye.
    pub weight: f32,
    /// The same light with the exported normal.
    pub written: f32,
    /// `true` if the material has relief at this point.
    pub relief: bool,
}

/// Two directions at a leaf, with their weight.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Cosines of the angles from the surface's normal to the eye and to the light, each on its own side.
    pub cos: [f32; 2],
    /// `true` if the light is on the other side than the eye.
    pub across: bool,
    /// Light that falls on the leaf from this direction.
    pub weight: f32,
}

/// Pairs of directions of a scene.
#[derive(Clone, Debug)]
pub struct Directions {
    /// Pairs on the ground; their weights sum to one.
    pairs: Vec<Pair>,
    leaves: Vec<Crossing>,
}

/// Mean effect of hairs and wax bloom on both sides of a leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cover {
    /// For each side: transmission of light that enters and leaves through the layer, and the layer's own reflectance.
    pub(super) sides: [(Spectrum, Spectrum); 2],
    /// Transmission through both layers of light that crosses the leaf.
    pub(super) across: Spectrum,
}

/// Averages over the directions of a scene, each computed once: thousands of leaves have the same coats and layers.
pub(super) struct Averages<'a> {
    pub(super) directions: &'a Directions,
    /// By the refractive indices of the coats, and whether light crosses the leaf.
    coats: Vec<(CoatKey, f32)>,
    covers: Vec<([Option<SurfaceLayer>; 2], Cover)>,
}

/// Refractive indices of two coats, and whether light crosses the leaf.
type CoatKey = ([Option<f32>; 2], bool);

impl<'a> Averages<'a> {
    pub(super) fn new(directions: &'a Directions) -> Self {
        Self { directions, coats: Vec::new(), covers: Vec::new() }
    }

    /// Returns [`Directions::coats`].
    pub(super) fn coats(&mut self, coats: [Option<Ggx>; 2], across: bool) -> f32 {
        let key = (coats.map(|coat| coat.map(|coat| coat.ior)), across);
        if let Some((_, known)) = self.coats.iter().find(|(known, _)| *known == key) {
            return *known;
        }
        let mean = self.directions.coats(coats, across);
        self.coats.push((key, mean));
        mean
    }

    /// Returns [`Directions::cover`].
    pub(super) fn cover(&mut self, layers: [Option<SurfaceLayer>; 2]) -> Cover {
        if let Some((_, known)) = self.covers.iter().find(|(known, _)| *known == layers) {
            return *known;
        }
        let cover = self.directions.cover(layers);
        self.covers.push((layers, cover));
        cover
    }
}

impl Directions {
    /// Collects the pairs on the ground and on leaves; weights are relative.
    pub fn new(mut ground: Vec<Pair>, leaves: Vec<Crossing>) -> Self {
        let total: f32 = ground.iter().map(|pair| pair.weight).sum();
        for pair in &mut ground {
            pair.weight /= total.max(f32::MIN_POSITIVE);
            pair.written /= total.max(f32::MIN_POSITIVE);
        }
        Self { pairs: ground, leaves }
    }

    /// Returns k of this module's equation. It replaces Oren–Nayar's A and B, the transmission of a water film over a
    /// fraction of the surface, and the shadowing by fine relief. If the image has both surfaces with relief and
    /// without, only those that match `relief` are used.
    pub(super) fn soil(
        &self,
        [a, b]: [f32; 2],
        film: Option<(Ggx, f32)>,
        shadowing: Option<Shadowing>,
        relief: bool,
    ) -> f32 {
        let any = self.pairs.iter().any(|pair| pair.relief == relief && pair.written > 0.0);
        let scale = film.map_or(1.0, |(coat, _)| norm(coat.ior));
        let through = |cos: f32| {
            film.map_or(1.0, |(coat, share)| 1.0 + share * ((1.0 - fresnel::dielectric(cos, coat.ior)) / scale - 1.0))
        };
        let (mut ours, mut written) = (0.0_f64, 0.0_f64);
        for pair in self.pairs.iter().filter(|pair| !any || pair.relief == relief) {
            let [eye, light] = pair.cos;
            // max(0, cos Δφ) sin α tan β of Oren & Nayar 1994 without trigonometry, as in `OrenNayar`.
            let s = (pair.between - eye * light).max(0.0) / eye.max(light);
            let open = shadowing.map_or(1.0, |relief| relief.factor(light, eye, pair.between));
            ours += f64::from(pair.weight * (a + b * s) * through(eye) * through(light) * open);
            written += f64::from(pair.written);
        }
        if written > 0.0 { (ours / written).to_f32() } else { a }
    }

    /// Returns the mean transmission of the coats that the eye and the light see, c(θ_eye) c(θ_light) of `Leaf`, over
    /// the leaves in view: for transmitted light if `across`, otherwise for reflected light. 1 if there are no leaves.
    fn coats(&self, coats: [Option<Ggx>; 2], across: bool) -> f32 {
        let norms = coats.map(|coat| coat.map_or(1.0, |coat| norm(coat.ior)));
        let through =
            |k: usize, cos: f32| coats[k].map_or(1.0, |coat| (1.0 - fresnel::dielectric(cos, coat.ior)) / norms[k]);
        let (mut sum, mut weights) = (0.0_f64, 0.0_f64);
        for crossing in self.leaves.iter().filter(|crossing| crossing.across == across) {
            let [eye, light] = crossing.cos;
            sum += f64::from(crossing.weight * through(0, eye) * through(1, light));
            weights += f64::from(crossing.weight);
        }
        if weights > 0.0 { (sum / weights).to_f32() } else { 1.0 }
    }

    /// Returns the effect of the layers on the upper and the lower side of a leaf.
    fn cover(&self, layers: [Option<SurfaceLayer>; 2]) -> Cover {
        let side = |layer: Option<SurfaceLayer>| layer.map_or((Spectrum::ONE, Spectrum::ZERO), |l| self.layer(l));
        Cover { sides: layers.map(side), across: self.across(layers) }
    }

    /// Returns the transmission of light that enters and leaves through a layer on the visible side, and the layer's
    /// own reflectance.
    fn layer(&self, layer: SurfaceLayer) -> (Spectrum, Spectrum) {
        let mut sums = (Spectrum::ZERO, Spectrum::ZERO);
        for pair in &self.pairs {
            let through = pair.cos.map(|cos| layer.through(cos));
            sums.0 += through[0] * through[1] * pair.weight;
            sums.1 += SurfaceLayer::reflect(pair.cos, through) * (PI * pair.weight);
        }
        sums
    }

    /// Returns the transmission through both layers of light that crosses the leaf: one on the eye's side, the other on
    /// the light's.
    fn across(&self, [near, far]: [Option<SurfaceLayer>; 2]) -> Spectrum {
        let through = |layer: Option<SurfaceLayer>, cos| layer.map_or(Spectrum::ONE, |layer| layer.through(cos));
        let both = |pair: &Pair| through(near, pair.cos[0]) * through(far, pair.cos[1]) * pair.weight;
        self.pairs.iter().map(both).fold(Spectrum::ZERO, |sum, part| sum + part)
    }
}

/// Returns √((1 − F₀)(1 − F̄)) of a smooth interface of this index, the normalisation of its transmission (see `Wet`
/// and `Leaf`).
fn norm(ior: f32) -> f32 {
    ((1.0 - fresnel::dielectric(1.0, ior)) * (1.0 - fresnel::hemispherical(ior))).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::{Vec3, vec2};
    use furrow_optics::bsdf::{Bsdf, Form, Leaf, OrenNayar, Portable, Side, Wet};

    /// Rationale: a surface exported as Lambertian must be as bright as the original. Expected: for the directions of
    /// one scene, the formula's mean equals that of the BSDF itself. Source: `Bsdf::eval_pdf`, with the same pairs.
    #[test]
    fn means_are_those_of_the_scattering() {
        let direction = |elevation: f32, azimuth: f32| {
            vec2(azimuth.cos(), azimuth.sin()).extend(0.0) * elevation.cos() + Vec3::Z * elevation.sin()
        };
        let pairs = [(direction(0.9, 0.3), direction(0.8, 0.1), 0.7), (direction(1.2, 2.0), direction(0.5, -1.0), 0.3)];
        let pair = |(eye, light, weight): (Vec3, Vec3, f32)| Pair {
            cos: [eye.z, light.z],
            between: eye.dot(light),
            weight,
            written: weight,
            relief: false,
        };
        let crossing =
            |(eye, light, weight): (Vec3, Vec3, f32)| Crossing { cos: [eye.z, light.z], across: false, weight };
        let mean = Directions::new(pairs.map(pair).to_vec(), pairs.map(crossing).to_vec());
        let brightness = |bsdf: Bsdf| {
            let part =
                |(eye, light, weight): &(Vec3, Vec3, f32)| bsdf.eval_pdf(*eye, *light).0 * (PI * weight / light.z);
            pairs.iter().map(part).fold(Spectrum::ZERO, |sum, part| sum + part)
        };
        let near = |a: Spectrum, b: Spectrum| (a - b).map(f32::abs).max() < 1e-5;
        let soil = OrenNayar::new(Spectrum::splat(0.2), 0.5);
        let factor = mean.soil(soil.shape(), None, None, false);
        assert!(near(brightness(Bsdf::OrenNayar(soil)), Spectrum::splat(0.2) * factor));
        // The surface below a film, without the film's own reflection. If no pair has relief, those without it count.
        let wet = Wet::new(Spectrum::splat(0.2), 0.5, 0.6, 1.0);
        let film = brightness(Bsdf::Wet(wet)) - brightness(Bsdf::Wet(Wet::new(Spectrum::ZERO, 0.5, 0.6, 1.0)));
        let Form::Rough { albedo, shape, film: Some(water), .. } = wet.form() else { panic!("{wet:?}") };
        let factor = mean.soil(shape, Some((water.coat, water.share)), None, true);
        assert!(near(film, albedo * factor));

        let layer = SurfaceLayer::new(0.3, 0.2).unwrap();
        let reflectance = Spectrum::new(0.05, 0.1, 0.03, 0.5);
        let side = *Leaf::bare(reflectance, Spectrum::ZERO).both_sides()[0];
        let leaf = Leaf::new(side.layered(Some(layer)), side, Spectrum::ZERO);
        let (through, own) = mean.layer(layer);
        assert!(near(brightness(Bsdf::Leaf(leaf)), reflectance * through + own));

        // The tissue below a coat, without the coat's own reflection.
        let coated = |reflectance: Spectrum| Side::new(1.45, [0.3; 2], reflectance);
        let bright = |side: Side| brightness(Bsdf::Leaf(Leaf::new(side, side, Spectrum::ZERO)));
        let side = coated(Spectrum::splat(0.4));
        let below = bright(side) - bright(coated(Spectrum::ZERO));
        assert!(near(below, side.diffuse() * mean.coats([side.coat(); 2], false)));
    }
}
