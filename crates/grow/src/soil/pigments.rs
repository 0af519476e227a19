//! Variation of the soil's colour over a ground: iron oxides, humus, lime and algae.
//!
//! Iron and humus vary from the largest patches down to a centimetre, and from aggregate to aggregate. Their amounts are
//! log-normal, as most contents of soil are (Ahrens 1954, Geochim. Cosmochim. Acta 5:49): rich places are rare and
//! strong. Lime and salts are left where water evaporates, at the rims of moist patches. Algae grow in moist ones.

use furrow_base::math::{RoundTo, Spectrum, ToFloat, Vec2, smoothstep};
use furrow_base::ron_file::{Fraction, NonNegative, Num, Positive, Vary};
use furrow_base::sampling::{Purpose, Stream};
use furrow_optics::optics::SoilTint;
use furrow_optics::texture::noise::Perlin;
use serde::{Deserialize, Serialize};

/// Ratio of the amplitudes of successive octaves.
const GAIN: f32 = 0.75;
/// Standard deviation of one octave of [`Perlin`].
const OCTAVE_SD: f32 = 0.43;
/// Smallest wavelength, metres.
const FINEST_M: f32 = 0.008;
/// Standard deviation of the logarithm of iron and humus.
const LOG_SD: f32 = 0.35;
/// Limit of the noise, standard deviations.
const MOST: f32 = 2.5;
/// Distance of the lime's maximum below the mean moisture, and width of its rim, in standard deviations of the moisture.
const RIM: (f32, f32) = (0.6, 0.5);
/// Noise of the algae's patches where they start and where they are complete, standard deviations.
const GROWN: (f32, f32) = (0.3, 1.6);
/// Moisture where algae start and where they grow fully, in standard deviations from its mean.
const MOIST: (f32, f32) = (-1.2, 0.6);

/// Variation of the soil's colour over the ground.
///
/// ```
/// use furrow_grow::soil::SoilDesc;
/// assert!(ron::from_str::<SoilDesc>("(pigments: (iron: Uniform(0.2, 0.6), algae: 2))").is_ok());
/// assert!(ron::from_str::<SoilDesc>("(pigments: (iron: -1))").is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PigmentsDesc {
    /// Standard deviation of iron oxides, which redden the soil: 1 is the difference between the colours `Reddish` and
    /// `Loam`.
    pub iron: Vary<NonNegative<10>>,
    /// Standard deviation of humus, which darkens the soil: 1 is the difference between `Humic` and `Loam`.
    pub humus: Vary<NonNegative<10>>,
    /// Pale lime and salts at the rims of moist patches: 1 is the difference between `Chalky` and `Loam`.
    pub lime: Vary<NonNegative<10>>,
    /// Chlorophyll of algae in moist patches, µg/cm²: 0 on fresh tilth, 1–5 on ground that was moist for weeks.
    pub algae: Vary<NonNegative<100>>,
    /// Size of the largest patches, metres.
    pub patch_m: Vary<Positive<100>>,
    /// Variation of iron and humus from one clod or crumb to the next, relative to that of the ground.
    pub aggregates: Num<NonNegative<10>>,
    /// Correlation between a clod's own colour and that of the ground around it.
    pub mixing: Num<Fraction>,
}

impl Default for PigmentsDesc {
    fn default() -> Self {
        Self {
            iron: Vary::uniform(0.1, 0.35),
            humus: Vary::uniform(0.08, 0.2),
            lime: Vary::uniform(0.0, 0.12),
            algae: Vary::fixed(0.0),
            patch_m: Vary::uniform(0.15, 0.4),
            aggregates: Num::new(0.6),
            mixing: Num::new(0.8),
        }
    }
}

/// Colour variation of one ground.
#[derive(Clone, Debug)]
pub(super) struct Pigments {
    amounts: SoilTint,
    aggregates: f32,
    mixing: f32,
    patch_m: f32,
    octaves: u32,
    /// Standard deviation of the sum of all octaves.
    sd: f32,
    noise: [Perlin; 3],
}

impl Pigments {
    pub(super) fn new(desc: &PigmentsDesc, stream: &Stream) -> Self {
        let child = |k: u64| stream.child(Purpose::Soil, 50 + k);
        let patch_m = desc.patch_m.draw32(&mut child(4));
        let octaves = 1 + (patch_m / FINEST_M).log2().clamp(0.0, 12.0).trunc_to::<u32>();
        let squares = (1.0 - GAIN.powi(2).powf(octaves.to_f32())) / (1.0 - GAIN.powi(2));
        let sum = (1.0 - GAIN.powf(octaves.to_f32())) / (1.0 - GAIN);
        Self {
            amounts: SoilTint {
                iron: desc.iron.draw32(&mut child(0)),
                humus: desc.humus.draw32(&mut child(1)),
                lime: desc.lime.draw32(&mut child(2)),
                algae: desc.algae.draw32(&mut child(3)),
            },
            aggregates: desc.aggregates.f32(),
            mixing: desc.mixing.f32(),
            patch_m,
            octaves,
            sd: OCTAVE_SD * squares.sqrt() / sum,
            noise: [5, 6, 7].map(|k| Perlin::new(child(k).seed32())),
        }
    }

