//! Conversion of a texel's colour to a leaf's reflectance and transmittance in four bands, with one lookup table.
//!
//! A photographed or synthesised texture stores only the R, G and B reflectance of a leaf. Most of the variation
//! between two points of a leaf is due to chlorophyll. The leaf model is therefore inverted from the texel's luminance
//! to a chlorophyll content, which yields the transmittance and the near infrared.
//!
//! Where the texel's hue differs from the model's (a red vein, a brown spot), the transmitted light is tinted by the
//! ratio. The reflected R, G and B remain those of the texel.

use super::pigments::{LeafBands, Pigments, safe};
use super::prospect::Inputs;
use furrow_base::math::{RoundTo, Spectrum, ToFloat, Vec3};

/// Reflectance and transmittance at one point of a leaf, per band; their sum never exceeds 0.99.
pub type Leaf = LeafBands;

/// Number of table entries over luminance.
const ENTRIES: usize = 256;
/// Number of chlorophyll contents at which the model is evaluated; the bands are interpolated between them.
const NODES: usize = 64;
/// The largest chlorophyll content, µg/cm².
const MOST: f64 = 100.0;

#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    /// Reciprocal of the model's R, G, B reflectance.
    inverse: Vec3,
    transmittance: Spectrum,
    nir: f32,
}

/// Lookup tables of one kind of leaf, used to convert texels.
#[derive(Clone, Debug)]
pub struct LeafOptics {
    plain: Leaf,
    nodes: Vec<Leaf>,
    entries: Box<[Entry; ENTRIES]>,
}

impl LeafOptics {
    /// Evaluates the leaf model for chlorophyll contents of 0..100 µg/cm²; the other inputs follow `base`. Takes about
    /// 2 ms.
    ///
    /// Carotenoids decrease with the chlorophyll but never to zero, because pale tissue is yellowish. Tissue far paler
    /// than the leaf is treated as a vein: N rises by up to 0.6 and half as much light is transmitted.
    pub fn new(base: &Pigments) -> Self {
        let inputs = base.inputs();
        let nodes: Vec<Leaf> = (0..NODES).map(|i| node(&inputs, content(i))).collect();
        let mut entries = Box::new([Entry::default(); ENTRIES]);
        for (i, entry) in entries.iter_mut().enumerate() {
            *entry = invert(&nodes, position_to_luminance(i.to_f32()));
        }
        Self { plain: base.bands(), nodes, entries }
    }

    /// Returns the leaf without a texture, from its base pigments.
    #[inline]
    pub fn plain(&self) -> Leaf {
        self.plain
    }

    /// Returns the leaf at another chlorophyll content in µg/cm², clamped to 0..100. Texture synthesis paints with
    /// these values.
    pub fn with_chlorophyll(&self, chlorophyll: f32) -> Leaf {
        let place = (f64::from(chlorophyll).clamp(0.0, MOST) / MOST).sqrt() * (NODES - 1).to_f64();
        let i = place.trunc_to::<usize>().min(NODES - 2);
        blend(self.nodes[i], self.nodes[i + 1], (place - i.to_f64()).to_f32())
    }

    /// Converts a texel's linear Rec.709 colour. R, G, B reflectance are the texel's own; NIR reflectance and
    /// transmittance come from the model.
    #[inline]
    pub fn at(&self, rgb: [f32; 3]) -> Leaf {
        let own = Vec3::from(rgb).clamp(Vec3::ZERO, Vec3::splat(0.99));
        let luminance = own.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        let place = luminance.sqrt() * (ENTRIES - 1).to_f32();
        let i = place.trunc_to::<usize>().min(ENTRIES - 2);
        let part = place - i.to_f32();
        let (a, b) = (&self.entries[i], &self.entries[i + 1]);
        let inverse = a.inverse.lerp(b.inverse, part);
        let tint = (own * inverse).clamp(Vec3::splat(0.25), Vec3::splat(4.0));
        let nir = a.nir + (b.nir - a.nir) * part;
        let reflectance = Spectrum(own.extend(nir));
        let transmittance = a.transmittance.lerp(b.transmittance, part) * Spectrum(tint.extend(1.0));
        Leaf { reflectance, transmittance: safe(reflectance, transmittance) }
    }
}

/// Returns the chlorophyll content of node `i`. Nodes are dense at low contents, where a small change in pigment has a
/// large effect.
fn content(i: usize) -> f64 {
    let x = i.to_f64() / (NODES - 1).to_f64();
    MOST * x * x
}

