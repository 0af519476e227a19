//! Meaning of the sensor's linear values: electrons per radiance and the full well.

use furrow_base::math::Spectrum;

/// Electrons per radiance in R, G, B, NIR, relative to G; from the quantum efficiencies of the JAI AD-130's two sensors.
pub(in crate::sensor) const RESPONSE: Spectrum = Spectrum::new(0.94, 1.0, 0.77, 0.93);

/// Largest linear value of a sensor: a ninth above white, which is 90 % of the full well.
pub(in crate::sensor) const CLIP: f32 = 1.0 / 0.9;