    /// Returns noise with mean 0 and standard deviation 1 at a point: of iron, humus or algae, for `k` 0 to 2. Ground
    /// without algae has none for them.
    pub(super) fn noise(&self, k: usize, p: Vec2) -> f32 {
        if k == 2 && self.amounts.algae == 0.0 {
            return 0.0;
        }
        let q = p / self.patch_m + 0.5;
        let noise = self.noise[k].fbm2(f64::from(q.x), f64::from(q.y), self.octaves, f64::from(GAIN));
        (noise.to_f32() / self.sd).clamp(-MOST, MOST)
    }

    /// Returns the factors on the reflectance of a place, from its noise of iron, humus and algae and from its moisture, in
    /// standard deviations from the mean.
    pub(super) fn place(&self, [iron, humus, algae]: [f32; 3], moist: f32) -> Spectrum {
        let rim = ((moist + RIM.0) / RIM.1).powi(2);
        let SoilTint { iron: i, humus: h, lime, algae: a } = self.amounts;
        SoilTint {
            iron: i * log_normal(iron),
            humus: h * log_normal(humus),
            // Salts are left in patches of the rims.
            lime: lime * (-0.5 * rim).exp() * smoothstep(-0.5, 1.5, humus - iron),
            algae: a * smoothstep(GROWN.0, GROWN.1, algae) * smoothstep(MOIST.0, MOIST.1, moist),
        }
        .factors()
    }

    /// Returns the factors on the reflectance of an aggregate, from two standard normal numbers.
    pub(super) fn aggregate(&self, iron: f32, humus: f32) -> Spectrum {
        let SoilTint { iron: i, humus: h, .. } = self.amounts;
        let [iron, humus] = [iron, humus].map(|x| self.aggregates * log_normal(x));
        SoilTint { iron: i * iron, humus: h * humus, ..SoilTint::default() }.factors()
    }

    /// Returns a standard normal number for the iron of a clod at `p`, correlated with that of the ground there. `own`
    /// is a standard normal number.
    pub(super) fn clod(&self, p: Vec2, own: f32) -> f32 {
        self.mixing * self.noise(0, p) + (1.0 - self.mixing * self.mixing).sqrt() * own
    }
}

/// Returns a log-normal number with mean 0 and standard deviation 1 from a standard normal one.
fn log_normal(x: f32) -> f32 {
    let (variance, mean) = (LOG_SD * LOG_SD, (0.5 * LOG_SD * LOG_SD).exp());
    ((LOG_SD * x).exp() - mean) / (mean * (variance.exp() - 1.0).sqrt())
}

/// Returns the quantile of the standard normal distribution, within 0.02 for p from 0.05 to 0.95: the logistic one.
pub(super) fn quantile(p: f32) -> f32 {
    (p / (1.0 - p)).ln() / 1.702
}

