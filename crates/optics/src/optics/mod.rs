//! Reflectance and transmittance of leaves and soils per band, computed from their constituents.
//!
//! Pigments and water determine a leaf's spectra ([`prospect`]), which are weighted to four bands ([`bands`]).
//! [`LeafOptics`] converts a texel's colour to the reflectance and transmittance of a leaf. [`soil`] darkens soil by
//! moisture, [`Shadowing`] by relief. User-defined soils are given as spectra ([`measured`]) or in [`Munsell`]
//! notation.

pub mod ageing;
pub mod bands;
pub mod interface;
mod leaf;
pub mod measured;
mod munsell;
mod pigments;
pub mod prospect;
mod rock;
pub mod shadowing;
pub mod soil;
mod soil_tint;

pub use leaf::{Leaf, LeafOptics};
pub use munsell::Munsell;
pub use pigments::{LeafBands, Pigments};
pub use rock::Rock;
pub use shadowing::{Shadowing, UnmeshedRelief};
pub use soil_tint::SoilTint;