fn node(base: &Inputs, chlorophyll: f64) -> Leaf {
    let share = if base.chlorophyll > 0.0 { chlorophyll / base.chlorophyll } else { 1.0 };
    // 0 in the blade, 1 in a vein that has less than a tenth of the blade's chlorophyll.
    let paleness = ((0.7 - share) / 0.6).clamp(0.0, 1.0);
    let paleness = paleness * paleness * (3.0 - 2.0 * paleness);
    let bands = LeafBands::of(&Inputs {
        n: (base.n + 0.6 * paleness).min(4.0),
        chlorophyll,
        carotenoid: base.carotenoid * (0.06 + 0.94 * share).min(1.5),
        ..*base
    });
    let transmittance = bands.transmittance * (1.0 - 0.5 * paleness.to_f32());
    Leaf { transmittance, ..bands }
}

fn blend(a: Leaf, b: Leaf, t: f32) -> Leaf {
    Leaf { reflectance: a.reflectance.lerp(b.reflectance, t), transmittance: a.transmittance.lerp(b.transmittance, t) }
}

fn position_to_luminance(i: f32) -> f32 {
    let x = i / (ENTRIES - 1).to_f32();
    x * x
}

/// Returns the table entry of a luminance. A value above that of tissue without chlorophyll is white wax or meal, a
/// value below the darkest green is dead or shaded tissue; both transmit less.
fn invert(nodes: &[Leaf], luminance: f32) -> Entry {
    let y = |i: usize| nodes[i].reflectance.luminance();
    let (brightest, darkest) = (y(0), y(nodes.len() - 1));
    let leaf = if luminance >= brightest {
        let white = (luminance - brightest) / (1.0 - brightest);
        let scale = luminance / brightest.max(1e-4);
        let r = nodes[0].reflectance;
        Leaf {
            reflectance: Spectrum((r.0 * scale).truncate().extend(r.0.w + (0.9 - r.0.w).max(0.0) * white)),
            transmittance: nodes[0].transmittance * (1.0 - white),
        }
    } else if luminance <= darkest {
        let last = nodes[nodes.len() - 1];
        let scale = luminance / darkest.max(1e-4);
        Leaf {
            reflectance: Spectrum((last.reflectance.0 * scale).truncate().extend(last.reflectance.0.w * scale)),
            transmittance: last.transmittance * scale,
        }
    } else {
        let i = (1..nodes.len()).find(|&i| y(i) <= luminance).unwrap_or(nodes.len() - 1);
        let t = (y(i - 1) - luminance) / (y(i - 1) - y(i)).max(1e-9);
        blend(nodes[i - 1], nodes[i], t)
    };
    Entry {
        inverse: Vec3::ONE / leaf.reflectance.0.truncate().max(Vec3::splat(1e-3)),
        transmittance: leaf.transmittance,
        nir: leaf.reflectance.0.w,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_texel_makes_a_leaf_that_returns_more_than_it_receives(rgb in prop::array::uniform3(-0.5f32..2.0)) {
            let leaf = LeafOptics::new(&Pigments::default()).at(rgb);
            let sum = (leaf.reflectance + leaf.transmittance).max();
            prop_assert!(leaf.reflectance.is_finite() && leaf.transmittance.is_finite());
            prop_assert!(leaf.reflectance.0.min_element() >= 0.0 && leaf.transmittance.0.min_element() >= 0.0);
            prop_assert!(sum <= 0.9901, "{sum}");
        }
    }

    /// Rationale: a texture painted with the model's own colours must be converted back to the model's values.
    #[test]
    fn the_models_own_colours_come_back_as_the_model() {
        let optics = LeafOptics::new(&Pigments::default());
        for chlorophyll in [3.0, 10.0, 20.0, 38.0, 60.0, 90.0] {
            let truth = optics.with_chlorophyll(chlorophyll);
            let [r, g, b, _] = truth.reflectance.to_array();
            let read = optics.at([r, g, b]);
            assert!((read.transmittance.0 - truth.transmittance.0).abs().max_element() < 0.01, "{chlorophyll}");
            assert!((read.reflectance.0 - truth.reflectance.0).abs().max_element() < 0.01, "{chlorophyll}");
        }
    }

    #[test]
    fn green_grows_darker_with_chlorophyll_while_nir_stays() {
        let optics = LeafOptics::new(&Pigments::default());
        let (pale, dark) = (optics.with_chlorophyll(25.0), optics.with_chlorophyll(60.0));
        assert!(pale.reflectance.luminance() > 1.3 * dark.reflectance.luminance());
        assert!((pale.reflectance.0.w - dark.reflectance.0.w).abs() < 0.03);
    }

    #[test]
    fn the_plain_leaf_is_the_leaf_of_its_base() {
        let base = Pigments::default();
        let optics = LeafOptics::new(&base);
        let other = optics.with_chlorophyll(38.0);
        assert_eq!(optics.plain(), base.bands());
        assert!((optics.plain().reflectance.0 - other.reflectance.0).abs().max_element() < 2e-3);
    }
}