/// Returns the distribution function whose inverse is [`quantile`].
pub(super) fn rank(x: f32) -> f32 {
    1.0 / (1.0 + (-1.702 * x).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::vec2;

    fn pigments(desc: &PigmentsDesc) -> Pigments {
        Pigments::new(desc, &Stream::of(8, 0, Purpose::Test, 0))
    }

    fn mean_and_sd(values: &[f32]) -> (f32, f32) {
        let n = values.len().to_f32();
        let mean = values.iter().sum::<f32>() / n;
        (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / n).sqrt())
    }

    /// Expected: noise of any patch size has mean 0 and standard deviation 1 within a tenth, over an area of many
    /// patches; points closer than the finest wavelength are nearly equal, points two patches apart are independent.
    #[test]
    fn noise_is_standard_and_correlated_within_patches() {
        for patch_m in [0.02, 0.15, 0.4] {
            let pigments = pigments(&PigmentsDesc { patch_m: Vary::fixed(patch_m), ..PigmentsDesc::default() });
            let patch = pigments.patch_m;
            let points: Vec<Vec2> = (0..160 * 160)
                .map(|k| vec2((k % 160).to_f32(), (k / 160).to_f32()) * 0.37 * patch + 0.1 * patch)
                .collect();
            let noise =
                |shift: f32| -> Vec<f32> { points.iter().map(|p| pigments.noise(0, *p + vec2(shift, 0.0))).collect() };
            let here = noise(0.0);
            let (mean, sd) = mean_and_sd(&here);
            assert!(mean.abs() < 0.1 && (sd - 1.0).abs() < 0.1, "{patch_m}: {mean} {sd}");
            let correlation = |there: &[f32]| {
                here.iter().zip(there).map(|(a, b)| a * b).sum::<f32>() / (here.len().to_f32() * sd * sd)
            };
            assert!(correlation(&noise(0.001)) > 0.9, "{patch_m}");
            assert!(correlation(&noise(2.0 * patch + 0.003)).abs() < 0.1, "{patch_m}");
        }
    }

    /// Expected: without amounts nothing changes colour; iron keeps the luminance of an aggregate; a clod's iron is
    /// standard normal and follows the ground's with the correlation that was asked for.
    #[test]
    fn amounts_and_mixing_are_those_that_were_asked_for() {
        let none = PigmentsDesc {
            iron: Vary::fixed(0.0),
            humus: Vary::fixed(0.0),
            lime: Vary::fixed(0.0),
            ..PigmentsDesc::default()
        };
        assert_eq!(pigments(&none).place([1.0, -1.0, 2.0], 0.0), Spectrum::ONE);
        let some = pigments(&PigmentsDesc {
            iron: Vary::fixed(1.0),
            aggregates: Num::new(1.0),
            mixing: Num::new(0.6),
            ..none
        });
        let [red, pale] = [1.0, -1.0].map(|iron| some.aggregate(iron, 0.0).to_array());
        assert!(red[0] / red[2] > 1.2 && (0.7..0.9).contains(&(pale[0] / pale[2])), "{red:?} {pale:?}");
        let mut stream = Stream::of(9, 0, Purpose::Test, 0);
        let (mut own, mut ground) = (Vec::new(), Vec::new());
        for _ in 0..20_000 {
            let p = vec2(stream.uniform32(), stream.uniform32()) * 9.0;
            own.push(some.clod(p, stream.normal().to_f32()));
            ground.push(some.noise(0, p));
        }
        let (mean, sd) = mean_and_sd(&own);
        assert!(mean.abs() < 0.1 && (sd - 1.0).abs() < 0.07, "{mean} {sd}");
        let together = own.iter().zip(&ground).map(|(a, b)| a * b).sum::<f32>() / own.len().to_f32();
        assert!((together - 0.6).abs() < 0.08, "{together}");
    }

    /// Expected: lime whitens the rims of moist patches and neither their middles nor dry ground; algae green the moist
    /// ground and leave dry ground as it is.
    #[test]
    fn lime_lies_at_rims_and_algae_grow_where_it_is_moist() {
        let bare = PigmentsDesc {
            iron: Vary::fixed(0.0),
            humus: Vary::fixed(0.0),
            lime: Vary::fixed(0.0),
            ..PigmentsDesc::default()
        };
        let mean = |desc: &PigmentsDesc, moist: f32, ratio: fn(Spectrum) -> f32| {
            let pigments = pigments(desc);
            let place = |k: usize| vec2((k % 120).to_f32(), (k / 120).to_f32()) * 0.05;
            let noise = |k: usize| [0, 1, 2].map(|of| pigments.noise(of, place(k)));
            (0..14_400).map(|k| ratio(pigments.place(noise(k), moist))).sum::<f32>() / 14_400.0
        };
        let limed = PigmentsDesc { lime: Vary::fixed(1.0), ..bare.clone() };
        let blue: fn(Spectrum) -> f32 = |f| f.0.z;
        assert!(mean(&limed, -RIM.0, blue) > 1.2, "{}", mean(&limed, -RIM.0, blue));
        assert!([-2.5, 1.5].iter().all(|moist| mean(&limed, *moist, blue) < 1.02));
        let grown = PigmentsDesc { algae: Vary::fixed(4.0), ..bare };
        let green: fn(Spectrum) -> f32 = |f| f.0.y / f.0.x;
        assert!(mean(&grown, 1.0, green) > 1.01 && mean(&grown, -1.5, green) < 1.001, "{}", mean(&grown, 1.0, green));
    }

    #[test]
    fn quantiles_and_ranks_are_inverse() {
        for k in 1..20u8 {
            let p = f32::from(k) / 20.0;
            assert!((rank(quantile(p)) - p).abs() < 1e-5);
        }
        assert!((quantile(0.841_3) - 1.0).abs() < 0.03 && quantile(0.5).abs() < 1e-6);
    }
}
