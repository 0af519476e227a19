//! Biochemical constituents of a leaf, as written in a species file.

use super::bands;
use super::prospect::{self, Inputs};
use furrow_base::math::Spectrum;
use furrow_base::ron_file::{Bound, NonNegative, Num};
use serde::{Deserialize, Serialize};

/// Structure parameter N of the leaf model: at least 1; no leaf was ever measured above 4.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Structure;

impl Bound for Structure {
    const MIN: f64 = 1.0;
    const MAX: f64 = 4.0;
    const WORDS: &'static str = "between 1 and 4";
}

/// Biochemical constituents of a leaf. The defaults describe a young sugar beet leaf.
///
/// ```
/// use furrow_optics::optics::Pigments;
/// let p: Pigments = ron::from_str("(n: 1.45, chlorophyll: 32, carotenoid: 8, anthocyanin: 1.5, water: 0.016)").unwrap();
/// assert!(p.bands().reflectance.to_array()[3] > 0.4);
/// assert!(ron::from_str::<Pigments>("(n: 0.5)").is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Pigments {
    /// Structure N: 1 is one compact layer, 1.2–1.7 a young leaf, 2.2 dry or thick tissue.
    pub n: Num<Structure>,
    /// Chlorophyll a + b, µg/cm²: 25–60 in a green leaf.
    pub chlorophyll: Num<NonNegative<1000>>,
    /// Carotenoids, µg/cm²: about a quarter to a fifth of the chlorophyll.
    pub carotenoid: Num<NonNegative<1000>>,
    /// Anthocyanins, µg/cm²: below 2 in a green leaf, 5–12 in a red one.
    pub anthocyanin: Num<NonNegative<1000>>,
    /// Brown pigment of dying tissue: 0 in a green leaf, 0.6–2.5 in straw.
    pub brown: Num<NonNegative<100>>,
    /// Equivalent water thickness, cm: 0.01–0.035 in a leaf, 0.2 in a petiole.
    pub water: Num<NonNegative<10>>,
    /// Dry matter, g/cm²: 0.002–0.006.
    pub dry_matter: Num<NonNegative<10>>,
}

impl Default for Pigments {
    fn default() -> Self {
        Self {
            n: Num::new(1.35),
            chlorophyll: Num::new(38.0),
            carotenoid: Num::new(8.5),
            anthocyanin: Num::new(0.8),
            brown: Num::new(0.0),
            water: Num::new(0.025),
            dry_matter: Num::new(0.003),
        }
    }
}

/// Reflectance and transmittance of a leaf near normal incidence, as fractions of the incident light, surface
/// reflection included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafBands {
    /// Reflected fraction per band.
    pub reflectance: Spectrum,
    /// Transmitted fraction per band.
    pub transmittance: Spectrum,
}

impl Pigments {
    /// Returns the inputs of the PROSPECT model.
    pub fn inputs(&self) -> Inputs {
        Inputs {
            n: self.n.get(),
            chlorophyll: self.chlorophyll.get(),
            carotenoid: self.carotenoid.get(),
            anthocyanin: self.anthocyanin.get(),
            brown: self.brown.get(),
            water: self.water.get(),
            dry_matter: self.dry_matter.get(),
        }
    }

    /// Returns the leaf's reflectance and transmittance in four bands.
    pub fn bands(&self) -> LeafBands {
        LeafBands::of(&self.inputs())
    }
}

impl LeafBands {
    /// Evaluates the leaf model for any inputs; reflectance plus transmittance never exceeds 0.99 in a band.
    pub fn of(inputs: &Inputs) -> Self {
        let (reflectance, transmittance) = bands::weigh2(|nm| prospect::at(inputs, nm));
        Self { reflectance, transmittance: safe(reflectance, transmittance) }
    }
}

/// Returns the transmittance clamped so that the sum with the reflectance is at most 0.99 per band.
pub(super) fn safe(reflectance: Spectrum, transmittance: Spectrum) -> Spectrum {
    let room = Spectrum::splat(0.99) - reflectance.clamp(0.0, 0.99);
    Spectrum(transmittance.0.max(Spectrum::ZERO.0).min(room.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: within 0.01 of full spectral integrals with the tabulated observer and the camera's curves.
    #[test]
    fn bands_match_full_spectral_sums() {
        // n, chlorophyll, carotenoid, anthocyanin, brown, water, dry matter; R of R, G, B, NIR; T of R, G, B, NIR.
        let rows = [
            ([1.3, 30., 7., 1., 0., 0.03, 0.0025], [0.079, 0.1211, 0.0332, 0.4301], [0.1071, 0.157, 0.0, 0.5373]),
            ([1.35, 38., 8.5, 0.8, 0., 0.025, 0.003], [0.0648, 0.1086, 0.034, 0.4378], [0.0751, 0.1286, 0.0, 0.5252]),
            ([1.5, 50., 10., 0.5, 0., 0.03, 0.0045], [0.0538, 0.1014, 0.0347, 0.4575], [0.0403, 0.0928, 0.0, 0.49]),
            ([1.5, 22., 6.5, 1., 0.02, 0.027, 0.0045], [0.1251, 0.1579, 0.0318, 0.4575], [0.1313, 0.1566, 0., 0.49]),
            ([2.2, 6., 1.8, 0.3, 0., 0.2, 0.012], [0.3468, 0.3846, 0.1162, 0.5095], [0.2115, 0.2251, 0.0312, 0.3529]),
            ([1.5, 28., 7., 8., 0., 0.014, 0.0035], [0.0913, 0.0767, 0.0376, 0.4643], [0.0914, 0.0631, 0.0, 0.497]),
            ([1.8, 6., 5., 1., 0.1, 0.018, 0.0045], [0.3301, 0.2494, 0.0489, 0.5001], [0.2708, 0.1857, 0.0076, 0.4391]),
            (
                [2.2, 1., 1.5, 0., 1.2, 0.0015, 0.006],
                [0.2731, 0.1891, 0.1031, 0.4773],
                [0.1511, 0.0829, 0.0267, 0.3252],
            ),
        ];
        for (p, r, t) in rows {
            let [n, chlorophyll, carotenoid, anthocyanin, brown, water, dry_matter] = p;
            let b = LeafBands::of(&Inputs { n, chlorophyll, carotenoid, anthocyanin, brown, water, dry_matter });
            let off = |s: Spectrum, expected: [f32; 4]| (s.0 - Spectrum::from(expected).0).abs().max_element();
            assert!(off(b.reflectance, r) < 0.01, "{p:?}: {:?} for {r:?}", b.reflectance);
            assert!(off(b.transmittance, t) < 0.01, "{p:?}: {:?} for {t:?}", b.transmittance);
        }
    }

    #[test]
    fn pigments_survive_being_written_and_read() {
        let p = Pigments { chlorophyll: Num::new(51.5), ..Pigments::default() };
        assert_eq!(ron::from_str::<Pigments>(&ron::to_string(&p).unwrap()).unwrap(), p);
        assert!(ron::from_str::<Pigments>("(chlorofyll: 3)").is_err());
    }
}
