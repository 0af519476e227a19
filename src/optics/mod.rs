//! What leaves and soils do to light, band by band, from what they are made of.
//!
//! Pigments and water decide a leaf's reflectance and transmittance ([`prospect`]); the four bands come from weighing the
//! spectra ([`bands`]); [`LeafOptics`] turns a texel's colour into both sides of the leaf; [`soil`] darkens soil by moisture.

pub mod bands;
pub mod interface;
mod leaf;
mod pigments;
pub mod prospect;
pub mod soil;

pub use leaf::{Leaf, LeafOptics};
pub use pigments::{LeafBands, Pigments};
