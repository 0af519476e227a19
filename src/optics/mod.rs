//! What leaves and soils do to light, band by band, from what they are made of.
//!
//! Pigments and water decide a leaf's reflectance and transmittance ([`prospect`]); the four bands come from weighing the
//! spectra ([`bands`]); [`LeafOptics`] turns a texel's colour into both sides of the leaf; [`soil`] darkens soil by moisture, [`Shadowing`] by relief. Soils of
//! one's own come as spectra ([`measured`]) or by [`Munsell`] notation.

pub mod ageing;
pub mod bands;
pub mod interface;
mod leaf;
pub mod measured;
mod munsell;
mod pigments;
pub mod prospect;
pub mod shadowing;
pub mod soil;

pub use leaf::{Leaf, LeafOptics};
pub use munsell::Munsell;
pub use pigments::{LeafBands, Pigments};
pub use shadowing::{LostRelief, Shadowing};
